"""The whole study, part by part, and its record."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import capsule_sym
from capsule_sym._bench import machine, reference
from capsule_sym._bench.goals import Goal, Width, goals, widths
from capsule_sym._bench.peers import own
from capsule_sym._bench.ratios import Ratio, ratios
from capsule_sym._bench.reference import Case
from capsule_sym._bench.roots import Root, roots
from capsule_sym._bench.scaling import Growth, growth, plan
from capsule_sym._bench.study import LONG, Row, compare, strided
from capsule_sym._bench.tools import MPMATH, ONE_ROW, OURS, Tool, for_sweeps, one_at_a_time, skipped
from capsule_sym._errors import InvalidInput
from capsule_sym._files import write_whole
from capsule_sym._native import core
from capsule_sym._records import dumps

_QUICK = 4  # the quick study makes every fourth run, and one of a slow tool
_QUICK_LONG = 0.1  # seconds; a pass that takes longer is made once in the quick study
_MOST = {False: 10**6, True: 100}  # periods and runs of the growth, by `quick`


class Study:
    """The parts that were run so far, and `record`, all of them ready for JSON."""

    def __init__(self, repeats: int, only: str, quick: bool) -> None:
        """Chooses the peers with `only` in their name; raises InvalidInput if there are none."""
        self.repeats, self.quick = repeats, quick
        self.single, self.many = (
            [tool for tool in tools if tool.name in (OURS, ONE_ROW) or only in tool.name]
            for tools in (one_at_a_time(), for_sweeps())
        )
        if not any(only in tool.name for tool in (*self.single, *self.many)):
            names = sorted({tool.name for tool in one_at_a_time() + for_sweeps()})
            raise InvalidInput("only", only, f"part of one of {', '.join(names)}")
        self.trajectory: list[Row] = []
        self.tangencies: list[Row] = []
        self.sweep: list[Row] = []
        self.growth: list[Growth] = []
        self.widths: list[Width] = []
        self.roots: list[Root] = []

    @property
    def goals(self) -> list[Goal]:
        """What has to be reached, as far as the parts so far tell."""
        return goals(self.trajectory, self.tangencies, self.sweep, self.widths)

    @property
    def ratios(self) -> list[Ratio]:
        """Ratios of the times so far."""
        return ratios(self.trajectory, self.sweep, self.growth)

    @property
    def record(self) -> dict[str, Any]:
        """Provenance and all rows, ready for JSON."""
        return {
            "version": capsule_sym.__version__,
            "machine": machine.machine(),
            "versions": machine.versions(),
            "repeats": self.repeats,
            "quick": self.quick,
            "skipped": skipped(),
            "goals": [goal._asdict() | {"met": goal.met} for goal in self.goals],
            "trajectory": [row._asdict() for row in self.trajectory],
            "tangencies": [row._asdict() for row in self.tangencies],
            "sweep": [row._asdict() for row in self.sweep],
            "ratios": [ratio._asdict() for ratio in self.ratios],
            "growth": [row._asdict() for row in self.growth],
            "widths": [row._asdict() for row in self.widths],
            "roots": [row._asdict() for row in self.roots],
        }

    def turns(self) -> dict[str, int]:
        """The parts in order, each with how often `run` calls `advance` in it."""
        rounds = self.repeats + 1
        return {
            "trajectory": len(self.single) * rounds,
            "tangencies": len(self._near()) * 2,
            "sweep": len(self.many) * rounds,
            "growth": len(list(plan(_MOST[self.quick]))) if core else 0,
            "switches": 2,
        }

    def run(self, part: str, advance: Callable[[], None]) -> None:
        """Runs a part."""
        long = _QUICK_LONG if self.quick else LONG
        if part == "trajectory":
            cases = reference.cases("case study")
            chosen = _few(cases) if self.quick else lambda _: cases
            self.trajectory = compare(self.single, chosen, self.repeats, advance, long)
        elif part == "tangencies":
            near = reference.cases("tangencies")
            chosen = _few(near) if self.quick else strided(near)
            self.tangencies = compare(self._near(), chosen, 1, advance, long)
        elif part == "sweep":
            self.sweep = compare(self.many, self._sweep_cases(), self.repeats, advance, long)
        elif part == "switches":
            cases = [*reference.cases("case study"), *reference.cases("tangencies")]
            cases = cases[::_QUICK] if self.quick else cases
            self.widths = widths(cases) if core else []
            advance()
            starts = [case.start._replace(periods=1) for case in reference.cases("case study")]
            self.roots = roots(starts[::_QUICK] if self.quick else starts)
            advance()
        elif core:
            self.growth = growth(self.repeats, _MOST[self.quick], advance)

    def write(self, path: Path) -> None:
        """Writes the record."""
        write_whole(path, dumps(self.record) + "\n")

    def _near(self) -> list[Tool]:
        """Tools for the tangencies: the 50-digit map is itself their truth."""
        return [tool for tool in self.single if tool.name != MPMATH]

    def _sweep_cases(self) -> Callable[[Tool], Sequence[Case]]:
        sample = reference.cases("sweep")
        if self.quick:
            return _few(sample)
        if core is None:
            return lambda _: sample
        every = reference.sweep()
        unknown = [case.start for case in every if not case.truth]
        ours = iter(own.simulated("c")(unknown))
        judged = [case if case.truth else Case(case.start, next(ours)) for case in every]
        # What our own itineraries are compared with is known of the sample alone.
        return lambda tool: sample if tool.slow else every if tool.name == OURS else judged


def _few(cases: Sequence[Case]) -> Callable[[Tool], Sequence[Case]]:
    """One of the cases for a slow tool, every fourth for a fast one."""
    return lambda tool: cases[:1] if tool.slow else cases[::_QUICK]
