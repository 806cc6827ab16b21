"""Commands that are made of functions: the line, the types, and what a function gets."""

from pathlib import Path
from typing import Annotated, Any

import click
import pytest
from click.testing import CliRunner

from capsule_sym._commands.signature import argument, command, group, option


def total(*, low: int, high: int) -> int:
    return low + high


def made(got: dict[str, Any]) -> click.Command:
    @command(epilog="The end.")
    def try_all(
        *,
        name: Annotated[str, argument(metavar="NAME")],
        pair: Annotated[int, group(total)],
        rate: float | None = None,
        place: Annotated[tuple[float, float, float], option("--at")] = (0.0, 0.0, 0.0),
        notes: tuple[str, ...] = (),
        loud: Annotated[bool, option("--loud/--quiet")] = True,
        dry_run: bool = False,
        most: int = 3,
        word: str = "",
        path: Annotated[Path | None, option(type=click.Path(path_type=Path))] = None,
    ) -> None:
        """Try it.

        Parameters
        ----------
        rate
            A
            rate.
        """
        got.update(locals())

    return try_all


def test_a_function_gets_what_its_defaults_say() -> None:
    got: dict[str, Any] = {}
    line = "one --low 2 --high 3 --rate .5 --at 1 2 3 --notes a --notes b --quiet --path x"
    line += " --dry-run --most 4"
    assert CliRunner().invoke(made(got), line.split()).exit_code == 0
    assert (got["name"], got["pair"], got["rate"], got["place"]) == ("one", 5, 0.5, (1, 2, 3))
    assert (got["notes"], got["loud"], got["path"]) == (("a", "b"), False, Path("x"))
    assert (got["dry_run"], got["most"]) == (True, 4)
    assert CliRunner().invoke(made(got), ["one", "--low", "2", "--high", "3"]).exit_code == 0
    assert (got["rate"], got["place"], got["notes"], got["loud"]) == (None, (0, 0, 0), (), True)
    assert (got["dry_run"], got["most"], got["path"], got["word"]) == (False, 3, None, "")


@pytest.mark.parametrize("line", ["", "one two", "one --rate x", "one --at 1 2", "one --most 2.5"])
def test_a_line_that_the_types_exclude_is_refused(line: str) -> None:
    assert CliRunner().invoke(made({}), line.split()).exit_code == 2


def test_help_is_the_docstring_and_the_options_in_order() -> None:
    shown = CliRunner().invoke(made({}), ["--help"]).stdout
    words = ("try-all", "NAME", "Try it.", "--low", "--high", "--rate FLOAT", "A rate.", "--at")
    places = [shown.index(word) for word in (*words, "--notes", "--quiet", "--path", "The end.")]
    assert places == sorted(places)


def test_an_option_may_be_written_with_low_lines_but_nothing_else_is_changed() -> None:
    got: dict[str, Any] = {}
    line = "--dry_run --low 1 --high 2 --notes=a_b --notes a_b -- --a_b"
    assert CliRunner().invoke(made(got), line.split()).exit_code == 0
    assert (got["dry_run"], got["notes"], got["name"]) == (True, ("a_b", "a_b"), "--a_b")
