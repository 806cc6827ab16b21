"""The study with integrators in C, growth, widths, roots and goals beside what `bench` measures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks.bench import reference
from benchmarks.bench.parts import QUICK, Study
from benchmarks.bench.ratios import Ratio, of_named
from benchmarks.bench.tools import OURS, Tool
from benchmarks.speed import compiled
from benchmarks.speed.goals import Goal, Width, goals, widths
from benchmarks.speed.roots import Root, roots
from benchmarks.speed.scaling import Growth, growth, plan
from benchmarks.speed.tools import NAMES, compiled_tools
from capsule_sym._native import core

_MOST = {False: 10**6, True: 100}  # periods and runs of the growth, by `quick`
_NAMED = ("trajectory", "DOP853 in C", "1e-13, inside steps", 10.0)
_TWO_THREADS = 1.8


class FullStudy(Study):
    """All parts, of which `record` has the goals too."""

    def __init__(self, repeats: int, only: str, quick: bool) -> None:
        """Chooses the peers with `only` in their name; raises InvalidInput if there are none."""
        super().__init__(repeats, only, quick)
        self.growth: list[Growth] = []
        self.widths: list[Width] = []
        self.roots: list[Root] = []

    def tools(self) -> tuple[list[Tool], list[Tool]]:
        """Tools for one trajectory, and for many."""
        single, many = super().tools()
        return single + compiled_tools((100, 1000, 10000)), many + compiled_tools((100, 1000))

    @property
    def skipped(self) -> list[str]:
        """A line for every tool that cannot run here, with the reason."""
        why = compiled.problem()
        return super().skipped + [f"{NAMES} is skipped: {why}"] * bool(why)

    @property
    def goals(self) -> list[Goal]:
        """Goals, as far as the parts so far decide them."""
        single, near, many = self.rows.values()
        return goals(single, near, many, self.widths)

    @property
    def ratios(self) -> list[Ratio]:
        """Ratios of the times so far."""
        us = {g.value: g.us_per_period for g in self.growth if g.against == "threads"}
        found = of_named((_NAMED,), self.rows)
        if us:
            found.append(Ratio("threads", OURS, "2 threads", None, us[1] / us[2], _TWO_THREADS))
        return found + super().ratios

    @property
    def record(self) -> dict[str, Any]:
        """Provenance and all rows, ready for JSON."""
        return super().record | {
            "versions": super().record["versions"] | {"cc": compiled.version()},
            "goals": [goal._asdict() | {"met": goal.met} for goal in self.goals],
            "growth": [row._asdict() for row in self.growth],
            "widths": [row._asdict() for row in self.widths],
            "roots": [row._asdict() for row in self.roots],
        }

    def turns(self) -> dict[str, int]:
        """The parts in order, each with how often `run` calls `advance` in it."""
        growing = len(list(plan(_MOST[self.quick]))) if core else 0
        return super().turns() | {"growth": growing, "switches": 2}

    def run(self, part: str, advance: Callable[[], None]) -> None:
        """Runs a part."""
        if part == "switches":
            cases = [*reference.cases("case study"), *reference.cases("tangencies")]
            self.widths = widths(cases[:: QUICK if self.quick else 1]) if core else []
            advance()
            starts = [case.start._replace(periods=1) for case in reference.cases("case study")]
            self.roots = roots(starts[:: QUICK if self.quick else 1])
            advance()
        elif part != "growth":
            super().run(part, advance)
        elif core:
            self.growth = growth(self.repeats, _MOST[self.quick], advance)
