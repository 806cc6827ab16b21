"""Scenes in C: declared in a file of this folder, generated, compiled, and run by a driver."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from tests.native import LIBRARY, ROOT
from tests.scenes import HERE, Start

SANITIZED = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
WARNED = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-psabi", "-ffp-contract=off")


class Ended(NamedTuple):
    """Where a run of the library ended: a capsule_stop, the state, and alone the fields passed.

    `open` is a capsule_outcome: what stayed open.
    """

    stop: int
    state: tuple[float, ...]
    fields: tuple[int, ...] = ()
    open: int = -1


class Scene(NamedTuple):
    """A scene's compiled library, and the names of its parameters in their order."""

    folder: Path
    names: tuple[str, ...]
    flags: tuple[str, ...]

    def program(self, source: Path) -> Path:
        """A program that is linked with the library."""
        made = self.folder / source.stem
        objects = sorted(self.folder.glob("*.o"))
        paths = (f"-I{LIBRARY}", f"-I{self.folder / 'generated' / 'c'}")
        command = ["cc", *WARNED, *self.flags, *paths, source, *objects, "-lm", "-o", made]
        subprocess.run(command, check=True)
        return made

    def lines(
        self, source: Path, rows: Iterable[Sequence[float]], *words: object
    ) -> list[list[str]]:
        """What a program prints of rows of numbers."""
        text = "".join(" ".join(map(repr, map(float, row))) + "\n" for row in rows)
        command = [str(self.program(source)), *map(str, words)]
        done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return [line.split() for line in done.stdout.splitlines()]

    def row(self, start: Start) -> list[float]:
        """Parameters and state of a start."""
        return [*(start.parameters[name] for name in self.names), *start.state]

    def runs(
        self, starts: Iterable[Start], periods: int, precision: int = 0, lanes: int = 0
    ) -> list[Ended]:
        """Runs alone, in so many digits, or side by side in so many lanes."""
        rows = ([*self.row(start), start.phase] for start in starts)
        found = []
        for stop, *rest in self.lines(HERE / "driver.c", rows, periods, precision, lanes):
            passed, last = rest[4:-1], rest[4:][-1:] or ["-1"]
            fields = tuple(int(one.partition(":")[0]) for one in passed)
            found.append(Ended(int(stop), tuple(map(float, rest[:4])), fields, int(last[0])))
        return found


def scene(
    folder: Path, name: str, parameters: tuple[str, ...], *flags: str, library: Path = LIBRARY
) -> Scene:
    """A scene of this folder, generated unless it is there, and compiled."""
    made = folder / "generated"
    if not made.exists():
        words = ["-m", "capsule_sym.codegen", "--scene", HERE / f"{name}.py", "--out", made]
        subprocess.run([sys.executable, *words], cwd=ROOT, check=True, capture_output=True)
    sources = [*library.glob("*.c"), made / "c" / "capsule_kernels.c"]
    paths = (f"-I{library}", f"-I{made / 'c'}")
    subprocess.run(["cc", "-c", *WARNED, *flags, *paths, *sources], cwd=folder, check=True)
    return Scene(folder, parameters, flags)
