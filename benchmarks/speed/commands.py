"""`bench`, `first-calls`, `scenes`, `installation`, `bench-design`: figures beside goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import count
from pathlib import Path
from typing import Annotated, Any

import click

from capsule_sym._commands import options
from capsule_sym._commands.signature import between, command, option
from capsule_sym._texts import bars, tables

Repeats = Annotated[int, between(1, help="Repeats of each timing; the median is reported.")]
Quick = Annotated[bool, option(help="Only a few runs of each set, about 20 s.")]


@command()
def bench(
    *,
    repeats: Repeats = 3,
    only: Annotated[str, option(metavar="TEXT")] = "",
    quick: Quick = False,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Measure speed against error, beside other tools, and the goals.

    Times are processor times of calls from Python, per excitation period. Errors are those of the
    final state against 50 digits, after 20 periods, or 100 in the sweep. Missed and invented
    switches are the fewest that explain a run's itinerary by comparison with the reference. In the
    sweep the references are itineraries of this map; 50 digits confirm 11 of the 1,000.

    --out writes bench.json (part.json with --only or --quick), the same as --json prints, after
    each part, so that an interrupted study keeps the finished parts, and at the end its picture,
    time against error, as bench.svg or part.svg. "trajectory" (the case study), "tangencies" (its
    motions within 1e-2 to 1e-12 of a tangency) and "sweep" are rows of tool and setting, DOP853
    and RK4 in C among them, where cc is; "ratios" are their times over ours. "growth" is ours
    alone; "widths" counts what is wrong in lanes and in 106 bits; "roots" sets Newton's method
    beside Brent's; and "goals" is what has to be reached.

    Parameters
    ----------
    only
        Only tools with TEXT in their name.
    out
        Write the record to this directory, part by part.
    """
    from benchmarks.speed.study import Study
    from capsule_sym._records import dumps

    study = Study(repeats, only, quick)
    for line in study.skipped:
        click.echo(line, err=True)
    file = None if out is None else out / ("part.json" if only or quick else "bench.json")
    for part, turns in study.turns().items():
        with bars.reporting(part) as report:
            done = count(1)
            study.run(part, lambda: report(next(done), turns))  # noqa: B023
            if file is not None:
                study.write(file)
    if file is not None:
        from benchmarks.speed.precision import plot_work_precision
        from capsule_sym.figures import save_figure

        picture = file.with_suffix(".svg")
        save_figure(plot_work_precision(study.record), picture)
        click.echo(f"wrote {file}, {picture}", err=True)
    if as_json:
        click.echo(dumps(study.record))
        return
    for part, title in _TITLES.items():
        show(f"{title}:", _ROWS, study.rows[part])
    show("Time of others by ours:", _RATIOS, study.ratios)
    show("Growth of ours:", _GROWTH, study.growth)
    show("Brackets with one switch, solved in Python over the closed form:", _ROOTS, study.roots)
    show("What has to be reached:", GOALS, study.goals)


