"""Orbits and their metrics in C with a line changed: Python's orbits show each change."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from capsule_sym import Parameters, floquet_multipliers, performance, simulate, solve_orbit
from capsule_sym._orbits.metrics.many import METRICS, multipliers_of
from capsule_sym.generated.interface import ORBIT, SEGMENT, Closing
from tests.native import KERNELS, LIBRARY

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")

CHANGED = ("sensitivities.c", "orbit.c", "metrics.c", "peaks.c")
MUTANTS = {
    "times of switches that stay": ("later[k] /= -guard[BY_TIME];", "later[k] = 0.0;"),
    "v_c that sticking leaves": ("if (next->drift == 0.0)", "if (0)"),
    "a period that stays": ("+= slopes[i][RATE] * run->end_by_omega;", "+= 0.0;"),
    "v_c at rest": ("at->state[2][2] = 0.0;", "at->state[2][2] = 1.0;"),
    "Newton's method not at its end": ("#define ROUNDINGS 16.0", "#define ROUNDINGS 1e11"),
    "a shorter period": ("return repeats;", "return 0;"),
    "other switches": ("passed == first", "1"),
    "a state that is held": ("metric[m][i] * orbit->by_parameter", "0.0 * orbit->by_parameter"),
    "a loss at times that stay": ("2.0 * p->zeta * v_r * v_r * run->end_by_omega", "0.0"),
    "zeta in the loss alone": ("+= weight * 2.0 * v_r * v_r;", "+= 0.0;"),
    "f_b in the loss alone": ("+= slip * per_period;", "+= 0.0;"),
    "omega in the velocity alone": ("+= orbit->progression / TWO_PI;", "+= 0.0;"),
    "one panel": ("fmax(1.0, ceil(type / RULE[rule].reach))", "1.0"),
    "8 nodes too far": ("{4, 2.0,", "{4, 12.0,"),
    "10 nodes too far": ("{5, 4.0,", "{5, 20.0,"),
    "12 nodes too far": ("{6, 7.0,", "{6, 30.0,"),
    "16 nodes too far": ("{8, 12.0,", "{8, 40.0,"),
    "friction that gains": ("way * (after[k] - before[k])", "(after[k] - before[k])"),
    "a switch's peak at a time that stays": ("by[row][RATE] * ends[k]", "0.0"),
    "no forcing in the remainder": ("at.energy + drive * h", "at.energy"),
    "no energy in the remainder": ("at.energy + drive * h", "drive * h"),
    "no remainder of the force": ("left * h * h / 24.0", "0.0"),
    "no remainder of its rate": ("left * h / 6.0", "0.0"),
    "no remainder of its bend": ("left / 2.0", "0.0"),
    "the force at a stretch's start": ("bound_of(&at, h) +", "fabs(at.value) +"),
    "peaks at switches alone": ("(at.rate > 0.0) != (then.rate > 0.0)", "0"),
    "peaks in segments alone": ("if (size > peak.size)", "if (0)"),
    "delta in the force": ("+= side * by_delta;", "+= 0.0;"),
    "zeta in the force": ("+= side * by_zeta;", "+= 0.0;"),
    "beta in the force": ("+= side * by_beta;", "+= 0.0;"),
    "a force's sign": ("< 0.0 ? -1.0 : 1.0;", "< 0.0 ? 1.0 : 1.0;"),
}

# Sticking, never, and for ever; slow and hardly damped, with a peak at a switch, and of two periods.
MOTIONS = (
    dict(alpha=1.2),
    dict(alpha=1.9),
    dict(alpha=0.45),
    dict(alpha=0.005),
    dict(alpha=2.762, omega=0.055, delta=0.046, zeta=0.049, beta=7.005, gamma=2.015),
    dict(alpha=2.951, omega=2.075, delta=0.018, zeta=0.979, beta=3.501, gamma=0.129),
    dict(alpha=1.0693, omega=2.583, delta=0.1901, zeta=0.1519, beta=14.7854, gamma=8.5398),
)
STUB = """
#include "internal.h"
static void leave_open(capsule_context *context, capsule_state *state, capsule_result *p)
{
    *p = (capsule_result){.outcome = CAPSULE_UNDECIDED};
}
const capsule_code capsule_code_fused, capsule_code_wide = {leave_open}, capsule_code_wide_fused;
"""


class Request(ctypes.Structure):
    """A capsule_orbit_request."""

    _fields_ = (
        ("segments", ctypes.c_void_p),
        ("room", ctypes.c_size_t),
        ("energies", ctypes.c_int),
        ("forces", ctypes.c_int),
        ("gradients", ctypes.c_int),
        ("watch", ctypes.c_void_p),
    )


def command(*words: object) -> list[str]:
    return ["cc", "-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-w", "-DCAPSULE_LANES=1",
            f"-I{LIBRARY}", f"-I{KERNELS}", *map(str, words)]  # fmt: skip


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All that a mutant is linked with, in double precision alone."""
    place = tmp_path_factory.mktemp("objects")
    (place / "stub.c").write_text(STUB)
    sources = [LIBRARY / name for name in ("tables.c", "scalar.c", "run.c", *CHANGED)]
    sources += [KERNELS / "capsule_kernels.c", place / "stub.c"]
    subprocess.run(command("-c", *sources), cwd=place, check=True)
    return place


