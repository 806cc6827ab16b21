"""The commands `hardcases` and `adversarial`: named hard cases, and random ones in numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.signature import between, command, option
from capsule_sym._texts import bars, tables

if TYPE_CHECKING:
    from benchmarks.hardcases.adversarial import Tally
    from benchmarks.hardcases.table import Row

_WIDTH = 200  # columns of a table that is piped
_FAR = 1e-13  # from here on, double precision is expected to decide


@command()
def hardcases(
    *,
    as_json: options.Json = False,
    only: Annotated[str, option(metavar="TEXT")] = "",
    every: Annotated[int, between(1)] = 1,
) -> None:
    """Run every hard case and compare the switches found with 50 digits.

    The error is that of the worst switching time t*, in units of u (t* + M/|g'(t*)|) with M the
    largest term of the guard g; 8 are allowed. Beside it stands what two baseline methods find:
    200 samples per period with Brent's method, and SciPy's solve_ivp with events at 1e-10.
    Exits with 1 if a switch is missed, invented or off by more than is allowed.

    Parameters
    ----------
    only
        Only the cases with this in their name.
    every
        Only the first of each N cases, in their order.
    """
    from benchmarks.hardcases.cases import cases
    from benchmarks.hardcases.table import cost, rows
    from capsule_sym._records import dumps

    chosen = [case for case in cases() if only in case.name][::every]
    if not chosen:
        raise click.BadParameter(f"no case has {only!r} in its name", param_hint="--only")
    table = list(bars.track(rows(chosen), "Checking the hard cases", len(chosen)))
    median, most = cost()
    if as_json:
        evaluations = {"median": median, "maximum": most}
        records = [asdict(row) for row in table]
        click.echo(dumps({"cases": records, "evaluations_per_segment": evaluations}))
    else:
        _print(table, median, most)
    if not all(row.passed for row in table):
        raise click.exceptions.Exit(1)


def _print(rows: list[Row], median: float, most: int) -> None:
    from rich.text import Text

    numbers, words = ("error", "events", "true"), ("outcome", "verdict", "sampling", "solve_ivp")
    cells = (
        (
            row.name,
            row.hard,
            f"{row.error_ulp:.1f}",
            str(row.events_found),
            str(row.events_true),
            row.outcome,
            Text("ok", "green") if row.passed else Text(row.verdict, "red"),
            row.baselines["sampling"],
            row.baselines["solve_ivp"],
        )
        for row in rows
    )
    console = tables.make_console(width=_WIDTH)
    names = ("case", "what is hard", *numbers, *words)
    tables.table(names, cells, right=numbers, console=console)
    console.print(
        f"\n{sum(row.passed for row in rows)} of {len(rows)} as 50 digits have them; "
        f"sampling finds all switches in {_all(rows, 'sampling')}, "
        f"solve_ivp in {_all(rows, 'solve_ivp')}; "
        f"{sum(row.escalations for row in rows)} decisions made by 50 digits.\n"
        f"Evaluations per segment over the case study: median {median:g}, maximum {most}."
    )


def _all(rows: list[Row], way: str) -> int:
    return sum(row.baselines[way] == "all" for row in rows)


@command()
def adversarial(
    *,
    count: Annotated[int, between(1)] = 2000,
    seed: int = 1,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Compare the first switch of random starts near tangencies and corners with 50 digits.

    The log in --out grows by a line for every 200 starts; an interrupted run resumes where
    it stopped, unless the code has changed. Exits with 1 if at a single start another field
    follows, another guard fires, or the time is not as accurate as promised.

    Parameters
    ----------
    seed
        Decides all starts.
    out
        Folder of the log, seed-SEED.jsonl, from which runs resume.
    """
    from benchmarks.hardcases.adversarial import CHUNK, Tally, run
    from capsule_sym._records import dumps

    total, log = Tally(), out / f"seed-{seed}.jsonl" if out else None
    try:
        for tally in bars.track(
            run(count, seed, log), "Comparing with 50 digits", -(-count // CHUNK)
        ):
            total.add(tally)
    except KeyboardInterrupt:
        raise present.interrupted(log) from None
    if as_json:
        click.echo(dumps(asdict(total)))
    else:
        _print_tally(total)
    if total.disagreements or total.inaccurate:
        raise click.exceptions.Exit(1)


def _print_tally(total: Tally) -> None:
    console = tables.make_console(width=_WIDTH)
    for problem in total.disagreements + total.inaccurate:
        console.print(problem["problem"], style="red", end="  ")
        console.print(problem)
    columns = ("distance from", "starts", "decided by 50 digits", "open to 50 digits")
    decades = sorted(total.distances, key=_size)
    rows = ((decade, *map(str, total.distances[decade])) for decade in decades)
    tables.table(columns, rows, right=columns, console=console)
    far = [n for decade, n in total.distances.items() if _size(decade) >= _FAR]
    outcomes = ", ".join(f"{name} {count}" for name, count in sorted(total.outcomes.items()))
    backends = ", ".join(
        f"{name} {count}" + (f" (of {total.alone[name]} alone)" if total.alone.get(name) else "")
        for name, count in sorted(total.backends.items())
    )
    console.print(
        f"\n{total.starts} starts, {len(total.disagreements)} disagreements, "
        f"{len(total.inaccurate)} times outside the accuracy contract. Checked: {backends}.\n"
        f"Outcomes: {outcomes}.\n"
        f"Decided by 50 digits because double precision could not: {total.escalated}, of which "
        f"{sum(n[1] for n in far)} among the {sum(n[0] for n in far)} starts from {_FAR:g} on; "
        f"open to 50 digits as well: {total.undecided}.\n"
        f"Largest error of a switching time: {total.worst:.2f} of 8 allowed.\n"
        f"{total.starts / total.seconds:.1f} starts per second and process."
    )


def _size(decade: str) -> float:
    return float("inf") if decade == "anywhere" else float(decade)


@command()
def events(*, check: bool = False) -> None:
    """Write the suite of hard events, benchmarks/events/events.json.

    Exits with 1 if the file that is there differs.

    Parameters
    ----------
    check
        Compare with the file that is there, and write nothing.
    """
    from pathlib import Path

    from benchmarks.hardcases.suite import text

    path = Path(__file__).parents[1] / "events" / "events.json"
    made = text()
    if not check:
        path.write_text(made, encoding="utf-8")
    elif path.read_text(encoding="utf-8") != made:
        click.echo(f"{path} differs: python -m benchmarks events", err=True)
        raise click.exceptions.Exit(1)
