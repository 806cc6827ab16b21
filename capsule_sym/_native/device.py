"""Source of the runs on a graphics card, as one text."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

from capsule_sym._parameters import Scene

_INCLUDE = re.compile(r'^#include (["<])([\w.]+)[">].*$', re.MULTILINE)
_LITERAL = re.compile(r"\((\w+)\)\{")
BLOCK = 128
"""Threads of a block."""
# The bounds count the fused sums that are written: the compiler makes no others.
OPTIONS = ("--std=c++20", "--disable-warnings", "--fmad=false", f"-DBLOCK={BLOCK}")
"""Options of NVRTC, to which CuPy adds --device-as-default-execution-space."""
TABLES = "capsule_tables"
"""Kernel that makes tables."""
COMPILED = {TABLES: "-DTABLES", "capsule_motions": "-DORBITS", "capsule_orbits": "-DORBITS"}
"""Options of kernels that are compiled apart from those of runs."""
BASICS = """\
typedef signed char int8_t;
typedef short int16_t;
typedef unsigned char uint8_t;
typedef int int32_t;
typedef long long int64_t;
typedef unsigned long long uint64_t;
#define offsetof(type, member) ((size_t) &((type *)0)->member)
#define __builtin_fma fma
#define INFINITY __longlong_as_double(0x7ff0000000000000)
#define NAN __longlong_as_double(0x7ff8000000000000)
"""
"""Definitions of C's headers that NVRTC, which has their functions, lacks."""


def source(scene: Scene, sources: Path = Path(__file__).parent) -> str:
    """CUDA C++ of a scene's runs, `device.cu` with the C sources in it, without C's headers.

    The C sources are taken as they are, but for two words: a compound literal `(type){...}` is
    `type{...}` in C++, and `restrict` is `__restrict__`.
    """
    kernels = (Path(at) / "c" for at in import_module(scene.package).__path__)
    folders, seen = [sources, *kernels], set[str]()

    def included(found: re.Match[str]) -> str:
        if found[1] == "<" or found[2] in seen:
            return ""
        seen.add(found[2])
        return text_of(found[2])

    def text_of(name: str) -> str:
        path = next(at / name for at in folders if (at / name).exists())
        return _INCLUDE.sub(included, path.read_text(encoding="utf-8"))

    return re.sub(r"\brestrict\b", "__restrict__", _LITERAL.sub(r"\1{", text_of("device.cu")))
