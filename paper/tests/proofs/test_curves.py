"""Patches through which a bifurcation curve passes: both sides, gluing, each condition alone."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count, product
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from capsule_sym import Parameters, solve_orbit
from capsule_sym._enclosures.numbers.balls import Unproved, arb, ball, floats, matrix, precision
from capsule_sym._enclosures.numbers.fields import Field
from capsule_sym._enclosures.orbits.events import beyond
from capsule_sym._enclosures.orbits.krawczyk import Tube, newton
from capsule_sym._enclosures.passage.guards import Signs
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym.orbits import solve_itinerary
from paper.proofs import curve_patches, curve_sides, patch_orbits, patches
from paper.proofs.case import ALPHA, GAMMA
from paper.proofs.curve_sides import WithoutSegment, WithSegment
from paper.proofs.forms import MONOMIALS, hull, polynomial
from paper.proofs.parts import Patch
from tests.enclosures.case import precise

pytestmark = pytest.mark.long

REST = (0.0, 0.0, 0.0)
STUCK, SLIPPED, LOOSE = "F5 F4 F1 F2", "F5 F4 F1 F2 F3 F2", "F5 F4 F5 F2"
ENDS_STUCK, ENDS_LOOSE = "F5 F4 F1 F3 F6", "F4 F1 F3 F6"
TOUCH = 0.9409980034460778, f"{STUCK} | {SLIPPED}"
CORNER = 0.5245932427623313, f"{LOOSE} | {STUCK}"
LANDING = 1.5886210774813494, f"{ENDS_STUCK} | {ENDS_LOOSE}"
"""Bifurcations at gamma = 3.3, in double precision, and the itineraries on both sides."""
CURVES = TOUCH, CORNER, LANDING

bits = precise(64)


class Curve(NamedTuple):
    """Patch on a curve: its motions with the longer itinerary first, and the orbit between."""

    patch: Patch
    near: list[Any]
    far: list[Any]
    event: Tube
    segment: int

    @property
    def guesses(self) -> list[Any]:
        return [*self.near, *self.far]

    def with_segment(self) -> WithSegment:
        return curve_patches._with_segment(self.event, self.segment, self.near, self.patch.radii[1])

    def without(self) -> WithoutSegment:
        radii = 1.5 * self.patch.radii[0], self.patch.radii[1]
        other = beyond(self.event, self.segment)
        return WithoutSegment(self.event, self.segment, other, self.patch.middle[0], radii)


def patch_at(alpha: float, gamma: float, levels: tuple[int, int]) -> Patch:
    places = (
        int((x - ends[0]) / (ends[1] - ends[0]) * 2**level)
        for x, ends, level in zip((alpha, gamma), (ALPHA, GAMMA), levels, strict=True)
    )
    return Patch(levels[0], next(places), levels[1], next(places))


def curve_of(alpha: float, levels: tuple[int, int] = (10, 8)) -> Curve:
    patch = patch_at(alpha, 3.3, levels)
    guesses = [patches._guess(one) for one in patches._corners(patch, REST).values()]
    longest = max(len(one.itinerary) for one in guesses)
    near = [one for one in guesses if one.itinerary.cyclic == guesses[0].itinerary.cyclic]
    far = [one for one in guesses if one not in near]
    if len(far[0].itinerary) == longest > len(near[0].itinerary):
        near, far = far, near
    event, segment = curve_patches._event(patch, near, far[0].itinerary.cyclic)
    return Curve(patch, near, far, event, segment)


@pytest.fixture(scope="module")
def touch() -> Curve:
    with precision(64):
        return curve_of(TOUCH[0])


@pytest.fixture(scope="module")
def large_touch() -> Curve:
    with precision(64):
        return curve_of(TOUCH[0], (9, 6))


@pytest.fixture(scope="module")
def corner() -> Curve:
    with precision(64):
        return curve_of(CORNER[0])


@pytest.fixture(scope="module")
def landing() -> Curve:
    with precision(64):
        return curve_of(LANDING[0])


def refused(*_: object, **__: object) -> None:
    raise Unproved("told", "so")


def nth(function: Callable[..., Any], number: int, answer: Any) -> Callable[..., Any]:
    """A function with another answer at one call."""
    calls = count()
    return lambda *given: answer if next(calls) == number else function(*given)


# Both sides


@pytest.mark.parametrize(("alpha", "sides"), CURVES)
def test_a_patch_on_a_curve_has_an_orbit_on_each_side(alpha: float, sides: str) -> None:
    patch = patch_at(alpha, 3.3, (10, 8))
    assert patches.attempt(patch, REST).itinerary == sides
    (middle, gamma), (wide, high) = patch.middle, patch.radii
    seen = []
    for side, up in product((-1, 1), repeat=2):
        orbit = solve_orbit(Parameters(alpha=middle + side * wide, gamma=gamma + up * high))
        assert orbit.success, orbit.message
        seen.append(str(orbit.itinerary))
    assert " | ".join((seen[0], seen[-1])) == sides
    assert {*seen} == {*sides.split(" | ")}


def shortened(group: list[Any], itinerary: Any, segment: int) -> list[Any]:
    """Motions with half of the duration of a segment: orbits up to it do not reach as far."""
    found = []
    for one in group:
        columns, n = list(one.columns), len(itinerary)
        shift = next(k for k in range(n) if itinerary.rotated(k).fields == one.itinerary.fields)
        columns[one.shooting.durations[(segment - shift) % n]] /= 2
        found.append(one._replace(columns=columns))
    return found


@pytest.mark.parametrize("name", ["touch", "corner", "landing"])
def test_a_patch_that_orbits_do_not_reach_is_not_proved(
    name: str, request: pytest.FixtureRequest
) -> None:
    curve = request.getfixturevalue(name)
    near = shortened(curve.near, curve.event.shooting.itinerary, curve.segment)
    with pytest.raises(Unproved, match="coverage"):
        curve_patches.prove_curve(curve.patch, [*near, *curve.far])


def test_at_a_corner_both_sides_reach_beyond_the_patch(corner: Curve) -> None:
    other, _, _ = beyond(corner.event, corner.segment)
    far = shortened(corner.far, other.itinerary, corner.segment)
    with pytest.raises(Unproved, match="coverage"):
        curve_patches.prove_curve(corner.patch, [*corner.near, *far])


@pytest.mark.parametrize("call", range(2))
@pytest.mark.parametrize("name", ["touch", "corner", "landing"])
@pytest.mark.parametrize("condition", ["stable", "admissible"])
def test_orbits_of_both_sides_are_stable_and_admissible(
    name: str,
    call: int,
    condition: str,
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    curve, calls = request.getfixturevalue(name), count()

    def fails(*_: object) -> None:
        if next(calls) >= call:
            raise Unproved("told", "so")

    monkeypatch.setattr(patch_orbits.PatchOrbits, "admissible", lambda *_: None)
    if condition == "stable":
        monkeypatch.setattr(curve_sides, "prove_stable", fails)
    else:
        monkeypatch.setattr(patch_orbits.PatchOrbits, "admissible", fails)
    with pytest.raises(Unproved, match="told: so"):
        curve_patches.prove_curve(curve.patch, curve.guesses)


HOLDS = {"touch": 6, "corner": 2, "landing": 2}
"""Number of gluings; at a touch the ends of the orbits with the segment are glued too."""


@pytest.mark.parametrize(
    ("name", "number"), [(name, k) for name, calls in HOLDS.items() for k in range(calls)]
)
def test_both_sides_are_glued_on_the_curve(
    name: str, number: int, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    curve = request.getfixturevalue(name)
    monkeypatch.setattr(patch_orbits.PatchOrbits, "admissible", lambda *_: None)
    monkeypatch.setattr(curve_sides._Side, "holds", nth(curve_sides._Side.holds, number, False))
    with pytest.raises(Unproved, match="gluing"):
        curve_patches.prove_curve(curve.patch, curve.guesses)


@pytest.mark.parametrize(("name", "calls"), HOLDS.items())
def test_each_gluing_is_checked_once(
    name: str, calls: int, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    curve, seen, held = request.getfixturevalue(name), count(), curve_sides._Side.holds
    monkeypatch.setattr(patch_orbits.PatchOrbits, "admissible", lambda *_: None)
    monkeypatch.setattr(curve_sides._Side, "holds", lambda *a: (next(seen), held(*a))[1])
    curve_patches.prove_curve(curve.patch, curve.guesses)
    assert next(seen) == calls


def test_a_corner_is_the_same_in_both_orders(
    corner: Curve, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Tube, "holds", lambda *_: False)
    with pytest.raises(Unproved, match="the same orbit on the curve"):
        curve_patches.prove_curve(corner.patch, corner.guesses)


# Orbits with a segment from 0 on


def single_orbits(curve: Curve, shares: tuple[float, ...]) -> list[tuple[Any, float]]:
    """Orbits with the segment in double precision, and gammas: on the patch, alpha from the far."""
    shooting, found = curve.event.shooting, []
    one = max(curve.near, key=lambda one: one.duration(shooting.itinerary, curve.segment))
    start = solve_orbit(
        Parameters(**{n: float(one.columns[one.shooting.parameter(n)]) for n in ("alpha", "gamma")})
    )
    assert start.success, start.message
    at = float(curve.event.hull()[shooting.parameter("alpha")])
    for share, up in product(shares, (-1, 1)):
        values = list(start.values)
        alpha = values[0] + share * (at - values[0])
        values[0], gamma = alpha, curve.patch.middle[1] + up * 0.05 * curve.patch.radii[1]
        values[PARAMETERS.index("gamma")] = gamma
        orbit = solve_itinerary(values, start.itinerary, list(start.z))
        assert orbit.success, orbit.message
        found.append((orbit, gamma))
    return found


def durations(curve: Curve, orbit: Any) -> np.ndarray:
    """Durations of an orbit, beginning with the segment that the curve's orbit begins with."""
    itinerary, n = curve.event.shooting.itinerary, len(orbit.itinerary)
    shift = next(k for k in range(n) if orbit.itinerary.rotated(k).fields == itinerary.fields)
    return np.roll(np.array(orbit.durations, dtype=float), -shift)


