"""The study, part by part, and its record."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import capsule_sym
from benchmarks.speed import machine, reference, tools
from benchmarks.speed.compare import LONG, Row, compare, strided
from benchmarks.speed.goals import Goal, Width, goals, widths
from benchmarks.speed.peers import compiled, own
from benchmarks.speed.ratios import Ratio, ratios
from benchmarks.speed.reference import Case
from benchmarks.speed.roots import Root, roots
from benchmarks.speed.scaling import Growth, growth, plan
from benchmarks.speed.tools import MPMATH, OURS, OWN, Tool
from capsule_sym import InvalidInput
from capsule_sym._files import write_whole
from capsule_sym._native import core
from capsule_sym._records import dumps

QUICK = 4  # the quick study makes every fourth run, and one run of a slow tool
_MOST = {False: 10**6, True: 100}  # periods and runs of the growth, by `quick`
_TWO_THREADS = 1.8  # times as fast as one
_QUICK_LONG = 0.1  # seconds; a pass that takes longer is made once in the quick study


class Study:
    """Parts that were run so far; `record` has all of them, ready for JSON."""

    def __init__(self, repeats: int, only: str, quick: bool) -> None:
        """Choose the tools with `only` in their name; raises InvalidInput if there are none."""
        self.repeats, self.quick = repeats, quick
        every = tools.one_at_a_time(), tools.for_sweeps()
        self.single, self.many = (
            [tool for tool in some if tool.name in OWN or only in tool.name] for some in every
        )
        if not any(only in tool.name for tool in (*self.single, *self.many)):
            names = sorted({tool.name for some in every for tool in some})
            raise InvalidInput("only", only, f"part of one of {', '.join(names)}")
        self.rows: dict[str, list[Row]] = {"trajectory": [], "tangencies": [], "sweep": []}
        self.growth: list[Growth] = []
        self.widths: list[Width] = []
        self.roots: list[Root] = []

    @property
    def skipped(self) -> list[str]:
        """One line for each tool that cannot run here, with the reason."""
        return tools.skipped()

    @property
    def ratios(self) -> list[Ratio]:
        """Ratios of the times so far."""
        us = {g.value: g.us_per_period for g in self.growth if g.against == "threads"}
        found = ratios(self.rows["trajectory"], self.rows["sweep"])
        if us:
            found.append(Ratio("threads", OURS, "2 threads", None, us[1] / us[2], _TWO_THREADS))
        return found

    @property
    def goals(self) -> list[Goal]:
        """Goals, as far as the parts so far decide them."""
        single, near, many = self.rows.values()
        return goals(single, near, many, self.widths)

    @property
    def record(self) -> dict[str, Any]:
        """Provenance and all rows, ready for JSON."""
        return {
            "version": capsule_sym.__version__,
            "machine": machine.machine(),
            "versions": machine.versions() | {"cc": compiled.version()},
            "repeats": self.repeats,
            "quick": self.quick,
            "skipped": self.skipped,
            **{part: [row._asdict() for row in rows] for part, rows in self.rows.items()},
            "ratios": [ratio._asdict() for ratio in self.ratios],
            "goals": [goal._asdict() | {"met": goal.met} for goal in self.goals],
            "growth": [row._asdict() for row in self.growth],
            "widths": [row._asdict() for row in self.widths],
            "roots": [row._asdict() for row in self.roots],
        }

    def turns(self) -> dict[str, int]:
        """Parts in order, each with the number of calls of `advance` in it."""
        rounds = self.repeats + 1
        return {
            "trajectory": len(self.single) * rounds,
            "tangencies": len(self._near()) * 2,
            "sweep": len(self.many) * rounds,
            "growth": len(list(plan(_MOST[self.quick]))) if core else 0,
            "switches": 2,
        }

    def run(self, part: str, advance: Callable[[], None]) -> None:
        """Run a part."""
        if part == "growth":
            self.growth = growth(self.repeats, _MOST[self.quick], advance) if core else []
        elif part == "switches":
            self._switches(advance)
        else:
            self._compare(part, advance)

    def _switches(self, advance: Callable[[], None]) -> None:
        """Switches wrong at each width of the core, and roots of single brackets."""
        step = QUICK if self.quick else 1
        case_study = reference.cases("case study")
        cases = [*case_study, *reference.cases("tangencies")]
        self.widths = widths(cases[::step]) if core else []
        advance()
        starts = [case.start._replace(periods=1) for case in case_study]
        self.roots = roots(starts[::step])
        advance()

    def _compare(self, part: str, advance: Callable[[], None]) -> None:
        chosen, repeats = self.single, self.repeats
        if part == "sweep":
            chosen, cases = self.many, self._sweep_cases()
        elif part == "tangencies":
            near = reference.cases("tangencies")
            chosen, repeats = self._near(), 1
            cases = _few(near) if self.quick else strided(near)
        else:
            every = reference.cases("case study")
            cases = _few(every) if self.quick else lambda _: every
        long = _QUICK_LONG if self.quick else LONG
        self.rows[part] = compare(chosen, cases, repeats, advance, long)

    def write(self, path: Path) -> None:
        """Write the record."""
        write_whole(path, dumps(self.record) + "\n")

    def _near(self) -> list[Tool]:
        """Tools for the tangencies, without the 50-digit map, which is their reference."""
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
        # Itineraries of ours have a reference for the sample alone.
        return lambda tool: sample if tool.slow else every if tool.name == OURS else judged


def _few(cases: Sequence[Case]) -> Callable[[Tool], Sequence[Case]]:
    """One of the cases for a slow tool, every fourth for a fast one."""
    return lambda tool: cases[:1] if tool.slow else cases[::QUICK]
