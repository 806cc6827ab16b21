"""Options that several commands share, as types of their parameters."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Sequence
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Annotated, Any

import click
from click.core import ParameterSource

from capsule_sym._commands.signature import WORDS, OptionGroup, Setting, flagged, option
from capsule_sym._commands.values import SECONDS, Range, WritablePath
from capsule_sym._commands.values import Named as Named
from capsule_sym._errors import InvalidInput, NotInstalled
from capsule_sym._parameters import (
    CAPSULE,
    Scene,
    SceneDevice,
    SceneParameters,
    load,
    read_parameters,
    scene_in,
)

if TYPE_CHECKING:
    from pathlib import Path as Path
else:  # pathlib takes a fifteenth of the time of --help
    Path = object

Device = SceneDevice | None
Triple = tuple[float, float, float]


def written(metavar: str = "DIR", *flags: str, **settings: Any) -> Setting:
    """Settings of an option for a directory to write, or a file if its metavar begins with FILE."""
    kind = WritablePath(metavar.startswith("FILE"))
    return option(*flags, type=kind, metavar=metavar, **settings)


def file_of(path: str) -> str:
    """File of the branches or curves in a directory; other paths as they are."""
    files = (os.path.join(path, name) for name in ("branch.json", "curves.json"))
    return next(filter(os.path.isfile, files), path)


def by_name(of: Any, *flags: str, **settings: Any) -> Setting:
    """Settings of an option for NAME=VALUE pairs as a dictionary.

    `of` is the type of a pair. A repeated name raises InvalidInput.
    """

    def check(_: click.Context, given: click.Parameter, pairs: Sequence[Any]) -> dict[str, Any]:
        found = dict(pairs)
        if len(found) < len(pairs):
            names = [name for name, _ in pairs]
            raise InvalidInput(given.opts[0], names, "different parameters")
        return found

    return option(*flags, type=of, multiple=True, callback=check, **settings)


def _check_provable(context: click.Context, _: click.Parameter, path: Path | None) -> Path | None:
    """Path of a certificate, after a check that a proof can be made, before work begins.

    Raises NotInstalled without python-flint, and InvalidInput for another scene than the paper's.
    """
    if path is not None:
        require("flint")
        if (scene := scene_of(context.meta[WORDS])) is not CAPSULE:
            raise InvalidInput("--certify", path, f"absent for the scene {scene.name}")
    return path


def _windows(counted: bool = False) -> OptionGroup:
    """The options --x-r, --v-r, --v-c and --phase: ranges of starts, on request with counts."""
    kind = Range(counted)
    along = {name: name for name in ("x_r", "v_r", "v_c")} | {"phase": "the phase"}
    options = [flagged(one, type=kind, help=f"Starts along {of}.") for one, of in along.items()]
    return OptionGroup(lambda _: (_ranges_of_starts, options))


def _ranges_of_starts(**given: Any) -> dict[str, Any]:
    return {name: window for name, window in given.items() if window}


def ranges() -> dict[str, tuple[float, ...]]:
    """Ranges given to parameters of the running command, in the order of the line."""
    context = click.get_current_context()
    own = {one.name for one in context.command.params if one.type in _RANGED}
    given = context.params.items()
    return {name: value for name, value in given if name in own and isinstance(value, tuple)}


def only_range() -> tuple[str, tuple[float, ...]] | None:
    """Name and range of the only parameter with a range; None without one.

    Raises InvalidInput if several parameters have ranges.
    """
    found = ranges()
    for name, ends in [*found.items()][1:]:
        shown = ":".join(f"{end:g}" for end in ends)
        raise InvalidInput(name, shown, "the only parameter with a range")
    return next(iter(found.items()), None)


def _parameters(kind: Any = float, of_device: Any = None) -> OptionGroup:
    """Options of a `System`, of types for its parameters and for those of a device."""
    return OptionGroup(lambda words: _of_scene(scene_of(words), kind, of_device))


def _of_scene(
    scene: Scene, kind: Any, in_file: Any
) -> tuple[Callable[..., System], list[click.Parameter]]:
    """Function that makes a `System` of options, and these, for each parameter, a file, the scene.

    With `in_file`, the type of their values, also one for each quantity of a device that is
    proportional to a parameter.
    """
    facts = scene.facts
    of_device = " ".join(
        f"[{name}]" if name in facts.DEVICE_DEFAULTS else name for name in facts.DEVICE
    )
    dimensionless = [
        flagged(name, type=kind, help=f"{facts.LABELS[name].capitalize()}.  [default: {value:g}]")
        for name, value in facts.DEFAULTS.items()
    ]
    in_si = f" or physical in SI units ({of_device}; no options above)" if of_device else ""
    file = click.Option(
        ["file", "--params"],
        type=click.Path(),
        metavar="FILE.toml",
        help=f"File of parameters, dimensionless (options above override it){in_si}.",
    )
    named = click.Option(
        ["--scene"],
        metavar="NAME|FOLDER",
        help="Scene: the name of a shipped one, or the folder of its generated code.  "
        f"[default: that of --params, or {CAPSULE.name}]",
    )
    driven = [
        flagged(
            name,
            type=in_file,
            help=f"{facts.DEVICE_LABELS[name].capitalize()}"
            f"{facts.DEVICE[name] and f' ({facts.DEVICE[name]})'}, of the device in --params.",
        )
        for name in (facts.DRIVEN if in_file else ())
    ]
    return partial(System, scene), [*dimensionless, file, named, *driven]


def scene_of(words: Sequence[str]) -> Scene:
    """Scene of a line: that of --scene, else of the file in --params, else the paper's.

    Raises InvalidInput for an unknown --scene. An invalid file is left to `System.load`.
    """
    from capsule_sym._files import read_toml

    given = _LINE.make_context("", [*words], resilient_parsing=True).params
    if given["scene"] is not None:
        return _named(given["scene"])
    file = given["params"]
    if file is not None and os.path.isfile(file):  # a pipe can be read only once
        try:
            return scene_in(read_toml(file), file) or CAPSULE
        except InvalidInput:
            pass
    return CAPSULE


_LINE = click.Command(
    "",
    params=[click.Option(["--scene"]), click.Option(["--params"])],
    add_help_option=False,
    context_settings={"ignore_unknown_options": True, "allow_extra_args": True},
)


def _named(given: str) -> Scene:
    """Scene of --scene, whose folder is loaded."""
    try:
        return load(given)
    except InvalidInput as error:
        raise InvalidInput("--scene", error.value, error.allowed) from error


class System:
    """Parameters chosen on a command line: from a file, from options, or defaults.

    `given` has the single values of options; `ranges` returns the ranges.
    """

    def __init__(
        self,
        of: Scene,
        file: str | None,
        scene: str | None,
        **given: float | tuple[float, ...] | None,
    ) -> None:
        self.of, self.file, self.named = of, file, scene
        self.given = {name: v for name, v in given.items() if isinstance(v, float)}

    @property
    def chosen(self) -> bool:
        """True if a file, a value of a parameter, or a scene other than the paper's is given."""
        return self.file is not None or bool(self.given) or self.of is not CAPSULE

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the options that choose parameters, without the scene."""
        return (*self.of.facts.PARAMETERS, "file")

    def load(self) -> tuple[SceneParameters, Device]:
        """Parameters, and those of the device if the file is in SI units, else None.

        Raises InvalidInput for values that are not allowed, for options beside SI units, for ranges
        of a device's parameters without a device, and for a file of another scene.
        """
        try:
            default = self.of.Parameters
            loaded = default() if self.file is None else read_parameters(self.file, self.of)
        except InvalidInput as error:
            if error.field != "file":
                raise
            raise InvalidInput("--params", error.value, error.allowed) from error
        self.check_scene(loaded.scene, str(self.file))
        if isinstance(loaded, SceneParameters):
            for name, ends in ranges().items():
                if name in self.of.facts.DRIVEN:
                    text = ":".join(f"{end:g}" for end in ends)
                    raise InvalidInput(name, text, "absent unless --params is a device")
            return loaded.replace(**self.given), None
        for name, value in self.given.items():
            raise InvalidInput(name, value, f"absent if {self.file} is in SI units")
        return loaded.dimensionless(), loaded

    def check_scene(self, found: Scene, file: str) -> None:
        """Raises InvalidInput for a --scene other than that of a file."""
        if self.named is not None and found is not self.of:
            raise InvalidInput("--scene", self.named, f"{found.shown}, as in {file}, or absent")


def check_beside(name: str, *, needs: Collection[str] = (), never: Collection[str] = ()) -> None:
    """Raises UsageError for an option, by the name of its value, that has no effect as given.

    It has none if none of those that it `needs` is given, or beside one that it excludes (`never`).
    """
    if not is_given(name):
        return
    if needs and not any(map(is_given, needs)):
        raise click.UsageError(
            f"{flag(name)} needs {' or '.join(map(flag, needs))}, which is missing"
        )
    for one in filter(is_given, never):
        raise click.UsageError(
            f"{flag(name)} and {flag(one)} exclude each other: leave one of them out"
        )


def flag(name: str) -> str:
    """Flag of the running command's option or argument, by the name of its value."""
    params = click.get_current_context().command.params
    given = next(one for one in params if one.name == name)
    return given.opts[0] if isinstance(given, click.Option) else str(given.metavar).strip("[]")


