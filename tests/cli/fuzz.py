"""Command lines of all kinds, made from the commands' own options, and their outcomes."""

import contextlib
import io
import os
import pkgutil
import shutil
import signal
import subprocess
import sys
import threading
import webbrowser
from collections.abc import Iterator
from importlib import import_module
from itertools import chain
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import click
import pytest
from hypothesis import strategies as st

import capsule_sym
from capsule_sym._cli import _ended, _status, group
from capsule_sym._commands.values import Named, Range

NOT_PROVED, INTERRUPTED = 4, 130
ENDS = {0, 2, 3}
_LOST_IN = {"gc_callback", "remove", "_remove", "__del__"}  # whose exceptions nobody gets
_APART = ("capsule_sym.__main__", "capsule_sym.codegen")
# Lines on stderr beside the one with the reason for a failure.
_BESIDE = ("wrote ", "drawing ", "proved ")

_SWEEP = """periods = 3
[axes]
alpha = { from = 0.1, to = 2.0, count = 3 }
gamma = [1.0, 3.3]
"""
_DEVICE = "M_m=1\nM_c=3\nk1=1\nk2=1\nc=0\nG=0\nP_d=1\nOmega=1\nmu=0.1\n"
_FILES = {
    "sweep.toml": _SWEEP,
    "axes.toml": "[axes]\nword = [1, 2]\n",
    "device.toml": _DEVICE,
    "parameters.toml": "alpha = 0.5\ngamma = 3.0\n",
    "not.toml": "alpha = = 1\n",
    "empty.toml": "",
}
_PLACES = [*_FILES, "store", "new", "folder", "none/new", "sweep.toml/below", ".", "", "x.svg"]
_NAMES = ["alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b", "x_r", "all", "grazing"]
_NAMES += ["adding-sliding", "crossing", "SciPy DOP853", "this map", "graze", "erratum", "local"]
_HOSTILE = ["nan", "inf", "-inf", "1e400", "-1", "-0.0", "0", "5e-324", "1e308", "1e20", "x", ""]
_HOSTILE += ["0x10", "1e-300", "١", "--", "-", "\udcff"]

_texts = st.text(st.characters(exclude_characters="\0"), max_size=6)
_floats = st.floats(0, 6).map(repr) | st.floats(0, 6).map(lambda x: f"{x:.1f}")
_numbers = _floats | _floats | st.floats().map(repr) | st.sampled_from(_HOSTILE)
_counts = st.integers(1, 8).map(str)
_integers = _counts | _counts | st.integers().map(str) | st.sampled_from([*_HOSTILE, "9" * 20])


def commands() -> dict[str, click.Command]:
    """The commands by name, each imported."""
    context = click.Context(group)
    found = {name: group.resolve_command(context, [name])[1] for name in group.commands}
    return {name: command for name, command in found.items() if command}


def _value(kind: click.ParamType) -> st.SearchStrategy[list[str]]:
    """The words of one value of a type."""
    if isinstance(kind, click.Tuple):
        return st.tuples(*map(_value, kind.types)).map(lambda parts: list(chain(*parts)))
    if isinstance(kind, Named):
        name = st.sampled_from([*_NAMES, "P_d", "Omega"])
        return st.tuples(name, _value(kind.of)).map(lambda two: [f"{two[0]}={two[1][0]}"])
    if isinstance(kind, Range):
        parts = [_numbers, _numbers, *[_integers] * kind.counted]
        return st.tuples(*parts).map(":".join).map(lambda one: [one])
    word: st.SearchStrategy[str] = st.sampled_from(_NAMES) | st.sampled_from(_PLACES) | _texts
    if isinstance(kind, click.Choice):
        word = st.sampled_from(list(kind.choices)) | st.sampled_from(list(kind.choices)) | _texts
    elif isinstance(kind, click.types.FloatParamType):
        word = _numbers
    elif isinstance(kind, click.types.IntParamType):
        word = _integers
    elif isinstance(kind, click.Path):
        word = st.sampled_from(_PLACES)
    return word.map(lambda one: [one])


