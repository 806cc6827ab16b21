"""The command `claims`: every printed statement compared with its derivation."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import count
from time import perf_counter
from typing import Annotated, Any

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option
from capsule_sym._files import write_whole
from capsule_sym._texts import bars


@command()
def claims(
    *,
    only: Annotated[str | None, option(metavar="NAME")] = None,
    out: Annotated[options.Path | None, options.written("FILE.md")] = None,
    freeze: bool = False,
    as_json: options.Json = False,
) -> Sequence[Any]:
    """Compare every printed statement of the paper with its derivation, and prove what is derived.

    One line for each statement: proved, refuted (a statement of the paper that fails, with its
    witness in --json and --out) or conditional. Exits with 1 if a statement is not settled, or if
    a verdict differs from the expected one.

    Parameters
    ----------
    only
        Check this section, statement, or statements that begin so; --json lists names as id.
    out
        Write the report with formulas here.
    freeze
        Save the verdicts as the expected ones.
    """
    options.check_beside("only", never=("out", "freeze"))
    start = perf_counter()
    with bars.reporting("Checking") as progress:
        progress("importing SymPy")
        from capsule_sym._symbolic import theory
        from paper.claims import everything, frozen
        from paper.claims.report import markdown

        progress("deriving")
        chosen = everything.sections() if only is None else everything.named(only)
        total, done = sum(map(len, chosen.values())), count(1)
        report = theory.run(chosen, lambda result: progress(next(done), total))
    results = [result for section in report.values() for result in section]
    if as_json:
        click.echo(json.dumps({"items": [theory.record(result) for result in results]}))
    else:
        for result in results:
            click.echo(theory.line(result))
    if out is not None:
        write_whole(out, markdown(report), "--out")
        click.echo(f"wrote {out}", err=True)
    unsettled = [result.statement.name for result in results if not result.settled]
    took = f"{perf_counter() - start:.0f} s"
    click.echo(f"{len(results)} statements, {len(unsettled)} not settled, {took}", err=True)
    if unsettled:
        present.fail(f"not settled: {', '.join(unsettled)}", 1)
    if freeze:
        frozen.freeze(results)
        click.echo(f"wrote {frozen.PATH}", err=True)
    changed = list(frozen.differences(results, frozen.expected(), whole=only is None))
    for difference in changed:
        click.echo(f"not as expected: {difference}", err=True)
    if changed:
        raise click.exceptions.Exit(1)
    return results
