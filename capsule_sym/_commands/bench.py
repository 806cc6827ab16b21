"""`capsule-sym bench`: the study as tables, and its record."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from capsule_sym._commands.options import (
    check_beside,
    json_option,
    make_console,
    make_progress,
    make_table,
    out_option,
    require,
)

if TYPE_CHECKING:
    from rich.table import Table

    from capsule_sym._bench.full_study import Study
    from capsule_sym._bench.goals import Goal
    from capsule_sym._bench.ratios import Ratio
    from capsule_sym._bench.roots import Root
    from capsule_sym._bench.scaling import Growth
    from capsule_sym._bench.study import Row


@click.command("bench")
@click.option(
    "--repeats",
    type=click.IntRange(min=1),
    default=3,
    show_default=True,
    help="Repeats of which the median counts, or the best.",
)
@click.option("--only", default="", metavar="TEXT", help="Only the peers with this in their name.")
@click.option("--quick", is_flag=True, help="A few runs of each set: about 20 seconds.")
@click.option("--face", is_flag=True, help="What a person calls first, instead: under a minute.")
@click.option("--design", is_flag=True, help="What the design of a device asks for, instead.")
@out_option("Write the record to this directory, part by part.")
@json_option
def bench(
    repeats: int,
    only: str,
    quick: bool,
    face: bool,
    design: bool,
    out: Path | None,
    as_json: bool,
) -> None:
    """Measure speed against error, beside other tools.

    Times are processor time of calls from Python, by excitation period. Errors are those of the
    final state against 50 digits, after 20 periods, or 100 in the sweep. Switches missed and
    invented are the fewest that explain a run's itinerary of fields beside the true one; in the
    sweep the true itineraries are those of this map, and 50 digits confirm them in 11 of the 1,000.

    --out writes bench.json (part.json if --only or --quick is given), what --json prints,
    after each part, so that an interrupted study leaves the parts that were done. `figure
    work-precision` draws results/bench/bench.json, or part.json where there is no other.
    "trajectory" (the case study), "tangencies" (its motions within 1e-2 to 1e-12 of a tangency)
    and "sweep" are rows of tool and setting; "ratios" are of their times by ours; "growth" is ours
    alone; "widths" counts what is wrong in lanes and in 106 bits; "roots" sets Newton's method
    beside Brent's; and "goals" is what has to be reached.

    --face measures by the clock a run with its segments, states at a million times, a fit's inner
    loop, and whole processes; beside SciPy's dense output and heyoka.py's over the same segments.
    Each is the least of the repeats, which go in rounds through all. --out writes face.json.

    --design measures, by processor time and the best of its repeats, what an optimiser of drives is
    built on: cells with all metrics and multipliers, and a run's derivatives. --out writes
    design.json.
    """
    check_beside("face", never=("design", "only"))
    check_beside("design", never=("only",))
    require("peers", "scipy")  # without which there is nothing to compare with
    if face:
        return _face(quick, repeats, out, as_json)
    if design:
        return _design(quick, repeats, out, as_json)
    from capsule_sym._bench.full_study import Study
    from capsule_sym._records import dumps

    study = Study(repeats, only, quick)
    for line in study.record["skipped"]:
        click.echo(line, err=True)
    file = None if out is None else out / ("part.json" if only or quick else "bench.json")
    with make_progress() as progress:
        for part, turns in study.turns().items():
            task = progress.add_task(part, total=turns)
            study.run(part, lambda task=task: progress.advance(task))  # type: ignore[misc]
            if file is not None:
                study.write(file)
    if as_json:
        click.echo(dumps(study.record))
    else:
        _print(study)
    if file is not None:
        click.echo(f"wrote {file}", err=True)


def _keep(
    name: str, rows: list[dict[str, Any]], out: Path | None, as_json: bool, **said: str
) -> None:
    """Writes a record to a directory, if there is one, and prints it, if that is asked for."""
    from capsule_sym._bench.machine import machine, versions
    from capsule_sym._records import dumps, write

    text = dumps({"machine": machine(), "versions": versions(), **said, name: rows})
    if out is not None:
        (file,) = write({f"{name}.json": text + "\n"}, out)
        click.echo(f"wrote {file}", err=True)
    if as_json:
        click.echo(text)


def _face(quick: bool, repeats: int, out: Path | None, as_json: bool) -> None:
    from capsule_sym._bench.first_calls import figures, how, lacking

    for line in lacking():
        click.echo(line, err=True)
    found = list(figures(quick, repeats))
    _keep("face", [figure._asdict() for figure in found], out, as_json, measured=how(repeats))
    if as_json:
        return
    console = make_console(width=200)
    console.print(f"Times {how(repeats)}:")
    table = _table("what", "tool", "", "unit", "at most", "difference")
    for figure in found:
        at_most = "" if figure.goal is None else f"{figure.goal:g}"
        off = "" if figure.error is None else f"{figure.error:.0e}"
        table.add_row(figure.what, figure.tool, f"{figure.value:.3g}", figure.unit, at_most, off)
    console.print(table)


def _design(quick: bool, repeats: int, out: Path | None, as_json: bool) -> None:
    from capsule_sym._bench.design import goals

    found = list(goals(quick, repeats))
    _keep("design", [goal._asdict() | {"met": goal.met} for goal in found], out, as_json)
    if not as_json:
        make_console(width=200).print(_goals(found))


def _print(study: Study) -> None:
    console = make_console(width=200)
    for title, rows in (
        ("One trajectory, 20 periods from rest, over the case study", study.trajectory),
        ("One trajectory, 20 periods, beside the tangencies", study.tangencies),
        ("A sweep over alpha, 100 periods from rest", study.sweep),
    ):
        console.print(f"{title}:")
        console.print(_rows(rows))
        console.print()
    console.print("Time of others by ours:")
    console.print(_ratios(study.ratios))
    console.print("\nGrowth of ours:")
    console.print(_growth(study.growth))
    console.print("\nBrackets with one switch, solved in Python over the closed form:")
    console.print(_roots(study.roots))
    console.print("\nWhat has to be reached:")
    console.print(_goals(study.goals))


def _rows(rows: Sequence[Row]) -> Table:
    table = _table(
        "tool",
        "setting",
        "us/period",
        "max error",
        "missed",
        "invented",
        "locked",
        "runs",
        "compared",
        "set up, s",
    )
    for row in rows:
        table.add_row(
            row.tool,
            row.setting,
            f"{row.us_per_period:.3g}",
            "" if row.max_error is None else f"{row.max_error:.1e}",
            *map(str, (row.missed, row.invented, row.locked, row.runs, row.compared)),
            f"{row.setup_s:.2f}",
        )
    return table


def _ratios(ratios: Sequence[Ratio]) -> Table:
    table = _table("tool", "setting", "part", "error up to", "ratio", "wanted")
    for r in ratios:
        limit = "" if r.max_error is None else f"{r.max_error:g}"
        wanted = "" if r.wanted is None else f"{r.wanted:g}"
        table.add_row(r.tool, r.setting, r.part, limit, f"{r.ratio:.4g}", wanted)
    return table


def _growth(growth: Sequence[Growth]) -> Table:
    table = _table("against", "", "runs", "periods", "threads", "us/period", "switches/period")
    for g in growth:
        switches = "" if g.switches_per_period is None else f"{g.switches_per_period:g}"
        table.add_row(
            g.against,
            f"{g.value:g}",
            *map(str, (g.runs, g.periods, g.threads)),
            f"{g.us_per_period:.3g}",
            switches,
        )
    return table


def _roots(roots: Sequence[Root]) -> Table:
    table = _table("method", "tolerance", "us/root", "evaluations", "max error")
    for r in roots:
        table.add_row(
            r.method,
            f"{r.tolerance:g}",
            f"{r.us_per_root:.3g}",
            f"{r.evaluations:.3g}",
            f"{r.max_error:.1e}",
        )
    return table


def _goals(goals: Sequence[Goal]) -> Table:
    table = _table("what", "", "reached", "goal", "met")
    for g in goals:
        goal = f"{g.relation} {g.goal:g}"
        table.add_row(g.what, g.unit, f"{g.value:.3g}", goal, "yes" if g.met else "no")
    return table


def _table(*columns: str) -> Table:
    return make_table(*columns, right=columns[2:])
