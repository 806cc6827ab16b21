"""A drive that pushes the capsule back, by the C library, against the integrator of the scenes."""

from __future__ import annotations

import math
import shutil
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.scenes import SCENES, Integrator, Run, Start, grouped, integrator, random_starts
from tests.scenes.library import SANITIZED, Library, library, printed

FORM = SCENES["reaction"]
ORBITS = Path(__file__).parents[1] / "secondmodel" / "orbits.c"
SCENES_HERE = ("reacting", "reacting_pulsed")
PERIODS, COUNT = 4, 300

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]


@pytest.fixture(scope="module")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Integrator:
    return integrator(tmp_path_factory.mktemp("reaction"))


@pytest.fixture(scope="module", params=SCENES_HERE)
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The C library compiled for a scene, under sanitizers."""
    return library(request.param, tmp_path_factory.mktemp(request.param), *SANITIZED)


class Judged(NamedTuple):
    """Starts with the integrator's runs."""

    starts: list[Start]
    runs: list[Run]


@pytest.fixture(scope="module")
def judged(judge: Integrator, scene: Library) -> Judged:
    starts = grouped(random_starts(scene.form, COUNT), 8)
    runs = judge.runs(scene.form, starts, PERIODS)
    assert all(run.status == "done" for run in runs)
    return Judged(starts, runs)


@pytest.mark.parametrize("way", ["alone", "106 bits", 4, 8])
def test_runs_are_those_of_the_integrator(way: str | int, judged: Judged, scene: Library) -> None:
    """Fields equal, and errors of few roundings, times what the run does to them."""
    if isinstance(way, int):
        found = scene.many(judged.starts, way, PERIODS)
    else:
        found = scene.runs(judged.starts, PERIODS, precision=2 * (way != "alone"))
    for one, run in zip(found, judged.runs, strict=True):
        assert one.stop == "done"
        assert run.off(one.state[:3]) < 32
        assert isinstance(way, int) or one.fields == run.fields


class Found(NamedTuple):
    """An orbit, by the C library or by differences of the integrator's, with what it depends on."""

    state: np.ndarray
    monodromy: np.ndarray
    by_parameter: np.ndarray
    progression: float
    gradient: np.ndarray


STEP = Fraction(1, 2**12)


def by_differences(
    judge: Integrator, names: tuple[str, ...], row: list[float], state: np.ndarray
) -> Found | None:
    """The period's end from an orbit, and its slopes to fourth order in STEP.

    None where the itinerary is not the same in all directions: there are no two-sided slopes.
    """
    at, m = np.array([*row[: len(names)], *state]), len(names)
    moves = [k * float(STEP) * one for one in np.eye(len(at)) for k in (-2, -1, 1, 2)]
    places = [at + move for move in (0 * at, *moves)]
    begun = [Start(dict(zip(names, z, strict=False)), tuple(z[m:])) for z in places]
    runs = judge.runs(FORM, begun, 1, checked=False)
    if len({run.fields for run in runs}) > 1:
        return None
    ends = np.array([run.state[:4] for run in runs])
    rows = ends[1:].reshape(len(at), 4, 4)
    slopes = ((rows[:, 0] - 8 * rows[:, 1] + 8 * rows[:, 2] - rows[:, 3]) / (12 * STEP)).T
    slopes, end = slopes.astype(float), ends[0].astype(float)
    moved = np.linalg.solve(np.eye(3) - slopes[:3, m:], slopes[:3, :m])
    gradient = slopes[3, :m] + slopes[3, m:] @ moved
    return Found(end[:3], slopes[:3, m:], moved, end[3], gradient)


def apart(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.max(np.abs(first - second)) / (1 + np.max(np.abs(second))))


@pytest.mark.parametrize("scene", ["reacting"], indirect=True)
def test_orbits_and_what_they_depend_on_are_those_of_the_integrator(
    scene: Library, judge: Integrator
) -> None:
    """State and progression to rounding; slopes to what is left of STEP^4 and of 1 - multipliers.

    The itinerary's own equations come to the same multipliers. Contacts of stiffness 900 enlarge
    rounding too much for differences.
    """
    names, m = scene.parameters, len(scene.parameters)
    starts = [s for s in random_starts(FORM, 150) if s.parameters["beta"] < 100]
    rows = [scene.row(start) for start in starts]
    compared = 0
    for row, (fit, *texts) in zip(rows, printed(scene.linked(ORBITS), rows, 1), strict=True):
        if not int(fit):
            continue
        places = np.cumsum([3, 9, 3 * m, 1, m])
        state, by, moved, (advance,), gradient, rest = np.split(np.array(texts, float), places)
        residual, trace, determinant = rest
        assert residual < 1e-13 * max(1, 2 * math.pi / row[1])  # the longest duration's
        if (found := by_differences(judge, names, row, state)) is None:
            continue
        compared += 1
        assert apart(state, found.state) < 1e-13
        assert abs(advance - found.progression) < 1e-12
        assert apart(by.reshape(3, 3), found.monodromy) < 1e-10
        assert apart(moved.reshape(3, m), found.by_parameter) < 1e-8
        assert apart(gradient, found.gradient) < 1e-8
        assert abs(trace - np.trace(found.monodromy)) < 1e-10
        assert abs(determinant - np.linalg.det(found.monodromy)) < 1e-10
    assert compared >= 10
