"""Attraction of motions from rest over intervals of alpha, against single runs."""

from __future__ import annotations

import gzip
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flint import arb_mat
from scipy.linalg import expm
from scipy.optimize import brentq

from capsule_sym import InvalidInput, Parameters, simulate, solve_orbit
from capsule_sym._enclosures.numbers.balls import (
    Unproved,
    arb,
    ball,
    floats,
    matrix,
    precision,
    thin,
)
from capsule_sym._enclosures.numbers.fields import Field
from capsule_sym._enclosures.passage import exchanges
from capsule_sym._enclosures.passage.segments import Leg
from capsule_sym._enclosures.passage.switches import guard_row
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.equations import PARAMETERS
from paper.proofs import segments as passage
from paper.proofs import subdivision as regions
from paper.proofs.attraction import attempt, tendency
from paper.proofs.case import ALPHA, EXACT
from paper.proofs.guesses import steps_of
from paper.proofs.parts import BOTH, AlphaPart
from paper.proofs.segments import Interval, Passage
from paper.proofs.subdivision import FROM_REST, attraction, begun, prove

AT_3_3 = EXACT | {"gamma": "3.3"}
SECTION, PLACES = 3, (-1.0, -0.6, 0.0, 0.7, 1.0)


def carried(alphas: Interval, sections: int) -> tuple[passage.Bundle, float]:
    """The bundle from rest after some periods, and the phase of its sections in periods."""
    with precision(80):
        exact = {name: ball(AT_3_3[name]) for name in PARAMETERS if name != "alpha"}
        motions = attraction.Motions(
            Passage(exact, alphas),
            simulate(Parameters(alpha=alphas.middle, gamma=3.3), periods=attraction.PERIODS),
        )
        start = motions.passage.section(matrix(3, 2), arb(0))
        ahead = motions.turn * arb(motions.offset)
        first = steps_of(motions.run, 0, motions.offset)
        found, _ = motions.passage.period(start, first, ahead, motions.angle)
        for section in range(sections):
            found, _ = motions.passed(found, section)
        return found, motions.offset


def missed(found: passage.Bundle, offset: float, alphas: Interval) -> float:
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
    monkeypatch.setattr(exchanges, "_added", with_terms())
    alphas = Interval(1.2, 8e-4)
    assert missed(*carried(alphas, SECTION), alphas) > 1e-7


def with_terms(*, error: bool = False, rest: bool = False):
    """The step to a switch with only some of the terms that are no form of (1, s, e)."""
    added = exchanges._added

    def without(moved, rates, late, missed, lost):
        found = added(moved, rates, late, missed if error else arb(0), lost)
        return found if rest else arb_mat([row[: -passage.SIZE] for row in found.tolist()])

    return without


def fields_at(alphas: Interval) -> Passage:
    return Passage({name: ball(AT_3_3[name]) for name in PARAMETERS if name != "alpha"}, alphas)


def flowed(field: Field, start: passage.Bundle, place: np.ndarray, h: float) -> np.ndarray:
    """The state of a bundle's member after a time."""
    return expm(floats(field.A) * h) @ (start[:6] @ place)


def one_switch(place: Sequence[float]) -> tuple[passage.Bundle, float, np.ndarray]:
    """F1 in a thick bundle to its switch: the bundle, and time and state at a place."""
    with precision(80):
        fields = fields_at(Interval(1.2, 2e-2))
        columns = np.array([[-1.0, 0.01, 0.0], [1.0, 0.02, 0.03], [0.5, 0.0, 0.01]])
        start, field = fields.section(thin(columns), arb(0.5)), fields._fields[1]
        row = floats(guard_row(field, Guard.GAP))[0]
        at = np.array([1.0, *place] + [0.0] * (start.shape[1] - 3))
        h = brentq(lambda h: row @ flowed(field, start, at, h), 0.0, 2.0, xtol=1e-15)
        switch = fields._switch(field, thin(start), Leg(1, h, Guard.GAP), "F1")
        return (
            passage.rounded(exchanges.shifted(field, *switch[1:])),
            h,
            flowed(field, start, at, h),
        )


