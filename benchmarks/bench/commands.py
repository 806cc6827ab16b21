"""The command `bench`: the study as tables, and its record."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option

if TYPE_CHECKING:
    from benchmarks.bench.parts import Study


REPEATS = options.count("Repeats of each timing; the median is reported.", 3, 1)
ONLY = option("Only tools with TEXT in their name.", default="", metavar="TEXT")
QUICK = option("Only a few runs of each set, about 20 s.")


@command(further=options.paper_alone)
def bench(
    repeats: int = REPEATS,
    only: str = ONLY,
    quick: bool = QUICK,
    out: options.Path | None = options.out("Write the record to this directory, part by part."),
    as_json: bool = options.as_json,
) -> None:
    """Measure speed against error, beside other tools.

    Times are processor times of calls from Python, per excitation period. Errors are those of the
    final state against 50 digits, after 20 periods, or 100 in the sweep. Missed and invented
    switches are the fewest that explain a run's itinerary by comparison with the reference. In the
    sweep the references are itineraries of this map; 50 digits confirm 11 of the 1,000.

    --out writes bench.json (part.json with --only or --quick), the same as --json prints, after
    each part, so that an interrupted study keeps the finished parts. `figure work-precision` draws
    results/bench/bench.json, or part.json if there is no other. "trajectory" (the case study),
    "tangencies" (its motions within 1e-2 to 1e-12 of a tangency) and "sweep" are rows of tool and
    setting; "ratios" are their times over ours.
    """
    options.require("peers", "scipy")  # without it there is nothing to compare with
    from benchmarks.bench.parts import Study

    study = Study(repeats, only, quick)
    run_study(study, only, out, as_json)
    if not as_json:
        show_study(study)


def run_study(study: Study, only: str, out: options.Path | None, as_json: bool) -> None:
    """Run all parts of a study; write its record or print it as JSON."""
    from capsule_sym._records import dumps

    for line in study.skipped:
        click.echo(line, err=True)
    file = None if out is None else out / ("part.json" if only or study.quick else "bench.json")
    with present.make_progress() as progress:
        for part, turns in study.turns().items():
            task = progress.add_task(part, total=turns)
            study.run(part, lambda task=task: progress.advance(task))  # type: ignore[misc]
            if file is not None:
                study.write(file)
    if as_json:
        click.echo(dumps(study.record))
    if file is not None:
        click.echo(f"wrote {file}", err=True)


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


def show_study(study: Study) -> None:
    """Print the tables of a study."""
    for part, title in _TITLES.items():
        show_table(f"{title}:", _ROWS, study.rows[part])
        click.echo()
    show_table("Time of others by ours:", _RATIOS, study.ratios)


def show_table(title: str, columns: Mapping[str, str], rows: Iterable[object]) -> None:
    """Print a wide table, below its title if any; the first two columns are text."""
    console = present.make_console(width=200)
    if title:
        console.print(title)
    present.table(columns, zip(rows), right=[*columns][2:], console=console)
