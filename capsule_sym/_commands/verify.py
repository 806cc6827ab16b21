"""The subcommand `capsule-sym verify`."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from itertools import count
from time import perf_counter
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option
from capsule_sym._errors import InvalidInput, counted
from capsule_sym._files import write_whole
from capsule_sym._texts import bars, tables

if TYPE_CHECKING:
    from capsule_sym._symbolic.proofs.statement import Report


@command()
def verify(
    *,
    scene: Annotated[str | None, option(metavar="NAME|FILE")] = None,
    only: Annotated[str | None, option(metavar="GROUP|NAME")] = None,
    everything: Annotated[bool, option("--all")] = False,
    out: Annotated[options.Path | None, options.written("FILE.md")] = None,
    as_json: options.Json = False,
) -> Sequence[Any]:
    """Prove the theory of a scene: closed forms, switching, Jacobians, the energy balance.

    One row for each group of statements: how many are proved, or failed, and the time. Exits with 1
    if a statement is not proved.

    `python -m paper claims` in a checkout proves the tables and appendices of the paper, and
    compares its printed statements.

    Parameters
    ----------
    scene
        Prove what holds of a scene: a shipped one, or a file that declares one.
    only
        Prove a group alone, or statements whose names begin so.
    everything
        Print each statement.
    out
        Write the report with formulas here.
    """
    options.require("sympy")
    start = perf_counter()
    with bars.reporting("Proving") as progress:
        progress("importing SymPy")
        theory = _theory(scene)
        from capsule_sym._symbolic.proofs.statement import line, record, run

        progress("deriving")
        chosen = theory.statements(only)
        total, done = sum(map(len, chosen.values())), count(1)
        report = run(chosen, lambda result: progress(next(done), total))
    results = [result for group in report.values() for result in group]
    if as_json:
        click.echo(json.dumps({"items": [record(result) for result in results]}))
    else:
        if everything or only not in (None, *chosen):
            click.echo("\n".join(map(line, results)))
        _summary(report, theory)
    if out is not None:
        write_whole(out, theory.markdown(report), "--out")
        click.echo(f"wrote {out}", err=True)
    unproved = [result.statement.name for result in results if not result.settled]
    took = f"{perf_counter() - start:.0f} s"
    click.echo(f"{counted(len(results), 'statement')}, {len(unproved)} unproved, {took}", err=True)
    if unproved:
        present.fail(f"not proved: {', '.join(unproved)}", 1)
    return results


def _theory(scene: str | None) -> ModuleType:
    """Module of the statements about the paper's scene, or about another one.

    Raises InvalidInput if there is no such scene or file, and exits with 2 for a file that does not
    declare a scene.
    """
    from capsule_sym._symbolic.model import declaration

    if scene is not None:
        home = declaration.home(scene)
        if not home.is_file():
            allowed = f"{', '.join(declaration.SHIPPED)}, or a file that declares a scene"
            raise InvalidInput("--scene", scene, allowed)
        if home != declaration.path() and declaration.chosen.cache_info().currsize:
            raise RuntimeError(f"a process has one scene, and this one has {declaration.path()}")
        declaration.choose(home)
    try:
        from capsule_sym._symbolic import verify as theory
    except declaration.BadDeclaration as error:
        present.fail(f"error: {error}", 2)
    return theory


def _summary(report: Report, theory: ModuleType) -> None:
    """Print a row for each group."""
    rows = []
    for name, results in report.items():
        group, found = theory.GROUPS[name], Counter(result.status for result in results)
        place = [group.place.replace("beyond the paper", "–")] if theory.PAPERS else []
        counts = [str(found[kind] or "") for kind in ("proved", "failed")]
        rows.append([name, *place, group.about, *counts, f"{sum(r.seconds for r in results):.2f}"])
    heads = ["group", *(["in the paper"] if theory.PAPERS else []), "about"]
    numbers = ["proved", "failed", "s"]
    tables.table(heads + numbers, rows, right=numbers)
