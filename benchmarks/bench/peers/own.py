"""This map itself: in C, and its reference in NumPy and mpmath."""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.bench.model import Result, Run, Start
from capsule_sym._map import simulate
from capsule_sym._map.many import simulate_many


def final(starts: Sequence[Start]) -> list[Result]:
    """Final states alone, by the C core, a call for each; itineraries are empty."""
    return [
        Result(b"", simulate(s.parameters, s.state, periods=s.periods, keep="final").final[1])
        for s in starts
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
