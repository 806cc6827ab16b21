"""This map itself: in C, and its reference in NumPy and mpmath."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from capsule_sym.bench.model import Result, Run, Start
from capsule_sym.map import simulate
from capsule_sym.map.batch import final_state, final_states, parameter_rows


def final(starts: Sequence[Start]) -> list[Result]:
    """Final states alone, by the C core, a call for each; words are empty."""
    return [Result(b"", final_state(s.parameters, s.state, 0.0, s.periods)) for s in starts]


def sweep(starts: Sequence[Start]) -> list[Result]:
    """Final states alone, by the C core, in one call and one thread; words are empty."""
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
            word = bytes(segment.field for segment in found.segments)
            state = None if found.stopped else tuple(float(v) for v in found.final[1])
            results.append(Result(word, state))
        return results

    return run
