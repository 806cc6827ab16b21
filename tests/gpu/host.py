"""Stand-in for a card: the device source, compiled by the host's C++ compiler."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from threading import Lock
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._native import core_of
from capsule_sym._native.device import BLOCK, COMPILED, source
from capsule_sym._native.on_card import OnCard
from capsule_sym._parameters import Scene, as_scene

HERE = Path(__file__).parent
NATIVE_TESTS = HERE.parent / "native"
COMPILER = shutil.which("g++")
_ALONE = Lock()  # for the numbers of thread and block, which a launch has as its own on a card
FLAGS = ("-std=c++20", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-w")
"""Fused sums by libm: with -mfma GCC makes further ones, whatever -ffp-contract is."""


class Library(NamedTuple):
    """Libraries of the device source: of runs, of tables, and of motions."""

    runs: ctypes.CDLL
    tables: ctypes.CDLL
    orbits: ctypes.CDLL | None = None

    def of(self, kernel: str) -> ctypes.CDLL:
        """Library that has a kernel."""
        found = {"-DTABLES": self.tables, "-DORBITS": self.orbits}
        library = found[COMPILED[kernel]] if kernel in COMPILED else self.runs
        assert library is not None
        return library


def compiled(text: str, *options: str, program: str = "shim.cpp") -> Library:
    """Libraries of a text of the device source, in a program around it."""
    folder = Path(mkdtemp(prefix="shim"))
    (folder / "device.inc").write_text(text)
    assert COMPILER is not None
    command = [COMPILER, *FLAGS, *options, f"-I{folder}", f"-I{NATIVE_TESTS}"]
    made = []
    parts = [("runs", "", program), ("tables", "-DTABLES", "shim.cpp")]
    if program == "shim.cpp":
        parts.append(("orbits", "-DORBITS", program))
    for name, given, file in parts:
        to = str(folder / f"{name}.so")
        subprocess.run(
            [*command, *given.split(), str(HERE / file), "-o", to], check=True, timeout=600
        )
        made.append(ctypes.CDLL(to))
    shutil.rmtree(folder)
    return Library(*made)


@cache
def library(scene: Scene, block: int = BLOCK, most_expansions: int = 0) -> Library:
    """Libraries of a scene's device source, with so many threads in a block."""
    options = [f"-DBLOCK={block}"]
    options += [f"-DMOST_EXPANSIONS={most_expansions}"] if most_expansions else []
    return compiled(source(scene), *options)


class Host:
    """A card of the host's memory."""

    name = "host"

    def __init__(self, library: Library, room: int = 2**26) -> None:
        self.library, self.room = library, room
        self.launches: list[tuple[str, int]] = []

    def free(self) -> int:
        return self.room

    def blank(self, size: int) -> Any:
        return np.full(size, 0xA5, np.uint8)  # as a card's memory, it is not zero

    def put(self, values: Any) -> Any:
        return np.array(values, order="C")

    def take(self, held: Any, values: Any) -> None:
        values.view("u1").reshape(-1)[:] = held.view("u1").reshape(-1)

    def launch(self, kernel: str, count: int, *arguments: Any) -> None:
        self.launches.append((kernel, count))
        given = [np.uintp(a.ctypes.data) if isinstance(a, np.ndarray) else a for a in arguments]
        words = [np.array(a) for a in given]
        places = (ctypes.c_void_p * len(words))(*(word.ctypes.data for word in words))
        with _ALONE:
            getattr(self.library.of(kernel), f"launch_{kernel}")(ctypes.c_int64(count), places)


def on_host(name: str = "capsule", block: int = BLOCK, most_expansions: int = 0) -> OnCard:
    """Runs of a scene as on a card."""
    scene = as_scene(name)
    binding = core_of(scene)
    assert binding is not None
    return OnCard(binding, scene, Host(library(scene, block, most_expansions)))
