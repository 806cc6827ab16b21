"""Commands made from functions: their parameters are options, described by the docstring.

The type of a parameter decides how a text is read. `Annotated` adds what a type does not say: an
`option` or an `argument` with settings of click, or an `OptionGroup`, whose options make one value.
The text below the parameter's name, in the docstring's section "Parameters", is the help.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

import click

from capsule_sym._errors import InvalidInput

WORDS = f"{__name__}.words"
"""Key of the words of the line in a command's context."""
# Names of options by that of the argument in an error, where they differ.
_OPTIONS = {
    "over": "shares",
    "metric": "maximise minimise quantity",
    "metrics": "metric",
    "start": "state",
    "end": "to between",
    "starts": "state",
    "most_periods": "max_periods",
    "seconds": "max_seconds",
    "threads": "workers",
    "store": "info",
    "bounds": "over unknown",
    "tolerance": "tolerances shares",
    "deviation": "normal",
}


class Setting(NamedTuple):
    """Kind of a parameter of click, its flags and settings, beside type and default."""

    kind: type[click.Parameter]
    flags: tuple[str, ...]
    settings: dict[str, Any]


def option(*flags: str, **settings: Any) -> Setting:
    """Settings of an option; its flags are by default those of its name.

    A `help` here is that of a parameter without a text in the docstring.
    """
    return Setting(click.Option, flags, settings)


def argument(**settings: Any) -> Setting:
    """Settings of an argument."""
    return Setting(click.Argument, (), settings)


def between(least: int, most: int | None = None, *flags: str, **settings: Any) -> Setting:
    """Settings of an option for an integer from `least` to `most`."""
    return option(*flags, type=click.IntRange(least, most), **settings)


class OptionGroup(NamedTuple):
    """Options that a command gets as one value, made by a function of the words of its line.

    The function returns what makes the value, and its options.
    """

    of_line: Callable[[Sequence[str]], tuple[Callable[..., Any], Sequence[click.Parameter]]]


def flagged(name: str, **settings: Any) -> click.Option:
    """Option with the flag of its name."""
    return click.Option([name, f"--{name.replace('_', '-')}"], **settings)


def group(make: Callable[..., Any]) -> OptionGroup:
    """Options of the parameters of a function, which makes one value of the options' values."""
    return OptionGroup(lambda _: (make, _read(make, ())[0]))


class Command(click.Command):
    """Command whose options may depend on the line."""

    of_line: Callable[[Sequence[str]], Command]
    """Returns the command with its options on a line of these words."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse a line, on which an option may have _ for -, as in the name of a parameter."""
        ctx.meta[WORDS] = [*args]  # the parser empties its own list
        ctx.token_normalize_func = lambda word: word.replace("_", "-")
        return super().parse_args(ctx, args)

    def invoke(self, ctx: click.Context) -> Any:
        """Call the command; an error about a value of an option names the option."""
        try:
            return super().invoke(ctx)
        except InvalidInput as error:
            field, _, part = error.field.partition(" of ")  # such as "bounds of alpha"
            names = {field, *_OPTIONS.get(field, "").split()} - {"file"}
            distinct = isinstance(error.value, str | tuple) or field == "to"
            refused = str(error.value) if distinct else None
            for one in self.params:
                given = ctx.get_parameter_source(str(one.name))
                typed = [str(part) for part in _parts(ctx.params.get(str(one.name)))]
                named = one.name in names or refused in typed
                if named and given is click.core.ParameterSource.COMMANDLINE:
                    shown = one.human_readable_name.rstrip(".")
                    word = one.opts[0] if isinstance(one, click.Option) else shown
                    error.field = f"{word} {part}".rstrip()
            raise


def _parts(value: Any) -> Iterator[Any]:
    """A value, and its parts if it is a tuple."""
    yield value
    for part in value if isinstance(value, tuple) else ():
        yield from _parts(part)


def command(epilog: str | None = None) -> Callable[[Callable[..., Any]], Command]:
    """Decorator that makes a command of a function, with its name and its docstring as help."""

    def decorate(function: Callable[..., Any], words: Sequence[str] = ()) -> Command:
        parameters, joined = _read(function, words)

        def called(**values: Any) -> Any:
            for name, (make, options) in joined.items():
                values[name] = make(**{str(one.name): values.pop(one.name) for one in options})
            return function(**values)

        made = Command(
            function.__name__.replace("_", "-"),
            callback=called,
            params=parameters,
            help=_texts(function)[0],
            epilog=epilog,
        )
        made.of_line = partial(decorate, function)
        return made

    return decorate


def _read(
    function: Callable[..., Any], words: Sequence[str]
) -> tuple[list[click.Parameter], dict[str, Any]]:
    """Options of a function on a line of these words, and groups of them by parameter."""
    texts, hints = _texts(function)[1], get_type_hints(function, include_extras=True)
    assert texts.keys() <= hints.keys(), f"{function.__name__}: {texts.keys() - hints.keys()}"
    parameters, joined = list[click.Parameter](), dict[str, Any]()
    for name, one in inspect.signature(function).parameters.items():
        hint = hints[name]
        about = hint.__metadata__[-1] if hasattr(hint, "__metadata__") else option()
        if isinstance(about, OptionGroup):
            joined[name] = about.of_line(words)
            parameters += joined[name][1]
        else:
            kind = hint.__origin__ if hasattr(hint, "__metadata__") else hint
            parameters.append(_parameter(name, kind, one.default, about, texts.get(name)))
    return parameters, joined


def _parameter(
    name: str, kind: Any, default: Any, about: Setting, text: str | None
) -> click.Parameter:
    """Option or argument of a parameter."""
    settings = ({} if "type" in about.settings else _of_type(kind)) | about.settings
    if default is inspect.Parameter.empty:
        settings.setdefault("required", not settings.get("multiple"))
    elif default not in (None, ()) and default is not False:
        settings["default"] = default
    if about.kind is click.Argument:
        return click.Argument([name], required=settings.pop("required", False), **settings)
    settings["help"] = text or settings.get("help", "")
    if "default" in settings and "[default:" not in settings["help"]:
        settings.setdefault("show_default", default is not True and default != "")
    return click.Option([name, *(about.flags or [f"--{name.replace('_', '-')}"])], **settings)


def _of_type(kind: Any) -> dict[str, Any]:
    """Settings of click for values of a type."""
    first, *rest = get_args(kind) or [None]
    if rest == [type(None)]:
        return _of_type(first)
    if get_origin(kind) is Literal:
        return {"type": click.Choice([first, *rest])}
    if get_origin(kind) is tuple:
        return {"type": first} | ({"multiple": True} if rest == [...] else {"nargs": 1 + len(rest)})
    if kind is bool:
        return {"is_flag": True}
    return {"type": kind} if kind in (float, int, str) else {}


def _texts(function: Callable[..., Any]) -> tuple[str, dict[str, str]]:
    """Docstring of a function without its parameters, and the text of each of these."""
    about, _, listed = inspect.cleandoc(function.__doc__ or "").partition(
        "\n\nParameters\n----------\n"
    )
    found = re.findall(r"^(\w+)\n((?: +.*\n?)+)", listed, re.MULTILINE)
    lines = ((name, " ".join(text.split())) for name, text in found)
    # Two spaces before a default, as click writes them.
    return about, {name: re.sub(r"\. \[default:", ".  [default:", text) for name, text in lines}
