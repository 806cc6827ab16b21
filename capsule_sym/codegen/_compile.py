"""Compiled core of a user's scene, beside its generated code."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

_SOURCES = Path(__file__).resolve().parents[1] / "_native"


class NotCompiled(Exception):
    """Raised if CMake is missing or fails; the text is its output."""


def compiled_core(folder: Path) -> tuple[str, bytes]:
    """Name and content of the C library and its Python binding, compiled with a folder's code.

    Needs CMake 3.26, a C compiler and Cython. Raises NotCompiled.
    """
    # Tools of this Python's environment come first, also where it is not activated.
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", os.defpath)])
    cmake, ninja = (shutil.which(name, path=path) for name in ("cmake", "ninja"))
    if cmake is None:
        raise NotCompiled("no cmake: `python -m pip install cmake ninja cython`, or make test")
    options = ["-DCAPSULE_BINDING=ON", f"-DCAPSULE_SCENE={folder.resolve().as_posix()}"]
    options.append(f"-DPython_EXECUTABLE={Path(sys.executable).as_posix()}")
    if ninja:
        options += ["-G", "Ninja"]
    with TemporaryDirectory() as build:
        for command in (
            [cmake, "-S", str(_SOURCES), "-B", build, *options],
            [cmake, "--build", build, "--config", "Release", "--parallel"],
            [cmake, "--install", build, "--config", "Release", "--prefix", f"{build}/made"],
        ):
            done = subprocess.run(
                command,
                env=os.environ | {"PATH": path},
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                check=False,
            )
            if done.returncode:
                raise NotCompiled(done.stdout)
        (made,) = Path(build, "made").glob("_core.*")
        return made.name, made.read_bytes()
