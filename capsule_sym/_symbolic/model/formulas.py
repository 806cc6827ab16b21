"""Formulas of the certified step, each derived from the model and its flow.

A formula may have a size: the sum of the magnitudes of its terms, with each argument as its own
magnitude. A value summed from these terms has an error of a few units of its size.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import sympy as sp

from capsule_sym._symbolic.model import geometry, jets
from capsule_sym._symbolic.model.basis import K, Q, W, s, sigma
from capsule_sym._symbolic.model.flow import (
    DAMPER,
    PLACE,
    SHARE,
    SPRING,
    STIFF,
    STIFFNESS,
    contact,
    cos_theta,
    drift,
    friction,
    general_constants,
    m,
    margin,
    push,
    sin_theta,
)
from capsule_sym._symbolic.model.jets import at_angle, drive, forcing, gap, reaction, with_gap
from capsule_sym._symbolic.model.model import (
    DRIVE,
    LEVEL,
    LOAD,
    PULL,
    REACTS,
    SEGMENTS,
    STEADY,
    WEIGHT,
    P,
    bound_of,
    friction_of,
    kappa,
    segment,
)
from capsule_sym._symbolic.model.symbols import (
    PARAMETERS,
    PULSED,
    PULSES,
    STATE,
    alpha,
    front,
    gamma,
    omega,
    stop,
    theta,
    v_c,
    v_r,
    x_r,
)

x_change, v_change, v_rate, index = sp.symbols("x_change v_change v_rate n", real=True)
level, sign, pull, way = sp.symbols("level sign pull way", real=True)
source, last, before, term = sp.symbols("drive last before term", real=True)
root_K, reach = sp.symbols("root_K reach", positive=True)
_SYMBOLS = (x_r, gap, v_r, v_c, cos_theta, sin_theta, margin, x_change, v_change, v_rate, index)
ARGUMENTS = {
    str(one): one
    for one in (*_SYMBOLS, level, sign, pull, way, source, last, before, root_K, reach)
}
"""Arguments of formulas by name."""


@dataclass(frozen=True)
class Formula:
    """Named results in named arguments and segment constants; `sized` if it has a size."""

    name: str
    doc: str
    arguments: tuple[sp.Symbol, ...]
    results: tuple[tuple[str, sp.Expr], ...]
    sized: bool = False
    array: bool = False
    """True if the results are entries of one array."""
    carried: tuple[sp.Symbol, ...] = ()
    """Arguments with errors of their own in units of a size, such as terms of a recurrence."""

    @property
    def size(self) -> Formula:
        """Formula of the summed magnitudes of each result's terms, by magnitudes of arguments."""
        ones = {cos_theta: sp.S.One, sin_theta: sp.S.One}
        magnitudes = {a: sp.Symbol(a.name, nonnegative=True) for a in self.arguments}
        known = {**magnitudes, **ones}
        return Formula(
            f"{self.name}_size",
            f"Magnitudes of the terms of `{self.name}`, added up.",
            tuple(magnitudes[a] for a in self.arguments if a not in ones),
            tuple((name, jets.size_of(one, known)) for name, one in self.results),
        )


def _forced() -> dict[str, sp.Expr]:
    """Forced response SHARE alpha Re(e^(i theta)/Q(i omega)), and its rate."""
    real, imaginary = sp.expand(Q.subs(s, sp.I * omega)).as_real_imag()
    norm = real**2 + imaginary**2
    x = SHARE * alpha * (real * cos_theta + imaginary * sin_theta) / norm
    rate = x.subs({cos_theta: -sin_theta, sin_theta: cos_theta}, simultaneous=True) * omega
    return {"x_forced": x, "v_forced": rate}


def _next(operator: sp.Expr, driven: sp.Expr) -> sp.Expr:
    """Coefficient n + 2 of a power series in h/reach that solves operator(d/dh) y = driven.

    `driven` is coefficient n of the right-hand side in h/reach; `last` and `before` are those of y,
    n + 1 and n.
    """
    known = {0: before, 1: last}
    total = -driven * reach**2
    for (power,), coefficient in sp.Poly(operator, s).terms():
        rising = sp.prod([index + i for i in range(1, power + 1)])
        value = known.get(power, sp.Symbol("next"))
        total += coefficient * rising * reach ** (2 - power) * value
    (solution,) = sp.solve(total, sp.Symbol("next"))
    parts = (sp.factor(sp.expand(solution).coeff(a)) * a for a in (source, last, before))
    return sp.Add(*parts)


Results: TypeAlias = sp.Expr | dict[str, sp.Expr]
"""A result, or several by name."""


def formulas() -> dict[str, Results]:
    """Results of all formulas by name; `codegen/kernels.toml` has their arguments and meaning."""
    found = _forces() | _motion() | _points() | _gradients()
    found |= {"response_next": _next(Q, source), "forcing_next": _next(W, sp.S.Zero)}
    if PULSES:
        found = {name: result for name, result in found.items() if name not in _FORCED}
        found |= {"drive_level": LEVEL, "high_share": PULSES.share}
        found["high_share_gradient"] = _gradient(PULSES.share)
    return found


_FORCED = ("forcing_terms", "forced", "force_gain2", "forcing_next")
"""Formulas of a forcing that varies within a segment."""


