"""This map at one width of the C core: in 106 bits, or side by side in lanes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.bench.model import MOST, Result, Start
from capsule_sym._map.native import NativeRun, core
from capsule_sym.generated.capsule.interface import Precision


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