@pytest.mark.parametrize("name", ["touch", "large_touch", "corner", "landing"])
def test_alpha_is_that_of_single_orbits(name: str, request: pytest.FixtureRequest) -> None:
    """And so are its derivative and those of all durations, from differences."""
    curve = request.getfixturevalue(name)
    side = curve.with_segment()
    found = side.enclose()
    column = side.shooting.parameter("alpha")
    form, rates = side.columns(side.unique.tolist())[column], side.rates(found)
    reach, high = side.radii
    for orbit, gamma in single_orbits(curve, (0.0, 0.5, 0.9)):
        s = durations(curve, orbit)[curve.segment] / reach - 1
        t = (gamma - curve.patch.middle[1]) / high
        assert abs(s) <= 1
        true = sum((c * s**a * t**b for c, (a, b) in zip(form.p, MONOMIALS, strict=True)), form.e)
        assert (true + ball(0, 1e-12)).contains(arb(orbit.values[0]))
        step, moved = 1e-7, []
        for change in (-step, step):
            values = [orbit.values[0] + change, *orbit.values[1:]]
            beside = solve_itinerary(values, orbit.itinerary, list(orbit.z))
            assert beside.success, beside.message
            moved.append(durations(curve, beside))
        gained = moved[1] - moved[0]
        for at, gain in [(column, 2 * step), *zip(side.shooting.durations, gained, strict=True)]:
            slope = gain / gained[curve.segment]
            assert (rates[at, 0] + ball(0, 1e-4)).contains(arb(slope)), (at, slope, rates[at, 0])


