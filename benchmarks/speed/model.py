"""The six fields of Eqs. (7)-(12), written as for a general integrator, and the result of a run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, pi
from typing import Any, NamedTuple

import numpy as np

from capsule_sym import Parameters

CONTACT = {1: 0, 2: 0, 3: 0, 4: 1, 5: 1, 6: 1}
"""1 where the second spring acts, by field."""

DRIFT = {1: 1, 2: 0, 3: -1, 4: 1, 5: 0, 6: -1}
"""Direction of drift by field: 1 forward, 0 stick, -1 backward."""

FIELD = {(CONTACT[field], DRIFT[field]): field for field in CONTACT}
"""Field by contact and drift."""

NUDGE = 1e-16
"""Offset into its guards at which a careful restart begins; the guards are of order one."""

MOST = 40
"""Limit of switches a period; a run with more counts as locked up."""

_SHORTEST = 1e-12  # length of a segment that counts as zero
_MOST_SHORT = 50


class Start(NamedTuple):
    """Run to make: from a state (x_r, v_r, v_c) at time 0 over whole excitation periods."""

    parameters: Parameters
    state: tuple[float, float, float]
    periods: int

    @property
    def end(self) -> float:
        """Time at the end of the run."""
        return self.periods * 2 * pi / self.parameters.omega

    @property
    def field(self) -> int:
        """Field at the start, from the regions of Eqs. (7)-(12)."""
        x_r, v_r, v_c = self.state
        p, contact = self.parameters, int(self.state[0] >= self.parameters.delta)
        drift = (v_c > 0) - (v_c < 0) or drift_at_rest(p, contact, x_r, v_r)
        return FIELD[contact, drift]


class Result(NamedTuple):
    """Result of a run: the fields that it entered, one byte each, and its final (x_r, v_r, v_c).

    The state is None if the run locked up in switches that take almost no time.
    """

    itinerary: bytes
    state: tuple[float, ...] | None


Run = Callable[[Sequence[Start]], list[Result]]
"""Function that makes the runs of several starts, one after the other. The starts share all
parameters but alpha."""


Rates = Callable[[float, float, float], tuple[float, float, float]]
Guard = Callable[[float, float, float], float]


class Locked(Exception):
    """Raised if switches follow each other and time hardly passes."""


class Clock:
    """Time of a run; detects segments of zero length."""

    def __init__(self, start: Start) -> None:
        self.now, self._short = 0.0, 0
        self._room = MOST * (start.periods + 1)

    def advance(self, time: float) -> None:
        """Advance to the time of the next switch.

        Raises Locked after 50 switches in a row that took no time, or 40 for each period.
        """
        self._short = self._short + 1 if time - self.now < _SHORTEST else 0
        self._room -= 1
        self.now = time
        if self._short == _MOST_SHORT or not self._room:
            raise Locked


def force(p: Parameters, contact: int, x_r: float, v_r: float) -> float:
    """Interaction force P3 or P4 on the capsule."""
    return x_r + 2 * p.zeta * v_r + (p.beta * (x_r - p.delta) if contact else 0.0)


def drift_at_rest(p: Parameters, contact: int, x_r: float, v_r: float) -> int:
    """Direction in which a capsule at rest begins to slip, 0 if it sticks."""
    pull = force(p, contact, x_r, v_r)
    return 0 if abs(pull) <= p.f_b else (1 if pull > 0 else -1)


def following(p: Parameters, field: int, fired: int, x_r: float, v_r: float) -> int:
    """Successor field after an event of guard 0 (gap), or 1 or 2 (velocity or friction)."""
    contact, drift = CONTACT[field], DRIFT[field]
    if fired == 0:
        return FIELD[1 - contact, drift]
    if drift:
        return FIELD[contact, drift_at_rest(p, contact, x_r, v_r)]
    return FIELD[contact, 1 if fired == 1 else -1]


def rates(p: Parameters, field: int) -> Rates:
    """Time derivative of (x_r, v_r, v_c) in a field, as a function of time, x_r and v_r."""
    alpha, omega, delta, damping = p.alpha, p.omega, p.delta, 2 * p.zeta
    spring = p.beta if CONTACT[field] else 0.0
    slip = 1 / p.gamma if DRIFT[field] else 0.0
    friction = DRIFT[field] * p.f_b * slip

    def value(t: float, x_r: float, v_r: float) -> tuple[float, float, float]:
        pull = x_r + damping * v_r + spring * (x_r - delta)
        capsule = slip * pull - friction
        return v_r, alpha * cos(omega * t) - pull - capsule, capsule

    return value


def guards(p: Parameters, field: int, raised: float) -> list[Guard]:
    """Guards of a field as functions of the state, positive inside its region: two or three.

    `raised` is added to each. SciPy may take a guard that starts at exactly zero for an event, and
    CVODE does not monitor it.
    """
    contact, drift, delta, f_b = CONTACT[field], DRIFT[field], p.delta, p.f_b
    if drift:
        others: list[Guard] = [lambda x_r, v_r, v_c: drift * v_c + raised]
    else:
        others = [
            lambda x_r, v_r, v_c: f_b - force(p, contact, x_r, v_r) + raised,
            lambda x_r, v_r, v_c: f_b + force(p, contact, x_r, v_r) + raised,
        ]
    if contact:
        return [lambda x_r, v_r, v_c: x_r - delta + raised, *others]
    return [lambda x_r, v_r, v_c: delta - x_r + raised, *others]


Step = Callable[[int, float, Any], tuple[float, Any, int | None]]
"""Integrates a field from a time and state to its first event: time, state and guard number. The
number is None at the end of the run; the state is None if the integration failed."""


def switched(start: Start, step: Step) -> Result:
    """Run that restarts the integrator at each switch and sets x_r = delta or v_c = 0 there."""
    p, clock = start.parameters, Clock(start)
    field, z, itinerary = start.field, np.array(start.state), bytearray()
    while clock.now < start.end:
        itinerary.append(field)
        time, z, fired = step(field, clock.now, z)
        if fired is None:
            return Result(bytes(itinerary), None if z is None else tuple(z.tolist()))
        try:
            clock.advance(time)
        except Locked:
            return Result(bytes(itinerary), None)
        field = following(p, field, fired, z[0], z[1])
        z[0 if fired == 0 else 2] = p.delta if fired == 0 else 0.0
    return Result(bytes(itinerary), tuple(z.tolist()))
