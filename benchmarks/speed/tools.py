"""The integrators in C as tools of the study."""

from __future__ import annotations

from functools import partial

from benchmarks.bench.tools import Tool
from benchmarks.speed import compiled

NAMES = "DOP853 and RK4 in C"


def compiled_tools(rk4_steps: tuple[int, ...]) -> list[Tool]:
    """DOP853 at all its settings, and RK4 with so many steps a period; none without a compiler."""
    if compiled.problem():
        return []
    tools = [
        Tool("DOP853 in C", f"{tol:g}, {form}", partial(compiled.dop853, tol, interior))
        for form, interior in (("ends of steps", False), ("inside steps", True))
        for tol in (1e-6, 1e-9, 1e-12, 1e-13)
    ]
    return tools + [
        Tool("RK4 in C", f"{steps} steps a period", partial(compiled.rk4, steps))
        for steps in rk4_steps
    ]
