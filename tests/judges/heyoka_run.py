"""The piecewise system by heyoka's adaptive Taylor integrator, in extended precision.

Needs the optional package `heyoka`; where long double is not the 80-bit format, in double.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

import heyoka as hy  # type: ignore[import-untyped]
import numpy as np

from capsule_sym import Parameters
from tests.judges import CONTACT, DRIFT, Run, Segment, first_field, next_field

EXTENDED = np.finfo(np.longdouble).nmant == 63
FLOAT: Any = np.longdouble if EXTENDED else np.float64
TOLERANCE = FLOAT("1e-18" if EXTENDED else "1e-16")

_PI = FLOAT("3.14159265358979323846264338327950288")

# heyoka loses the next root of a guard that starts at exactly zero, so every segment starts off
# the surface that it comes from: v_c by one unit of roundoff, x_r by one unit in the last place.
_NUDGE = np.finfo(FLOAT).eps


def run(
    parameters: Parameters,
    state: Sequence[Any] = (0.0, 0.0, 0.0),
    phase: Any = 0.0,
    periods: int = 20,
) -> Run:
    """Trajectory over `periods` forcing periods from (x_r, v_r, v_c) at time `phase`, x_c = 0.

    Raises ArithmeticError when a segment has no length or the integrator fails.
    """
    z = np.array([*state, 0.0], dtype=FLOAT)
    tau = FLOAT(phase)
    end = tau + periods * 2 * _PI / FLOAT(parameters.omega)
    field = first_field(parameters, state)
    segments: list[Segment] = []
    while tau < end:
        integrator = _integrator(field)
        integrator.pars[:] = [
            FLOAT(getattr(parameters, name))
            for name in ("alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b")
        ]
        integrator.time = tau
        integrator.state[:] = z
        integrator.reset_cooldowns()
        outcome = integrator.propagate_until(end)[0]
        start, tau = tau, FLOAT(integrator.time)
        if tau <= start:
            raise ArithmeticError(f"field {field} has no length at tau = {tau!r}")
        z = integrator.state.copy()
        following = field
        if outcome == hy.taylor_outcome.time_limit:
            tau = end
        elif -4 < int(outcome) < 0:
            fired = -int(outcome) - 1
            following = next_field(parameters, field, fired, z)
            if fired == 0:
                z[0] = np.nextafter(FLOAT(parameters.delta), FLOAT(8 if CONTACT[following] else -8))
            else:
                z[2] = DRIFT[following] * _NUDGE
        else:
            raise ArithmeticError(f"field {field} at tau = {tau!r}: {outcome}")
        segments.append(Segment(field, start, tau, tuple(z)))
        field = following
    return Run(tuple(segments))


@cache
def _integrator(field: int) -> Any:
    """Integrator of one field, Eqs. (7)-(12), with its guards as terminal events."""
    x, v, w, y = hy.make_vars("x_r", "v_r", "v_c", "x_c")
    alpha, omega, delta, zeta, beta, gamma, f_b = (hy.par[index] for index in range(7))
    push = x + 2.0 * zeta * v
    if CONTACT[field]:
        push += beta * (x - delta)
    drift = float(DRIFT[field])
    capsule = (push - drift * f_b) / gamma if drift else hy.expression(FLOAT(0))
    inside = [x - delta if CONTACT[field] else delta - x]
    inside += [drift * w] if drift else [f_b - push, f_b + push]
    event = hy.t_event_ldbl if EXTENDED else hy.t_event_dbl
    return hy.taylor_adaptive(
        [(x, v), (v, alpha * hy.cos(omega * hy.time) - push - capsule), (w, capsule), (y, w)],
        state=np.zeros(4, dtype=FLOAT),
        pars=np.zeros(7, dtype=FLOAT),
        tol=TOLERANCE,
        fp_type=FLOAT,
        t_events=[event(guard, direction=hy.event_direction.negative) for guard in inside],
    )
