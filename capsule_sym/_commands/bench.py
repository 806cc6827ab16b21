"""The command `bench`: the study as tables, and its record."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from capsule_sym._commands import options, present

if TYPE_CHECKING:
    from rich.table import Table

    from capsule_sym._bench.parts import Study
    from capsule_sym._bench.ratios import Ratio
    from capsule_sym._bench.study import Row

repeats_option = click.option(
    "--repeats",
    type=click.IntRange(min=1),
    default=3,
    show_default=True,
    help="Repeats of which the median counts, or the best.",
)
only_option = click.option(
    "--only", default="", metavar="TEXT", help="Only the peers with this in their name."
)
quick_option = click.option(
    "--quick", is_flag=True, help="A few runs of each set: about 20 seconds."
)


@click.command("bench")
@repeats_option
@only_option
@quick_option
@options.out_option("Write the record to this directory, part by part.")
@options.json_option
def bench(repeats: int, only: str, quick: bool, out: Path | None, as_json: bool) -> None:
    """Measure speed against error, beside other tools.

    Times are processor time of calls from Python, by excitation period. Errors are those of the
    final state against 50 digits, after 20 periods, or 100 in the sweep. Switches missed and
    invented are the fewest that explain a run's itinerary of fields beside the true one; in the
    sweep the true itineraries are those of this map, and 50 digits confirm them in 11 of the 1,000.

    --out writes bench.json (part.json if --only or --quick is given), what --json prints,
    after each part, so that an interrupted study leaves the parts that were done. `figure
    work-precision` draws results/bench/bench.json, or part.json where there is no other.
    "trajectory" (the case study), "tangencies" (its motions within 1e-2 to 1e-12 of a tangency)
    and "sweep" are rows of tool and setting; "ratios" are of their times by ours.
    """
    options.require("peers", "scipy")  # without which there is nothing to compare with
    from capsule_sym._bench.parts import Study

    study = Study(repeats, only, quick)
    run_study(study, only, out, as_json)
    if not as_json:
        show_study(study)


def run_study(study: Study, only: str, out: Path | None, as_json: bool) -> None:
    """Run all parts of a study, and write its record or print it as JSON."""
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


def show_study(study: Study) -> None:
    """Print the tables of a study."""
    console = present.make_console(width=200)
    for part, title in _TITLES.items():
        console.print(f"{title}:")
        console.print(_rows(study.rows[part]))
        console.print()
    console.print("Time of others by ours:")
    console.print(_ratios(study.ratios))


def filled(columns: str, rows: Iterable[Iterable[str]]) -> Table:
    """A table with its columns, of which the first two are text, separated by |."""
    names = columns.split("|")
    table = present.make_table(*names, right=names[2:])
    for row in rows:
        table.add_row(*row)
    return table


def _rows(rows: Iterable[Row]) -> Table:
    return filled(
        "tool|setting|us/period|max error|missed|invented|locked|runs|compared|set up, s",
        (
            (
                row.tool,
                row.setting,
                f"{row.us_per_period:.3g}",
                "" if row.max_error is None else f"{row.max_error:.1e}",
                *map(str, (row.missed, row.invented, row.locked, row.runs, row.compared)),
                f"{row.setup_s:.2f}",
            )
            for row in rows
        ),
    )


def _ratios(ratios: Iterable[Ratio]) -> Table:
    def limit(value: float | None) -> str:
        return "" if value is None else f"{value:g}"

    return filled(
        "tool|setting|part|error up to|ratio|wanted",
        (
            (r.tool, r.setting, r.part, limit(r.max_error), f"{r.ratio:.4g}", limit(r.wanted))
            for r in ratios
        ),
    )