def outside(
    found: passage.Bundle, place: Sequence[float], time: float, state: np.ndarray
) -> tuple[float, float]:
    """By how much time and state of a place are outside."""
    thick = np.sum(abs(found[:, 3:]), axis=1)
    away = abs(np.append(state, time) - found[:, :3] @ [1.0, *place])
    return float(np.max(away[6:] - thick[6:])), float(np.max(away[:3] - thick[:3]))


CORNERS = ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0))


def test_a_switch_is_held_only_with_each_of_its_terms(monkeypatch: pytest.MonkeyPatch) -> None:
    def worst() -> np.ndarray:
        found = [(place, *one_switch(place)) for place in CORNERS]
        return np.max([outside(bundle, place, *true) for place, bundle, *true in found], axis=0)

    assert max(worst()) < 1e-14
    monkeypatch.setattr(exchanges, "_added", with_terms(rest=True))
    assert worst()[0] > 1e-7
    monkeypatch.undo()
    monkeypatch.setattr(exchanges, "_added", with_terms(error=True))
    assert worst()[1] > 1e-7


@pytest.mark.parametrize(
    ("middle", "spread"),
    [((0.0, 0.0, 0.0), 1e-2), ((-1.0, 1.0, 0.5), 0.0)],
    ids=["first", "second"],
)
def test_a_bundle_of_many_times_is_held_at_one_time(
    middle: tuple[float, ...], spread: float
) -> None:
    """Each of the two terms of second order alone is needed: the other one is far smaller here."""
    with precision(80):
        fields = fields_at(Interval(1e-3, 1e-9))
        field = fields._fields[1]
        columns = np.array([[middle[0], 0.0, spread], [middle[1], 0.0, 0.0], [middle[2], 0.0, 0.0]])
        start = fields.section(thin(columns), arb(0.5))
        late = np.zeros((7, 1))
        late[exchanges.TIME] = 1e-2
        start = np.column_stack([start[:, :3], late, start[:, 3:]])
        total = 0.7
        found = passage.rounded(
            exchanges.shifted(field, *fields._until(field, thin(start), arb(total))[1:])
        )
    for place in CORNERS:
        at = np.array([1.0, 0.0, *place] + [0.0] * (start.shape[1] - 4))
        state = flowed(field, start, at, total - 1e-2 * place[1])
        away = abs(state - found[:6, :4] @ at[:4])[:3]
        assert np.all(away <= np.sum(abs(found[:3, 4:]), axis=1) + 1e-15)
        assert np.max(away) > 1e-7


@pytest.mark.parametrize("count", [40, 70])
def test_doubles_hold_balls_and_columns_that_are_put_together(count: int) -> None:
    rng = np.random.default_rng(1)
    middles, radius = rng.normal(size=(7, count)), 1e-3
    whole = thin(middles) + arb_mat([[ball(0, radius)] * count] * 7)
    found = passage.rounded(whole)
    assert found.shape[1] <= max(count, passage._KEPT + 2) + 7
    assert np.array_equal(found[:, :2], middles[:, :2])
    for _ in range(50):
        direction = rng.normal(size=7)
        reach = np.sum(abs(direction @ middles[:, 1:])) + count * radius * np.sum(abs(direction))
        assert np.sum(abs(direction @ found[:, 1:])) >= reach


def motions_at(alpha: float, radius: float) -> attraction.Motions:
    run = simulate(Parameters(alpha=alpha, gamma=3.3), periods=attraction.PERIODS)
    return attraction.Motions(fields_at(Interval(alpha, radius)), run)


def columns_about(motions: attraction.Motions, section: int, wide: float) -> np.ndarray:
    """A box in x_r and v_r about the run at a section."""
    x, v, _ = motions.run([math.tau / 0.8 * (section + motions.offset)])[0]
    return np.array([[x, 0.0, wide, 0.0], [v, 0.0, 0.0, wide], [0.0, 0.0, 0.0, 0.0]])


def test_sections_are_at_their_phase_and_begin_at_rest() -> None:
    """A narrow bundle is the run in double precision, so that an angle off by 1e-9 would show."""
    alphas = Interval(1.2, 1e-10)
    found, offset = carried(alphas, 1)
    run = simulate(Parameters(alpha=1.2, gamma=3.3), periods=3)
    state = run([math.tau / 0.8 * (1 + offset)])[0]
    assert np.max(abs(state - found[:3, 0])) < 1e-11


