"""The rows of the table of hard cases, and what certification costs over the case study."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from benchmarks.hardcases import baselines
from benchmarks.hardcases.cases import Case
from benchmarks.hardcases.reference import ReferenceCheck, Start, check
from capsule_sym import Parameters, simulate
from capsule_sym.results import Outcome, Trajectory
from paper.processes import end, spawning, undisturbed
from paper.study import casestudy

_COST_PERIODS = 6  # each motion of the case study passes some thirty segments in them
_PROCESSES = 2


@dataclass(frozen=True)
class Row:
    """A hard case checked: events of the map and of 50 digits, error, outcome, and baselines.

    `error_ulp` is the largest error of a switching time in units of u (t* + M/|g'(t*)|), allowed
    up to 8; `error_ulp_at_phase` is the same with the smaller of the two readings of M (`Error`).
    `baselines` has the result of each of these methods: "all", or the failure.
    """

    name: str
    hard: str
    events_found: int
    events_true: int
    error_ulp: float
    error_ulp_at_phase: float
    outcome: str
    escalations: int
    verdict: str
    baselines: dict[str, str]

    @property
    def passed(self) -> bool:
        """True if all events are true ones, none is missing, and all times are accurate."""
        return self.verdict == "ok"


def rows(cases: list[Case]) -> Iterator[Row]:
    """The rows of the cases, in order, computed by two processes."""
    with undisturbed():
        pool = spawning(_PROCESSES)
    try:
        with undisturbed():
            found = [pool.submit(row, case) for case in cases]
        for one in found:
            yield one.result()
    finally:
        end(pool)


def row(case: Case) -> Row:
    """One case checked, with the baseline methods beside it."""
    start = case.build()
    checked = check(start)
    return Row(
        case.name,
        case.hard,
        len(checked.found),
        len(checked.true),
        *checked.error,
        _outcome(checked.run),
        checked.run.statistics.escalations,
        _verdict(checked),
        {
            "sampling": _compared(baselines.sampling, start, checked.true),
            "solve_ivp": _compared(baselines.solve_ivp, start, checked.true),
        },
    )


def cost() -> tuple[float, int]:
    """Evaluations of the closed form per segment over the case study: median and maximum."""
    evaluations = [
        segment.evaluations
        for gamma in casestudy.GAMMAS
        for alpha in casestudy.PANELS.values()
        for segment in simulate(
            Parameters(alpha=alpha, gamma=gamma), periods=_COST_PERIODS, backend="numpy"
        ).segments
        if segment.target
    ]
    return statistics.median(evaluations), max(evaluations)


def _outcome(run: Trajectory) -> str:
    """The outcome that is rarest: of a tangency, of a segment that is not regular, or regular."""
    seen = [outcome for s in run.segments for outcome, _ in s.tangencies]
    seen += [s.outcome for s in run.segments if s.outcome not in (Outcome.REGULAR, Outcome.END)]
    seen += [s.outcome for s in run.segments]
    return str(seen[0]) if seen else str(Outcome.UNDECIDED)


def _verdict(checked: ReferenceCheck) -> str:
    if checked.wrong:
        return f"wrong switch in {checked.wrong}"
    if checked.found != checked.true:
        return _difference(checked.found, checked.true)
    return "ok" if checked.passed else "outside the accuracy contract"


def _difference(found: tuple[int, ...], true: tuple[int, ...]) -> str:
    if found == true:
        return "all"
    if len(found) < len(true):
        return f"missed {len(true) - len(found)}"
    if len(found) > len(true):
        return f"invented {len(found) - len(true)}"
    return f"other: {_itinerary(found)}, not {_itinerary(true)}"


def _itinerary(fields: tuple[int, ...]) -> str:
    return " ".join(f"F{field}" for field in fields)


def _compared(way: Callable[[Start], tuple[int, ...]], start: Start, true: tuple[int, ...]) -> str:
    try:
        return _difference(way(start), true)
    except baselines.GaveUp as reason:
        return f"gave up: {reason}"
    except (ArithmeticError, ValueError) as failure:
        return f"failed: {failure}"