def is_given(name: str) -> bool:
    """True if the running command's option, by the name of its value, is on the line."""
    source = click.get_current_context().get_parameter_source(name)
    return source is ParameterSource.COMMANDLINE


def require(*names: str) -> None:
    """Raises NotInstalled, before work begins, unless these packages are installed."""
    for name in names:
        if find_spec(name) is None:
            raise NotInstalled(ModuleNotFoundError(name=name))


Json = Annotated[bool, option("--json", help="One JSON object on stdout and nothing else.")]
State = Annotated[
    Triple,
    option(
        metavar="X_R V_R V_C",
        help="Dimensionless state at phase 0 from which the motion settles.  [default: 0 0 0]",
    ),
]
Folder = Annotated[Path | None, written(help="Write the JSON and its tables as CSV here.")]
Certificate = Annotated[Path | None, written("FILE", callback=_check_provable)]
TimeLimit = Annotated[
    float,
    option(
        type=SECONDS,
        help="Time limit in seconds, after which the results so far are shown; inf for none.",
    ),
]
Over = Annotated[
    dict[str, Any],
    by_name(
        Named(),
        help="A varied parameter with its bounds: dimensionless, or of the device. Repeatable.",
    ),
]
SHARE = Named(click.FLOAT, "alpha=0.05")
Tolerances = Annotated[
    dict[str, float],
    by_name(
        SHARE,
        "--tolerance",
        metavar="NAME=SHARE",
        help="A tolerance of ±SHARE of a parameter: the worst case counts. Repeatable.",
    ),
]
Windows = Annotated[dict[str, Any], _windows()]
CountedWindows = Annotated[dict[str, Any], _windows(counted=True)]
ForeignScene = Annotated[
    Scene | None,
    option(
        "--scene",
        metavar="FOLDER",
        callback=lambda _, option, given: given and _named(given),
        help="Folder of the results' scene, whose code runs, unless it is a shipped one.",
    ),
]
Chosen = Annotated[System, _parameters()]
"""Options of a `System`: one for each parameter of the line's scene, a file, the scene."""
_RANGED = [Range(counted, either) for counted in (False, True) for either in (True, False)]
Ranged = Annotated[System, _parameters(*_RANGED[:2])]
"""Those of `Chosen`, where each parameter takes a range too, and ranges of a device's parameters.

`ranges` returns them.
"""
CountedRanged = Annotated[System, _parameters(*_RANGED[2:])]