class Library:
    """The C library with one text of it changed."""

    def __init__(self, place: Path, objects: Path, change: tuple[str, str] | None) -> None:
        others = sorted(objects.glob("*.o"))
        made: list[Path] = []
        if change:
            texts = {name: (LIBRARY / name).read_text() for name in CHANGED}
            (name,) = [name for name, text in texts.items() if change[0] in text]
            assert texts[name].count(change[0]) == 1, change
            made = [place / name]
            made[0].write_text(texts[name].replace(*change))
            others = [path for path in others if path.stem != Path(name).stem]
        built = place / "built.so"
        subprocess.run(command("-shared", *made, *others, "-lm", "-o", built), check=True)
        self.library = ctypes.CDLL(str(built))

    def orbit(self, parameters: Parameters, state: Any, periods: int) -> NDArray[np.void]:
        """The record of an orbit with all that can be asked for."""
        values, start = np.array([*parameters.to_dict().values()]), np.array(state, dtype=float)
        work, room = np.zeros(1 << 17, np.uint8), np.zeros(256, SEGMENT)
        found = np.zeros(1, ORBIT)

        def at(array: NDArray[np.generic]) -> ctypes.c_void_p:
            return ctypes.c_void_p(array.ctypes.data)

        self.library.capsule_map_make(at(values), at(work))
        request = Request(room.ctypes.data, len(room), 1, 1, 1, None)
        self.library.capsule_solve_orbit(
            at(work), at(start), periods, ctypes.byref(request), at(found)
        )
        return found


Known = tuple[Parameters, Any, int, NDArray[np.float64]]


def known(**given: float) -> Known:
    """Parameters, a state near the motion, its period number, and what Python has of its orbit."""
    p = Parameters(**given)
    run = simulate(p, periods=400)
    motion = run.steady()
    assert motion is not None
    orbit = solve_orbit(p, run.final[1], 0.0, 2 * motion.period_number + 1)
    assert orbit.success, orbit.message
    found = performance(orbit)
    metrics = [getattr(found, name) for name in METRICS]
    values = [[m.value, *m.gradient.values()] for m in metrics]
    multipliers = floquet_multipliers(orbit)
    parts = [np.ravel(values), np.sort(abs(multipliers)), [abs(multipliers.sum())]]
    nudge = 1e-6 * np.array([1.0, -1.0, 1.0 if run.final[1][2] else 0.0])
    return p, np.array(run.final[1]) + nudge, motion.period_number, np.concatenate(parts)


@pytest.fixture(scope="module")
def motions() -> list[Known]:
    return [known(**given) for given in MOTIONS]


def off(library: Library, motions: list[Known]) -> float:
    """Largest difference from Python's orbits, and infinite for a status that is wrong."""
    worst = 0.0
    for p, state, periods, expected in motions:
        record = library.orbit(p, state, periods)
        if record["closing"][0] != Closing.CLOSED:
            return np.inf
        values = np.array([record[name][0] for name in METRICS])[:, None]
        table = np.hstack([values, record["gradients"].reshape(7, 7)])
        (multipliers,) = multipliers_of(record["monodromy"].reshape(1, 3, 3), record["sticks"])
        found = [np.ravel(table), np.sort(abs(multipliers)), [abs(multipliers.sum())]]
        difference = abs(np.concatenate(found) - expected) / (1 + abs(expected))
        worst = max(worst, float(difference.max()))
    p, state, periods, _ = motions[0]
    twice = library.orbit(p, state, 2 * periods)["closing"][0]
    far = library.orbit(p, (1.3358, 0.3703, -0.0298), periods)["closing"][0]
    return worst if twice == far == Closing.CHANGED else np.inf


def test_unchanged_it_gives_what_python_gives(
    tmp_path: Path, objects: Path, motions: list[Known]
) -> None:
    assert off(Library(tmp_path, objects, None), motions) < 1e-11


@pytest.mark.parametrize("name", MUTANTS)
def test_a_change_is_noticed(
    name: str, tmp_path: Path, objects: Path, motions: list[Known]
) -> None:
    assert not off(Library(tmp_path, objects, MUTANTS[name]), motions) < 1e-10
