"""Orbits and their metrics in C with a line changed: Python's orbits show each change."""

import ctypes
import shutil
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from capsule_sym import Parameters, orbits, performance, simulate, solve_orbit
from capsule_sym._native import core
from capsule_sym._orbits.metrics.many import METRICS, multipliers_of
from capsule_sym._parameters import CAPSULE
from capsule_sym.generated.interface import OrbitStatus, Quantity
from tests.native import KERNELS, LIBRARY, changed_library, compile_in, structure

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

CHANGED = ("sensitivities.c", "orbit.c", "metrics.c", "extrema.c")
MUTANTS = {
    "times of switches that stay": ("later[k] /= -guard[BY_TIME];", "later[k] = 0.0;"),
    "v_c that sticking leaves": ("if (next->drift == 0.0)", "if (0)"),
    "a period that stays": ("{[PARAMETER + OMEGA_AT] = run->end_by_omega}", "{0.0}"),
    "v_c at rest": ("at->state[2][2] = 0.0;", "at->state[2][2] = 1.0;"),
    "Newton's method not at its end": ("#define ROUNDINGS 16.0", "#define ROUNDINGS 1e11"),
    "corrections that are rounding": ("#define STAGNANT 1e-9", "#define STAGNANT 0.0"),
    "corrections that no longer shrink": ("#define STAGNANT 1e-9", "#define STAGNANT 1.0"),
    "a shorter period": ("return repeats;", "return 0;"),
    "other switches": ("passed == first", "1"),
    "a state that is held": ("metric[m][i] * orbit->by_parameter", "0.0 * orbit->by_parameter"),
    "a loss at times that stay": ("power * run->end_by_omega", "0.0"),
    "parameters in the loss alone": (
        "damper_power_gradient(c, v_r, gradient);",
        "damper_power_gradient(c, v_r, gradient); memset(gradient + PARAMETER, 0, 56);",
    ),
    "friction in the loss alone": ("+= slip[k] * per_period;", "+= 0.0;"),
    "omega in the velocity alone": ("+= orbit->progression / TWO_PI;", "+= 0.0;"),
    "one panel": ("fmax(1.0, ceil(type / RULE[rule].reach))", "1.0"),
    "8 nodes too far": ("{4, 2.0,", "{4, 12.0,"),
    "10 nodes too far": ("{5, 4.0,", "{5, 20.0,"),
    "12 nodes too far": ("{6, 7.0,", "{6, 60.0,"),
    "16 nodes too far": ("{8, 12.0,", "{8, 40.0,"),
    "friction that gains": (
        "friction * (after[k] - before[k])",
        "fabs(friction) * (after[k] - before[k])",
    ),
    "a switch's peak at a time that stays": ("peak->at_end ? ends : still", "still"),
    "the force at a stretch's start": ("bernstein(a, ORDER + 1) + left", "fabs(e->value) + left"),
    "peaks at switches alone": ("if (how < 0 && !note", "if (0 && !note"),
    "a peak at the run's own end": ("(s->target ? 1.0 : 1.0 - 16.0 * UNIT)", "1.0"),
    "peaks in segments alone": ("if (size > peak->size &&", "if (0 &&"),
    "parameters in the force": (
        "force_gradient(c, peak->gap, peak->v_r, gradient);",
        "force_gradient(c, peak->gap, peak->v_r, gradient), gradient[7] = 0.0;",
    ),
    "the contact's force as the whole": (
        "contact_gradient(c, peak->gap, gradient);",
        "force_gradient(c, peak->gap, peak->v_r, gradient);",
    ),
    "a force's sign": ("peak->v_r) : peak->gap) < 0.0)", "peak->v_r) : peak->gap) < -1e9)"),
}

# Remainders are small: they are looked at where expansions are tried sixteen times as far.
FURTHER = ("#define REACH_OF_RATE 3.0", "#define REACH_OF_RATE 48.0")
REMAINDERS = {
    "no energy in the remainder": ("e.rest = factor * inverse", "e.rest = 0.0"),
    "no remainder of its rate": (
        "(value - error) * power",
        "(n < ORDER ? value - error : 0.0) * power",
    ),
}

