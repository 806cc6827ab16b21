"""The subcommand `capsule-sym verify`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from time import perf_counter

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from capsule_sym.symbolic import frozen
from capsule_sym.symbolic import verify as theory
from capsule_sym.symbolic.items import Result
from capsule_sym.symbolic.report import markdown

_REPORT = Path("results/verify.md")


@click.command()
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout, nothing else.")
@click.option("--write", is_flag=True, help=f"Write the report with formulas to {_REPORT}.")
@click.option("--freeze", is_flag=True, help="Make what is found the expected verdicts.")
def verify(as_json: bool, write: bool, freeze: bool) -> None:
    """Prove the theory: the flow, the switching mechanisms, Tables 1 to 3 and the appendices.

    One line for each statement: proved, refuted (a statement of the paper that fails, with its
    witness in --json and --write) or conditional. Exit status 1 when one is left unproved, or
    when any differs from the expected verdicts.
    """
    start = perf_counter()
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("deriving", total=None)
        chosen = theory.items()
        progress.update(task, description="proving", total=sum(map(len, chosen.values())))

        def advance(result: Result) -> None:
            progress.advance(task)
            if not as_json:
                click.echo(theory.line(result))

        report = theory.run(chosen, advance)
    results = [result for section in report.values() for result in section]
    if as_json:
        click.echo(json.dumps({"items": [theory.record(result) for result in results]}))
    if write:
        _REPORT.parent.mkdir(parents=True, exist_ok=True)
        _REPORT.write_text(markdown(report), encoding="utf-8")
        click.echo(f"wrote {_REPORT}", err=True)
    unproved = [result.item.id for result in results if not result.settled]
    seconds = perf_counter() - start
    click.echo(f"{len(results)} statements, {len(unproved)} unproved, {seconds:.0f} s", err=True)
    if freeze and not unproved:
        try:
            frozen.freeze(results)
        except OSError as problem:
            raise click.ClickException(f"{frozen.PATH}: {problem.strerror}") from None
        click.echo(f"wrote {frozen.PATH}", err=True)
    changed = [] if freeze else list(frozen.differences(results, frozen.expected()))
    for difference in changed:
        click.echo(f"not as expected: {difference}", err=True)
    if unproved:
        click.echo(f"not proved: {', '.join(unproved)}", err=True)
    if unproved or changed:
        sys.exit(1)
