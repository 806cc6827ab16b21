"""`bench`, `first-calls` and `bench-design`: figures beside what they ought to be."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.bench import (
    filled,
    only_option,
    quick_option,
    repeats_option,
    run_study,
    show_study,
)

if TYPE_CHECKING:
    from rich.table import Table

    from benchmarks.speed.goals import Goal
    from benchmarks.speed.roots import Root
    from benchmarks.speed.scaling import Growth


@click.command("bench")
@repeats_option
@only_option
@quick_option
@options.out_option("Write the record to this directory, part by part.")
@options.json_option
def bench(repeats: int, only: str, quick: bool, out: Path | None, as_json: bool) -> None:
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
    console = present.make_console(width=200)
    console.print("\nGrowth of ours:")
    console.print(_growth(study.growth))
    console.print("\nBrackets with one switch, solved in Python over the closed form:")
    console.print(_roots(study.roots))
    console.print("\nWhat has to be reached:")
    console.print(_goals(study.goals))


@click.command("first-calls")
@repeats_option
@quick_option
@options.out_option("Write first-calls.json to this directory.")
@options.json_option
def first_calls(repeats: int, quick: bool, out: Path | None, as_json: bool) -> None:
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
    if as_json:
        return
    console = present.make_console(width=200)
    console.print(f"Times {how(repeats)}:")
    rows = (
        (
            figure.what,
            figure.tool,
            f"{figure.value:.3g}",
            figure.unit,
            "" if figure.goal is None else f"{figure.goal:g}",
            "" if figure.error is None else f"{figure.error:.0e}",
        )
        for figure in found
    )
    console.print(filled("what|tool||unit|at most|difference", rows))


@click.command("bench-design")
@repeats_option
@quick_option
@options.out_option("Write design.json to this directory.")
@options.json_option
def bench_design(repeats: int, quick: bool, out: Path | None, as_json: bool) -> None:
    """Measure what an optimiser of drives is built on, by processor time, the best of the repeats.

    Cells with all metrics and multipliers, a run's derivatives, optima, and fits.
    """
    options.require("peers", "scipy")
    from benchmarks.speed.design import goals

    found = list(goals(quick, repeats))
    _keep("design", [goal._asdict() | {"met": goal.met} for goal in found], out, as_json)
    if not as_json:
        present.make_console(width=200).print(_goals(found))


def _keep(
    name: str, rows: list[dict[str, Any]], out: Path | None, as_json: bool, **said: str
) -> None:
    """Write a record to a directory, if there is one, and print it, if that is asked for."""
    from capsule_sym._bench.machine import machine, versions
    from capsule_sym._records import dumps, write

    text = dumps({"machine": machine(), "versions": versions(), **said, name: rows})
    if out is not None:
        (file,) = write({f"{name}.json": text + "\n"}, out)
        click.echo(f"wrote {file}", err=True)
    if as_json:
        click.echo(text)


def _growth(growth: Iterable[Growth]) -> Table:
    return filled(
        "against||runs|periods|threads|us/period|switches/period",
        (
            (
                g.against,
                f"{g.value:g}",
                *map(str, (g.runs, g.periods, g.threads)),
                f"{g.us_per_period:.3g}",
                "" if g.switches_per_period is None else f"{g.switches_per_period:g}",
            )
            for g in growth
        ),
    )


def _roots(roots: Iterable[Root]) -> Table:
    return filled(
        "method|tolerance|us/root|evaluations|max error",
        (
            (
                r.method,
                f"{r.tolerance:g}",
                f"{r.us_per_root:.3g}",
                f"{r.evaluations:.3g}",
                f"{r.max_error:.1e}",
            )
            for r in roots
        ),
    )


def _goals(goals: Iterable[Goal]) -> Table:
    rows = (
        (g.what, g.unit, f"{g.value:.3g}", f"{g.relation} {g.goal:g}", "yes" if g.met else "no")
        for g in goals
    )
    return filled("what||reached|goal|met", rows)