@st.composite
def words_of(draw: Any, parameter: click.Parameter) -> list[str]:
    """An option with its value, or an argument."""
    words: list[str] = []
    if isinstance(parameter, click.Option):
        words.append(draw(st.sampled_from(parameter.opts)))
        if parameter.is_flag:
            return words
    count = parameter.nargs if not isinstance(parameter.type, click.Tuple) else 1
    if count < 0:  # any number of them
        count = draw(st.integers(1, 2))
    for _ in range(count):
        words += draw(_value(parameter.type))
    return words


@st.composite
def command_lines(draw: Any) -> list[str]:
    """A command with some of its options in any order, mostly those that it requires."""
    every = commands()
    name = draw(st.sampled_from(sorted(every)))
    required = [one for one in every[name].params if one.required]
    optional = [one for one in every[name].params if not one.required]
    chosen = [one for one in required if draw(st.integers(0, 15))]
    if optional:
        chosen += draw(st.lists(st.sampled_from(optional), max_size=4, unique_by=id))
    parts = [draw(words_of(one)) for one in draw(st.permutations(chosen))]
    return [name, *chain(*parts)]


class Ended(NamedTuple):
    """End of a command line; `cut` if Ctrl-C ended it at its time limit."""

    line: list[str]
    status: int
    out: str
    err: str
    cut: bool

    def problem(self) -> str | None:
        """Fault of this end; empty if there is none."""
        lines = [line for line in self.err.splitlines() if not _beside(line)]
        ends = ENDS | ({INTERRUPTED} if self.cut else set())
        if self.status not in ends | ({NOT_PROVED} if "--certify" in self.line else set()):
            return f"status {self.status}"
        if self.status and len(lines) != 1:
            return f"{len(lines)} lines for a status of {self.status}"
        return "warning" if any("Warning" in line for line in lines) else None


def _beside(line: str) -> bool:
    return line.lower().startswith(_BESIDE) or " is skipped: " in line


def prepare(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Fill a folder with what command lines name, and import all that they may need."""
    for module in pkgutil.walk_packages(capsule_sym.__path__, "capsule_sym."):
        if not module.name.startswith(_APART):
            import_module(module.name)
    patch.setattr(webbrowser, "open", lambda address: True)
    for name, text in _FILES.items():
        (folder / name).write_text(text)
    (folder / "folder").mkdir()
    with _inside(folder):
        assert run(["sweep", "sweep.toml", "--out", "store"], seconds=60).status == 0


@contextlib.contextmanager
def _inside(folder: Path) -> Iterator[None]:
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


def run_in_copy(folder: Path, arguments: list[str], seconds: float) -> Ended:
    """Run a command line in a fresh copy of the folder."""
    copy = folder.with_name("copy")
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(folder, copy)
    with _inside(copy):
        return run_apart(arguments) if _declares(arguments) else run(arguments, seconds)


def _declares(arguments: list[str]) -> bool:
    """True if a command line chooses the declaration to derive: a process can have one only."""
    return arguments[0] == "verify" and any(word.startswith("--scene") for word in arguments)


def run_apart(arguments: list[str]) -> Ended:
    """Run a command line to its end in a process of its own."""
    program = [sys.executable, "-m", "capsule_sym", *arguments]
    done = subprocess.run(program, capture_output=True, text=True, check=False)
    return Ended(arguments, done.returncode, done.stdout, done.stderr, False)


def _is_left_alone(frame: FrameType | None) -> bool:
    """True if Ctrl-C has to wait: the command has not begun or is over, or imports.

    An interrupted import would leave half a module behind for all later lines.
    """
    begun = False
    while frame:
        code = frame.f_code
        if code.co_name in _LOST_IN or code.co_filename.startswith("<frozen importlib"):
            return True
        begun |= code is _ended.__code__
        frame = frame.f_back
    return not begun


def run(arguments: list[str], seconds: float) -> Ended:
    """Run a command line in this process, and type Ctrl-C when its time is over."""
    cut = threading.Event()

    def interrupt(_: int, frame: FrameType | None) -> None:
        if _is_left_alone(frame):
            signal.setitimer(signal.ITIMER_REAL, 0.01)
            return
        cut.set()
        signal.raise_signal(signal.SIGINT)

    out, err = io.StringIO(), io.StringIO()
    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = _status(arguments)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    return Ended(arguments, status, out.getvalue(), err.getvalue(), cut.is_set())
