"""Two stops with a cosine: the C library's runs, and the integrator's."""

from __future__ import annotations

import random
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.scenes import Form, Integrator, Run, Start, grouped, integrator, random_starts
from tests.scenes.library import SANITIZED, Library, library, printed

ORBITS = Path(__file__).with_name("orbits.c")
FORM = Form(stops=2)
ORDER = ("alpha", "omega", "delta_1", "delta_2", "zeta", "beta_1", "beta_2", "gamma", "f_b")
PERIODS = 4
WITHIN = 10
"""Units of a run's rounding errors, of which states are off by a few."""

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]


def starts(count: int) -> list[Start]:
    """Random starts, every fifth on the surface of a stop, every sixth with narrow gaps.

    Of twenty each linear flows are the same, so that they run side by side.
    """
    r, found = random.Random(2), list[Start]()
    for k, start in enumerate(grouped(random_starts(FORM, count), 20)):
        given = dict(start.parameters)
        x_r, v_r, v_c = start.state
        if k % 6 == 1:
            given["delta_1"], given["delta_2"] = 0.01, r.choice([0.01, 0.0])
        if k // 20 % 6 == 2:
            given["beta_1"] = given["beta_2"] = 900.0
        if k % 5 == 1:
            x_r = given["delta_1"]
        if k % 5 == 2:
            x_r = -given["delta_2"]
        if given["delta_1"] + given["delta_2"] > 0:
            found.append(Start(given, (x_r, v_r, v_c), start.phase))
    return found


@pytest.fixture(scope="module")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Integrator:
    return integrator(tmp_path_factory.mktemp("integrator"))


@pytest.fixture(scope="module")
def stops(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The C library of the scene, under sanitizers."""
    return library("two_stops", tmp_path_factory.mktemp("two_stops"), *SANITIZED)


@pytest.fixture(scope="module")
def judged(judge: Integrator) -> tuple[list[Start], list[Run]]:
    """Starts whose runs the integrator decides."""
    given = starts(1000)
    pairs = zip(given, judge.runs(FORM, given, PERIODS), strict=True)
    found = [(s, run) for s, run in pairs if run.status == "done"]
    assert len(found) > 0.99 * len(given)
    assert {e.event for _, run in found for e in run.segments} >= {"F", "B", "V", "U", "L"}
    return [s for s, _ in found], [run for _, run in found]


@pytest.mark.parametrize("precision", [0, 1, 2])
def test_runs_alone_are_those_of_the_integrator(
    precision: int, stops: Library, judged: tuple[list[Start], list[Run]]
) -> None:
    given, expected = judged
    open_ = 0
    for found, run in zip(stops.runs(given, PERIODS, precision=precision), expected, strict=True):
        if found.stop == "open" and precision == 1:  # doubles alone cannot decide some
            open_ += 1
            continue
        assert found.stop == "done"
        assert found.fields == run.fields
        assert run.off(found.state[:3]) < WITHIN
    assert open_ < 0.02 * len(given)


@pytest.mark.parametrize("lanes", [4, 8])
def test_runs_side_by_side_are_those_of_the_integrator(
    lanes: int, stops: Library, judged: tuple[list[Start], list[Run]]
) -> None:
    given, expected = judged
    for found, run in zip(stops.many(given, lanes, PERIODS), expected, strict=True):
        assert found.stop == "done"
        assert run.off(found.state[:3]) < WITHIN


STEP = 1e-4


def by_differences(judge: Integrator, row: list[float]) -> tuple[np.ndarray, np.ndarray] | None:
    """A period's end (x_r, v_r, v_c) and its slopes by parameters and start, to fourth order.

    None where the fields passed are not the same in all directions.
    """
    at = np.array(row)
    steps = [k * STEP * e for e in np.eye(len(at)) for k in (-2, -1, 1, 2)]
    given = [
        Start(dict(zip(ORDER, map(float, r[:-3]), strict=True)), tuple(map(float, r[-3:])))
        for r in (at, *(at + d for d in steps))
    ]
    runs = judge.runs(FORM, given, 1, checked=False)
    if len({(run.status, run.fields) for run in runs}) > 1 or runs[0].status != "done":
        return None
    ends = np.array([[float(x) for x in run.state[:3]] for run in runs])
    rows = ends[1:].reshape(len(at), 4, 3)
    slopes = (rows[:, 0] - 8 * rows[:, 1] + 8 * rows[:, 2] - rows[:, 3]).T / (12 * STEP)
    return ends[0], slopes


def test_orbits_and_monodromy_are_those_of_the_integrator(
    stops: Library, judge: Integrator
) -> None:
    """Of orbits that meet either stop, with the itinerary's equations solved to rounding."""
    m, orbits = len(ORDER), stops.linked(ORBITS)
    assert stops.parameters == ORDER
    r, rows = random.Random(5), []
    for _ in range(60):
        drawn = (r.uniform(1, 2.5), r.uniform(0.6, 1.6), r.uniform(0.1, 0.6), r.uniform(0.1, 0.6))
        rest = (r.choice([0.05, 0.2]), r.uniform(1, 8), r.uniform(1, 8), r.uniform(0.5, 4), 0.5)
        rows.append([*drawn, *rest, 0.1, 0.0, 0.0])
    compared = 0
    for row, (fit, *texts) in zip(rows, printed(orbits, rows, 1), strict=True):
        if not int(fit):
            continue
        numbers = np.array(texts, float)
        state, monodromy = numbers[:3], numbers[3:12].reshape(3, 3)
        moved = numbers[12 : 12 + 3 * m].reshape(3, m)
        residual, trace, determinant = numbers[-3:]
        assert residual < 1e-13
        if (found := by_differences(judge, [*row[:m], *map(float, state)])) is None:
            continue
        end, slopes = found
        compared += 1
        assert np.max(np.abs(end - state)) < 1e-12
        expected = slopes[:, m:]
        assert np.max(np.abs(monodromy - expected)) < 1e-8 * (1 + np.max(np.abs(expected)))
        by = np.linalg.solve(np.eye(3) - expected, slopes[:, :m])
        assert np.max(np.abs(moved - by)) < 1e-6 * (1 + np.max(np.abs(by)))
        assert abs(trace - np.trace(expected)) < 1e-8 * (1 + abs(trace))
        assert abs(determinant - np.linalg.det(expected)) < 1e-8
    assert compared >= 10
