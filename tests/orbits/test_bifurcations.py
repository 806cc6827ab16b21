"""Bifurcations: 50 digits confirm them, theory names them, and itinerary changes are undone."""

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._map.backend import backend
from capsule_sym._orbits.continuation import bifurcations, conditions, kinds
from capsule_sym._orbits.continuation.bifurcations import refined
from capsule_sym._orbits.continuation.conditions import ExtendedSystem
from capsule_sym._orbits.continuation.kinds import (
    CORNER,
    FOLD,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    place,
)
from capsule_sym._orbits.shooting.admissibility import DURATION, inequalities
from capsule_sym._orbits.shooting.changes import insert_segment, remove_segment, swap_segment
from capsule_sym._orbits.shooting.equations import PARAMETERS, shooting
from capsule_sym._orbits.shooting.itinerary import contact, drift
from capsule_sym._symbolic.model.symbols import PARAMETERS as SYMBOLS
from capsule_sym._symbolic.model.symbols import STATE
from capsule_sym.inputs import ParameterPath
from capsule_sym.orbits import monodromy_matrix, solve_itinerary
from capsule_sym.results import Itinerary
from paper.derived.parts import PARTS
from tests.orbits.branches import hysteretic, settled, upwards

EVERY = [(gamma, index) for gamma in (3.3, 3.0) for index in range(8)]
# Fifty digits take their time, and the second gamma shows little that is new.
FEW = [pytest.param(*one, marks=() if one == (3.3, 1) else pytest.mark.long) for one in EVERY]
HALF = [pytest.param(*one, marks=() if one[0] == 3.3 else pytest.mark.long) for one in EVERY]


@pytest.mark.parametrize(("gamma", "index"), FEW)
def test_fifty_digits_give_the_value_within_its_uncertainty(gamma: float, index: int) -> None:
    one = upwards(gamma).bifurcations[index]
    exact = refined(one)
    assert exact.uncertainties[0] < 1e-50
    assert abs(exact.orbit.values[0] - one.value) <= one.uncertainty


@pytest.mark.long
@pytest.mark.parametrize(("gamma", "index"), EVERY)
def test_fifty_digits_confirm_the_value_to_twenty(gamma: float, index: int) -> None:
    # An orbit of an itinerary without the segment, or with the other one, exists on both sides. All
    # its inequalities hold 1e-20 on one side, and one fails 1e-20 on the other.
    one = upwards(gamma).bifurcations[index]
    exact = refined(one).orbit
    with backend("mpmath") as numbers:
        other = swap_segment(exact.itinerary, exact.z, one.segment)
        if other is None:
            other, _ = remove_segment(numbers, exact.itinerary, exact.z, exact.system, one.segment)
        ahead = 1 if _same(other.itinerary, one.itinerary_after) else -1
        for side in (-1, 1):
            values = list(exact.values)
            values[0] += side * numbers.number(10) ** -20
            orbit = solve_itinerary(values, other.itinerary, list(other.z), backend="mpmath")
            assert orbit.success, orbit.message
            least = min(i.value for i in inequalities(numbers, orbit.itinerary, orbit.system))
            assert (least > 0) == (side == ahead)


def _same(itinerary: Itinerary, other: Itinerary) -> bool:
    return itinerary.rotated(itinerary.first) == other.rotated(other.first)


@pytest.mark.long
@pytest.mark.parametrize(("gamma", "index"), HALF)
def test_what_theory_says_of_the_place(gamma: float, index: int) -> None:
    one = upwards(gamma).bifurcations[index]
    x_r, v_r, v_c = (float(v) for v in one.orbit.system.flows[one.segment].start)
    parameters = one.orbit.parameters
    line = one.line.split("^")[0]
    force3 = x_r + 2 * parameters.zeta * v_r
    force4 = force3 + parameters.beta * (x_r - parameters.delta)
    if line == "L9":
        assert (x_r, v_r) == pytest.approx((parameters.delta, 0), abs=1e-12)
        return
    assert v_c == pytest.approx(0, abs=1e-12)
    if one.type == CORNER:
        assert x_r == pytest.approx(parameters.delta, abs=1e-12)
        assert abs(force3) < parameters.f_b
        assert line == ("L6" if v_r > 0 else "L7")
        return
    edge = {"L1": 1, "L2": -1, "L3": 1, "L4": -1}[line] * parameters.f_b
    assert (force3 if line in ("L1", "L2") else force4) == pytest.approx(edge, abs=1e-12)
    part = next(part for part in PARTS if part.name == one.line)
    numbers = dict(zip(STATE, (x_r, v_r, v_c), strict=True))
    numbers |= dict(zip(SYMBOLS, parameters.to_dict().values(), strict=True))
    assert all(bool(relation.subs(numbers)) for relation in part.within)
    kinds = bifurcations_of(part)
    assert one.type.split("-")[0] in kinds