# Sticking, never, and for ever; slow and hardly damped; a peak at a switch; two periods.
MOTIONS = (
    dict(alpha=1.2),
    dict(alpha=1.9),
    dict(alpha=0.45),
    dict(alpha=0.005),
    dict(alpha=2.762, omega=0.055, delta=0.046, zeta=0.049, beta=7.005, gamma=2.015),
    dict(alpha=2.951, omega=2.075, delta=0.018, zeta=0.979, beta=3.501, gamma=0.129),
    dict(alpha=1.0693, omega=2.583, delta=0.1901, zeta=0.1519, beta=14.7854, gamma=8.5398),
)
# P has its top so close to the period's end that rounding decides which is larger.
TOP = 0.546515415442515
PEAKED = [
    dict(alpha=1.8, omega=TOP + k * 1e-9, delta=1.0, beta=2.0, zeta=0.3, gamma=3.0)
    for k in range(-10, 11)
]
# Friction is so weak beside P that v_c comes back by 4 f_b/P of itself a period, some 1e-4: a
# rounding of the run is a correction thousands of times as large.
SLOWLY = Parameters(alpha=3e4, omega=0.7, delta=3e6, zeta=0.1, gamma=1.0)
ROUNDED = [Parameters(*values) for values in (
    (1.9129971052158024, 2.1686615044531696, 0.3254749604168795, 0.03177860223950555,
     27.48296345254292, 1.872567274490781),
    (2.998760297177118, 0.4228681790825429, 0.6593882831090137, 0.06784893172284591,
     11.69398242129951, 3.028596091559377),
    (0.3656849254260202, 0.6028038876906743, 0.5699406828341114, 0.057269445925474234,
     17.022024919628354, 1.3586922928317446),
    (1.864040084559151, 0.4564364049490021, 0.7788102662768914, 0.06018309980915948,
     16.829713562317906, 4.167211658517079),
)]  # fmt: skip
"""Motions of one period at which corrections stop at some hundred roundings."""
# The second correction from here is larger than half the first.
CROOKED = (0.8628, 0.4042, 0.8994)
STUB = """
#include "internal.h"
static void leave_open(capsule_context *context, capsule_state *state, capsule_result *p)
{
    *p = (capsule_result){.outcome = CAPSULE_UNDECIDED};
}
const capsule_code capsule_code_fused, capsule_code_wide = {leave_open}, capsule_code_wide_fused;
"""


