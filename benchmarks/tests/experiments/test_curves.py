"""Bifurcations, their normal forms and curves in scenes beside the judge."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import pytest

from benchmarks.experiments.curves import (
    Judged,
    Tally,
    Undecided,
    checked,
    judge_bifurcation,
    judge_curve,
)
from capsule_sym import continue_bifurcation, continue_orbit, scenes, solve_orbit
from capsule_sym.results import Bifurcation
from tests.scenes import Integrator

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")

# A motion that turns at the fall of its drive: the map is piecewise linear there.
TURNING = {
    **{"alpha": 1.9554827325355435, "alpha_low": -0.09574323627587988, "D": 0.8768046827525245},
    **{"omega": 1.0875150390795385, "delta": 0.02, "zeta": 0.02, "beta": 15.554798665527118},
    **{"gamma": 1.5, "f_b": 1.0},
}


@pytest.fixture(scope="module")
def turning() -> Bifurcation:
    orbit = solve_orbit(scenes.reaction_pulse.Parameters(**TURNING))
    (edge, *_) = continue_orbit(orbit, "gamma", 1.47, points=10).bifurcations
    return edge


@pytest.mark.long
def test_an_edge_at_which_the_capsule_turns_round_has_multipliers_of_two_sides(
    judge: Integrator, turning: Bifurcation
) -> None:
    tally = Tally()
    judge_bifurcation(tally, judge, turning)
    assert not tally.wrong
    assert not tally.open
    assert turning.type == "edge"
    form = turning.normal_form
    assert form is not None
    assert form.order == 1
    assert abs(turning.multipliers[1] - turning.multipliers_without[1]) > 1e-3


def mutants(one: Bifurcation) -> Iterator[tuple[str, Bifurcation]]:
    """The same with sides exchanged, or a normal form of another, and what has to notice it."""
    sides = {"itinerary_before": one.itinerary_after, "itinerary_after": one.itinerary_before}
    yield "border", replace(one, **sides)
    form = one.normal_form
    assert form is not None
    same = replace(one)
    same.__dict__["multipliers_without"] = one.multipliers
    yield "border", same
    mutant = replace(one)
    mutant.__dict__["normal_form"] = form._replace(growth=1.02 * form.growth)
    yield "growth", mutant


@pytest.mark.long
def test_the_judge_notices_what_is_wrong(judge: Integrator, turning: Bifurcation) -> None:
    for name, mutant in mutants(turning):
        met = Judged(judge, mutant, "edge")
        judged = partial(met.border, ("gamma",)) if name == "border" else getattr(met, name)
        with pytest.raises(AssertionError):
            judged()
    moved = Judged(judge, turning, "edge")
    moved.p = moved.p | {"gamma": turning.value + 1e-6}
    with pytest.raises((AssertionError, Undecided)):
        moved.border(("gamma",))


@pytest.mark.long
@pytest.mark.parametrize("scene", ["prototype"])
def test_a_few_curves_are_the_judge_s(judge: Integrator, scene: str) -> None:
    tally = checked(scene, judge, 2, 1)
    assert not tally.wrong
    assert tally.right.total() > 4 * tally.open.total()


@pytest.mark.long
@pytest.mark.parametrize("scene", ["slope", "prototype", "reaction", "reaction_pulse"])
def test_random_curves_are_the_judge_s(judge: Integrator, scene: str) -> None:
    tally = checked(scene, judge, 20, 0)
    assert not tally.wrong
    assert tally.right.total() > 4 * tally.open.total()


@pytest.mark.long
def test_where_a_symmetry_breaks_the_judge_finds_both_orbits_and_the_curve(
    judge: Integrator,
) -> None:
    alike = {"delta_1": 0.5, "delta_2": 0.5, "beta_1": 3, "beta_2": 3, "gamma": 2, "omega": 0.9}
    given = {**alike, "zeta": 0.05, "D": 0.5, "s": 0, "f_plus": 1, "f_minus": 1}
    orbit = solve_orbit(scenes.prototype.Parameters(**given, alpha=0.95, alpha_low=-0.95))
    (breaking,) = continue_orbit(orbit, "zeta", 0.045, points=8).bifurcations
    assert breaking.type == "symmetry breaking"
    tally = Tally()
    judge_bifurcation(tally, judge, breaking)
    ranges = ((breaking.value - 1e-3, breaking.value + 1e-3), (1.98, 2.02))
    judge_curve(tally, judge, continue_bifurcation(breaking, "gamma", ranges, points=3))
    assert not tally.wrong
    assert not tally.open
    assert tally.right.total() == 5
