"""SUNDIALS' CVODE with root finding, by scikit-sundae, restarted at each switch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from benchmarks.speed.model import (
    NUDGE,
    Guard,
    Rates,
    Result,
    Run,
    Start,
    guards,
    rates,
    switched,
)
from capsule_sym import Parameters

_GUARDS = 3  # in stick; drift has two
_ROOT_FOUND = 2
_MOST_STEPS = 1_000_000


def build(method: str, tolerance: float, careful: bool) -> Run:
    """Run function of method "Adams" or "BDF", with the tolerance as rtol and atol.

    With `careful` every guard is raised by 1e-16.
    """
    from sksundae.cvode import CVODE  # type: ignore[import-not-found,import-untyped,unused-ignore]

    here = _Field(NUDGE if careful else 0.0)

    def derivative(t: float, z: Any, out: Any) -> None:
        x_r, v_r, _ = z.tolist()
        out[0], out[1], out[2] = here.rate(t, x_r, v_r)

    def events(_: float, z: Any, out: Any) -> None:
        state = z.tolist()
        for i, guard in enumerate(here.guards):
            out[i] = guard(*state)

    events.terminal, events.direction = [True] * _GUARDS, [-1] * _GUARDS  # type: ignore[attr-defined]
    solver = CVODE(
        derivative,
        method=method,
        rtol=tolerance,
        atol=tolerance,
        eventsfn=events,
        num_events=_GUARDS,
        max_num_steps=_MOST_STEPS,
    )

    def run(starts: Sequence[Start]) -> list[Result]:
        return [_run(solver, here, start) for start in starts]

    return run


class _Field:
    """Equations of the current field, for the callbacks of one solver that serves all six."""

    rate: Rates
    guards: list[Guard]

    def __init__(self, raised: float) -> None:
        self._raised = raised

    def enter(self, p: Parameters, field: int) -> None:
        self.rate, self.guards = rates(p, field), guards(p, field, self._raised)
        self.guards += [lambda x_r, v_r, v_c: 1.0] * (_GUARDS - len(self.guards))


def _run(solver: Any, here: _Field, start: Start) -> Result:
    def step(field: int, now: float, z: Any) -> tuple[float, Any, int | None]:
        here.enter(start.parameters, field)
        solver.init_step(now, z)
        found = solver.step(start.end, tstop=start.end)
        z = np.array(found.y, dtype=float).reshape(-1, 3)[-1]
        if found.status != _ROOT_FOUND:
            return start.end, z if found.status >= 0 else None, None
        fired = int(np.flatnonzero(np.reshape(found.i_events, (-1, _GUARDS))[-1])[0])
        return float(np.ravel(found.t)[-1]), z, fired

    return switched(start, step)
