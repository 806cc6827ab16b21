"""heyoka.py, one trajectory at a time or in lanes of its batch mode.

One integrator has all six fields. Contact and drift are run-time parameters, which the callbacks of
its terminal events change, as its documentation advises. Of the forms tried this was the fastest:
one integrator a field, restarted from Python, takes half as long again.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import nextafter
from typing import Any

import numpy as np

from benchmarks.speed.model import (
    CONTACT,
    DRIFT,
    FIELD,
    MOST,
    NUDGE,
    Result,
    Run,
    Start,
    drift_at_rest,
)
from capsule_sym import Parameters

_PARAMETERS = 12
_SIDE, _SPRING, _SLIP = 4, 5, slice(6, 11)


def build(tolerance: float, careful: bool, lanes: int | None = None) -> Run:
    """Run function at a tolerance, in lanes of the batch mode if `lanes` is given.

    After a switch x_r is set to delta, or v_c to zero. With `careful` it is one unit off, inside
    the region that is entered: guards that start at exactly zero can lose their next root.
    """
    import heyoka as hy  # type: ignore[import-not-found,import-untyped,unused-ignore]

    hy.set_logger_level_critical()  # the results show the errors that its warnings announce
    hy.llvm_state.clear_memcache()  # the time to compile is part of the measurement
    batch = Lanes(lanes or 1, careful)
    callbacks = (batch.gap, batch.upper, batch.lower)
    event = hy.t_event_batch if lanes else hy.t_event
    system, guards = _system(hy)
    shape: tuple[int, ...] = (lanes,) if lanes else ()
    integrator = (hy.taylor_adaptive_batch if lanes else hy.taylor_adaptive)(
        system,
        state=np.zeros((3, *shape)),
        pars=np.zeros((_PARAMETERS, *shape)),
        tol=tolerance,
        t_events=[
            event(guard, direction=hy.event_direction.negative, callback=callback)
            for guard, callback in zip(guards, callbacks, strict=True)
        ],
    )
    batch.values = integrator.pars.reshape(_PARAMETERS, -1)
    batch.state = integrator.state.reshape(3, -1)

    def run(starts: Sequence[Start]) -> list[Result]:
        results: list[Result] = []
        for first in range(0, len(starts), batch.lanes):
            chosen = list(starts[first : first + batch.lanes])
            batch.begin(chosen + chosen[-1:] * (batch.lanes - len(chosen)))
            if lanes:
                integrator.set_time(0.0)
            else:
                integrator.time = 0.0
            integrator.reset_cooldowns()
            end = chosen[0].end
            integrator.propagate_until([end] * lanes if lanes else end)
            results += batch.results()[: len(chosen)]
        return results

    return run


def _system(hy: Any) -> tuple[list[Any], list[Any]]:
    """Eqs. (7)-(12) with contact and drift as parameters, and the three guards."""
    x, v, w = hy.make_vars("x", "v", "w")
    alpha, omega, delta, zeta, side, spring, slip, friction, sign, stick, bound, f_b = (
        hy.par[i] for i in range(_PARAMETERS)
    )
    pull = x + 2.0 * zeta * v + spring * (x - delta)
    capsule = slip * pull - friction
    system = [(x, v), (v, alpha * hy.cos(omega * hy.time) - pull - capsule), (w, capsule)]
    return system, [side * (x - delta), sign * w + stick * (f_b - pull), bound + stick * pull]


class Lanes:
    """Contact and drift of every lane, and the callbacks that change them.

    `state` (3, lanes) and `values` (12, lanes) are the integrator's own arrays.
    """

    state: Any
    values: Any

    def __init__(self, lanes: int, careful: bool) -> None:
        self.lanes, self.careful = lanes, careful
        self.contact, self.drift = [0] * lanes, [0] * lanes
        self.itineraries = [bytearray() for _ in range(lanes)]

    def __deepcopy__(self, _memo: Any) -> Lanes:
        """The same object: heyoka copies its callbacks, which have to share what they change."""
        return self

    def begin(self, starts: Sequence[Start]) -> None:
        """Put every lane at its start; all parameters but alpha are those of the first start."""
        p = self.parameters = starts[0].parameters
        self.room, self.locked = MOST * (starts[0].periods + 1), False
        self.edge: tuple[float, ...] = (p.delta, p.delta)
        self.still = {0: 0.0, 1: 0.0, -1: 0.0}
        if self.careful:
            self.edge = (nextafter(p.delta, -np.inf), nextafter(p.delta, np.inf))
            self.still = {0: 0.0, 1: NUDGE, -1: -NUDGE}
        self.columns = {drift: _column(p, drift) for drift in (0, 1, -1)}
        self.values[:4] = np.array([0.0, p.omega, p.delta, p.zeta])[:, None]
        self.values[-1] = p.f_b
        for lane, start in enumerate(starts):
            field = start.field
            self.itineraries[lane] = bytearray([field])
            contact, drift = CONTACT[field], DRIFT[field]
            self.contact[lane], self.drift[lane] = contact, drift
            self.values[0, lane] = start.parameters.alpha
            self.values[_SIDE, lane] = 2 * contact - 1
            self.values[_SPRING, lane] = contact * p.beta
            self.values[_SLIP, lane] = self.columns[drift]
            self.state[:, lane] = start.state

    def results(self) -> list[Result]:
        """Itineraries and states of all lanes."""
        states = [None if self.locked else tuple(state) for state in self.state.T.tolist()]
        return [Result(bytes(w), state) for w, state in zip(self.itineraries, states, strict=True)]

    def gap(self, _integrator: Any, _sign: int, lane: int = 0) -> bool:
        """The first guard: contact begins or ends."""
        contact = self.contact[lane] = 1 - self.contact[lane]
        self.values[_SIDE, lane] = 2 * contact - 1
        self.values[_SPRING, lane] = contact * self.parameters.beta
        self.state[0, lane] = self.edge[contact]
        return self._entered(lane)

    def upper(self, _integrator: Any, _sign: int, lane: int = 0) -> bool:
        """The second guard: v_c = 0 in drift, or the upper bound of friction in stick."""
        if self.drift[lane]:
            x_r, v_r, _ = self.state[:, lane].tolist()
            drift = drift_at_rest(self.parameters, self.contact[lane], x_r, v_r)
            return self._move(lane, drift)
        return self._move(lane, 1)

    def lower(self, _integrator: Any, _sign: int, lane: int = 0) -> bool:
        """The third guard: the lower bound of friction in stick."""
        return self._move(lane, -1)

    def _move(self, lane: int, drift: int) -> bool:
        self.drift[lane] = drift
        self.values[_SLIP, lane] = self.columns[drift]
        self.state[2, lane] = self.still[drift]
        return self._entered(lane)

    def _entered(self, lane: int) -> bool:
        """Record the field that is entered; returns False to stop all lanes that locked up."""
        self.itineraries[lane].append(FIELD[self.contact[lane], self.drift[lane]])
        self.locked = len(self.itineraries[lane]) > self.room
        return not self.locked


def _column(p: Parameters, drift: int) -> Any:
    """slip, friction, sign, stick and bound of `_system`."""
    if drift:
        return np.array([1 / p.gamma, drift * p.f_b / p.gamma, drift, 0.0, 1.0])
    return np.array([0.0, 0.0, 0.0, 1.0, p.f_b])
