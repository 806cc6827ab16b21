"""Newton's steps by elimination of blocks, beside the dense matrix of the same equations."""

import ctypes
import shutil
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

import capsule_sym as cs
from tests.native import KERNELS, LIBRARY, changed_library, compile_in, structure
from tests.native.test_shooting import orbits, random_case

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

SOURCES = ("equations.c", "blocks.c", "linear.c")
MUTANTS = {
    "no row is exchanged": ("if (fabs(a[i][k]) > fabs(a[best][k]))", "if (0)"),
    "rows of a segment alone": (
        "for (int i = k + 1; i < WINDOW_ROWS; i++)\n            if (fabs",
        "for (int i = k + 1; i < BLOCK_ROWS; i++)\n            if (fabs",
    ),
    "no exchange of right sides": ("exchange(b[k], b[(int)segment->order[k]], columns);", ""),
    "a parameter that stays": (
        "segment->window[r][WINDOW_COLUMNS - 1] =",
        "if (0) carried[0][0] =",
    ),
    "a duration that is not held": ("segment->window[BLOCK_ROWS + HELD][0] = 1.0;", ";"),
    "a start that is not held": ("ends[BLOCK_STATES + held] = 0.0;", ";"),
    "a surface that stays": ("+= gradient[STATES + 1 + k] * direction[k];", "+= 0.0;"),
    "a surface that no start is held to": (
        "memcpy(&block[row][BLOCK_STATES], gradient",
        "memcmp(block, gradient",
    ),
}
SINGULAR = 1e15  # condition of equations that fix no step, as where what is held is on a surface


Spelt = structure(
    "capsule_itinerary",
    fields=ctypes.c_void_p,
    **dict.fromkeys(("count", "periods", "mirrored"), ctypes.c_int),
)


