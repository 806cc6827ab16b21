"""The piecewise system in double precision by SciPy's DOP853, segment by segment."""

from collections.abc import Callable, Sequence
from functools import partial
from math import cos, inf, pi

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from capsule_sym import Parameters
from tests.judges import CONTACT, DRIFT, Run, Segment, first_field, next_field

RTOL, ATOL = 1e-13, 1e-14

# solve_ivp compares a guard's signs at the ends of a step and takes the event's state from the
# dense output, of lower order than the step. Short steps keep two crossings out of one step and
# the dense output as accurate as the steps.
_MAX_STEP = 0.05

# solve_ivp takes a guard that starts at exactly zero for an event when the step ends beyond it,
# so every guard is started inside its region by about one unit of roundoff.
_NUDGE = 1e-16

State = NDArray[np.float64]
Guard = Callable[[float, State], float]


def run(
    parameters: Parameters,
    state: Sequence[float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    periods: int = 20,
) -> Run:
    """Trajectory over `periods` forcing periods from (x_r, v_r, v_c) at time `phase`, x_c = 0.

    Two crossings of one guard closer than the steps (0.05) can be missed. Raises ArithmeticError
    when a segment has no length or the integrator fails.
    """
    z = np.array([*state, 0.0])
    tau, end = phase, phase + periods * 2 * pi / parameters.omega
    field = first_field(parameters, state)
    segments: list[Segment] = []
    while tau < end:
        solution = solve_ivp(
            partial(derivative, parameters, field),
            (tau, end),
            z,
            method="DOP853",
            rtol=RTOL,
            atol=ATOL,
            max_step=_MAX_STEP,
            events=guards(parameters, field),
        )
        if not solution.success:
            raise ArithmeticError(f"field {field} at tau = {tau!r}: {solution.message}")
        t_events, y_events = solution.t_events or [], solution.y_events or []
        times = [float(found[0]) if len(found) else inf for found in t_events]
        fired = int(np.argmin(times))
        start, tau = tau, min(times[fired], end)
        if tau <= start:
            raise ArithmeticError(f"field {field} has no length at tau = {tau!r}")
        following = field
        if times[fired] < inf:
            z = y_events[fired][0].copy()
            following = next_field(parameters, field, fired, z)
            if fired == 0:
                z[0] = parameters.delta
            else:
                z[2] = 0.0
        else:
            z = solution.y[:, -1]
        segments.append(Segment(field, start, tau, tuple(map(float, z))))
        field = following
    return Run(tuple(segments))


def derivative(
    parameters: Parameters, field: int, tau: float, z: State
) -> tuple[float, float, float, float]:
    """Time derivative of (x_r, v_r, v_c, x_c) in one field, Eqs. (7)-(12)."""
    x_r, v_r, v_c, _ = z
    push = _push(parameters, CONTACT[field], x_r, v_r)
    drift = DRIFT[field]
    capsule = (push - drift * parameters.f_b) / parameters.gamma if drift else 0.0
    return v_r, parameters.alpha * cos(parameters.omega * tau) - push - capsule, capsule, v_c


def _push(parameters: Parameters, contact: bool, x_r: float, v_r: float) -> float:
    spring = parameters.beta * (x_r - parameters.delta) if contact else 0.0
    return x_r + 2 * parameters.zeta * v_r + spring


def guards(parameters: Parameters, field: int) -> list[Guard]:
    """Terminal events of a field in the order of `next_field`, positive inside its region."""
    side, drift = (1 if CONTACT[field] else -1), DRIFT[field]

    def contact(_tau: float, z: State) -> float:
        return float(side * (z[0] - parameters.delta) + _NUDGE)

    def motion(_tau: float, z: State) -> float:
        return float(drift * z[2] + _NUDGE)

    def upper(_tau: float, z: State) -> float:
        return parameters.f_b - _push(parameters, CONTACT[field], z[0], z[1]) + _NUDGE

    def lower(_tau: float, z: State) -> float:
        return parameters.f_b + _push(parameters, CONTACT[field], z[0], z[1]) + _NUDGE

    events: list[Guard] = [contact, motion] if drift else [contact, upper, lower]
    for event in events:
        event.terminal, event.direction = True, -1  # type: ignore[attr-defined]
    return events
