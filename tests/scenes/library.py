"""The C library of a scene, compiled from what is generated for it, and its runs."""

import runpy
import subprocess
import sys
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

from tests.native import LIBRARY, ROOT
from tests.scenes import HERE, SCENES, Form, Run, Start

FORMS = {
    **SCENES,
    "biased": SCENES["slope"],
    "pulsed": Form(pulsed=True, biased=True),
    "two_stops": Form(stops=2),
}
"""Scenes that ship, and declarations of tests."""

STOPS = ("done", "full", "open", "stopped", "refused")
FLAGS = (
    *("-std=c99", "-O2", "-ffp-contract=off", "-DCAPSULE_ANY_WIDTH=1"),
    *("-Wall", "-Wextra", "-Werror", "-Wno-psabi"),
)
SANITIZED = ("-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


class Switched(NamedTuple):
    """A segment by the library: field, plane on which it ends (0: none), and duration."""

    field: int
    plane: int
    duration: float


class Found(NamedTuple):
    """A run by the library: why it came back, its final state with x_c, and its segments.

    `outcome` is a capsule_outcome: what stayed open.
    """

    stop: str
    state: tuple[float, ...]
    segments: tuple[Switched, ...]
    alone: bool = True
    outcome: int = -1

    @property
    def fields(self) -> tuple[int, ...]:
        """Numbers of the fields passed."""
        return tuple(segment.field for segment in self.segments)


class Motion(NamedTuple):
    """A motion's period number (0: not periodic), the orbit's status and state, the run's state."""

    number: int
    status: int
    orbit: tuple[float, ...]
    end: tuple[float, ...]


class Library(NamedTuple):
    """A compiled driver, with the scene's parameters in their order, and the compiler's flags."""

    form: Form
    parameters: tuple[str, ...]
    program: Path
    flags: tuple[str, ...] = ()

    def runs(
        self, starts: Sequence[Start], periods: int = 4, most: int = 10**6, precision: int = 0
    ) -> list[Found]:
        """A run from each start; precision is 0 as needed, 1 for doubles, 2 for double-doubles."""
        return [_found(line) for line in self._printed(starts, "alone", precision, periods, most)]

    def switches(self, starts: Sequence[Start], lanes: int, periods: int = 4) -> list[Found]:
        """Runs side by side from switch to switch, with the angle of each as its duration."""
        return [
            _found(line)
            for block in batched(starts)
            for line in self._printed(block, "switches", lanes, periods)
        ]

    def in_lanes(self, starts: Sequence[Start], lanes: int, periods: int = 2) -> list[Found]:
        """The first switch from each start, found side by side with others."""
        return [
            Found(
                STOPS[int(line[0])],
                (),
                (Switched(int(line[1]), int(line[2]), float(line[3])),) if int(line[1]) else (),
                alone=line[4] == "1",
            )
            for line in self._printed(starts, "lanes", lanes, periods)
        ]

    def many(self, starts: Sequence[Start], lanes: int, periods: int = 4) -> list[Found]:
        """Final states of runs side by side."""
        return [
            Found(STOPS[int(stop)], tuple(map(float, state)), ())
            for block in batched(starts)
            for stop, *state in self._printed(block, "many", lanes, periods)
        ]

    def motions(self, starts: Sequence[Start], periods: int, longest: int = 16) -> list[Motion]:
        """Periodic motions that runs come to, and the orbits that are found of them."""
        return [
            Motion(int(line[0]), int(line[1]), *(tuple(map(float, line[i::2])) for i in (2, 3)))
            for line in self._printed(starts, "motion", longest, periods)
        ]

    def times(self, starts: Sequence[Start], periods: int) -> tuple[float, float]:
        """Microseconds a switch of the same runs, one by one and in four lanes."""
        ((together, alone, switches),) = self._printed(starts, "time", 4, periods)
        return float(alone) / int(switches) * 1e6, float(together) / int(switches) * 1e6

    def plane(self, run: Run) -> int | None:
        """The plane on which a run of one segment ends, 0 for none; None if not decided."""
        (segment,) = run.segments
        form, fields = self.form, 3 * (1 + self.form.stops) * (1 + self.form.pulsed)
        if segment.event == "E":
            return 0
        if segment.event in "RD":
            return fields + 4 * form.stops + (1 if segment.event == "R" else 2)
        if run.state[2] == 0:
            return run.following if run.status == "most" else None
        ways = 2 * (run.state[2] < 0) + (run.state[1] < 0)
        return fields + 4 * (segment.event == "B") + ways + 1

    def _printed(self, starts: Sequence[Start], *words: object) -> list[list[str]]:
        return printed(self.program, ([*self.row(s), s.phase] for s in starts), *words)

    def row(self, start: Start) -> list[float]:
        """Parameters and state of a start."""
        return [*(start.parameters[name] for name in self.parameters), *start.state]

    def linked(self, source: Path) -> Path:
        """Another program, linked with the library."""
        made = self.program.with_name(source.stem)
        objects = [file for file in made.parent.glob("*.o") if file.stem != self.program.stem]
        command = ["cc", *self.flags, source, *sorted(objects), "-lm", "-o", made]
        subprocess.run(command, check=True)
        return made


def printed(program: Path, rows: Iterable[Sequence[float]], *words: object) -> list[list[str]]:
    """Output of a program for rows of numbers."""
    text = "".join(" ".join(map(repr, map(float, row))) + "\n" for row in rows)
    command = [str(program), *map(str, words)]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [line.split() for line in done.stdout.splitlines()]


def _found(line: list[str]) -> Found:
    if len(line) == 1:  # refused
        return Found(STOPS[int(line[0])], (), ())
    stop, outcome, *rest = line
    segments = (
        Switched(int(field), int(plane), float(duration))
        for field, plane, duration in zip(*(rest[i::3] for i in (4, 5, 6)), strict=True)
    )
    state = tuple(map(float, rest[:4]))
    return Found(STOPS[int(stop)], state, tuple(segments), outcome=int(outcome))


def batched(starts: Sequence[Start], most: int = 4096) -> Iterator[Sequence[Start]]:
    """Starts, as many at a time as the driver takes."""
    for i in range(0, len(starts), most):
        yield starts[i : i + most]


def generated(scene: str, folder: Path) -> Path:
    """Generated code of a scene: what is committed, or else written from its declaration."""
    if (kept := ROOT / "generated" / scene).exists():
        return kept
    places = (HERE / f"{scene}.py", HERE.parent / "secondmodel" / f"{scene}.py")
    (model,) = [place for place in places if place.exists()]
    if not (folder / "facts.py").exists():
        command = [sys.executable, "-m", "capsule_sym.codegen", "--scene", model, "--out", folder]
        subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return folder


def library(scene: str, folder: Path, *flags: str, source: Path = LIBRARY) -> Library:
    """The library of a scene, compiled in a folder, from these sources."""
    code = generated(scene, folder / "generated")
    flags = (*FLAGS, *flags, f"-I{source}", f"-I{code / 'c'}")
    sources = [*source.glob("*.c"), code / "c" / "capsule_kernels.c", HERE / "library.c"]

    def compiled(source: Path) -> Path:
        made = folder / f"{source.stem}.o"
        command = ["cc", "-c", *flags, source, "-o", made]
        subprocess.run(command, check=True)
        return made

    with ThreadPoolExecutor(2) as pool:
        objects = list(pool.map(compiled, sources))
    subprocess.run(["cc", *flags, *objects, "-lm", "-o", folder / "library"], check=True)
    parameters = runpy.run_path(str(code / "facts.py"))["PARAMETERS"]
    return Library(FORMS[scene], parameters, folder / "library", flags)
