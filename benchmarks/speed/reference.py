"""Reference results: itineraries and final states of the 50-digit map, from reference.json."""

from __future__ import annotations

import json
from importlib import resources
from typing import NamedTuple

from benchmarks.speed.model import Result, Start
from capsule_sym import Parameters

ALPHAS = (0.3, 0.45, 0.7, 1.2, 1.5, 1.64, 1.69, 1.9)
"""Excitation amplitudes of the case study, one inside each of the paper's intervals."""

PERIODS = 20

SWEEP_ALPHAS = tuple(k / 500 for k in range(1, 1001))
"""Excitation amplitudes of the sweep; near 1.522 a backward phase is very short."""

SWEEP_PERIODS = 100

REST = (0.0, 0.0, 0.0)


class Case(NamedTuple):
    """Run to make, and its reference result if known."""

    start: Start
    truth: Result | None


def cases(part: str) -> list[Case]:
    """Runs with a reference: "case study", "tangencies", or a sample of the "sweep"."""
    file = resources.files(__package__).joinpath("reference.json")
    record = json.loads(file.read_text(encoding="utf-8"))[part]
    return [
        Case(
            Start(Parameters(alpha=run["alpha"]), tuple(run["start"]), record["periods"]),
            Result(bytes(map(int, run["itinerary"])), tuple(map(float, run["final"]))),
        )
        for run in record["runs"]
    ]


def sweep() -> list[Case]:
    """All runs of the sweep, from rest; the sample alone has references."""
    known = {case.start: case.truth for case in cases("sweep")}
    starts = [Start(Parameters(alpha=alpha), REST, SWEEP_PERIODS) for alpha in SWEEP_ALPHAS]
    return [Case(start, known.get(start)) for start in starts]
