"""Inequalities of an itinerary: they say whether the map follows it."""

import pytest

import capsule_sym as cs
from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.admissibility import LANDING, MINIMUM, inequalities
from capsule_sym.orbits import is_admissible, solve_itinerary, tightest
from tests.orbits.branches import settled


def held(orbit: cs.results.Orbit) -> list[cs.results.Inequality]:
    with backend(orbit.backend) as numbers:
        return inequalities(numbers, orbit.itinerary, orbit.system)


def test_the_landing_is_the_distance_to_the_edge_of_stick() -> None:
    orbit = settled(alpha=1.2)  # F5 F4 F1 F2 F3 F2
    landings = [one for one in held(orbit) if one.kind == LANDING]
    assert [orbit.itinerary.fields[one.segment] for one in landings] == [1, 3]
    for one in landings:
        x_r, v_r, v_c = orbit.motion.segments[one.segment].end_state
        assert v_c == 0
        force = x_r + 2 * 0.05 * v_r
        edge = -1.0 if orbit.itinerary.fields[one.segment] == 1 else 1.0
        assert one.value == pytest.approx(abs(force - edge), abs=1e-12)


@pytest.mark.parametrize("alpha", [0.9, 0.935, 0.94, 0.942, 0.95, 1.0])
def test_the_map_follows_a_word_just_where_its_inequalities_hold(alpha: float) -> None:
    # At 0.9409980 the force in F2 reaches the edge of stick.
    start = settled(alpha=0.9)
    orbit = cs.orbits.solve_itinerary(cs.Parameters(alpha=alpha), start.itinerary, start.z)
    assert orbit.success, orbit.message
    least = cs.orbits.tightest(orbit)
    assert (least.kind, least.guard) == (MINIMUM, Guard.LOWER)
    assert (least.value > 0) == (alpha < 0.9409980) == cs.orbits.is_admissible(orbit)


def test_legs_and_guards_are_named_from_where_the_paper_begins() -> None:
    orbit = settled(alpha=0.9)
    turned = cs.orbits.solve_itinerary(
        orbit.parameters, orbit.itinerary.rotated(2), _turned(orbit, 2)
    )
    assert turned.success, turned.message
    names = {one.named(turned.itinerary) for one in held(turned)}
    assert names == {one.named(orbit.itinerary) for one in held(orbit)}
    assert "minimum of lower in segment 4, F2" in names


def _turned(orbit: cs.results.Orbit, segment: int) -> list[float]:
    flow = orbit.system.flows[segment]
    return [*flow.start, flow.angle, *orbit.z[4 + segment :], *orbit.z[4 : 4 + segment]]


def test_a_run_from_inside_stays_on_the_orbit() -> None:
    orbit = settled(alpha=1.5)
    x_r, v_r, v_c = (float(value) for value in orbit.motion.segments[0].start_state)
    phase = float(orbit.motion.segments[0].start.phase)
    run = cs.simulate(orbit.parameters, (x_r, v_r, v_c), phase, 3)
    assert tuple(s.field for s in run.segments[:6]) == orbit.itinerary.fields


def test_the_first_half_of_the_longest_segment_is_compared_too() -> None:
    start = settled(alpha=0.9, omega=0.6819)
    touching = solve_itinerary(cs.Parameters(alpha=0.9, omega=0.68189804), start.itinerary, start.z)
    assert touching.success
    assert tightest(touching).value < 0
    assert not is_admissible(touching)


def test_a_first_half_stands_for_its_whole_orbit() -> None:
    """Without contact there is one motion, its own mirror image; it rests at the lower alpha."""
    for alpha, fields in ((0.9, (2, 1)), (1.2, (1,))):
        half = cs.orbits.half_orbit(settled(alpha=alpha, delta=10.0))
        assert half is not None
        assert half.itinerary.fields == fields
        assert is_admissible(half)
    other = solve_itinerary(cs.Parameters(alpha=0.9, delta=10.0), half.itinerary, half.z)
    assert other.success
    assert not is_admissible(other)
