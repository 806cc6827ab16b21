"""This map itself: in C, its reference in NumPy and mpmath, and single widths of the core."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.speed.model import MOST, Result, Run, Start
from capsule_sym import simulate, simulate_many
from capsule_sym._map.interface import NativeRun, core
from capsule_sym.generated.interface import Precision


def final(starts: Sequence[Start]) -> list[Result]:
    """Final states alone, by the C core, a call for each; itineraries are empty."""
    return [
        Result(b"", simulate(s.parameters, s.state, periods=s.periods, keep="final").final[1])
        for s in starts
    ]


def whole(starts: Sequence[Start]) -> list[Result]:
    """The same of runs whose segments are all kept."""
    return [
        Result(b"", simulate(s.parameters, s.state, periods=s.periods).final[1]) for s in starts
    ]


def one_row(starts: Sequence[Start]) -> list[Result]:
    """The same by calls of `simulate_many` with one row for each."""
    return [_many([start])[0] for start in starts]


def sweep(starts: Sequence[Start]) -> list[Result]:
    """The same in one call and one thread."""
    return _many(starts)


def _many(starts: Sequence[Start]) -> list[Result]:
    systems, states = [s.parameters for s in starts], [s.state for s in starts]
    found = simulate_many(systems, states, periods=starts[0].periods).states.tolist()
    return [Result(b"", tuple(state)) for state in found]


def simulated(backend: str) -> Run:
    """Whole trajectories by a backend; states are rounded to double precision."""

    def run(starts: Sequence[Start]) -> list[Result]:
        results = []
        for start in starts:
            found = simulate(start.parameters, start.state, 0.0, start.periods, backend=backend)
            itinerary = bytes(segment.field for segment in found.segments)
            state = tuple(float(v) for v in found.final[1]) if found.success else None
            results.append(Result(itinerary, state))
        return results

    return run


def side_by_side(starts: Sequence[Start], lanes: int) -> list[tuple[float, ...]]:
    """Final states by so many lanes, of runs that last as long as the first."""
    rows = np.array([list(s.parameters.to_dict().values()) for s in starts])
    records, stops = np.empty(len(starts), core().records.STATE), np.empty(len(starts), np.int8)
    core().start_many(rows, np.array([s.state for s in starts]), np.zeros(len(starts)), records)
    core().run_many(rows, records, starts[0].periods, stops, lanes=lanes)
    return [(float(r["x_r"]), float(r["v_r"]), float(r["v_c"])) for r in records]


def simulated_wide(starts: Sequence[Start]) -> list[Result]:
    """Itineraries by the C core, every switch decided in 106 bits."""
    results = []
    for start in starts:
        run = NativeRun(start.parameters, escalate=True)
        run.precision = Precision.DOUBLE_DOUBLE
        found = run.go(start.state, 0.0, start.periods, MOST * start.periods)
        itinerary = bytes(segment.field for segment in found.segments)
        results.append(Result(itinerary, found.final[1]))
    return results