@pytest.mark.parametrize("name", ["touch", "large_touch", "corner", "landing"])
def test_derivatives_of_columns_are_held_at_the_corners(
    name: str, request: pytest.FixtureRequest
) -> None:
    """Against the equations at a point, in which all roots are divided out."""
    curve = request.getfixturevalue(name)
    side, shooting = curve.with_segment(), curve.event.shooting
    rates = side.rates(side.enclose())
    (first, second), (reach, high) = side.axes, side.radii
    for s, t in product((-1, 1), repeat=2):
        guess = list(side.centre)
        guess[first], guess[second] = arb(reach) * (1 + s), guess[second] + t * ball(high)
        _, there, inverse = newton(shooting, guess, side.solved)
        slopes = -inverse @ floats(there.by)[:, first]
        for at, slope in zip(side.solved, slopes, strict=True):
            assert (rates[at, 0] + ball(0, 1e-9)).contains(arb(slope))


@pytest.mark.parametrize(("name", "alpha"), [("touch", TOUCH[0]), ("corner", CORNER[0])])
def test_the_ends_of_the_orbits_with_a_segment(
    name: str, alpha: float, request: pytest.FixtureRequest
) -> None:
    """Alpha on the curve of Section 4, and beyond the motions at the corners."""
    curve = request.getfixturevalue(name)
    low, high = curve.with_segment().prove_side()
    assert (low + ball(0, 1e-12)).contains(arb(alpha))
    assert float(low.rad()) < 1e-4
    for one in curve.near:
        at = one.columns[one.shooting.parameter("alpha")]
        assert (high - at) * (at - low) > 0