def test_guards_are_those_of_all_members() -> None:
    """One direction leads beyond the gap, where F2 is not the field any more."""
    with precision(80):
        motions = motions_at(0.005, 1e-6)
        columns = np.array([[0.0, 0.0, 0.03], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
        with pytest.raises(Unproved, match="the gap"):
            motions.passed(motions.passage.section(thin(columns), motions.angle), 600)


@pytest.mark.parametrize("alpha", [0.7, 1.8])
def test_the_derivative_is_that_of_all_members(alpha: float) -> None:
    wide = 1e-4
    with precision(80):
        motions = motions_at(alpha, wide)
        columns = columns_about(motions, 600, wide)
        columns[2, 0] = motions.run([math.tau / 0.8 * (600 + motions.offset)])[0][2]
        _, by = motions.passed(motions.passage.section(thin(columns), motions.angle), 600)
        for s, u in CORNERS:
            narrow = motions_at(alpha + s * wide, 1e-15)
            narrow.offset, narrow.angle = motions.offset, motions.angle
            narrow.run = motions.run
            member = columns[:, :2] + np.outer(columns[:, 2:] @ [u, s], [1.0, 0.0])
            _, one = narrow.passed(narrow.passage.section(thin(member), narrow.angle), 600)
            size = 2 if alpha < 1 else 3
            assert all(by[i, j].overlaps(one[i, j]) for i in range(size) for j in range(size))


def test_a_bundle_farther_away_than_the_box_is_not_in_it() -> None:
    with precision(80):
        motions = motions_at(0.7, 1e-5)
        wide = thin(columns_about(motions, 600, 1e-1))
        bundle = motions.passage.section(wide, motions.angle)
        with pytest.raises(Unproved):
            motions._entered(bundle, 600, True)


def test_a_turn_that_begins_at_a_switch_is_no_map_of_a_box(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with precision(80):
        motions = motions_at(0.7, 1e-5)
        steps = motions.steps(600)
        other = replace(steps[-1], field=1 if steps[0].field != 1 else 2)
        monkeypatch.setattr(motions, "steps", lambda _: [*steps[:-1], other])
        bundle = motions.passage.section(thin(columns_about(motions, 600, 1e-5)), motions.angle)
        with pytest.raises(Unproved, match="begins at a switch"):
            motions._entered(bundle, 600, True)


def test_sides_that_do_not_span_a_box_are_refused() -> None:
    """Floating point has an inverse of this matrix; its balls know that there may be none."""
    sides = np.ones((2, 2)) + np.diag([2.0**-52, 0.0])
    assert np.all(np.isfinite(np.linalg.inv(sides)))
    with precision(40), pytest.raises(Unproved, match="not seen to span it"):
        attraction.contraction(matrix(3, 3), sides)


def test_a_bundle_has_to_be_in_the_box_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """Half as large as the bundle, the box is still carried into itself."""
    monkeypatch.setattr(attraction, "_ROOM", 0.5)
    with precision(80):
        motions = motions_at(0.7, 1e-9)
        wide = thin(columns_about(motions, 600, 1e-5))
        with pytest.raises(Unproved, match=r"^attraction: 2, then .* is not within it"):
            motions._entered(motions.passage.section(wide, motions.angle), 600, True)


def test_saltations_are_those_of_all_members(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[float] = []
    saltation = passage.saltation

    def spied(field, following, guard, end):
        seen.append(float(end[1, 0].rad()))
        return saltation(field, following, guard, end)

    monkeypatch.setattr(passage, "saltation", spied)
    carried(Interval(1.2, 1e-4), 1)
    assert min(seen) > 1e-6


@pytest.mark.long
def test_a_box_smaller_than_it_has_to_be_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(attraction, "_ROOM", 0.5)
    with pytest.raises(Unproved, match="is not within it"):
        tendency(AT_3_3, Interval(0.7, 1e-4))


@pytest.mark.parametrize(("ratio", "gamma"), [(0, 3.3), (1, 3.0)])
def test_a_part_is_proved_at_its_own_mass_ratio(ratio: int, gamma: float) -> None:
    """Near alpha = 1.636 the itineraries of both mass ratios differ."""
    part = AlphaPart(ratio, 13, 1490)
    orbit = solve_orbit(Parameters(alpha=part.alphas.middle, gamma=gamma))
    fields, _, told = attempt(part).itinerary.partition(", gamma = ")
    assert (sorted(fields.split()), float(told)) == (sorted(orbit.itinerary.names), gamma)


def test_other_constants_are_other_code(monkeypatch: pytest.MonkeyPatch) -> None:
    """The digest has the parameters and what contact and drift are, not only the proof."""
    held = {module.__name__.rpartition(".")[2] for module in regions_digest(monkeypatch)}
    assert {"parts", "case", "attraction", "segments", "guards", "itinerary", "facts"} <= held


def regions_digest(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    told: list[Any] = []
    monkeypatch.setattr(regions, "digest", lambda code: told.extend(code) or "")
    FROM_REST.code()
    return told


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
    monkeypatch.setattr(attraction, "_repeated", lambda *_: [1])
    with pytest.raises(Unproved):
        tendency(AT_3_3, alphas)


def test_a_derivative_that_is_too_large_proves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Were the saltation twice as large, the box would not be seen to shrink."""
    saltation = passage.saltation
    monkeypatch.setattr(passage, "saltation", lambda *given: saltation(*given) * 2)
    with pytest.raises(Unproved, match="attraction"):
        tendency(AT_3_3, Interval(0.7, 1e-5))


@pytest.mark.parametrize("decimal", ["0.7", "0.00737", "1.5513", "0.1", "1.9"])
def test_the_interval_about_a_decimal_holds_it(decimal: str) -> None:
    found = Interval.about(decimal)
    away = abs(Fraction(decimal) - Fraction(found.middle))
    assert 0 < away <= Fraction(found.radius)
    with precision(200):
        assert found.hull.contains(ball(decimal))


def test_halves_cover_their_interval() -> None:
    whole = AlphaPart(0, 0, 0)
    assert whole.alphas.middle - whole.alphas.radius < ALPHA[0]
    assert whole.alphas.middle + whole.alphas.radius > ALPHA[1]
    part = AlphaPart(1, 11, 700)
    high, low = part.halved((0,))
    assert low.area + high.area == part.area
    ends = [
        tuple(Fraction(one.alphas.middle) + side * Fraction(one.alphas.radius) for side in (-1, 1))
        for one in (part, low, high)
    ]
    assert ends[1][0] <= ends[0][0] + Fraction(1, 10**15)
    assert ends[1][1] > ends[2][0]
    assert ends[2][1] >= ends[0][1] - Fraction(1, 10**15)
    assert sum(one.area for one in FROM_REST.first()) == 1
    both = AlphaPart(BOTH, 11, 700)
    assert both.halved((1,)) == [AlphaPart(0, 11, 700), part]
    assert both.area == 2 * part.area
    assert (both.gammas, part.gammas) == (("3.3", "3.0"), ("3.0",))


def test_a_plan_keeps_halvings_and_no_claims(tmp_path: Path) -> None:
    """An earlier file, here of other code, spares attempts; what it proved is proved again."""
    earlier, path = tmp_path / "earlier.jsonl.gz", tmp_path / "from-rest.jsonl"
    header = {"option": "--from-rest", "code": "other"}
    whole = {"part": [BOTH, 9, 332], "seconds": 9.0, "work": 9.0, "along": [1]}
    claim = {"part": [0, 9, 332], "seconds": 9.0, "work": 9.0, "itinerary": "F1, gamma = 3.3"}
    lines = "".join(json.dumps(one) + "\n" for one in (header, whole, claim))
    earlier.write_bytes(gzip.compress(lines.encode()))
    plane = prove(path, 1e-9, workers=1, task=FROM_REST, plan=earlier)
    assert (plane.patches, plane.work, len(plane.open)) == (0, 0.0, len(FROM_REST.first()) + 1)


@pytest.mark.parametrize(
    "lines",
    [
        "[]",
        '{"option": "--region", "code": "other"}',
        '{"option": "--from-rest", "code": "other"}\n'
        '{"part": [0, 11, 0], "seconds": 1.0, "work": 1.0, "along": [1]}',
    ],
)
def test_a_plan_of_something_else_is_refused(tmp_path: Path, lines: str) -> None:
    earlier = tmp_path / "earlier.jsonl"
    earlier.write_text(lines + "\n")
    refused = partial(prove, tmp_path / "other.jsonl", 1e-9, workers=1, task=FROM_REST)
    with pytest.raises(InvalidInput, match="enclose --from-rest"):
        refused(plan=earlier)
    packed = tmp_path / "earlier.jsonl.gz"
    packed.write_bytes(b"not packed")
    with pytest.raises(InvalidInput, match="enclose --from-rest"):
        refused(plan=packed)


@pytest.mark.long
@pytest.mark.parametrize(("alpha", "ratio"), [(0.003, BOTH), (0.1, BOTH), (0.25, 1)])
def test_one_proof_is_for_both_mass_ratios_while_the_capsule_rests(
    alpha: float, ratio: int
) -> None:
    part = AlphaPart(BOTH, 11, int((ALPHA[1] - alpha) / (ALPHA[1] - ALPHA[0]) * 2**11))
    outcome = attempt(part)
    assert outcome.along == ((1,) if ratio != BOTH else ())
    if ratio == BOTH:
        assert outcome.itinerary.endswith("gamma = 3.3 and 3.0")


def test_one_proof_is_for_all_mass_ratios_between(monkeypatch: pytest.MonkeyPatch) -> None:
    """The mass ratio is an interval, and with it the fields in which the capsule slips."""
    seen: list[Any] = []
    monkeypatch.setattr(attraction, "tendency", lambda values, alphas: seen.append(values["gamma"]))
    with pytest.raises(AttributeError):
        attempt(AlphaPart(BOTH, 11, 1950))
    assert all(seen[0].contains(ball(gamma)) for gamma in ("3.3", "3.0", "3.15"))


@pytest.mark.long
@pytest.mark.parametrize("alpha", [0.3, 0.35])
def test_motions_that_slip_for_a_moment_at_some_alpha_are_held(alpha: float) -> None:
    """The first of these slips in periods in which others stick all the time."""
    radius = 2e-5
    found = tendency(AT_3_3, Interval(alpha, radius))
    assert found.itinerary == (2, 5)


def test_work_resumes_and_other_code_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "from-rest.jsonl"
    prove(path, 1e-9, workers=1, task=FROM_REST)
    first = len(FROM_REST.first())
    part = AlphaPart(0, 10, 665)  # about 0.7
    outcome = attempt(part)
    assert outcome.itinerary == "F1 F2 F5 F4, gamma = 3.3"
    line = {"part": list(part), "seconds": 1.0, "work": 0.5, "itinerary": outcome.itinerary}
    whole = {"part": [BOTH, 9, 332], "seconds": 1.0, "work": 0.1, "along": [1]}
    halved = {"part": [0, 9, 332], "seconds": 1.0, "work": 0.1, "along": [0]}
    with path.open("a") as file:
        file.writelines(json.dumps(one) + "\n" for one in (whole, halved, line))
    plane = begun(path, FROM_REST)
    assert (plane.patches, plane.share, len(plane.open)) == (1, 2.0**-11, first + 1)
    with pytest.raises(InvalidInput, match="enclose --region"):
        begun(path)


def test_guards_are_proved_between_the_switches_of_each_motion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """States at the start, and durations, are those of runs at both ends of the interval."""
    alphas = Interval(1.2, 1e-3)
    seen: list[Any] = []
    watch = passage.QuickWatch.segment

    def spied(self, field, start, end, h, *further):
        seen.append((field.index, floats(start), start, h))
        watch(self, field, start, end, h, *further)

    monkeypatch.setattr(passage.QuickWatch, "segment", spied)
    carried(alphas, 0)
    for s in (-1.0, 1.0):
        parameters = Parameters(alpha=alphas.middle + s * alphas.radius, gamma=3.3)
        made = simulate(parameters, periods=3).segments
        assert [one.field for one in made[:3]] == [index for index, *_ in seen[:3]]
        for (_, near, form, h), one in zip(seen[1:3], made[1:3], strict=True):
            thick = np.array([float(row[2].abs_upper()) for row in form.tolist()])
            away = abs(np.array(one.start_state) - near[:3, 0] - s * near[:3, 1])
            assert np.all(away <= thick[:3] + 1e-12)
            assert (h + ball(0, 1e-12)).contains(arb(float(one.duration)))
            assert float(h.rad()) > 1e-5
