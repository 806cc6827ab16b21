"""The commands for the reference that is made from them: one object each, by its name.

The options that most of them have are those of `shared`, and not repeated.
"""

import re

import click
from sphinx.application import Sphinx

from capsule_sym._cli import group


def _command(name: str) -> click.Command:
    """A command of the tool with all its options."""
    _, command, _ = group.resolve_command(click.Context(group), [name])
    assert command is not None
    return command


_RANGED = _command("branch").params
_SCENE = [one.name for one in _RANGED].index("scene")
# Up to --scene these are parameters; the last one is --json.
COMMON = [*_RANGED[: _SCENE + 1], _RANGED[-1]]
_NAMES = {one.name for one in COMMON}
shared = click.Command("COMMAND", params=COMMON)
for _name in group.commands:
    _made = _command(_name)
    _made.params = [one for one in _made.params if one.name not in _NAMES]
    globals()[_name] = _made


def _code(line: str) -> str:
    """A line of a help text with its options as code, since each is one word."""
    words = r"`[^`]+`|(?<![`\w-])--[a-zA-Z][a-zA-Z-]*"  # what is code already, or an option
    return re.sub(words, lambda one: f"`{one[0]}`" * (one[0][0] == "`") or f"``{one[0]}``", line)


def _escape(_app: Sphinx, _context: click.Context, lines: list[str]) -> None:
    """Help texts are plain: a bar in them opens no substitution; lines to be kept are literal."""
    kept, before = [], False
    for line in lines:
        if bar := line.startswith("| "):
            kept += ["", "::", ""] * (not before) + [f"    {line[2:]}"]
        else:
            kept += [""] * before + [_code(re.sub(r"\|(?=\S)", r"\\|", line))]
        before = bar
    lines[:] = kept


def _bars(_app: Sphinx, _context: click.Context, lines: list[str]) -> None:
    """Bars around a name, an absolute value, open no substitution; defaults end the text."""
    lines[:] = [re.sub(r"\|(\w+)\|", r"\|\1\|", line) for line in lines]
    lines[:] = [_code(line) if re.match(r" +\w", line) else line for line in lines]
    given = r"\n\s+:default: ``'?(.*?)'?``(\n\s+:options:)?"
    text = re.sub(
        given,
        lambda one: f"  [default: {one[1]}]" + f"\n{one[2]}" * bool(one[2]),
        "\n".join(lines),
    )
    lines[:] = text.split("\n")


def _outdated(app: Sphinx, *_: object) -> list[str]:
    """Pages of the reference, which are read with every build."""
    return [name for name in app.env.found_docs if name.startswith("cli/")]


def setup(app: Sphinx) -> dict[str, bool]:
    """Keep the line breaks of help texts, and rebuild the reference with every build."""
    app.connect("env-get-outdated", _outdated)
    for part in ("description", "epilog"):
        app.connect(f"sphinx-click-process-{part}", _escape)
    app.connect("sphinx-click-process-options", _bars)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
