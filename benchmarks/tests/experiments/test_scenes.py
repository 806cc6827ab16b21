"""Scenes beside the judge, in small numbers; the command `scenes-check` has the large ones."""

from __future__ import annotations

import math
import shutil
from collections.abc import Sequence

import pytest

from benchmarks.experiments.scene_cases import cases
from benchmarks.experiments.scenes import adversarial, hard_cases, random_runs
from tests.scenes import SCENES, UNIT, Integrator, Start
from tests.scenes.library import Library, library

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]


NAMED = {
    *("contact of stiffness 900", "graze", "sliding tangency", "corner", "no drive"),
    *("undamped, critical and stiff", "resonance, slow and fast drive"),
}
BIASED = {"bounds that differ by 100", "slip down a slope without rest"}
STOPS = {"stops next to each other"}
PULSED = {
    *("D near 0 and 1", "low level as high", "start on an edge"),
    *("edge at a switch", "edge at a tangency", "edge at rest"),
}
MOMENTUM = {"landing late on an expansion"}
"""Hard cases of every scene, and of those with a slope, two stops, pulses, or a
cosine that reacts."""


@pytest.fixture(scope="module", params=SCENES)
def scene(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Library:
    return library(request.param, tmp_path_factory.mktemp(request.param))


def test_random_runs_are_the_judge_s(scene: Library, judge: Integrator) -> None:
    tally = random_runs(judge, scene, 60)
    assert not tally.wrong
    assert tally.undecided == 0


def test_first_switches_of_hard_starts_are_the_judge_s(scene: Library, judge: Integrator) -> None:
    tally = adversarial(judge, scene, 1000, "test")
    assert not tally.wrong
    assert tally.undecided < 3


class Swapped(Library):
    """A library that takes both bounds in each other's place; of one bound, damping and gap."""

    def _printed(self, starts: Sequence[Start], *words: object) -> list[list[str]]:
        pair = ("f_plus", "f_minus") if self.form.biased else ("zeta", "delta")
        swap = dict(zip(pair, reversed(pair), strict=True))
        moved = [
            s._replace(parameters={swap.get(name, name): v for name, v in s.parameters.items()})
            for s in starts
        ]
        return super()._printed(moved, *words)


class Off(Library):
    """A library whose starts are off by many roundings."""

    def _printed(self, starts: Sequence[Start], *words: object) -> list[list[str]]:
        moved = [
            s._replace(state=(s.state[0], s.state[1] * (1 + 1e4 * UNIT), s.state[2]))
            for s in starts
        ]
        return super()._printed(moved, *words)


@pytest.mark.parametrize("mutant", [Swapped, Off])
def test_a_changed_library_is_noticed(
    mutant: type[Library], scene: Library, judge: Integrator
) -> None:
    assert random_runs(judge, mutant(*scene), 20).wrong
    assert adversarial(judge, mutant(*scene), 200, "test").wrong


def test_hard_cases_by_name_are_the_judge_s(scene: Library, judge: Integrator) -> None:
    tally, form = hard_cases(judge, scene), scene.form
    assert not tally.wrong
    assert tally.undecided == 0
    named = NAMED | (BIASED if form.biased else set()) | (STOPS if form.stops == 2 else set())
    driven = PULSED if form.pulsed else MOMENTUM if form.reacts else set()
    assert set(tally.kinds) == named | driven


def test_contacts_of_stiffness_900_are_shorter_than_a_hundredth_of_a_period(
    scene: Library, judge: Integrator
) -> None:
    starts = [one.start for one in cases(scene.form) if one.kind == "contact of stiffness 900"]
    assert len(starts) == 2 * scene.form.stops
    for start, run in zip(starts, judge.runs(scene.form, starts), strict=True):
        period = 2 * math.pi / start.parameters["omega"]
        contacts = [s for s in run.segments if (s.field - 1) // 3 % (1 + scene.form.stops)]
        assert min(float(s.duration) for s in contacts) < period / 100


@pytest.mark.parametrize("scene", ["slope", "prototype"], indirect=True)
def test_a_shell_that_cannot_rest_on_its_slope_is_refused(scene: Library) -> None:
    """Beyond the slope on which it slips for ever, its own weight is above its friction."""
    (steep, *_) = (c.start for c in cases(scene.form) if c.kind == "slip down a slope without rest")
    beyond = [steep._replace(parameters={**steep.parameters, "f_minus": f}) for f in (0.0, -0.2)]
    assert [run.stop for run in scene.runs([steep, *beyond])] == ["done", "refused", "refused"]
