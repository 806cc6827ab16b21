"""The integrators in C beside this file, compiled on first use."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks.speed.model import MOST, Result, Run, Start

# Vectors of three components make GCC's code slower.
_FLAGS = ("-O3", "-march=native", "-fno-tree-vectorize", "-std=c99", "-shared", "-fPIC")
_DOUBLES = ctypes.POINTER(ctypes.c_double)


def compiler() -> str | None:
    """Path of the C compiler `cc`, None where there is none."""
    return shutil.which("cc")


def version() -> str | None:
    """Name and version of the compiler; None without one."""
    if (path := compiler()) is None:
        return None
    done = subprocess.run([path, "--version"], capture_output=True, text=True, check=False)
    return done.stdout.partition("\n")[0] or None


def problem() -> str | None:
    """Reason why there are no integrators in C, or None; compiles them if needed."""
    if compiler() is None:
        return "there is no C compiler cc"
    try:
        _library()
    except OSError as failure:
        return str(failure)
    return None


def dop853(tolerance: float, interior: bool) -> Run:
    """Runs by DOP853 with the tolerance as rtol and atol, and switches from its dense output.

    A step is searched if a guard's sign differs at its ends; with `interior` also if the guard has
    a least value inside.
    """
    return _runner(
        lambda values, start, *rest: _library().run_dop853(
            values, ctypes.c_double(start.end), ctypes.c_double(tolerance), int(interior), *rest
        )
    )


def rk4(steps: int) -> Run:
    """Runs by the classical method with so many steps a period, switched at the ends of steps."""
    return _runner(
        lambda values, start, *rest: _library().run_rk4(
            values, ctypes.c_double(start.end), start.periods * steps, *rest
        )
    )


def _runner(call: Callable[..., int]) -> Run:
    def run(starts: Sequence[Start]) -> list[Result]:
        results = []
        for start in starts:
            p, room = start.parameters, MOST * (start.periods + 1)
            values = (ctypes.c_double * 7)(
                p.alpha, p.omega, p.delta, p.zeta, p.beta, p.gamma, p.f_b
            )
            z = (ctypes.c_double * 3)(*start.state)
            itinerary = ctypes.create_string_buffer(room)
            count = call(values, start, start.field, z, itinerary, room)
            state = tuple(z) if count >= 0 else None
            results.append(Result(itinerary.raw[: abs(count)], state))
        return results

    return run


@cache
def _library() -> Any:
    """The compiled integrators; raises OSError where the compiler fails."""
    source = resources.files(__package__).joinpath("integrators.c")
    with TemporaryDirectory() as folder, resources.as_file(source) as path:
        Path(folder, "tableau.h").write_text(_tableau(), encoding="ascii")
        target = Path(folder, "integrators.so")
        command = [str(compiler()), *_FLAGS, f"-I{folder}", str(path), "-o", str(target), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise OSError(f"{' '.join(command)}: {done.stderr}")
        library = ctypes.CDLL(str(target))
    common: list[Any] = [ctypes.c_int, _DOUBLES, ctypes.c_char_p, ctypes.c_int]
    library.run_dop853.argtypes = [
        _DOUBLES,
        ctypes.c_double,
        ctypes.c_double,
        ctypes.c_int,
        *common,
    ]
    library.run_rk4.argtypes = [_DOUBLES, ctypes.c_double, ctypes.c_int, *common]
    return library


def _tableau() -> str:
    """SciPy's coefficients as sums without the terms that vanish, in C."""
    from scipy.integrate._ivp import dop853_coefficients as tableau

    sums = {f"A{i}": row for i, row in enumerate(tableau.A) if i}
    sums |= {f"D{i}": row for i, row in enumerate(tableau.D)}
    sums |= {"E3": tableau.E3, "E5": tableau.E5}
    lines = [f"static const double NODES[] = {{{', '.join(map(_number, tableau.C))}}};"]
    for name, row in sums.items():
        terms = (f"{_number(a)} * (k)[{i}][j]" for i, a in enumerate(row) if a)
        lines.append(f"#define {name}(k, j) ({' + '.join(terms)})")
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    return float(value).hex()
