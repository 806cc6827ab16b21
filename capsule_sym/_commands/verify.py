"""The subcommand `capsule-sym verify`."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from time import perf_counter
from typing import TYPE_CHECKING

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option
from capsule_sym._files import write_whole

if TYPE_CHECKING:
    from capsule_sym._symbolic.proofs.items import Result


@command()
def verify(
    only: str | None = option(
        "Prove this statement alone; --json gives the names as id.", metavar="NAME"
    ),
    write: options.Path | None = option(
        "Write the report with formulas here.",
        type=options.WritablePath(file=True),
        metavar="FILE.md",
    ),
    freeze: bool = option("Make what is found the expected verdicts."),
    as_json: bool = options.as_json,
) -> Sequence[Result]:
    """Prove the theory: the flow, the switching mechanisms, Tables 1 to 3 and the appendices.

    One line for each statement: proved, refuted (a statement of the paper that fails, with its
    witness in --json and --write) or conditional. Exit status 1 when one is left unproved, or
    when any differs from the expected verdicts.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn

    options.check_beside("only", never=("write", "freeze"))
    options.require("proof", "sympy")
    start = perf_counter()
    text = TextColumn("{task.description}")
    with present.make_progress(
        text, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    ) as progress:
        task = progress.add_task("importing SymPy", total=None)
        from capsule_sym._symbolic import frozen
        from capsule_sym._symbolic import verify as theory
        from capsule_sym._symbolic.report import markdown

        prove_motions()
        progress.update(task, description="deriving")
        chosen = theory.items() if only is None else theory.item(only)
        progress.update(task, description="proving", total=sum(map(len, chosen.values())))

        def advance(result: Result) -> None:
            progress.advance(task)
            if not as_json:
                # Above the bar: what click takes for stdout by itself would go through it.
                click.echo(theory.line(result), file=sys.stdout)

        report = theory.run(chosen, advance)
    results = [result for section in report.values() for result in section]
    if as_json:
        click.echo(json.dumps({"items": [theory.record(result) for result in results]}))
    if write is not None:
        write_whole(write, markdown(report), "--write")
        click.echo(f"wrote {write}", err=True)
    unproved = [result.item.id for result in results if not result.settled]
    took = f"{perf_counter() - start:.0f} s"
    click.echo(f"{len(results)} statements, {len(unproved)} unproved, {took}", err=True)
    if freeze and not unproved:
        frozen.freeze(results)
        click.echo(f"wrote {frozen.PATH}", err=True)
    changed = (
        [] if freeze else list(frozen.differences(results, frozen.expected(), whole=only is None))
    )
    for difference in changed:
        click.echo(f"not as expected: {difference}", err=True)
    if unproved:
        present.fail(f"not proved: {', '.join(unproved)}", 1)
    if changed:
        raise click.exceptions.Exit(1)
    return results


def prove_motions() -> None:
    """Has the motions of Section 4 proved in ball arithmetic."""
    from capsule_sym._enclosures.numbers.balls import Unproved
    from capsule_sym._enclosures.orbits.steady import first_fields, steady_orbit
    from capsule_sym._enclosures.regions.attraction import tendency
    from capsule_sym._symbolic.paper.case_study import Prover, prove_by

    def from_rest(values: Mapping[str, str]) -> tuple[int, ...]:
        return tendency(values).itinerary

    prove_by(Prover(steady_orbit, from_rest, first_fields, Unproved))