def bifurcations_of(part) -> frozenset[str]:
    from paper.derived.parts import bifurcations

    return bifurcations(part)


@pytest.mark.parametrize(("gamma", "index"), HALF)
def test_a_leg_that_comes_in_can_be_taken_out(gamma: float, index: int) -> None:
    one = upwards(gamma).bifurcations[index]
    with backend("numpy") as numbers:
        itinerary, z, system = one.orbit.itinerary, one.orbit.z, one.orbit.system
        other = swap_segment(itinerary, z, one.segment)
        if other is not None:
            assert swap_segment(other.itinerary, z, one.segment).itinerary == itinerary
            again = shooting(numbers, one.orbit.values, other.itinerary, z)
            assert max(abs(again.residual)) < 1e-12
            return
        shorter, inequality = remove_segment(numbers, itinerary, z, system, one.segment)
        short = shooting(numbers, one.orbit.values, shorter.itinerary, shorter.z)
        assert max(abs(short.residual)) < 1e-12
        found = inequalities(numbers, shorter.itinerary, short)
        kind, guard = inequality.kind, inequality.guard
        assert min(abs(i.value) for i in found if (i.kind, i.guard) == (kind, guard)) < 1e-12
        longer, _ = insert_segment(numbers, shorter.itinerary, shorter.z, short, inequality)
        assert _same(longer.itinerary, itinerary)


def test_legs_keep_their_places_through_a_change() -> None:
    orbit = settled(alpha=1.5)  # F5 F4 F1 F2 F3 F6
    itinerary = orbit.itinerary
    with backend("numpy") as numbers:
        for segment in range(len(itinerary)):
            try:
                change, _ = remove_segment(numbers, itinerary, orbit.z, orbit.system, segment)
            except ValueError:
                continue
            assert change.kept[segment] is None
            for before, after in enumerate(change.kept):
                if after is not None:
                    assert change.itinerary.fields[after] == itinerary.fields[before]
                    assert change.z[4 + after] == orbit.z[4 + before]


def test_events_that_are_none_have_no_name() -> None:
    orbit = settled(alpha=1.5)
    itinerary = orbit.itinerary
    # F4 between F5 and F1 changes contact and drift, F2 between F1 and F3 reverses.
    assert place(orbit, 3).type == kinds.CROSSING
    for segment in range(len(itinerary)):
        before, during, after = (
            itinerary.fields[segment - 1],
            itinerary.fields[segment],
            itinerary.fields[(segment + 1) % 6],
        )
        if contact(before) == contact(after) != contact(during) and drift(before) != drift(after):
            assert place(orbit, segment) == kinds.HIGHER


def test_newton_that_finds_nothing_says_so() -> None:
    orbit = settled(alpha=1.5)
    with backend("numpy") as numbers:
        # F4 lasts for two units of time: no alpha makes it vanish.
        free = (ParameterPath("alpha"),)
        system = ExtendedSystem(numbers, orbit.values, free, orbit.itinerary, (1,))
        assert system.solve(orbit.z) is None
    one = upwards(3.3).bifurcations[0]
    with pytest.raises(ValueError, match="no segment"):
        refined(
            hysteretic().bifurcations[[b.segment for b in hysteretic().bifurcations].index(None)]
        )
    assert one.failed == "minimum of gap in segment 1, F2"
    assert DURATION in upwards(3.3).bifurcations[2].failed