def _forces() -> dict[str, Results]:
    """Interaction force, pull on the capsule, and friction."""
    pulled = at_angle(with_gap(PULL))
    drifting = {a: b.subs(drift, way) for a, b in general_constants(stick=False).items()}
    return {
        "force": with_gap(P),
        "pull": pulled,
        "margin_at": pulled - friction,
        "friction_at": drifting[friction],
        "loss_at": friction_of(way) - WEIGHT,
        "push_at": LOAD + SHARE * LEVEL + friction_of(way) / gamma,
        "friction_guard": bound_of(-sign) + sign * pull,
        "force_change": _change(x_change, v_change),
        "pull_rate": _change(x_change, v_change) - _rate_of(reaction(0)),
        "rest_force": _rest_force(),
    }


def _motion() -> dict[str, Results]:
    """Rates, the forcing, and bounds of the forced and the free motion."""
    gain = (omega**2 / m) ** 2 if REACTS else STIFFNESS**2 + (DAMPER * omega) ** 2
    return {
        "v_rate": _rest_force() - 2 * sigma * v_r + forcing(0),
        "v_c_rate": margin / gamma,
        "forcing_terms": {"drive": forcing(0), "drive_rate": _rate_of(forcing(0))},
        "forced": _forced(),
        "force_gain2": gain,
        "force_per_energy": STIFFNESS / root_K + DAMPER,
    }


def _points() -> dict[str, Results]:
    """Rest positions, points where P has a given value or an extremum, powers, constant forces."""
    return {
        "centre": (push - m * SPRING).subs(x_r, 0) / K,  # K is m times SPRING's slope
        "position_at": sp.together(sp.solve(P - level, x_r)[0]),
        "velocity_at": sp.solve(P.subs(x_r, stop) - level, v_r)[0],
        "turning_velocity": sp.solve(_change(v_r, v_rate), v_r)[0],
        "damper_power": DAMPER * v_r**2,
        "drive_power": (drive(0) + LEVEL) * DRIVEN,
        "load_force": LOAD,
        "lift_force": WEIGHT - LOAD,
        "rest_centre": STEADY / segment(2).here(STIFFNESS),
    }


def _gradients() -> dict[str, Results]:
    """Gradients of the terms of guards, forces and powers."""
    limit = PULL.subs(DRIVE, LEVEL if PULSED else alpha * sp.cos(theta)) - friction_of(way)
    functions = {
        "gap": x_r - stop,
        "speed": v_c,
        "force": P,
        "damper_power": DAMPER * v_r**2,
        "drive_power": (drive(0).subs(cos_theta, sp.cos(theta)) + LEVEL) * DRIVEN,
        "contact": P.coeff(kappa) * kappa,
        "loss": friction_of(way) - WEIGHT,
        "lift_force": WEIGHT - LOAD,
        "limit": limit,
        "slip": limit / gamma,
    }
    return {f"{name}_gradient": _gradient(one) for name, one in functions.items()}


def _change(x: sp.Expr, v: sp.Expr) -> sp.Expr:
    """Change of P with changes of x_r and v_r."""
    return STIFFNESS * x + DAMPER * v


def _rest_force() -> sp.Expr:
    return push - m * with_gap(SPRING)


DRIVEN = v_r if REACTS else v_r + v_c
"""Velocity along which the drive works: that of the mass, relative to the body it reacts on."""
GRADIENT = (*STATE, theta, *PARAMETERS)
"""Columns of gradients: state and phase, parameters."""


def _gradient(function: sp.Expr) -> dict[str, sp.Expr]:
    """Derivatives of a function of state, phase and parameters by `GRADIENT`, named `by_...`."""
    made = {kappa: STIFF} | ({stop: PLACE} if stop is not front else {})
    parts = {one: sp.Function(f"{one}_of")(*PARAMETERS) for one in made}
    whole = function.subs({one: contact * part for one, part in parts.items()})
    known = {contact * part: one for one, part in parts.items()}
    known |= {sp.cos(theta): cos_theta, sp.sin(theta): sin_theta}

    def slope(by: sp.Symbol) -> sp.Expr:
        rates = {part.diff(by): made[one].diff(by) / contact for one, part in parts.items()}
        return with_gap(sp.diff(whole, by).xreplace(rates).subs(known))

    return {f"by_{by}": slope(by) for by in GRADIENT}


def _rate_of(wave: sp.Expr) -> sp.Expr:
    """Rate of a function proportional to cos_theta."""
    return omega * wave.subs(cos_theta, -sin_theta)


def impact_planes() -> dict[tuple[int, int, int], int]:
    """Number of the plane of impact by the stop and the signs of v_c and v_r, Eq. (24).

    They come after those at rest, which have the numbers of fields, in the order of the surfaces.
    """
    found = {signs: len(SEGMENTS) + n for n, signs in enumerate(geometry.IMPACTS, start=1)}
    return dict(sorted(found.items(), key=lambda one: (-one[0][1], one[0][0], -one[0][2])))


def edge_planes() -> tuple[int, ...]:
    """Numbers of the planes of the drive's edges (rise, fall); empty without pulses."""
    last = max(impact_planes().values())
    return (last + 1, last + 2) if PULSED else ()
