"""Values of options: numbers, ranges, NAME=VALUE, times, and paths that can be written."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from pathlib import Path


class Range(click.ParamType):  # type: ignore[type-arg]
    """LOW:HIGH as a pair, or if `counted` LOW:HIGH:COUNT as three numbers.

    With `or_number` a single number is allowed too. Neither order nor range of LOW and HIGH is
    checked.
    """

    def __init__(self, counted: bool = False, or_number: bool = False) -> None:
        self.counted, self.or_number = counted, or_number
        self.name = "float | " * or_number + ("LOW:HIGH:COUNT" if counted else "LOW:HIGH")

    def convert(self, value: Any, param: Any, ctx: Any) -> float | tuple[float, ...]:
        """Numbers of a text; a value that is no text is returned as it is."""
        if not isinstance(value, str):
            return value  # type: ignore[no-any-return]
        parts = value.split(":")
        try:
            numbers = (*map(float, parts[:2]), *map(int, parts[2:]))
        except ValueError:
            numbers = ()
        if self.or_number and len(numbers) == 1:
            return numbers[0]
        if self.counted and len(numbers) == 3 and numbers[2] < 1:
            self.fail(f"{value!r} has COUNT = {numbers[2]}: must be 1 or more.", param, ctx)
        if len(numbers) != 2 + self.counted:
            example = "0.1:2:20" if self.counted else "0.1:2"
            shape = self.name.removeprefix("float | ")
            self.fail(f"{value!r} is not {shape}, such as {example}.", param, ctx)
        return numbers


class Named(click.ParamType):  # type: ignore[type-arg]
    """NAME=VALUE as a pair of a name and a value of a type; the `optional` part may be None."""

    def __init__(
        self, of: Any = None, example: str = "alpha=0.1:2", optional: str | None = None
    ) -> None:
        self.of, self.example, self.optional = of or Range(), example, optional
        value = self.of.name if isinstance(self.of, Range) else "VALUE"
        shown = {"name": "[NAME=]{}", "value": "NAME[={}]", None: "NAME={}"}
        self.name = shown[optional].format(value)

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """Name, with _ for -, and value of a text."""
        if isinstance(value, tuple):
            return value
        name, mark, text = value.partition("=")
        if self.optional == "name" and not mark:
            return None, self.of.convert(value, param, ctx)
        if not name or not (mark or self.optional):
            shown = param.metavar or self.name
            self.fail(f"{value!r} is not {shown}, such as {self.example}", param, ctx)
        return name.strip().replace("-", "_"), self.of.convert(text, param, ctx) if mark else None


SECONDS = click.FloatRange(min=0, min_open=True)
"""Type of a time above 0, which may be inf; NaN is refused by what gets it."""


# pathlib takes a fifteenth of the time of --help: imported on use.
class WritablePath(click.Path):
    """Directory, or file, to write; refused before work begins if it cannot be written."""

    def __init__(self, file: bool = False) -> None:
        super().__init__(file_okay=file, dir_okay=not file, writable=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        """Path of a text."""
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
            reason = f"{str(path)!r} cannot be written: {there} is not a writable directory"
            self.fail(reason, param, ctx)
        return path