class Case(NamedTuple):
    values: NDArray[np.float64]
    itinerary: cs.results.Itinerary
    z: NDArray[np.float64]
    held: int = -1
    direction: tuple[float, ...] = (1.0, 0.0, 0.3, 0.0, 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The elimination and what the probe of it calls."""
    place = tmp_path_factory.mktemp("objects")
    sources = [*(LIBRARY / name for name in SOURCES), Path(__file__).parent / "blocks_probe.c"]
    compile_in(place, "-c", *sources, KERNELS / "capsule_kernels.c")
    return place


def library(objects: Path, place: Path, *changes: tuple[str, str]) -> ctypes.CDLL:
    """The elimination, with texts of it changed."""
    return changed_library(place, objects, SOURCES, *changes)


def error(probe: Any, case: Case) -> float:
    """The largest backward error of what the blocks give, over what rounding may leave."""
    n = len(case.itinerary)
    m = n + 4
    fields, given = np.array(case.itinerary.fields, np.int32), np.cos(np.arange(float(m)))
    spelt = Spelt(fields.ctypes.data, n, case.itinerary.period_number, int(case.itinerary.mirrored))
    matrix, inverse = np.empty((m, m)), np.empty((m, 8))
    residual, step, product, transposed = (np.empty(m) for _ in range(4))
    arrays = (matrix, residual, step, product, transposed, inverse)
    held = (ctypes.c_int(case.held), np.array(case.direction))
    asked = (np.array(case.values), ctypes.byref(spelt), np.array(case.z), *held, given, *arrays)
    regular = probe(
        *(ctypes.c_void_p(a.ctypes.data) if isinstance(a, np.ndarray) else a for a in asked)
    )
    assert regular >= 0
    if np.linalg.cond(matrix) > SINGULAR:
        return 0.0
    size = abs(matrix).sum(axis=1).max()
    unit = np.eye(m)[:, m - 8 :]
    # Rows of a step are solved to the rounding of the largest of them, as by dense elimination.
    backward = [
        abs(matrix @ step - residual).max() / (size * abs(step).max() + abs(residual).max())
    ]
    if n >= 4:
        left = abs(matrix @ inverse - unit).max(axis=0)
        backward += list(left / (size * abs(inverse).max(axis=0) + 1))
    backward += [
        abs(product - matrix @ given).max() / size,
        abs(transposed - matrix.T @ given).max() / abs(matrix).sum(axis=0).max(),
    ]
    worst = max(backward)
    return float(worst / (m * 2.0**-53)) if np.isfinite(worst) else np.inf


@cache
def grazing() -> list[tuple[cs.results.Orbit, int]]:
    """Bifurcations at which a segment has no duration: at a graze its guard has no rate."""
    branch = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=0.05)), "alpha", 1.9, points=40)
    return [(one.orbit, one.segment) for one in branch.bifurcations if one.segment is not None]


@cache
def cases() -> tuple[Case, ...]:
    return tuple(_cases())


def _cases() -> Iterator[Case]:
    for orbit, segment in grazing():
        values, z = np.array(orbit.values, float), np.array(orbit.z, float)
        z *= 1 + 1e-9 * np.sin(np.arange(len(z)))
        z[4 + segment] = 0.0
        yield Case(values, orbit.itinerary, z, 4 + segment)
        yield Case(values, orbit.itinerary, z, 0 if orbit.itinerary.segments[-1].guard else -1)
    for seed, orbit in enumerate(orbits(12)):
        z = orbit.z * (1 + 1e-3 * np.random.default_rng(seed).normal(size=len(orbit.z)))
        for held in (-1, 0, 1, 3, 4, len(z) - 1):
            yield Case(np.array(orbit.values), orbit.itinerary, z, held)
    for seed in range(40):
        values, itinerary, z = random_case(seed)
        yield Case(np.array(values), itinerary, z, -1 if seed % 2 else 4 + seed % len(itinerary))


def test_a_step_solves_the_dense_equations(objects: Path, tmp_path: Path) -> None:
    probe = library(objects, tmp_path).probe
    assert max(error(probe, case) for case in cases()) < 1


@pytest.mark.parametrize("changed", MUTANTS)
def test_each_change_of_the_elimination_is_noticed(objects, tmp_path, changed) -> None:
    probe = library(objects, tmp_path, MUTANTS[changed]).probe
    with np.errstate(invalid="ignore"):
        assert any(error(probe, case) > 1e3 for case in cases())


def repeated(orbit: cs.results.Orbit, times: int) -> Case:
    """An itinerary over and over, beside its solution."""
    z = np.array([*orbit.z[:4], *(times * orbit.z[4:].tolist())])
    z *= 1 + 1e-9 * np.sin(np.arange(len(z)))
    return Case(
        np.array(orbit.values), cs.results.Itinerary(times * orbit.itinerary.segments, times), z
    )


def test_a_step_of_a_long_itinerary_is_that_of_the_dense_matrix(objects, tmp_path) -> None:
    long = repeated(cs.solve_orbit(cs.Parameters(alpha=0.7)), 175)
    assert len(long.itinerary) == 700
    assert error(library(objects, tmp_path).probe, long) < 1


def test_a_step_of_an_unstable_orbit_is_that_of_the_dense_matrix(objects, tmp_path) -> None:
    """Deviations grow 9.4-fold in a period, seven million times in seven."""
    values = (1.42, 0.424, 0.0, 0.031, 8.796, 2.559, 1.0)
    itinerary = cs.results.Itinerary.of((5, 2, 3, 6, 3, 2, 5, 4, 1, 4, 1, 4, 1, 4), 1)
    durations = (0.676, 1.188, 4.568, 0.613, 0.609, 1.049, 0.139, 1.081, 0.48, 1.309, 0.513, 1.184)
    guess = [0.043, 0.333, 0.0, 26.908, *durations, 1.287, 0.123]
    orbit = cs.orbits.solve_itinerary(values, itinerary, guess)
    assert orbit.success
    assert max(abs(cs.orbits.floquet_multipliers(orbit))) > 9
    probe = library(objects, tmp_path).probe
    for times in (1, 3, 7):
        assert error(probe, repeated(orbit, times)) < 1
