"""Options that several commands share, and what they mean."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Collection
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from capsule_sym._commands.signature import option, several
from capsule_sym._errors import InvalidInput, NotInstalled
from capsule_sym.generated.capsule.facts import (
    DEFAULTS,
    DEVICE,
    DEVICE_DEFAULTS,
    DEVICE_LABELS,
    DRIVEN,
    LABELS,
)

if TYPE_CHECKING:
    from pathlib import Path as Path

    from capsule_sym._parameters import SceneDevice, SceneParameters

    Device = SceneDevice | None

as_json: Any = option("One JSON object on stdout and nothing else.", "--json")


def count(
    help: str, default: int, least: int | None = None, most: int | None = None, **settings: Any
) -> Any:
    """An option that takes a whole number within limits, if there are any."""
    kind = click.INT if least is None else click.IntRange(least, most)
    return option(help, type=kind, default=default, show_default=True, **settings)


def state(help: str = "State at phase 0 from which the motion settles.") -> Any:
    """The option --state: x_r, v_r and v_c at the start, at rest if not given."""
    at_rest, text = (0.0, 0.0, 0.0), f"{help}  [default: 0 0 0]"
    return option(text, type=float, nargs=3, default=at_rest, metavar="XR VR VC")


_DASH = r"(?<=\d)(-|–|\.\.|;)(?=[-\d.])"  # what is written between numbers


def meant(text: str, marks: int = 0) -> str:
    """Question whether a number was meant, or several with so many marks ":" between them.

    Empty where nothing is near: 0,7 is near 0.7, and 0.1-2 and 0.1,2 are near 0.1:2.
    """
    decimal = text.replace(",", ".")
    comma = re.sub(_DASH.replace(";", "[;,]"), ":", text)
    for one in (decimal, re.sub(_DASH, ":", decimal), comma):
        parts = one.split(":")
        try:
            if [*map(float, parts)] and one != text and len(parts) - 1 in {0, marks}:
                return f" Did you mean {one}?"
        except ValueError:
            pass
    return ""


class Range(click.ParamType):  # type: ignore[type-arg]
    """LOW:HIGH as a pair, or where a count is needed LOW:HIGH:COUNT as three numbers."""

    def __init__(self, counted: bool = False) -> None:
        self.counted, self.name = counted, "LOW:HIGH:COUNT" if counted else "LOW:HIGH"

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[float, ...]:
        """The numbers of a text."""
        if isinstance(value, tuple):
            return value
        parts = value.split(":")
        try:
            numbers = (*map(float, parts[:2]), *map(int, parts[2:]))
        except ValueError:
            numbers = ()
        if len(numbers) != 2 + self.counted:
            example = "0.1:2:20" if self.counted else "0.1:2"
            told = f"{value!r} is not {self.name}, such as {example}."
            self.fail(told + meant(value, 1 + self.counted), param, ctx)
        return numbers


class _ValueOrRange(click.ParamType):  # type: ignore[type-arg]
    """A value, or a range LOW:HIGH, which `ranges` gives; the option is then None.

    Where a count is needed the range is LOW:HIGH:COUNT. An option of a device takes no value, which
    is in the file.
    """

    def __init__(self, counted: bool = False, device: bool = False) -> None:
        self.range, self.device = Range(counted), device
        self.name = self.range.name if device else f"float | {self.range.name}"

    def convert(self, value: Any, param: Any, ctx: Any) -> float | None:
        """The value of a text; of a range it is None."""
        if not self.device and (not isinstance(value, str) or ":" not in value):
            try:
                return float(click.FLOAT(value, param, ctx))
            except click.BadParameter as error:
                more = meant(value, 1 + self.range.counted)
                if not more and meant(value, 1):  # a range without its count
                    more = f" A range is {self.range.name}, such as 0.1:2:20."
                self.fail(error.message + more, param, ctx)
        ctx.meta.setdefault(_RANGES, {})[param.name] = self.range.convert(value, param, ctx)
        return None


_RANGES = f"{__name__}.ranges"


def ranges() -> dict[str, tuple[float, ...]]:
    """The ranges that the running command's parameters were given, in that order."""
    return dict(click.get_current_context().meta.get(_RANGES, {}))


def ranged_parameters(counted: bool = False) -> Any:
    """`parameters` of which each takes a range too, and ranges of a device's parameters.

    `ranges` gives them.
    """
    driven = {
        name: option(
            f"{DEVICE_LABELS[name].capitalize()} ({DEVICE[name]}), of the device in --params.",
            type=_ValueOrRange(counted, device=True),
            expose_value=False,
        )
        for name in DRIVEN
    }
    return parameters(_ValueOrRange(counted), **driven)


def parameters(kind: Any = float, **others: Any) -> Any:
    """The options of a `System`: one for each parameter, --params for a file, and `others`."""
    of_device = " ".join(f"[{name}]" if name in DEVICE_DEFAULTS else name for name in DEVICE)
    dimensionless = {
        name: option(
            f"{LABELS[name].capitalize()}.  [default: {default:g}]",
            *dict.fromkeys((f"--{name.replace('_', '-')}", f"--{name}")),
            type=kind,
        )
        for name, default in DEFAULTS.items()
    }
    file = option(
        "Parameters from a file, dimensionless (options above override it) or physical in SI "
        f"units ({of_device}; no options above).",
        "--params",
        type=click.Path(),
        metavar="FILE.toml",
    )
    return several(System, **dimensionless, file=file, **others)


