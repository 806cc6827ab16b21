"""Commands made from functions: the default of a parameter is its option or argument."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import click

from capsule_sym._errors import InvalidInput

# Settings of click by the annotation of a parameter.
_KINDS: dict[str, dict[str, Any]] = {
    "bool": {"is_flag": True},
    "float": {"type": float},
    "int": {"type": int},
    "str": {"type": str},
    "tuple[float, float, float]": {"type": float, "nargs": 3},
    "tuple[str, ...]": {"type": str, "multiple": True},
}


RANGES = f"{__name__}.ranges"
"""Key of the ranges of parameters in a command's context."""
WORDS = f"{__name__}.words"
"""Key of the words of the line in a command's context."""
# Options of arguments by other names.
_OPTIONS = {
    "to": "along",
    "over": "shares",
    "metric": "maximise minimise quantity",
    "metrics": "metric",
    "start": "state",
    "starts": "state",
    "most_periods": "max_periods",
    "threads": "workers",
    "store": "info",
    "bounds": "over unknown",
    "tolerance": "tolerances shares",
    "deviation": "normal",
}


class _Several:
    """Options that a command gets as one value, made by `make` from their values by name."""

    def __init__(self, make: Callable[..., Any], options: Sequence[click.Parameter]) -> None:
        self.make, self.options = make, options

    def take(self, values: dict[str, Any]) -> Any:
        """Value made from those of the options, which are removed from `values`."""
        names = [one.name for one in self.options if one.expose_value]
        return self.make(**{str(name): values.pop(name) for name in names})


def option(help: str, *flags: str, **settings: Any) -> Any:
    """Default of a parameter that is an option of a command.

    `flags` are by default those of its name; `settings` are those of click. The type is that of the
    parameter unless `type` is given.
    """
    return partial(_option, help, flags, settings)


def _option(
    help: str, flags: Sequence[str], settings: dict[str, Any], name: str, kind: str = ""
) -> click.Option:
    chosen = (name, *(flags or [f"--{name.replace('_', '-')}"]))
    if "type" not in settings:
        settings = _KINDS.get(kind.removesuffix(" | None"), {}) | settings
    return click.Option(chosen, help=help, **settings)


def argument(**settings: Any) -> Any:
    """Default of a parameter that is an argument of a command."""
    return lambda name, _: click.Argument([name], **settings)


def several(make: Callable[..., Any] = dict, **options: Any) -> Any:
    """Default of a parameter that has several options, by name: `make` gets their values."""
    return _Several(make, [made(name) for name, made in options.items()])


class ByLine(NamedTuple):
    """Default of a parameter whose options depend on the line, a `several` of its words."""

    made: Callable[[Sequence[str]], Any]


class Command(click.Command):
    """Command whose options may depend on the line."""

    of_line: Callable[[Sequence[str]], Command]
    """Returns the command with its options on a line of these words."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse a line, on which an option may have _ for -, as in the name of a parameter."""
        ctx.meta[WORDS] = args
        stop = args.index("--") if "--" in args else len(args)
        dashed = [
            re.sub("^--[^=]+", lambda flag: flag[0].replace("_", "-"), word) for word in args[:stop]
        ]
        return super().parse_args(ctx, dashed + args[stop:])

    def invoke(self, ctx: click.Context) -> Any:
        """Call the command; an error about a value of an option names the option."""
        try:
            return super().invoke(ctx)
        except InvalidInput as error:
            # The file of --params is named where it is read; other files are of other options.
            field, _, part = error.field.partition(" of ")  # such as "bounds of alpha"
            names = {field, *_OPTIONS.get(field, "").split()} - {"file"}
            names |= set(ctx.meta.get(RANGES, ())) if field == "to" else set()
            for one in self.params:
                given = ctx.get_parameter_source(str(one.name))
                typed = one.name in names and given is click.core.ParameterSource.COMMANDLINE
                if typed and isinstance(one, click.Option):
                    error.field = f"{one.opts[0]} {part}".rstrip()
            raise


def command(
    epilog: str | None = None, further: Sequence[click.Parameter] = ()
) -> Callable[[Callable[..., Any]], Command]:
    """Decorator that makes a command of a function, with its name and its docstring as help.

    The default of each parameter is made by `option`, `argument`, `several` or `ByLine`. `further`
    options are not passed to the function.
    """

    def decorate(function: Callable[..., Any], words: Sequence[str] = ()) -> Command:
        parameters: list[click.Parameter] = []
        joined: dict[str, _Several] = {}
        given = zip(function.__annotations__.items(), function.__defaults__ or (), strict=False)
        for (name, kind), default in given:
            if isinstance(default, ByLine):
                default = default.made(words)
            if isinstance(default, _Several):
                joined[name] = default
                parameters += default.options
            else:
                parameters.append(default(name, kind))

        def called(**values: Any) -> Any:
            return function(**{name: one.take(values) for name, one in joined.items()}, **values)

        name = function.__name__.replace("_", "-")
        made = Command(
            name,
            callback=called,
            params=[*parameters, *further],
            help=function.__doc__,
            epilog=epilog,
        )
        made.of_line = partial(decorate, function)
        return made

    return decorate
