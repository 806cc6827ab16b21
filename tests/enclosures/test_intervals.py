"""Where the motions from rest go over intervals of alpha: against single runs."""

from __future__ import annotations

import json
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from flint import arb_mat
from scipy.linalg import expm
from scipy.optimize import brentq

from capsule_sym import InvalidInput, Parameters, simulate, solve_orbit
from capsule_sym._enclosures import bundles, intervals
from capsule_sym._enclosures.balls import Unproved, arb, ball, floats, matrix, precision, thin
from capsule_sym._enclosures.bundles import Fields, Interval
from capsule_sym._enclosures.cells import ALPHA, EXACT
from capsule_sym._enclosures.from_rest import AlphaInterval, attempt
from capsule_sym._enclosures.intervals import tendency
from capsule_sym._enclosures.regions import FROM_REST, begun, prove
from capsule_sym._enclosures.trajectories import Step
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.equations import PARAMETERS

AT_3_3 = EXACT | {"gamma": "3.3"}
SECTION, PLACES = 3, (-1.0, -0.6, 0.0, 0.7, 1.0)


def carried(alphas: Interval, sections: int) -> tuple[bundles.Bundle, float]:
    """The bundle from rest after some periods, and the phase of its sections in periods."""
    with precision(80):
        exact = {name: ball(AT_3_3[name]) for name in PARAMETERS if name != "alpha"}
        motions = intervals._Motions(
            Fields(exact, alphas),
            simulate(Parameters(alpha=alphas.middle, gamma=3.3), periods=intervals._PERIODS),
        )
        start = motions.fields.section(matrix(3, 2), arb(0))
        ahead = motions.turn * arb(motions.offset)
        first = intervals.steps_of(motions.run, 0, motions.offset)
        found, _ = motions.fields.period(start, first, ahead, motions.angle)
        for section in range(sections):
            found, _ = motions.passed(found, section)
        return found, motions.offset


def missed(found: bundles.Bundle, offset: float, alphas: Interval) -> float:
    """By how much runs at places of the interval are outside, beside the bundle's thickness."""
    rest = np.sum(abs(found[:3, 2:]), axis=1)
    worst = 0.0
    for s in PLACES:
        alpha = alphas.middle + s * alphas.radius
        run = simulate(Parameters(alpha=alpha, gamma=3.3), periods=SECTION + 2)
        state = run([math.tau / 0.8 * (SECTION + offset)])[0]
        away = abs(state - found[:3, 0] - s * found[:3, 1])
        worst = max(worst, float(np.max(away - rest)))
    return worst


@pytest.mark.parametrize("alpha", [0.71, 1.2])
def test_a_bundle_holds_the_motions_of_its_interval(alpha: float) -> None:
    alphas = Interval(alpha, 2e-4)
    found, offset = carried(alphas, SECTION)
    assert missed(found, offset, alphas) < 1e-12
    # It is no thicker than what is of second order in the interval.
    assert np.max(np.sum(abs(found[:3, 2:]), axis=1)) < 2e3 * alphas.radius**2


def test_a_bundle_without_what_is_of_second_order_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bundles, "_shifted", with_terms())
    alphas = Interval(1.2, 8e-4)
    assert missed(*carried(alphas, SECTION), alphas) > 1e-7


def with_terms(*, error: bool = False, rest: bool = False):
    """The step to a switch with only some of the terms that are no form of (1, s, e)."""
    shifted = bundles._shifted

    def without(field, moved, late, missed, d):
        found = shifted(field, moved, late, missed if error else arb(0), d)
        return found if rest else arb_mat([row[: -bundles.SIZE] for row in found.tolist()])

    return without


def one_switch(place: float) -> tuple[bundles.Bundle, float, np.ndarray]:
    """F1 from rest in a thick bundle to its switch: the bundle, and time and state at a place."""
    alphas = Interval(1.2, 2e-2)
    with precision(80):
        exact = {name: ball(AT_3_3[name]) for name in PARAMETERS if name != "alpha"}
        fields = Fields(exact, alphas)
        start = fields.section(thin(np.array([[-1.0, 0.01], [1.0, 0.02], [0.5, 0.0]])), arb(0.5))
        field = fields._fields[1]
        row = floats(field.guards)[bundles.GUARD_ROWS[Guard.GAP]]

        def state(h: float) -> np.ndarray:
            return expm(floats(field.A) * h) @ (start[:6, 0] + place * start[:6, 1])

        h = brentq(lambda h: row @ state(h), 0.0, 2.0, xtol=1e-15)
        _, found = bundles._switch(field, start, Step(1, h, Guard.GAP), "F1")
        return bundles._doubles(found), h, state(h)


