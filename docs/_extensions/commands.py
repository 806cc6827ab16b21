"""The command line with every command imported, for the reference that is made from it."""

import re

import click
from sphinx.application import Sphinx

from capsule_sym._cli import group as lazy

group = click.Group(lazy.name, help=lazy.help, params=lazy.params)
for _name in lazy.commands:
    _, _command, _ = lazy.resolve_command(click.Context(lazy), [_name])
    assert _command is not None
    group.add_command(_command, _name)


def _escape(_app: Sphinx, _context: click.Context, lines: list[str]) -> None:
    """Help texts are plain: a bar in them opens no substitution, and an option is one word."""
    lines[:] = [re.sub(r"\|(?=\S)", r"\\|", line) for line in lines]
    lines[:] = [re.sub(r"(?<![`\w-])--[a-z][a-z-]*", r"``\g<0>``", line) for line in lines]


def _bars(_app: Sphinx, _context: click.Context, lines: list[str]) -> None:
    """Bars around a name, an absolute value, are no substitution."""
    lines[:] = [re.sub(r"\|(\w+)\|", r"\|\1\|", line) for line in lines]


def setup(app: Sphinx) -> dict[str, bool]:
    """Keep the line breaks of help texts, and rebuild the reference with every build."""
    app.connect("env-get-outdated", lambda *_: ["cli"])
    app.connect("sphinx-click-process-description", _escape)
    app.connect("sphinx-click-process-options", _bars)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