class System:
    """The parameters that a command line chooses: of a file, of options, or by default."""

    def __init__(self, file: str | None, **dimensionless: float | None) -> None:
        self.file = file
        self.given = {name: v for name, v in dimensionless.items() if v is not None}

    @property
    def chosen(self) -> bool:
        """Whether any of them is not by default."""
        return self.file is not None or bool(self.given)

    def load(self) -> tuple[SceneParameters, Device]:
        """The parameters, with those of the device if the file is in SI units.

        Raises InvalidInput for values that are not allowed, for options beside SI units, and for
        ranges of a device's parameters where there is none.
        """
        from capsule_sym._parameters import Parameters, SceneParameters, load_parameters

        try:
            loaded = Parameters() if self.file is None else load_parameters(self.file)
        except InvalidInput as error:
            if error.field != "file":
                raise
            raise InvalidInput("--params", error.value, error.allowed) from error
        if isinstance(loaded, SceneParameters):
            for name, ends in ranges().items():
                if name in DRIVEN:
                    text = ":".join(f"{end:g}" for end in ends)
                    raise InvalidInput(name, text, "absent unless --params is a device")
            return loaded.replace(**self.given), None
        for name, value in self.given.items():
            raise InvalidInput(name, value, f"absent where {self.file} is in SI units")
        return loaded.dimensionless(), loaded


# pathlib takes a fifteenth of the time of --help: it is imported where there is a path.
class WritablePath(click.Path):
    """A directory, or a file, to write; one that cannot be is refused before work begins."""

    def __init__(self, file: bool = False) -> None:
        super().__init__(file_okay=file, dir_okay=not file, writable=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """The path of a text."""
        import stat
        from pathlib import Path
        from tempfile import TemporaryFile

        from capsule_sym._files import mode_of

        if not value:
            self.fail("'' is no path", param, ctx)
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        place = Path(os.path.realpath(path))
        try:
            mode = mode_of(path)
        except OSError as error:
            self.fail(f"{str(path)!r} cannot be written ({error.strerror})", param, ctx)
        if mode is not None and not (stat.S_ISDIR(mode) or stat.S_ISREG(mode)):
            return path  # a device or a pipe
        folder = place.parent if self.file_okay else place
        there = next(one for one in (folder, *folder.parents) if os.path.exists(one))
        try:
            TemporaryFile(dir=there).close()
        except OSError:
            told = f"{str(path)!r} cannot be written: {there} is no writable directory"
            self.fail(told, param, ctx)
        return path


def out(what: str, metavar: str = "DIRECTORY", **settings: Any) -> Any:
    """The option --out, which says `what` it does: of a directory, or of a FILE by its metavar."""
    return option(
        what, "--out", type=WritablePath(metavar[:4] == "FILE"), metavar=metavar, **settings
    )


tables = out("Write the JSON and its tables as CSV here.")


class Seconds(click.FloatRange):
    """A time above 0; inf is one, NaN is none."""

    def __init__(self) -> None:
        super().__init__(min=0, min_open=True)

    def convert(self, value: Any, param: Any, ctx: Any) -> float:
        """The number of a text."""
        number = float(super().convert(value, param, ctx))
        if math.isnan(number):
            self.fail(f"{value} is not in the range x>0.", param, ctx)
        return number


def max_seconds(default: float = math.inf) -> Any:
    """The option --max-seconds, the limit of time of a command that can take long."""
    return option(
        "Stop after so long and show what was found; inf for no limit.",
        type=Seconds(),
        default=default,
        show_default="no limit" if default == math.inf else True,
    )


def check_beside(name: str, *, needs: Collection[str] = (), never: Collection[str] = ()) -> None:
    """Raises UsageError for an option, by the name of its value, that would do nothing as given.

    That is without any of those it `needs`, or beside one that it is `never` given with.
    """
    flags = {
        str(one.name): one.opts[0]
        if isinstance(one, click.Option)
        else str(one.metavar).strip("[]")
        for one in click.get_current_context().command.params
    }
    if not is_given(name):
        return
    if needs and not any(map(is_given, needs)):
        raise click.UsageError(
            f"{flags[name]} is for {' or '.join(flags[one] for one in needs)}, which is missing"
        )
    for one in never:
        if is_given(one):
            raise click.UsageError(
                f"{flags[name]} and {flags[one]} exclude each other: leave one of them out"
            )


def is_given(name: str) -> bool:
    """Whether the running command's option, by the name of its value, stands on the line."""
    return click.get_current_context().get_parameter_source(name) not in _NOT_GIVEN


_NOT_GIVEN = (None, ParameterSource.DEFAULT, ParameterSource.DEFAULT_MAP)


def require(extra: str, *names: str) -> None:
    """Raises NotInstalled, before work begins, unless these packages of an extra are installed."""
    for name in names:
        if find_spec(name) is None:
            raise NotInstalled(ModuleNotFoundError(name=name), extra)


def certify(what: str) -> Any:
    """The option --certify FILE of a command that can prove `what` it finds."""

    def check(_: click.Context, __: click.Parameter, path: Path | None) -> Path | None:
        if path is not None:
            require("proof", "flint")
        return path

    return option(
        f"Prove {what} in ball arithmetic, and write its certificate here.",
        type=WritablePath(file=True),
        callback=check,
        metavar="FILE",
    )