def test_every_condition_of_a_patch_that_holds_an_orbit(touch: Curve) -> None:
    side = touch.with_segment()
    side.enclose()
    columns = touch.event.hull()
    assert side.holds(columns)
    first, second = side.axes
    for at, radius in zip(side.solved, side.unique, strict=True):
        moved = list(columns)
        moved[at] = columns[at] + 2.01 * radius
        assert not side.holds(moved)
    side.unique = np.full(len(side.unique), 1e9)
    for at, change in ((first, -1e-9), (second, 1.01 * side.radii[1])):
        moved = list(columns)
        moved[at] = columns[at] + change
        assert not side.holds(moved)
    level = WithSegment(touch.event, touch.segment, 0.0, side.radii[1], arb(0))
    level.enclose()
    assert level.holds(columns)
    level.unique = side.unique
    columns[first] = arb(1e-12)
    assert not level.holds(columns)


@pytest.mark.parametrize("name", ["touch", "corner", "landing"])
def test_the_short_segment_is_watched_up_to_its_longest_duration(
    name: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    side, seen = request.getfixturevalue(name).with_segment(), {}
    found = side.enclose()
    side._found, side._rates = found, side.rates(found)
    monkeypatch.setattr(Signs, "segment", lambda self, *given: seen.update({given[5]: given[3]}))
    side.admissible(found)
    assert len(seen) == len(found.nodes)
    (longest,) = (h for text, h in seen.items() if text.startswith(f"segment {side.segment + 1},"))
    assert longest >= 2 * side.radii[0]


@pytest.mark.parametrize("name", ["touch", "corner"])
@pytest.mark.parametrize("way", ["pieces", "rising", "_grows"])
def test_guards_that_vanish_on_the_curve_are_proved_beside_it(
    name: str, way: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    side = request.getfixturevalue(name).with_segment()
    monkeypatch.setattr(Signs, "segment", lambda *_: None)
    side.prove_side()
    if way == "_grows":
        monkeypatch.setattr(WithSegment, way, refused)
    else:
        monkeypatch.setattr(Signs, way, lambda *_: False)
    with pytest.raises(Unproved, match="told" if way == "_grows" else "not proved positive along"):
        side.prove_side()


def test_what_is_left_apart_is_watched_from_both_ends(
    touch: Curve, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each end has half of the segment."""
    side, reaches = touch.with_segment(), []
    found = side.enclose()
    side._found, side._rates = found, side.rates(found)
    monkeypatch.setattr(Signs, "segment", lambda *_: None)
    for way in ("pieces", "rising"):
        monkeypatch.setattr(
            Signs, way, lambda self, field, sense, *given: bool(reaches.append((sense, given)) or 1)
        )
    side.admissible(found)
    # The force margin before the slip and after it, forwards and backwards.
    assert [sense for sense, _ in reaches] == [1, -1, 1, -1]
    n, short = len(found.durations), touch.segment
    for k, at in ((0, (short - 1) % n), (2, (short + 1) % n)):
        longest = hull(found.durations[at]).upper()
        assert sum(arb(given[-1 - (len(given) == 5)]) for _, given in reaches[k : k + 2]) > longest


def test_signs_of_derivatives_that_vanish_on_the_curve(touch: Curve) -> None:
    """Of any motion of the columns, against matrices in double precision."""
    side, n = touch.with_segment(), len(touch.event.shooting.itinerary)
    found = side.enclose()
    side._found = found
    rng = np.random.default_rng(4)
    for i, last in (((touch.segment - 1) % n, 1), ((touch.segment + 1) % n, 0)):
        field, node = found.fields[i].whole, found.nodes[(i + last) % n]
        by = floats(hull(node.own)) @ floats(node.columns)
        for reached, guard in product((1, 2), range(3)):
            row = floats(field.guards)[guard]
            for _ in range(reached - 1):
                row = row @ floats(field.A) * (-1 if last else 1)
            for _ in range(20):
                rates = rng.uniform(-1, 1, by.shape[1])
                change = row @ by @ rates
                side._rates = matrix(len(rates), 1, ((k, 0, x) for k, x in enumerate(rates)))
                if abs(change) < 0.1 * np.abs(row @ by).sum():
                    continue
                if change > 0:
                    side._grows(i, last, guard, reached - 1, reached)
                else:
                    with pytest.raises(Unproved, match="not seen to grow"):
                        side._grows(i, last, guard, reached - 1, reached)


def test_two_derivatives_vanish_after_a_slip_only(touch: Curve) -> None:
    side, n = touch.with_segment(), len(touch.event.shooting.itinerary)
    before, after = (touch.segment - 1) % n, (touch.segment + 1) % n
    for i, last, order, reached in [
        (before, 1, 0, 2),
        (before, 0, 0, 2),
        (after, 1, 0, 2),
        (after, 0, 1, 3),
        (after, 0, 0, 3),
    ]:
        with pytest.raises(Unproved, match="several derivatives vanish"):
            side._grows(i, last, 1, order, reached)


# Orbits without it


@pytest.mark.parametrize(("name", "side"), [("touch", -1), ("landing", 1)])
def test_a_guard_is_positive_on_one_side_of_the_curve(
    name: str, side: int, request: pytest.FixtureRequest
) -> None:
    curve = request.getfixturevalue(name)
    orbits, at = curve.without(), curve.event.hull()[curve.event.shooting.parameter("alpha")]
    orbits.prove_side(at, at, side)
    with pytest.raises(Unproved, match="not proved positive along"):
        orbits.prove_side(at, at, -side)
    outside = ball(curve.patch.middle[0]) + 1.01 * ball(orbits.radii[0])
    with pytest.raises(Unproved, match="gluing"):
        orbits.prove_side(outside, at, side)
    with pytest.raises(Unproved, match="coverage"):
        orbits.prove_side(at, outside, side)


@pytest.mark.parametrize(("name", "side", "pieces"), [("touch", -1, 3), ("landing", 1, 3)])
def test_the_guard_that_fails_is_proved_along_its_segment(
    name: str,
    side: int,
    pieces: int,
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    curve = request.getfixturevalue(name)
    orbits, at = curve.without(), curve.event.hull()[curve.event.shooting.parameter("alpha")]
    monkeypatch.setattr(Signs, "segment", lambda *_: None)
    monkeypatch.setattr(curve_sides, "_WINDOWS", (0.1,))
    seen: list[Any] = []
    monkeypatch.setattr(Signs, "pieces", lambda *given: bool(seen.append(given[1:]) or True))
    orbits.prove_side(at, at, side)
    assert len(seen) == pieces
    (_, *_, low, _), (_, _, _, order, slopes, wide, _), (*_, rest, _) = seen
    assert [given[1] for given in seen] == [1, 1, -1]
    assert low + wide + rest > hull(orbits.enclose().durations[orbits._fails[0]]).upper()
    assert (low > 0) == (name == "touch")
    assert order == (0 if low else 1)
    assert wide == pytest.approx(0.2 if low else 0.1)
    assert slopes.ncols() == 1

    def refuses(number: int) -> Callable[..., bool]:
        kind = ((1, False), (1, True), (-1, False))[number]
        return lambda *given: (given[2], given[5].ncols() == 1) != kind

    for number in range(pieces):
        monkeypatch.setattr(Signs, "pieces", refuses(number))
        with pytest.raises(Unproved, match="not proved positive along"):
            orbits.prove_side(at, at, side)
    monkeypatch.setattr(curve_sides, "_WINDOWS", (5.0,))
    monkeypatch.setattr(Signs, "pieces", lambda *_: True)
    with pytest.raises(Unproved, match="not proved positive along"):
        orbits.prove_side(at, at, side)


@pytest.mark.parametrize(("name", "side"), [("touch", -1), ("landing", 1)])
def test_all_other_guards_are_watched(
    name: str, side: int, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    curve = request.getfixturevalue(name)
    orbits, at = curve.without(), curve.event.hull()[curve.event.shooting.parameter("alpha")]
    seen: list[Any] = []
    monkeypatch.setattr(Signs, "segment", lambda self, *given: seen.append(given))
    monkeypatch.setattr(Signs, "pieces", lambda *_: True)
    orbits.prove_side(at, at, side)
    failing, guard = orbits._fails
    apart = [given[6] for given in seen]
    assert apart == [(guard,) if k == failing else () for k in range(len(apart))]
    assert len(apart) == len(orbits.shooting.itinerary)


@pytest.mark.parametrize(("name", "side"), [("touch", -1), ("landing", 1)])
def test_slopes_of_a_guard_are_those_of_single_orbits(
    name: str, side: int, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """States where the guard fails first, at two alphas of the same itinerary."""
    curve = request.getfixturevalue(name)
    orbits, at = curve.without(), curve.event.hull()[curve.event.shooting.parameter("alpha")]
    monkeypatch.setattr(WithoutSegment, "admissible", lambda *_: None)
    orbits.prove_side(at, at, side)
    corner = curve.far[0].columns[-2:]
    orbit = solve_orbit(Parameters(alpha=float(corner[0]), gamma=float(corner[1])))
    assert orbit.success, orbit.message
    itinerary, n = orbits.shooting.itinerary, len(orbit.itinerary)
    shift = next(k for k in range(n) if orbit.itinerary.rotated(k).fields == itinerary.fields)
    starts = []
    for change in (-1e-6, 1e-6):
        values = [orbit.values[0] + change, *orbit.values[1:]]
        moved = solve_itinerary(values, orbit.itinerary, list(orbit.z))
        assert moved.success, moved.message
        starts.append(moved.system.flows[(orbits._fails[0] + shift) % n].start[:3])
    for row, slope in enumerate((starts[1] - starts[0]) / 2e-6):
        assert (orbits._slopes[row, 0] * side + ball(0, 1e-6)).contains(arb(float(slope)))


def test_guards_that_fail_are_found(touch: Curve, landing: Curve) -> None:
    """The force before a slip from the middle of stick, and the drift after a slip has turned."""
    for curve, field, guard in ((touch, 2, 2), (landing, 4, 1)):
        orbits = curve.without()
        assert orbits.shooting.itinerary.fields[orbits._fails[0]] == field
        assert orbits._fails[1] == guard


def test_a_divided_flow_is_that_of_single_fields(touch: Curve) -> None:
    side = touch.with_segment()
    h = polynomial([0.25, 0.25, 0.0])
    row = matrix(1, 6, [(0, 2, 1)])
    for index, zeros in product((3, 4), (1, 2)):
        flow = patch_orbits._Flow(index, side.given, side.gamma)
        found = flow.divided(row, zeros, h)
        for s, t in product((-0.9, 0.2, 1.0), (-1.0, 1.0)):
            exact = Field(index, side.given | {"gamma": side.gamma.c + t * side.radii[1]})
            true = exact.divided(row, zeros, arb(0.25) * (1 + s))
            for one, single in zip(found, true, strict=True):
                for k in range(6):
                    entry = one[0, k]
                    terms = zip(entry.p, MONOMIALS, strict=True)
                    there = sum((c * s**a * t**b for c, (a, b) in terms), entry.e)
                    assert there.overlaps(single[0, k])
                    assert float(there.rad()) < 1e-2


def test_itineraries_that_differ_in_more_than_a_segment_have_no_curve() -> None:
    other = SimpleNamespace(itinerary=curve_of(LANDING[0]).far[0].itinerary)
    curve = curve_of(TOUCH[0])
    with pytest.raises(Unproved, match="do not differ in one segment"):
        curve_patches._event(curve.patch, curve.near, other.itinerary.cyclic)