POINTER, SIZE, INT, DOUBLE = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_double
Request = structure(
    "capsule_orbit_request",
    **dict(segments=POINTER, room=SIZE, energies=INT, forces=INT, gradients=INT, watch=POINTER),
)
Run = structure(
    "capsule_closed_run",
    **dict(map=POINTER, segments=POINTER, count=SIZE, periods=INT, end=DOUBLE, end_by_omega=DOUBLE),
)
Peak = structure(
    "capsule_peak",
    **dict.fromkeys(("size", "after", "x_r", "gap", "v_r"), DOUBLE),
    **dict(segment=SIZE, at_end=INT),
)


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All that a mutant is linked with, in double precision alone."""
    place = tmp_path_factory.mktemp("objects")
    (place / "stub.c").write_text(STUB)
    sources = [LIBRARY / name for name in ("tables.c", "scalar.c", "run.c", "linear.c", *CHANGED)]
    sources += [KERNELS / "capsule_kernels.c", place / "stub.c"]
    compile_in(place, "-c", *sources)
    return place


class Library:
    """The C library with texts of one of its files changed."""

    def __init__(self, place: Path, objects: Path, *changes: tuple[str, str]) -> None:
        self.library = changed_library(place, objects, CHANGED, *changes)

    def orbit(self, parameters: Parameters, state: Any, periods: int) -> NDArray[np.void]:
        """The record of an orbit with all optional results."""
        values, start = np.array([*parameters.to_dict().values()]), np.array(state, dtype=float)
        work, room = np.zeros(1 << 17, np.uint8), np.zeros(256, CAPSULE.records.SEGMENT)
        found = np.zeros(1, CAPSULE.records.ORBIT)

        def at(array: NDArray[np.generic]) -> ctypes.c_void_p:
            return ctypes.c_void_p(array.ctypes.data)

        self.library.capsule_map_make(at(values), at(work))
        request = Request(room.ctypes.data, len(room), 1, 1, 1, None)
        self.library.capsule_solve_orbit(
            at(work), at(start), periods, ctypes.byref(request), at(found)
        )
        return found

    def peak(self, values: NDArray[np.float64], segment: NDArray[np.void]) -> float:
        """The largest |P| along a segment, at its tops and its end."""
        work = np.zeros(1 << 17, np.uint8)
        self.library.capsule_map_make(
            ctypes.c_void_p(values.ctypes.data), ctypes.c_void_p(work.ctypes.data)
        )
        run = Run(work.ctypes.data, segment.ctypes.data, 1, 1, 0.0, 0.0)
        peak = Peak()
        self.library.capsule_find_peak(ctypes.byref(run), Quantity.FORCE, None, ctypes.byref(peak))
        return float(peak.size)


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
    multipliers = orbits.floquet_multipliers(orbit)
    parts = [np.ravel(values), np.sort(abs(multipliers)), [abs(multipliers.sum())]]
    nudge = 1e-6 * np.array([1.0, -1.0, 1.0 if run.final[1][2] else 0.0])
    return p, np.array(run.final[1]) + nudge, motion.period_number, np.concatenate(parts)


@pytest.fixture(scope="module")
def motions() -> list[Known]:
    return [known(**given) for given in (*MOTIONS, *PEAKED)]


@pytest.fixture(scope="module")
def slowly() -> NDArray[np.float64]:
    """A state of the motion of `SLOWLY`."""
    return np.array(simulate(SLOWLY, periods=200).final[1])


def off(library: Library, motions: list[Known], slowly: NDArray[np.float64]) -> float:
    """Largest difference from Python's orbits, and infinite for a status that is wrong."""
    worst = 0.0
    for p, state, periods, expected in motions:
        record = library.orbit(p, state, periods)
        if record["status"][0] != OrbitStatus.CLOSED:
            return np.inf
        by_parameter = record["by_parameter"].reshape(3, 7)
        if state[2] == 0.0 and by_parameter[2].any():
            return np.inf  # at rest v_c depends on nothing, to the last bit
        values = np.array([record[name][0] for name in METRICS])[:, None]
        table = np.hstack([values, record["gradients"].reshape(len(METRICS), -1)])
        (multipliers,) = multipliers_of(record["monodromy"].reshape(1, 3, 3), record["sticks"])
        found = [np.ravel(table), np.sort(abs(multipliers)), [abs(multipliers.sum())]]
        difference = abs(np.concatenate(found) - expected) / (1 + abs(expected))
        worst = max(worst, float(difference.max()))
    p, state, periods, _ = motions[0]
    twice = library.orbit(p, state, 2 * periods)["status"][0]
    far = library.orbit(p, (1.3358, 0.3703, -0.0298), periods)["status"][0]
    closed = library.orbit(p, CROOKED, periods)["status"][0]
    slow = library.orbit(SLOWLY, slowly * (1 + 1e-7), 1)["status"][0]
    for one in ROUNDED:
        ends = simulate(one, periods=200).final[1]
        if library.orbit(one, ends, 1)["status"][0] != OrbitStatus.CLOSED:
            return np.inf
    as_known = twice == far == OrbitStatus.CHANGED and closed == slow == OrbitStatus.CLOSED
    return worst if as_known else np.inf


def test_unchanged_it_gives_what_python_gives(tmp_path, objects, motions, slowly) -> None:
    assert off(Library(tmp_path, objects), motions, slowly) < 1e-11


@pytest.mark.parametrize("name", MUTANTS)
def test_a_change_is_noticed(name, tmp_path, objects, motions, slowly) -> None:
    assert not off(Library(tmp_path, objects, MUTANTS[name]), motions, slowly) < 1e-10


class Stretch(NamedTuple):
    """A segment, its parameters, and the largest sample of |P| at its tops and its end."""

    values: NDArray[np.float64]
    segment: NDArray[np.void]
    sampled: float