def outside(found: bundles.Bundle, place: float, time: float, state: np.ndarray) -> list[float]:
    """By how much time and state of a place are outside."""
    thick = np.sum(abs(found[:, 2:]), axis=1)
    away = abs(np.append(state, time) - found[:, 0] - place * found[:, 1])
    return [float(np.max(away[6:] - thick[6:])), float(np.max(away[:3] - thick[:3]))]


@pytest.mark.parametrize("place", [-1.0, 1.0])
def test_a_switch_is_held_only_with_each_of_its_terms(
    place: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert max(outside(*one_switch(place)[:1], place, *one_switch(place)[1:])) < 1e-14
    monkeypatch.setattr(bundles, "_shifted", with_terms(rest=True))
    late, _ = outside(*one_switch(place)[:1], place, *one_switch(place)[1:])
    assert late > 1e-7
    monkeypatch.undo()
    monkeypatch.setattr(bundles, "_shifted", with_terms(error=True))
    _, away = outside(*one_switch(place)[:1], place, *one_switch(place)[1:])
    assert away > 1e-7


@pytest.mark.parametrize(
    ("alpha", "radius", "fields"),
    [(0.005, 1e-5, (2,)), (0.7, 2e-4, (2, 5, 4, 1)), (1.8, 4e-4, (6, 4, 1, 3))],
)
def test_motions_from_rest_tend_to_the_orbits_of_their_interval(
    alpha: float, radius: float, fields: tuple[int, ...]
) -> None:
    found = tendency(AT_3_3, Interval(alpha, radius))
    assert found.factor < 1
    turned = [found.itinerary[k:] + found.itinerary[:k] for k in range(len(fields))]
    assert fields in turned
    for end in (alpha - radius, alpha + radius):
        assert solve_orbit(Parameters(alpha=end, gamma=3.3)).itinerary.cyclic.fields in turned


def test_an_interval_across_a_threshold_is_not_proved() -> None:
    with pytest.raises(Unproved):
        tendency(AT_3_3, Interval(0.0073756, 1e-6))
    with pytest.raises(Unproved):
        tendency(AT_3_3, Interval(0.5245932, 1e-6))


def test_a_motion_that_has_not_come_near_enough_proves_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    alphas = Interval(0.7, 2e-4)
    assert tendency(AT_3_3, alphas).factor < 1
    monkeypatch.setattr(intervals, "_repeated", lambda *_: [1])
    with pytest.raises(Unproved):
        tendency(AT_3_3, alphas)


def test_a_derivative_that_is_too_large_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Were the saltation twice as large, the box would not be seen to shrink."""
    saltation = bundles.saltation
    monkeypatch.setattr(bundles, "saltation", lambda *given: saltation(*given) * 2)
    with pytest.raises(Unproved, match="attraction"):
        tendency(AT_3_3, Interval(0.7, 1e-5))


def test_halves_cover_their_interval() -> None:
    whole = AlphaInterval(0, 0, 0)
    assert whole.alphas.middle - whole.alphas.radius < ALPHA[0]
    assert whole.alphas.middle + whole.alphas.radius > ALPHA[1]
    part = AlphaInterval(1, 11, 700)
    low, high = part.halved((0,))
    assert low.area + high.area == part.area
    ends = [
        tuple(Fraction(one.alphas.middle) + side * Fraction(one.alphas.radius) for side in (-1, 1))
        for one in (part, low, high)
    ]
    assert ends[1][0] <= ends[0][0] + Fraction(1, 10**15)
    assert ends[1][1] > ends[2][0]
    assert ends[2][1] >= ends[0][1] - Fraction(1, 10**15)
    assert sum(one.area for one in FROM_REST.first()) == 1


def test_work_resumes_and_other_code_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "from-rest.jsonl"
    prove(path, 0, workers=1, task=FROM_REST)
    part = AlphaInterval(0, 11, 717)  # about 0.7
    outcome = attempt(part)
    assert outcome.itinerary == "F1 F2 F5 F4, gamma = 3.3"
    line = {"cell": list(part), "seconds": 1.0, "work": 0.5, "itinerary": outcome.itinerary}
    with path.open("a") as file:
        file.write(json.dumps(line) + "\n")
    plane = begun(path, FROM_REST)
    assert (plane.patches, plane.share, len(plane.open)) == (1, 2.0**-12, 2**12 - 1)
    with pytest.raises(InvalidInput, match="enclose --region"):
        begun(path)
