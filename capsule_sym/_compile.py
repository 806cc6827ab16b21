"""Cores compiled by the C compiler alone: one shared library of a scene's code and the sources."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from capsule_sym._errors import CapsuleError, InvalidInput

CORE = "core.dll" if os.name == "nt" else "core.so.1"
"""Name of a core beside the code of its scene, with its table's version: no module of Python."""
_SOURCES = os.path.join(os.path.dirname(__file__), "_native")
# As CMake compiles it (CMakeLists.txt), so that the bits are the same.
_FLAGS = ["-std=gnu99", "-O3", "-DNDEBUG", "-ffp-contract=off", "-fvisibility=hidden", "-w"]
_FLAGS += ["-DCAPSULE_EXPORTS"] if os.name == "nt" else ["-fPIC"]
_LINKED = [] if os.name == "nt" else ["-lm"]


class NotCompiled(CapsuleError):
    """Raised if a core cannot be compiled; the text is the reason, in one line."""


def compiler() -> list[str]:
    """Command of the C compiler: CC if it is found, else cc, gcc or clang; empty without one."""
    from shlex import split
    from shutil import which

    named: list[str] = []
    with suppress(ValueError):  # of a quotation without its end
        named = split(os.environ.get("CC", ""), posix=os.name != "nt")
    return named if named and which(named[0]) else [*filter(which, ("cc", "gcc", "clang"))][:1]


def compiled(kernels: str, out: str, report: Callable[[int, int], object]) -> None:
    """Write the core of a scene to `out`, from the folder of its C code; whole or not at all.

    `report` receives the number of compiled files, and of all. Raises NotCompiled without a
    compiler, for its first error, and if `out` cannot be written.
    """
    from concurrent.futures import ThreadPoolExecutor  # these load some 50 modules
    from tempfile import TemporaryDirectory

    from capsule_sym._files import whole

    if not (command := compiler()):
        raise NotCompiled("no C compiler (cc, gcc or clang): install one, or name it in CC")
    names = (name for name in sorted(os.listdir(_SOURCES)) if name.endswith(".c"))
    sources = [*(os.path.join(_SOURCES, name) for name in names), f"{kernels}/capsule_kernels.c"]
    compile_ = [*command, *_FLAGS, f"-I{_SOURCES}", f"-I{kernels}", "-c"]
    try:
        with TemporaryDirectory() as folder, whole(out) as part, ThreadPoolExecutor() as pool:
            objects = [f"{folder}/{os.path.basename(source)}.o" for source in sources]
            pairs = zip(sources, objects, strict=True)
            jobs = [pool.submit(_run, [*compile_, source, "-o", made]) for source, made in pairs]
            try:
                for count, job in enumerate(jobs, 1):
                    job.result()
                    report(count, len(jobs))
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
            _run([*command, "-shared", *objects, *_LINKED, "-o", str(part)])
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
        said = [line for line in done.stderr.splitlines() if line.strip()]
        first = [line for line in said if "error" in line] or said
        raise NotCompiled(f"{command[0]}: {[*first, f'ended by {done.returncode}'][0]}")


def opened(path: str) -> Any:
    """Library at a path; raises OSError for one that cannot be loaded.

    The loader of Linux ends the process where a file is cut. Its last part there is the table of
    sections, whose place and size are in its head (64 bits).
    """
    import ctypes
    from struct import unpack_from

    with open(path, "rb") as file:
        head = file.read(64)
    if head[:5] == b"\x7fELF\2" and len(head) == 64:
        (begin,), (size, count) = unpack_from("=Q", head, 40), unpack_from("=2H", head, 58)
        if os.path.getsize(path) < begin + size * count:
            raise OSError("the file is cut")
    return ctypes.CDLL(path)


def kept(name: str, kernels: str) -> str:
    """Path of a shipped scene's core in the user's cache, compiled there at the first use.

    Writes a line to stderr. Empty without a compiler, and after another line if it fails. A file
    that cannot be loaded, cut or for another machine, is removed and compiled again.
    """
    import platform

    from platformdirs import user_cache_dir

    from capsule_sym._folders import digest_of_sources

    digest = digest_of_sources([kernels])[:16]
    machine = f"{sys.platform}{platform.libc_ver()[0]}-{platform.machine()}"
    home = user_cache_dir("capsule-sym", appauthor=False)
    path = os.path.join(home, f"{name}-{machine}-{digest}", CORE)
    if os.path.isfile(path):
        try:
            opened(path)
            return path
        except OSError:
            with suppress(FileNotFoundError):  # another process removed it
                os.unlink(path)
    if not compiler():
        return ""
    print(f"compiling the C core of scene {name}, once: about 15 s", file=sys.stderr)
    try:
        compiled(kernels, path, lambda done, total: None)
    except NotCompiled as error:
        print(f"no C core of scene {name}: {error}", file=sys.stderr)
    return path if os.path.isfile(path) else ""
