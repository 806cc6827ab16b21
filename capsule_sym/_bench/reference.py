"""What is true: itineraries and final states by the 50-digit map, kept in reference.json.

`python -m capsule_sym._bench.reference` computes them anew, in some minutes.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from capsule_sym._bench.model import Result, Start
from capsule_sym._files import write_whole
from capsule_sym._parameters import Parameters

ALPHAS = (0.3, 0.45, 0.7, 1.2, 1.5, 1.64, 1.69, 1.9)
"""Excitation amplitudes of the case study, one inside each of the paper's intervals."""

PERIODS = 20

SWEEP_ALPHAS = tuple(k / 500 for k in range(1, 1001))
"""Excitation amplitudes of the sweep; near 1.522 a backward phase is very short."""

SWEEP_PERIODS = 100

_SAMPLE = (*SWEEP_ALPHAS[99::100], 1.522)
_REST = (0.0, 0.0, 0.0)
_DIGITS = 25


class Case(NamedTuple):
    """A run to make, and what is true of it, if that is known."""

    start: Start
    truth: Result | None


def cases(part: str) -> list[Case]:
    """Runs of which the truth is known: "case study", "tangencies", or a sample of the "sweep"."""
    record = json.loads(_file().read_text(encoding="utf-8"))[part]
    return [
        Case(
            Start(Parameters(alpha=run["alpha"]), tuple(run["start"]), record["periods"]),
            Result(bytes(map(int, run["itinerary"])), tuple(map(float, run["final"]))),
        )
        for run in record["runs"]
    ]


def sweep() -> list[Case]:
    """All runs of the sweep, from rest; what is true is known of the sample alone."""
    known = {case.start: case.truth for case in cases("sweep")}
    starts = [Start(Parameters(alpha=alpha), _REST, SWEEP_PERIODS) for alpha in SWEEP_ALPHAS]
    return [Case(start, known.get(start)) for start in starts]


def _file() -> Any:
    return resources.files(__package__).joinpath("reference.json")


def compute() -> dict[str, Any]:
    """The content of reference.json."""
    from capsule_sym._bench import tangencies

    near = [start for name in tangencies.values() for start in tangencies.starts(name)]
    return {
        "case study": _computed([Start(Parameters(alpha=a), _REST, PERIODS) for a in ALPHAS]),
        "tangencies": {"alphas": tangencies.values()} | _computed(near),
        "sweep": _computed([Start(Parameters(alpha=a), _REST, SWEEP_PERIODS) for a in _SAMPLE]),
    }


def _computed(starts: Sequence[Start]) -> dict[str, Any]:
    with ProcessPoolExecutor() as pool:
        return {"periods": starts[0].periods, "runs": list(pool.map(_run, starts))}


def _run(start: Start) -> dict[str, Any]:
    import mpmath

    from capsule_sym._map import simulate

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
    """Writes reference.json."""
    write_whole(Path(str(_file())), text(compute()))


if __name__ == "__main__":
    main()
