"""Scenes beside the judge, in small numbers; `make scenes` has the large ones."""

from __future__ import annotations

import shutil
from collections.abc import Sequence

import pytest

from tests.scenes import UNIT, Integrator, Start, integrator
from tests.scenes.checks import adversarial, hard_cases, random_runs
from tests.scenes.library import Library, library

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]

SHIPPED = ("capsule", "slope")


@pytest.fixture(scope="module")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Integrator:
    return integrator(tmp_path_factory.mktemp("integrator"))


@pytest.fixture(scope="module", params=SHIPPED)
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
    tally = hard_cases(judge, scene)
    assert not tally.wrong
    assert tally.undecided == 0
    assert {"contact of stiffness 900", "graze", "sliding tangency", "corner"} <= tally.kinds.keys()
