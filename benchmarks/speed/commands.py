"""`bench`, `first-calls`, `scenes`, `bench-design`: figures beside what they should be."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from benchmarks.bench.commands import ONLY, QUICK, REPEATS, run_study, show_study, show_table
from capsule_sym._commands import options
from capsule_sym._commands.signature import command

if TYPE_CHECKING:
    from pathlib import Path


@command()
def bench(
    repeats: int = REPEATS,
    only: str = ONLY,
    quick: bool = QUICK,
    out: Path | None = options.out("Write the record to this directory, part by part."),
    as_json: bool = options.as_json,
) -> None:
    """Measure what `capsule-sym bench` does, and what only developers ask for.

    The peers have DOP853 and RK4 in C among them, where cc is. "growth" is ours alone; "widths"
    counts what is wrong in lanes and in 106 bits; "roots" sets Newton's method beside Brent's; and
    "goals" is what has to be reached. --out is as that of `capsule-sym bench`.
    """
    options.require("peers", "scipy")  # without which there is nothing to compare with
    from benchmarks.speed.study import FullStudy

    study = FullStudy(repeats, only, quick)
    run_study(study, only, out, as_json)
    if as_json:
        return
    show_study(study)
    show_table("\nGrowth of ours:", _GROWTH, study.growth)
    title = "\nBrackets with one switch, solved in Python over the closed form:"
    show_table(title, _ROOTS, study.roots)
    show_table("\nWhat has to be reached:", _GOALS, study.goals)


@command()
def first_calls(
    repeats: int = REPEATS,
    quick: bool = QUICK,
    out: Path | None = options.out("Write first-calls.json to this directory."),
    as_json: bool = options.as_json,
) -> None:
    """Measure by the clock what a person calls first: under a minute.

    A run with its segments, states at a million times, a fit's inner loop, and whole processes;
    beside SciPy's dense output and heyoka.py's over the same segments. Each is the least of the
    repeats, which go in rounds through all.
    """
    options.require("peers", "scipy")
    from benchmarks.speed.first_calls import figures, how, lacking

    for line in lacking():
        click.echo(line, err=True)
    found = list(figures(quick, repeats))
    _keep("first-calls", [one._asdict() for one in found], out, as_json, measured=how(repeats))
    if not as_json:
        show_table(f"Times {how(repeats)}:", _FIRST_CALLS, found)


@command()
def scenes(
    rounds: int = options.count("Rounds through all scenes.", 9, 1),
    quick: bool = QUICK,
    out: Path | None = options.out("Write scenes.json to this directory."),
    as_json: bool = options.as_json,
) -> None:
    """Measure microseconds a switch of each scene, and their ratio to the capsule's.

    Of runs from rest over 100 periods: 200 parameter sets about the default ones, and 200 random
    ones, one by one and by one call.
    """
    from benchmarks.speed.scenes import GOAL, how, speeds

    found = list(speeds(quick, rounds))
    rows = [one._asdict() for one in found]
    _keep("scenes", rows, out, as_json, measured=how(rounds), goal=f"{GOAL:g}")
    if not as_json:
        show_table(f"Microseconds a switch: {how(rounds)}", _SCENES, found)
        click.echo(f"Goal: {GOAL:g} times the capsule's at most, one by one.")


@command()
def bench_design(
    repeats: int = REPEATS,
    quick: bool = QUICK,
    out: Path | None = options.out("Write design.json to this directory."),
    as_json: bool = options.as_json,
) -> None:
    """Measure what an optimiser of drives is built on, by processor time, the best of the repeats.

    Cells with all metrics and multipliers, a run's derivatives, optima, fits, long itineraries, and
    attractors along a parameter.
    """
    options.require("peers", "scipy")
    from benchmarks.speed.design import goals

    found = list(goals(quick, repeats))
    _keep("design", [goal._asdict() | {"met": goal.met} for goal in found], out, as_json)
    if not as_json:
        show_table("", _GOALS, found)


def _keep(
    name: str, rows: list[dict[str, Any]], out: Path | None, as_json: bool, **said: str
) -> None:
    """Write a record to a directory, if there is one, and print it, on request."""
    from benchmarks.bench.machine import machine, versions
    from capsule_sym._records import dumps, write

    text = dumps({"machine": machine(), "versions": versions(), **said, name: rows})
    if out is not None:
        (file,) = write({f"{name}.json": text + "\n"}, out)
        click.echo(f"wrote {file}", err=True)
    if as_json:
        click.echo(text)


_GROWTH = {
    "against": "{0.against}",
    "": "{0.value:g}",
    **{name: f"{{0.{name}}}" for name in ("runs", "periods", "threads")},
    "us/period": "{0.us_per_period:.3g}",
    "switches/period": "{0.switches_per_period:g}",
}
_ROOTS = {
    "method": "{0.method}",
    "tolerance": "{0.tolerance:g}",
    "us/root": "{0.us_per_root:.3g}",
    "evaluations": "{0.evaluations:.3g}",
    "max error": "{0.max_error:.1e}",
}
_GOALS = {
    "what": "{0.what}",
    "": "{0.unit}",
    "reached": "{0.value:.3g}",
    "goal": "{0.relation} {0.goal:g}",
    "met": "{0.met}",
}
_SCENES = {
    "scene": "{0.scene}",
    "runs": "{0.runs}",
    "switches a period": "{0.switches:.2f}",
    "one by one": "{0.alone:.3f}",
    "ratio": "{0.ratio:.2f}",
    "side by side": "{0.many:.3f}",
    "of that the ratio": "{0.many_ratio:.2f}",
}
_FIRST_CALLS = {
    "what": "{0.what}",
    "tool": "{0.tool}",
    "": "{0.value:.3g}",
    "unit": "{0.unit}",
    "at most": "{0.goal:g}",
    "difference": "{0.error:.0e}",
}
