"""Cores compiled by the C compiler alone: one shared library of a scene's code and the sources."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable

from capsule_sym._errors import CapsuleError, InvalidInput

CORE = "core.dll" if os.name == "nt" else "core.so.1"
"""Name of a core beside the code of its scene, with its table's version: no module of Python."""
_SOURCES = os.path.join(os.path.dirname(__file__), "_native")
# As CMake compiles it (CMakeLists.txt), so that the bits are the same.
_FLAGS = ["-std=c99", "-O3", "-ffp-contract=off", "-fvisibility=hidden", "-w"]
_FLAGS += [] if os.name == "nt" else ["-fPIC"]


class NotCompiled(CapsuleError):
    """Raised if a core cannot be compiled; the text is the reason, in one line."""


def compiler() -> list[str]:
    """Command of the C compiler: of CC, else the first of cc, gcc and clang; empty without one."""
    from shlex import split
    from shutil import which

    named = split(os.environ.get("CC", ""))
    here = [name for name in ("cc", "gcc", "clang") if which(name)]
    return named if named and which(named[0]) else here[:1]


def compiled(kernels: str, out: str, report: Callable[[int, int], object]) -> None:
    """Write the core of a scene, from the folder of its C code; whole or not at all.

    `report` receives the number of compiled files, and of all. Raises NotCompiled.
    """
    from concurrent.futures import ThreadPoolExecutor  # these load some 50 modules
    from glob import glob
    from tempfile import TemporaryDirectory

    from capsule_sym._files import whole

    command = compiler()
    if not command:
        raise NotCompiled("no C compiler (cc, gcc or clang): install one, or name it in CC")
    sources = [*sorted(glob(f"{_SOURCES}/*.c")), f"{kernels}/capsule_kernels.c"]
    flags = [*_FLAGS, f"-I{_SOURCES}", f"-I{kernels}"]
    with TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = [f"{folder}/{os.path.basename(source)}.o" for source in sources]
        done = (
            pool.submit(_run, [*command, *flags, "-c", source, "-o", made])
            for source, made in zip(sources, objects, strict=True)
        )
        for count, one in enumerate([*done], 1):
            one.result()
            report(count, len(sources))
        try:
            with whole(out) as part:
                _run([*command, "-shared", *objects, "-lm", "-o", str(part)])
        except InvalidInput as error:
            raise NotCompiled(f"{out} cannot be written: {error.allowed}") from error


def _run(command: list[str]) -> None:
    """Run the compiler; raises NotCompiled with its first error."""
    import subprocess

    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace")
    except OSError as error:
        raise NotCompiled(f"{command[0]}: {error.strerror}") from error
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        said = (
            [line for line in lines if "error" in line] or lines or [f"ended by {done.returncode}"]
        )
        raise NotCompiled(f"{command[0]}: {said[0]}")


def kept(name: str, kernels: str) -> str:
    """Core of a shipped scene from the user's cache, compiled there at the first use.

    Empty without a compiler, and after a line on the standard error if it fails.
    """
    from sysconfig import get_platform

    from platformdirs import user_cache_dir

    from capsule_sym._folders import digest_of_sources

    digest = digest_of_sources([kernels])[:16]
    home = user_cache_dir("capsule-sym", appauthor=False)
    path = os.path.join(home, f"{name}-{get_platform()}-{digest}", CORE)
    if not os.path.isfile(path) and compiler():
        print(f"compiling the C core of scene {name}, once: about 15 s", file=sys.stderr)
        try:
            compiled(kernels, path, lambda done, total: None)
        except NotCompiled as error:
            print(f"no C core of scene {name}: {error}", file=sys.stderr)
    return path if os.path.isfile(path) else ""
