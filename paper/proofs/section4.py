"""Section 4 of the paper proved in balls, and the proved share: the record of `enclose`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from capsule_sym import Parameters, solve_orbit
from capsule_sym._enclosures.interface import Proved, Unproved, ball, certificates, precision
from capsule_sym._native import Watch
from paper.printed import panels, read
from paper.proofs.branches import Box
from paper.proofs.case import EXACT
from paper.proofs.decimals import decimal
from paper.proofs.intervals import (
    THRESHOLD_BITS,
    ProvedInterval,
    approximate,
    prove_intervals,
    threshold,
)

FIRST, LAST = Fraction(1, 1000), Fraction(2)
TIME_OVER = "the time was over"


@dataclass(frozen=True)
class Section:
    """Proofs at one mass ratio: bifurcations, the intervals between them, and the gaps.

    `failed` is the reason why the proof is incomplete, or empty.
    """

    gamma: str
    events: tuple[Proved, ...]
    intervals: tuple[ProvedInterval, ...]
    failed: str

    @property
    def unproved(self) -> float:
        """Bound on the length of alpha in [0.001, 2] that is not proved."""
        with precision(128):
            covered = sum((one.high - one.low for one in self.intervals), ball(0))
            return float((ball(LAST) - ball(FIRST) - covered).upper())


def prove_section(
    gamma: str,
    *,
    intervals: bool = True,
    report: Callable[[Box], object] = lambda box: None,
    max_seconds: float = math.inf,
) -> Section:
    """Prove every bifurcation of Section 4 at a mass ratio and, by default, every interval.

    Results proved within `max_seconds` are kept; `failed` then states that the time was over.
    """
    exact = EXACT | {"gamma": gamma}
    events: list[Proved] = []
    proved: list[ProvedInterval] = []
    failed = TIME_OVER
    with Watch(max_seconds):
        try:
            found, start = approximate(Parameters(gamma=float(gamma)), float(FIRST), float(LAST))
            events.extend(threshold(one, exact) for one in found)
            if intervals:
                with precision(128):
                    first, last = ball(FIRST), ball(LAST)
                proved.extend(prove_intervals(events, start, exact, first, last, report))
            failed = ""
        except Unproved as error:
            failed = str(error)
    return Section(gamma, tuple(events), tuple(proved), failed)


def certified(gamma: str, max_seconds: float = math.inf) -> tuple[list[dict[str, Any]], list[str]]:
    """Certificates at a mass ratio: all bifurcations, and the orbits of Fig. 7's amplitudes.

    Returns them with the reason for each missing one, including those not reached in time.
    """
    with Watch(max_seconds) as watch:
        found, _ = approximate(Parameters(gamma=float(gamma)), float(FIRST), float(LAST))
        orbits = [
            solve_orbit(Parameters(gamma=float(gamma), alpha=float(alpha)))
            for alpha in panels(read()).values()
        ]
        settled = [one for one in orbits if one.success]
        kept, missing = certificates((*found, *settled), watch)
        return kept, missing + [one.message for one in orbits if not one.success]
    return [], [TIME_OVER]


def record(section: Section) -> dict[str, Any]:
    """Section as plain data: bifurcation values are decimals correct to their last digit."""
    with precision(THRESHOLD_BITS):
        thresholds = [_told(event) for event in section.events]
    return {
        "gamma": section.gamma,
        "thresholds": thresholds,
        "intervals": [
            {
                "itinerary": list(one.itinerary.names),
                "from": float(one.low),
                "to": float(one.high),
                "boxes": one.boxes,
            }
            for one in section.intervals
        ],
        "unproved": section.unproved,
        "failed": section.failed,
    }


def _told(event: Proved) -> dict[str, Any]:
    return {
        "type": event.type,
        "line": event.line,
        "order": event.order,
        "alpha": decimal(event.values["alpha"]),
        "radius": float(event.values["alpha"].rad()),
        "coefficient": None if event.coefficient is None else decimal(event.coefficient),
        "multipliers": [
            {"trace": float(one.trace), "minors": float(one.minors)} for one in event.multipliers
        ],
    }