@command()
def first_calls(
    *,
    repeats: Repeats = 3,
    quick: Quick = False,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Measure by the clock what a person calls first: under a minute.

    A run with its segments, states at a million times, a fit's inner loop, and whole processes;
    beside SciPy's dense output and heyoka.py's over the same segments. Each is the least of the
    repeats, which go in rounds through all.

    Parameters
    ----------
    out
        Write first-calls.json to this directory.
    """
    from benchmarks.speed.first_calls import figures, how, lacking

    for line in lacking():
        click.echo(line, err=True)
    found = list(figures(quick, repeats))
    _keep("first-calls", [one._asdict() for one in found], out, as_json, measured=how(repeats))
    if not as_json:
        show(f"Times {how(repeats)}:", _FIRST_CALLS, found)


@command()
def scenes(
    *,
    rounds: Annotated[int, between(1)] = 9,
    quick: Quick = False,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Measure microseconds a switch of each scene, and their ratio to the capsule's.

    Of runs from rest over 100 periods: 200 parameter sets about the default ones, and 200 random
    ones, one by one and by one call.

    Parameters
    ----------
    rounds
        Rounds through all scenes.
    out
        Write scenes.json to this directory.
    """
    from benchmarks.speed.scenes import GOAL, how, speeds

    found = list(speeds(quick, rounds))
    rows = [one._asdict() for one in found]
    _keep("scenes", rows, out, as_json, measured=how(rounds), goal=f"{GOAL:g}")
    if not as_json:
        show(f"Microseconds a switch: {how(rounds)}", _SCENES, found)
        click.echo(f"Goal: {GOAL:g} times the capsule's at most, one by one.")


@command()
def installation(
    *, paper: bool = False, out: options.Folder = None, as_json: options.Json = False
) -> None:
    """Measure what a newcomer waits for, by processor time: five minutes.

    The installation from source, the size of the wheel, and a scene of one's own from an installed
    wheel, in an empty folder, by a C compiler alone. Nothing is downloaded.

    Parameters
    ----------
    paper
        Compute all about the paper too, which takes two minutes.
    out
        Write installation.json to this directory.
    """
    from benchmarks.speed.installation import goals

    found = list(bars.track(goals(paper), "Installing", 3 + paper))
    _keep("installation", [goal._asdict() | {"met": goal.met} for goal in found], out, as_json)
    if not as_json:
        show("", GOALS, found)


@command()
def bench_design(
    *,
    repeats: Repeats = 3,
    quick: Quick = False,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Measure what an optimiser of drives is built on, by processor time, the best of the repeats.

    Cells with all metrics and multipliers, a run's derivatives, optima, fits, long itineraries, and
    attractors along a parameter.

    Parameters
    ----------
    out
        Write design.json to this directory.
    """
    from benchmarks.speed.design import goals

    found = list(goals(quick, repeats))
    _keep("design", [goal._asdict() | {"met": goal.met} for goal in found], out, as_json)
    if not as_json:
        show("", GOALS, found)


def _keep(
    name: str, rows: list[dict[str, Any]], out: Path | None, as_json: bool, **said: str
) -> None:
    """Write a record to a directory, if there is one, and print it, on request."""
    from benchmarks.speed.machine import machine, versions
    from capsule_sym._records import dumps, write

    text = dumps({"machine": machine(), "versions": versions(), **said, name: rows})
    if out is not None:
        (file,) = write({f"{name}.json": text + "\n"}, out)
        click.echo(f"wrote {file}", err=True)
    if as_json:
        click.echo(text)


def show(title: str, columns: Mapping[str, str], rows: Iterable[object]) -> None:
    """Print a wide table, below its title if any; the first two columns are text."""
    console = tables.make_console(width=200)
    if title:
        console.print(title)
    cells = ([_text(one, row) for one in columns.values()] for row in rows)
    tables.table(columns, cells, right=[*columns][2:], console=console)
    click.echo()


def _text(template: str, row: object) -> str:
    """Text of a cell; empty for None, which takes no format of numbers."""
    try:
        text = template.format(row)
        return {"None": "", "True": "yes", "False": "no"}.get(text, text)
    except TypeError:
        return ""


_TITLES = {
    "trajectory": "One trajectory, 20 periods from rest, over the case study",
    "tangencies": "One trajectory, 20 periods, beside the tangencies",
    "sweep": "A sweep over alpha, 100 periods from rest",
}
_ROWS = {
    "tool": "{0.tool}",
    "setting": "{0.setting}",
    "us/period": "{0.us_per_period:.3g}",
    "max error": "{0.max_error:.1e}",
    **{name: f"{{0.{name}}}" for name in ("missed", "invented", "locked", "runs", "compared")},
    "set up, s": "{0.setup_s:.2f}",
}
_RATIOS = {
    "tool": "{0.tool}",
    "setting": "{0.setting}",
    "part": "{0.part}",
    "error up to": "{0.max_error:g}",
    "ratio": "{0.ratio:.4g}",
    "wanted": "{0.wanted:g}",
}
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
GOALS = {
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
