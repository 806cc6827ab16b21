"""Itineraries and final states by the 50-digit map, of the study's runs.

`python -m benchmarks.speed.truth` computes them, in some minutes, and writes reference.json.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.speed import tangencies
from benchmarks.speed.model import Start
from benchmarks.speed.reference import (
    ALPHAS,
    PERIODS,
    REST,
    SWEEP_ALPHAS,
    SWEEP_PERIODS,
)
from capsule_sym import Parameters, simulate
from capsule_sym._files import write_whole

_SAMPLE = (*SWEEP_ALPHAS[99::100], 1.522)
_DIGITS = 25


def compute() -> dict[str, Any]:
    """The content of reference.json."""
    near = [start for name in tangencies.values() for start in tangencies.starts(name)]
    return {
        "case study": _computed([Start(Parameters(alpha=a), REST, PERIODS) for a in ALPHAS]),
        "tangencies": {"alphas": tangencies.values()} | _computed(near),
        "sweep": _computed([Start(Parameters(alpha=a), REST, SWEEP_PERIODS) for a in _SAMPLE]),
    }


def _computed(starts: Sequence[Start]) -> dict[str, Any]:
    with ProcessPoolExecutor() as pool:
        return {"periods": starts[0].periods, "runs": list(pool.map(_run, starts))}


def _run(start: Start) -> dict[str, Any]:
    import mpmath

    found = simulate(start.parameters, start.state, 0.0, start.periods, backend="mpmath")
    return {
        "alpha": start.parameters.alpha,
        "start": list(start.state),
        "itinerary": "".join(str(segment.field) for segment in found.segments),
        "final": [mpmath.nstr(value, _DIGITS) for value in found.final[1]],
    }


def text(found: dict[str, Any]) -> str:
    """The content of reference.json as JSON, a line for each run."""
    parts = []
    for name, part in found.items():
        about = json.dumps({key: value for key, value in part.items() if key != "runs"})
        runs = ",\n".join(map(json.dumps, part["runs"]))
        parts.append(f'{json.dumps(name)}: {about[:-1]}, "runs": [\n{runs}\n]}}')
    return "{\n" + ",\n".join(parts) + "\n}\n"


def main() -> None:
    """Write reference.json."""
    write_whole(Path(__file__).with_name("reference.json"), text(compute()))


if __name__ == "__main__":
    main()
