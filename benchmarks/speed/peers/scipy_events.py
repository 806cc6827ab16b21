"""SciPy's solve_ivp with terminal events, restarted at each switch."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

import numpy as np

from benchmarks.speed.model import NUDGE, Guard, Result, Run, Start, guards, rates, switched
from capsule_sym import Parameters


def build(method: Any, tolerance: float, careful: bool) -> Run:
    """Run function of a method of solve_ivp, with the tolerance as rtol and atol.

    With `careful` every guard is raised by 1e-16.
    """
    raised = NUDGE if careful else 0.0

    def run(starts: Sequence[Start]) -> list[Result]:
        return [_run(start, method, tolerance, raised) for start in starts]

    return run


def _run(start: Start, method: Any, tolerance: float, raised: float) -> Result:
    from scipy.integrate import solve_ivp

    p, end = start.parameters, start.end

    def step(field: int, now: float, z: Any) -> tuple[float, Any, int | None]:
        solution: Any = solve_ivp(
            _rate(p, field),
            (now, end),
            z,
            method=method,
            rtol=tolerance,
            atol=tolerance,
            events=[_event(guard) for guard in guards(p, field, raised)],
        )
        hits = [float(e[0]) if len(e) else inf for e in solution.t_events]
        fired = int(np.argmin(hits))
        if hits[fired] == inf:
            return end, solution.y[:, -1], None
        return hits[fired], solution.y_events[fired][0].copy(), fired

    return switched(start, step)


def _rate(p: Parameters, field: int) -> Any:
    rate = rates(p, field)

    def value(t: float, z: Any) -> tuple[float, float, float]:
        x_r, v_r, _ = z.tolist()
        return rate(t, x_r, v_r)

    return value


def _event(guard: Guard) -> Any:
    def value(_: float, z: Any) -> float:
        return guard(*z.tolist())

    value.terminal, value.direction = True, -1  # type: ignore[attr-defined]
    return value