def stretch(rng: np.random.Generator, vanishing: tuple[int, int] | None) -> Stretch:
    """A segment at whose start two derivatives vanish: from 1 on of P, from 6 on of x_r.

    None stands for a free motion from anywhere.
    """
    alpha, omega = rng.uniform(0, 3) if vanishing else 0.0, 10 ** rng.uniform(-1.5, 0.7)
    delta, zeta, beta = rng.uniform(0, 1), 10 ** rng.uniform(-3, 0), rng.uniform(0, 30)
    gamma, angle, field = rng.uniform(0.2, 8), rng.uniform(0, 2 * np.pi), rng.integers(1, 7)
    contact, drift = int(field > 3), (1, 0, -1)[(field - 1) % 3]
    m, kappa = ((gamma + 1) / gamma if drift else 1.0), beta * contact
    stiff, damp = m * (1 + kappa), 2 * zeta * m
    rest = drift / gamma + m * kappa * delta
    # x_r and its derivatives in terms of (x_r, v_r, 1), by Eqs. (7)-(12).
    x = [np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])]
    for n in range(4):
        forcing = alpha * omega**n * np.cos(angle + n * np.pi / 2) + (rest if n == 0 else 0.0)
        x.append(-stiff * x[n] - damp * x[n + 1] + np.array([0.0, 0.0, forcing]))
    rows = [(1 + kappa) * x[n] + 2 * zeta * x[n + 1] for n in range(5)] + [*x[1:]]
    x_r, v_r = rng.normal(size=2)
    if vanishing:
        system = np.array([rows[n] for n in vanishing])
        x_r, v_r = np.linalg.solve(system[:, :2], -system[:, 2])
    values = np.array([alpha, omega, delta, zeta, beta, gamma, 1.0])
    duration = 10 ** rng.uniform(-0.5, 1.5) / max(np.sqrt(stiff), omega)
    start = np.array([x_r, x_r - delta, v_r, 0.0, 0.0, np.cos(angle), np.sin(angle)])
    closed_form, sizes = core.map(values).closed_form, []  # type: ignore[union-attr]
    for h in np.linspace(0, duration, 101):
        change, _ = closed_form(field, start, h)
        at, speed = x_r + change[0], change[1]
        sizes.append(abs(at + kappa * (at - delta) + 2 * zeta * speed))
    tops = [b for a, b, c in zip(sizes, sizes[1:], [*sizes[2:], 0.0], strict=False) if a <= b >= c]
    record = np.zeros(1, CAPSULE.records.SEGMENT)
    record["start"], record["end"] = [x_r, v_r, 0.0], [at, speed, 0.0]
    record["gap"], record["cosine"], record["sine"] = start[[1, 5, 6]]
    record["margin"] = x_r + kappa * (x_r - delta) + 2 * zeta * v_r - drift
    record["duration"], record["field"], record["target"] = duration, field, 1
    return Stretch(values, record, max([sizes[-1], *tops]))


@pytest.fixture(scope="module")
def stretches() -> list[Stretch]:
    """Starts at which Taylor's polynomial of P alone, or the energy alone, bounds least."""
    rng = np.random.default_rng(0)
    return [stretch(rng, kind) for kind in ((2, 3), (8, 9), None) for _ in range(200)]


def missed(library: Library, stretches: list[Stretch]) -> int:
    """Number of peaks below a sample."""
    found = [library.peak(values, segment) for values, segment, _ in stretches]
    pairs = zip(found, stretches, strict=True)
    return sum(size < one.sampled * (1 - 1e-12) for size, one in pairs)


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
def test_no_sample_exceeds_a_peak(tmp_path: Path, objects: Path, stretches: list[Stretch]) -> None:
    assert missed(Library(tmp_path, objects), stretches) == 0
    assert missed(Library(tmp_path, objects, FURTHER), stretches) == 0


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
@pytest.mark.parametrize("name", REMAINDERS)
def test_without_its_remainder_a_peak_is_missed(name, tmp_path, objects, stretches) -> None:
    assert missed(Library(tmp_path, objects, FURTHER, REMAINDERS[name]), stretches) > 0
