"""Goals of the core: speed compared with a compiled DOP853, accuracy, and switches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from benchmarks.speed.compare import Row, error, wrong_switches
from benchmarks.speed.model import Run
from benchmarks.speed.peers import own
from benchmarks.speed.reference import Case
from benchmarks.speed.tools import ONE_ROW, OURS, WHOLE
from capsule_sym._native import core

_COMPARED = ("DOP853 in C", "1e-13, inside steps")
_SAME = 1e-11  # a final state further off than that is of a run with other switches
_LARGEST_ERROR = 1e-13


class Goal(NamedTuple):
    """A figure and what it has to be: at least or at most `goal`."""

    what: str
    value: float
    unit: str
    """"times as fast" as DOP853 in C at 1e-13 that looks inside its steps, or of `value`."""
    relation: str
    goal: float

    @property
    def met(self) -> bool:
        """True if the goal is reached."""
        return self.value >= self.goal if self.relation == ">=" else self.value <= self.goal


class Width(NamedTuple):
    """Runs at one width or precision of the core that differ from what is true."""

    width: str
    runs: int
    wrong: int
    """Switches missed and invented, of lanes runs whose final state is off by more than 1e-11."""


def goals(
    trajectory: Sequence[Row],
    tangencies: Sequence[Row],
    sweep: Sequence[Row],
    widths: Sequence[Width],
) -> list[Goal]:
    """All that follow from the rows there are."""
    return [
        *_ratio("20 periods from rest, one call a run", trajectory, OURS, 20.0),
        *_ratio("the same, all segments kept", trajectory, WHOLE, 6.0),
        *_ratio("the same by simulate_many, one row a call", trajectory, ONE_ROW, 12.0),
        *_ratio("1,000 amplitudes, 100 periods, one core", sweep, OURS, 80.0),
        *_accuracy(trajectory, tangencies, sweep),
        *(Goal(f"wrong, {w.width}", w.wrong, f"in {w.runs} runs", "<=", 0) for w in widths),
    ]


def _ratio(what: str, rows: Sequence[Row], tool: str, goal: float) -> Iterator[Goal]:
    ours = next((row.us_per_period for row in rows if row.tool == tool), None)
    for row in rows:
        if ours and (row.tool, row.setting) == _COMPARED:
            yield Goal(what, row.us_per_period / ours, "times as fast", ">=", goal)


def _accuracy(*parts: Sequence[Row]) -> Iterator[Goal]:
    ours = [next((row for row in rows if row.tool == OURS), None) for rows in parts]
    if (near := ours[1]) is not None:
        yield Goal("beside tangencies", near.us_per_period, "us a period", "<=", 15.0)
    for name, row in zip(("20 periods", "beside tangencies", "the sweep"), ours, strict=True):
        if row is not None and row.max_error is not None:
            yield Goal(f"largest error, {name}", row.max_error, "", "<=", _LARGEST_ERROR)
    if any(ours):
        wrong = sum(row.missed + row.invented for row in ours if row)
        runs = sum(row.compared for row in ours if row)
        yield Goal("wrong, double", wrong, f"in {runs} runs", "<=", 0)


def widths(cases: Sequence[Case]) -> list[Width]:
    """Switches wrong in 106 bits, by words; and runs wrong side by side, by final states."""
    found = [_by_words("106 bits", own.simulated_wide, cases)]
    for lanes in (4, 8):
        if core is not None and core.lanes() >= lanes:
            states = own.side_by_side([case.start for case in cases], lanes)
            off = [error(s, c.truth.state) for s, c in zip(states, cases, strict=True) if c.truth]
            found.append(Width(f"{lanes} lanes", len(off), sum(not e <= _SAME for e in off)))
    return found


def _by_words(name: str, run: Run, cases: Sequence[Case]) -> Width:
    pairs = zip(run([case.start for case in cases]), cases, strict=True)
    wrong = [sum(wrong_switches(r.itinerary, c.truth.itinerary)) for r, c in pairs if c.truth]
    return Width(name, len(wrong), sum(wrong))
