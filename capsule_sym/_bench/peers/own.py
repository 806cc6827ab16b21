"""This map itself: in C, and its reference in NumPy and mpmath."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from capsule_sym._bench.model import Result, Run, Start
from capsule_sym._map import simulate
from capsule_sym._map.batch import final_state, final_states, parameter_rows


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
