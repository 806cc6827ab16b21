"""The command `hardcases`: the table of hard cases beside what plain approaches make of them."""

from __future__ import annotations

import sys
from typing import Any

import click


@click.command("hardcases")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout and nothing else.")
@click.option("--only", default="", metavar="TEXT", help="Only the cases with this in their name.")
def hardcases(as_json: bool, only: str) -> None:
    """Run every hard case and judge the switches found by 50 digits.

    The error is that of the worst switching time t*, in units of u (t* + M/|g'(t*)|) with M the
    largest term of the guard g; 8 are allowed. Beside it stands what two plain approaches find:
    200 samples per period with Brent's method, and SciPy's solve_ivp with events at 1e-10.
    Exits with 1 if a switch is missed, invented or off by more than is allowed.
    """
    from rich.progress import track

    from capsule_sym.hardcases.cases import cases
    from capsule_sym.hardcases.table import cost, rows
    from capsule_sym.records import dumps

    chosen = [case for case in cases() if only in case.name]
    if not chosen:
        raise click.BadParameter(f"no case has {only!r} in its name", param_hint="--only")
    progress = _console(stderr=True)
    table = list(
        track(
            rows(chosen),
            "Judging the hard cases",
            len(chosen),
            console=progress,
            disable=not progress.is_terminal,
            transient=True,
        )
    )
    median, most = cost()
    if as_json:
        evaluations = {"median": median, "maximum": most}
        records = [row.record() for row in table]
        click.echo(dumps({"cases": records, "evaluations_per_segment": evaluations}))
    else:
        _print(table, median, most)
    if not all(row.passed for row in table):
        raise click.exceptions.Exit(1)


def _print(rows: list[Any], median: float, most: int) -> None:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, show_edge=False, padding=(0, 1, 0, 0), pad_edge=False)
    for name in ("case", "what is hard"):
        table.add_column(name)
    for name in ("error", "events", "true"):
        table.add_column(name, justify="right")
    for name in ("outcome", "verdict", "sampling", "solve_ivp"):
        table.add_column(name)
    for row in rows:
        table.add_row(
            row.name,
            row.hard,
            f"{row.error_ulp:.1f}",
            str(row.events_found),
            str(row.events_true),
            row.outcome,
            "[green]ok" if row.passed else f"[red]{row.verdict}",
            row.plain["sampling"],
            row.plain["solve_ivp"],
        )
    console = _console()
    console.print(table)
    console.print(
        f"\n{sum(row.passed for row in rows)} of {len(rows)} as 50 digits have them; "
        f"sampling finds all switches in {_all(rows, 'sampling')}, "
        f"solve_ivp in {_all(rows, 'solve_ivp')}; "
        f"{sum(row.settled for row in rows)} decisions settled by 50 digits.\n"
        f"Evaluations per segment over the case study: median {median:g}, maximum {most}."
    )


def _all(rows: list[Any], way: str) -> int:
    return sum(row.plain[way] == "all" for row in rows)


def _console(stderr: bool = False) -> Any:
    from rich.console import Console

    file = sys.stderr if stderr else sys.stdout
    width = None if file.isatty() else 200
    return Console(file=file, width=width, highlight=False)
