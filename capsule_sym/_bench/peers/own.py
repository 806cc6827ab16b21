"""This map itself: in C, and its reference in NumPy and mpmath."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from capsule_sym._bench.model import MOST, Result, Run, Start
from capsule_sym._map import simulate
from capsule_sym._map.batch import final_state, final_states, parameter_rows
from capsule_sym._map.native import NativeRun, core
from capsule_sym.generated.interface import Precision


def final(starts: Sequence[Start]) -> list[Result]:
    """Final states alone, by the C core, a call for each; itineraries are empty."""
    return [Result(b"", final_state(s.parameters, s.state, 0.0, s.periods)) for s in starts]


def one_row(starts: Sequence[Start]) -> list[Result]:
    """Final states alone, by the C core, a call of `final_states` with one row for each."""
    results = []
    for start in starts:
        row = np.array([list(start.parameters.to_dict().values())])
        state = final_states(row, start.state, periods=start.periods).states[0].tolist()
        results.append(Result(b"", tuple(state)))
    return results


def side_by_side(starts: Sequence[Start], lanes: int) -> list[tuple[float, ...]]:
    """Final states by so many lanes, of runs that last as long as the first."""
    rows = np.array([list(s.parameters.to_dict().values()) for s in starts])
    records, stops = np.empty(len(starts), core().STATE), np.empty(len(starts), np.int8)
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


def sweep(starts: Sequence[Start]) -> list[Result]:
    """Final states alone, by the C core, in one call and one thread; itineraries are empty."""
    first = starts[0]
    rows = parameter_rows(first.parameters, alpha=[s.parameters.alpha for s in starts])
    states = np.array([s.state for s in starts])
    found = final_states(rows, states, periods=first.periods).states.tolist()
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