@pytest.mark.parametrize("seed", range(5))
def test_the_test_functions_vanish_with_the_multipliers(monkeypatch, seed: int) -> None:
    random = np.random.default_rng(seed)
    base = random.normal(size=(3, 3))

    def at(values: list[complex]) -> dict[str, float]:
        a, b, c = values
        if isinstance(a, complex):
            block = np.array([[a.real, a.imag, 0], [-a.imag, a.real, 0], [0, 0, c.real]])
        else:
            block = np.diag([a, b, c])
        matrix = base @ block @ np.linalg.inv(base)
        monkeypatch.setattr(conditions, "monodromy_matrix", lambda orbit: matrix)
        return conditions.evaluate_test_functions(None)

    assert at([1.0, 0.3, -0.4])[FOLD] == pytest.approx(0, abs=1e-12)
    assert at([-1.0, 0.3, 0.5])[PERIOD_DOUBLING] == pytest.approx(0, abs=1e-12)
    pair = complex(np.cos(seed + 1), np.sin(seed + 1))
    assert at([pair, pair.conjugate(), 0.4 + 0j])[NEIMARK_SACKER] == pytest.approx(0, abs=1e-12)
    for name, values in ((FOLD, (0.9, 1.1)), (PERIOD_DOUBLING, (-0.9, -1.1))):
        signs = [np.sign(at([value, 0.3, 0.2])[name]) for value in values]
        assert signs[0] == -signs[1]
    signs = [
        np.sign(at([r * pair, r * pair.conjugate(), 0.1 + 0j])[NEIMARK_SACKER]) for r in (0.9, 1.1)
    ]
    assert signs[0] == -signs[1]


def test_smooth_bifurcations_have_their_multiplier() -> None:
    found = [one for one in hysteretic().bifurcations if one.segment is None]
    assert [one.type for one in found].count(FOLD) == 2
    assert [one.type for one in found].count(PERIOD_DOUBLING) == 2
    for one in found:
        expected = 1 if one.type == FOLD else -1
        values = bifurcations.sorted_multipliers(one.orbit)
        assert min(abs(value - expected) for value in values) < 1e-9
        column = PARAMETERS.index("omega")
        assert one.orbit.values[column] == one.value
        sides = [abs(max(m, key=abs)) - 1 for m in (one.multipliers_before, one.multipliers_after)]
        assert sides[0] * sides[1] < 0


@pytest.mark.long
def test_the_uncertainty_of_a_smooth_bifurcation_covers_its_error() -> None:
    # Fifty digits: the root of det(M - mu I) by the secant method along the parameter.
    one = next(o for o in hysteretic().bifurcations if o.type == PERIOD_DOUBLING)
    column = PARAMETERS.index("omega")
    with backend("mpmath") as numbers:

        def test(value):
            values = [numbers.number(v) for v in one.orbit.values]
            values[column] = value
            orbit = solve_itinerary(
                values, one.orbit.itinerary, list(one.orbit.z), backend="mpmath"
            )
            m = monodromy_matrix(orbit) + np.eye(3, dtype=int)
            return (
                m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
                - m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
                + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
            )

        a, b = numbers.number(one.value), numbers.number(one.value) + numbers.number(10) ** -9
        f, g = test(a), test(b)
        for _ in range(3):
            a, f, b = b, g, b - g * (b - a) / (g - f)
            g = test(b)
        assert abs(g) < 1e-30
        assert abs(b - one.value) <= one.uncertainty < 1e-11


@pytest.mark.long
def test_parameters_other_than_the_free_one_stay() -> None:
    for one in upwards(3.0).bifurcations:
        assert one.orbit.parameters == cs.Parameters(alpha=one.value, gamma=3.0)


@pytest.mark.long
def test_multipliers_on_the_unit_circle_all_along_are_no_bifurcation() -> None:
    """At rest on the ground and without damping nothing dissipates: the product of two is 1."""
    damped = settled(alpha=0.0143, zeta=0.001)
    start = solve_itinerary(cs.Parameters(alpha=0.0143, zeta=0.0), damped.itinerary, damped.z)
    assert start.success
    branch = cs.continue_orbit(start, "alpha", 0.0074)
    for point in branch.points:
        first, second, last = point.multipliers
        assert (abs(first * second), last) == (pytest.approx(1.0, abs=1e-12), 0)
    assert NEIMARK_SACKER not in {one.type for one in branch.bifurcations}
