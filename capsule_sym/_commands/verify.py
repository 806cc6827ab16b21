"""The subcommand `capsule-sym verify`."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option
from capsule_sym._errors import InvalidInput
from capsule_sym._files import write_whole

if TYPE_CHECKING:
    from capsule_sym._symbolic.proofs.statement import Report, Result, Statement

    Sections = Mapping[str, tuple[Statement, ...]]


@command()
def verify(
    scene: str | None = option(
        "Prove the general statements for a scene: flows, cells, field graph, saltation, energy.",
        metavar="NAME|FILE",
    ),
    only: str | None = option(
        "Prove this statement alone; --json lists the names as id.", metavar="NAME"
    ),
    out: options.Path | None = options.out("Write the report with formulas here.", "FILE.md"),
    as_json: bool = options.as_json,
) -> Sequence[Result]:
    """Prove the theory: the flow, the switching mechanisms, Tables 1 to 3 and the appendices.

    One line for each statement: proved, or conditional. Exits with 1 if a statement is not proved.

    With --scene, the statements that hold for any scene: a shipped one, or a file that declares
    one. Statements about the paper alone are omitted.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn

    options.check_beside("only", never=("out",))
    options.require("sympy")
    start = perf_counter()
    text = TextColumn("{task.description}")
    with present.make_progress(
        text, BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    ) as progress:
        task = progress.add_task("importing SymPy", total=None)
        theory = _paper() if scene is None else _scene(scene)
        from capsule_sym._symbolic.proofs.statement import line, record, run

        progress.update(task, description="deriving")
        chosen = theory.statements(only)
        progress.update(task, description="proving", total=sum(map(len, chosen.values())))

        def advance(result: Result) -> None:
            progress.advance(task)
            if not as_json:
                # Above the bar: click's own stdout would write through it.
                click.echo(line(result), file=sys.stdout)

        report = run(chosen, advance)
    results = [result for section in report.values() for result in section]
    if as_json:
        click.echo(json.dumps({"items": [record(result) for result in results]}))
    if out is not None:
        write_whole(out, theory.markdown(report), "--out")
        click.echo(f"wrote {out}", err=True)
    unproved = [result.statement.name for result in results if not result.settled]
    took = f"{perf_counter() - start:.0f} s"
    click.echo(f"{len(results)} statements, {len(unproved)} unproved, {took}", err=True)
    if theory.apart:
        click.echo(theory.apart, err=True)
    if unproved:
        present.fail(f"not proved: {', '.join(unproved)}", 1)
    return results


@dataclass(frozen=True)
class _Theory:
    """Statements to prove, all or one by name, and their report."""

    statements: Callable[[str | None], Sections]
    markdown: Callable[[Report], str]
    apart: str = ""
    """Statements that are not proved, in a line."""


def _paper() -> _Theory:
    """Theory of the paper, for its scene."""
    from capsule_sym._symbolic import verify as theory
    from capsule_sym._symbolic.proofs.markdown import document

    return _Theory(
        lambda only: theory.item(only) if only else theory.items(),
        lambda report: document(report, "# Proved statements\n"),
    )


def _scene(name: str) -> _Theory:
    """General statements for a scene; exits with 2 for a file that declares none."""
    from capsule_sym._symbolic.model import declaration

    home = declaration.home(name)
    if not home.is_file():
        allowed = f"{', '.join(declaration.SHIPPED)}, or a file that declares a scene"
        raise InvalidInput("--scene", name, allowed)
    if home != declaration.path() and declaration.chosen.cache_info().currsize:
        raise RuntimeError(f"a process has one scene, and this one has {declaration.path()}")
    declaration.choose(home)
    try:
        from capsule_sym._symbolic.proofs import every_scene
    except declaration.BadDeclaration as error:
        present.fail(f"error: {error}", 2)
    return _Theory(every_scene.items, every_scene.markdown, every_scene.PAPERS_ALONE)
