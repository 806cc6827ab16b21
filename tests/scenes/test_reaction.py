"""A drive that pushes the capsule back, by the C library, against the integrator of the scenes."""

from __future__ import annotations

import shutil
from typing import NamedTuple

import pytest

from tests.scenes import SCENES, Integrator, Run, Start, grouped, integrator, random_starts
from tests.scenes.library import SANITIZED, Library, library
from tests.scenes.orbits import compared

FORM = SCENES["reaction"]
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


@pytest.mark.parametrize("scene", ["reacting"], indirect=True)
def test_orbits_and_what_they_depend_on_are_those_of_the_integrator(
    scene: Library, judge: Integrator
) -> None:
    """Contacts of stiffness 900 enlarge rounding too much for differences."""
    starts = [s for s in random_starts(FORM, 150) if s.parameters["beta"] < 100]
    assert compared(scene, judge, starts, step=2.0**-12, long=True) >= 10
