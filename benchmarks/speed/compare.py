"""Time per period, error, and missed and invented switches of every tool on the same runs."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from math import ceil
from statistics import median
from typing import NamedTuple

from benchmarks.speed.model import Result, Run
from benchmarks.speed.reference import Case
from benchmarks.speed.tools import Tool

_ENOUGH = 0.02  # seconds; shorter passes are repeated up to this time
LONG = 2.0  # seconds; a pass that takes longer is made once
_STRIDE = 5  # a slow tool makes every fifth run of the tangencies


class Row(NamedTuple):
    """Results of a tool at one setting over all its runs."""

    tool: str
    setting: str
    us_per_period: float
    """Processor time of the calls from Python, median over the repeats."""
    max_error: float | None
    """Largest error of a component of a final state, over the runs that reached their end."""
    missed: int
    invented: int
    """Switches missing from the itineraries, and additional ones: the fewest that explain them."""
    runs: int
    compared: int
    """Runs compared with the reference."""
    locked: int
    """Runs that locked up in repeated switches; the rest of their itinerary counts as missed."""
    setup_s: float
    """Time to set up or compile what all runs share; not part of `us_per_period`."""


class _Timed:
    """A tool that is set up, with its results and times so far."""

    def __init__(self, tool: Tool, cases: Sequence[Case], long: float) -> None:
        self.tool, self.cases, self.long = tool, cases, long
        self.starts = [case.start for case in cases]
        begin = time.perf_counter()
        self.run: Run = tool.build()
        self.setup = time.perf_counter() - begin
        begin = time.thread_time()
        self.results = self.run(self.starts)
        first = time.thread_time() - begin
        self.spent = [first] if first > long else []
        self.calls = ceil(_ENOUGH / max(first, 1e-6))
        if tool.check:
            finals = zip(tool.check(self.starts), self.results, strict=True)
            self.results = [Result(full.itinerary, final.state) for full, final in finals]

    def repeat(self) -> None:
        """Make all runs once more, unless one pass takes longer than `long`."""
        if self.spent and self.spent[0] > self.long:
            return
        begin = time.thread_time()
        for _ in range(self.calls):
            self.run(self.starts)
        self.spent.append((time.thread_time() - begin) / self.calls)

    def row(self) -> Row:
        """Times, and comparison with the reference."""
        periods = sum(start.periods for start in self.starts)
        pairs = [
            (found, case.truth)
            for found, case in zip(self.results, self.cases, strict=True)
            if case.truth
        ]
        wrong = [wrong_switches(found.itinerary, true.itinerary) for found, true in pairs]
        errors = [error(found.state, true.state) for found, true in pairs if found.state]
        return Row(
            self.tool.name,
            self.tool.setting,
            median(self.spent) / periods * 1e6,
            max(errors, default=None),
            sum(missed for missed, _ in wrong),
            sum(invented for _, invented in wrong),
            len(self.starts),
            len(pairs),
            len(pairs) - len(errors),
            self.setup,
        )


def compare(
    tools: Sequence[Tool],
    cases: Callable[[Tool], Sequence[Case]],
    repeats: int,
    advance: Callable[[], None],
    long: float = LONG,
) -> list[Row]:
    """Rows of tools on their cases. Repeats are interleaved: every tool once, then all again.

    A tool whose pass takes longer than `long` seconds makes it once. `advance` is called after each
    tool's turn, `repeats` + 1 times a tool.
    """
    timed = []
    for tool in tools:
        timed.append(_Timed(tool, cases(tool), long))
        advance()
    for _ in range(repeats):
        for one in timed:
            one.repeat()
            advance()
    return [one.row() for one in timed]


def strided(cases: Sequence[Case]) -> Callable[[Tool], Sequence[Case]]:
    """All of the cases for a fast tool, every fifth for a slow one."""
    return lambda tool: cases[::_STRIDE] if tool.slow else cases


def error(state: Sequence[float], true: Sequence[float] | None) -> float:
    """Largest difference of a component."""
    return max(abs(a - b) for a, b in zip(state, true or (), strict=True))


def wrong_switches(itinerary: bytes, true: bytes) -> tuple[int, int]:
    """Missed and invented switches: the complements of a longest common subsequence."""
    same = _common(itinerary[1:], true[1:])
    return len(true) - 1 - same, len(itinerary) - 1 - same


def _common(one: bytes, other: bytes) -> int:
    """Length of a longest common subsequence, with the rows of its table as bits of an int."""
    places = {letter: 0 for letter in set(other)}
    for i, letter in enumerate(one):
        if letter in places:
            places[letter] |= 1 << i
    full = (1 << len(one)) - 1
    row = full
    for letter in other:
        hits = row & places[letter]
        row = ((row + hits) | (row - hits)) & full
    return len(one) - row.bit_count()
