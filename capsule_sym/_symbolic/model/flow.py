"""The closed-form flow of a segment, derived by Laplace transform from the model.

All segments share one form. With contact and drift direction from the model, for the capsule

    m     = 1 in stick, (gamma + 1)/gamma in drift      kappa = beta in contact, else 0
    K     = m (1 + kappa)       sigma = m zeta          push  = drift f_b / gamma

the relative motion is x_r'' + 2 sigma x_r' + K x_r = m kappa stop + push + alpha cos(angle), and
the capsule follows from its own equation (`v_c` by the interaction force, for short durations) or
from the momentum of both bodies (for all others). `Flow` holds the result in terms of the response
functions of `basis`; `flow_proofs` substitutes it back into the fields of the model.

Other scenes have other constants (`general_constants`). A drive that reacts has the factor m in the
relative motion, and the level of pulses is in `push`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import sympy as sp

from capsule_sym._symbolic.model import basis
from capsule_sym._symbolic.model.basis import K, W, s, sigma
from capsule_sym._symbolic.model.model import (
    DRIVE,
    LEVEL,
    LOAD,
    PULL,
    REACTS,
    Linear,
    P,
    friction_of,
    high,
    kappa,
)
from capsule_sym._symbolic.model.symbols import (
    MODEL,
    PARAMETERS,
    PULSED,
    alpha,
    front,
    gamma,
    h,
    omega,
    stop,
    v_c,
    v_r,
    x_r,
)

m = sp.Symbol("m", positive=True)  # inertia factor of the relative motion
push = sp.Symbol("push", real=True)  # relative acceleration by friction, load and level of pulses
friction = sp.Symbol("friction", real=True)  # `friction_of(drift)`: the bound, with drift's sign

cos_theta, sin_theta = sp.symbols("cos_theta sin_theta", real=True)  # forcing angle at the start
STIFFNESS, DAMPER = sp.diff(P, x_r), sp.diff(P, v_r)  # P's derivatives by x_r and v_r

spring = sp.Symbol("spring", real=True)  # the interaction force at the start less the damper's
margin = sp.Symbol("margin", real=True)  # pull on the capsule minus `friction` at the start


# Definitions that keep x_r - stop together: near the impact surface it is small and exact.
SPRING = P.subs(v_r, 0)
MARGIN = PULL.subs(DRIVE, LEVEL if PULSED else alpha * cos_theta) - friction
FORCE = push - m * spring  # relative acceleration at v_r = 0 without a cosine drive
SHARE = m if REACTS else sp.S.One  # factor of the drive in the relative acceleration


@dataclass(frozen=True)
class Flow:
    """Closed forms at a duration h after the start, dimensionless, in the response functions.

    `position` is x_r(h) - x_r(0), `velocity` is v_r(h), `drift_short` and `drift_long` are two
    equal forms of v_c(h) - v_c(0), and `advance` is x_c(h) - x_c(0): these three in drift alone.
    """

    position: sp.Expr
    velocity: sp.Expr
    drift_short: sp.Expr
    drift_long: sp.Expr
    advance: sp.Expr


def _original(image: sp.Expr) -> sp.Expr:
    """Inverse Laplace transform of a sum of known images, each monomial in s looked up."""
    known = {sp.Integer(1): 1 / s, h: 1 / s**2, h**2 / 2: 1 / s**3, **basis.IMAGES}
    numerator, denominator = sp.fraction(sp.cancel(sp.together(image)))
    total = sp.S.Zero
    for (power,), coefficient in sp.Poly(numerator, s).terms():
        term = coefficient * s**power / denominator
        ratios = ((name, sp.cancel(term / known_image)) for name, known_image in known.items())
        name, ratio = next((n, r) for n, r in ratios if s not in r.free_symbols)
        total += sp.factor(ratio) * name
    return total


@lru_cache(maxsize=1)
def derive() -> Flow:
    """The flow of a segment, from the Laplace transforms of its equations of motion."""
    X = sp.Symbol("X")
    force = sp.Symbol("force")
    drive = 0 if PULSED else alpha * (s * cos_theta - omega * sin_theta) / W
    # x_r = x_r(0) + increment, so the spring's constant part enters through `force`.
    motion = sp.Eq(s**2 * X - v_r + 2 * sigma * s * X + K * X, force / s + SHARE * drive)
    increment = sp.solve(motion, X)[0]
    velocity = s * increment
    growth = (STIFFNESS * increment + DAMPER * (velocity - v_r / s)) / (gamma * s)
    outside = sp.S.Zero if REACTS else drive  # forces on both bodies together

    def in_time(image: sp.Expr) -> sp.Expr:
        sources = (v_r, force, cos_theta, sin_theta, friction)
        image = sp.expand(image)
        rest = image - sum(image.coeff(source) * source for source in sources)
        if sp.cancel(sp.together(rest)) != 0:
            raise ValueError(f"unexplained source of motion: {rest}")
        parts = (source * _original(image.coeff(source)) for source in sources)
        return sum(parts, sp.S.Zero).subs(force, FORCE)

    position, speed = in_time(increment), in_time(velocity)
    gained = in_time(growth)
    if REACTS and not PULSED:
        # By the momentum of both bodies `gained` is -(v_r(h) - v_r(0) - v_r'(0) h)/(gamma + 1).
        # `wave` is the forcing less its value at the start.
        wave = SHARE * (drive - alpha * cos_theta / s)
        pushed = force + SHARE * alpha * cos_theta
        steady = (v_r + pushed / s) * s / basis.Q - v_r / s - (pushed - 2 * sigma * v_r) / s**2
        gained = -(in_time(steady) + in_time(sp.factor(wave * s / basis.Q))) / (gamma + 1)
    # The momentum (gamma + 1) v_c + v_r of both bodies changes by the forces on them from outside.
    resistance = friction - (LOAD if REACTS else LOAD + LEVEL)
    return Flow(
        position=position,
        velocity=speed,
        drift_short=margin * h / gamma + gained,
        drift_long=(v_r - speed - resistance * h + in_time(outside / s)) / (gamma + 1),
        advance=v_c * h
        + (v_r * h - position - resistance * h**2 / 2 + in_time(outside / s**2)) / (gamma + 1),
    )


contact = sp.Symbol("contact", nonnegative=True)  # 1 in contact in front, 2 behind, else 0
drift = sp.Symbol("drift", real=True)  # +1 forward, -1 backward, 0 in stick


def _at_stops(values: Sequence[sp.Expr]) -> sp.Expr:
    """The first value in front contact, the second behind, else 0: a polynomial in `contact`."""
    if len(values) == 1:
        return contact * values[0]
    front_one, back_one = contact * (2 - contact), contact * (contact - 1) / 2
    return values[0] * front_one + values[1] * back_one


STIFF = _at_stops([region.stiffness for region in MODEL.regions[1:]])  # kappa by contact
PLACE = front + _at_stops([place - front for place in MODEL.stops])  # where the spring acts


def general_constants(stick: bool) -> dict[sp.Symbol, sp.Expr]:
    """Constants of all drifting (or sticking) segments, in `contact`, `drift` and `high`."""
    inertia = sp.Integer(1) if stick else 1 + 1 / gamma
    steady = LOAD + (inertia * LEVEL if REACTS else LEVEL)
    return {
        m: inertia,
        kappa: STIFF,
        push: steady if stick else steady + friction_of(drift) / gamma,
        friction: sp.S.Zero if stick else friction_of(drift),
        sigma: inertia * DAMPER / 2,
        K: inertia * STIFFNESS.subs(kappa, STIFF),
        **({stop: PLACE} if stop not in PARAMETERS else {}),
    }


def constants(segment: Linear) -> dict[sp.Symbol, sp.Expr]:
    """Constants of a segment; with two stops, the place of the segment's stop is one of them."""
    mode = {contact: segment.contact, drift: segment.drift, high: 1 - segment.level}
    general = general_constants(segment.stick)
    return {name: sp.sympify(value).subs(mode) for name, value in general.items()}
