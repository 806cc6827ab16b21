"""Branches both ways from an orbit: against brute-force runs, with an isola."""

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import capsule_sym as cs
from capsule_sym._orbits.continuation.kinds import FOLD
from capsule_sym._orbits.shooting.symmetry import same
from tests.finals import final_states, parameter_rows

BESIDE_THREE = cs.Parameters(alpha=2.96, omega=0.8, delta=0.5, zeta=0.01, beta=50.0, gamma=5.0)
REST = cs.Parameters(alpha=1.2, omega=1.5, delta=2.0, beta=50.0, gamma=5.0)
REACH = 3.0


@lru_cache
def isola() -> tuple[cs.results.Orbit, cs.results.Orbit, cs.results.Branch]:
    """Two orbits of three periods, and the closed branch through the first."""
    orbits = cs.search_orbits(BESIDE_THREE, 8, period_numbers=(3,), box=(REACH, REACH, 0))
    _, first, second = orbits
    assert [one.itinerary.period_number for one in orbits] == [1, 3, 3]
    (closed,) = cs.continue_both_ways(first, "delta", (0.3, 0.7), points=5)
    return first, second, closed


def of_period_three(parameters: cs.Parameters) -> int:
    """Number of starts of a grid that reach a motion of three periods, by the map alone."""
    line = np.linspace(-REACH, REACH, 16)
    x_r, v_r = (values.ravel() for values in np.meshgrid(line, line))
    states = np.stack([x_r, v_r, 0 * x_r], axis=1)
    rows = np.repeat(parameter_rows(parameters), len(states), axis=0)
    late = final_states(rows, states, 0.0, 300).states
    one, three = (final_states(rows, late, 0.0, n).states for n in (1, 3))
    apart = [abs(other - late).max(axis=1) for other in (one, three)]
    return int(((apart[0] > 1e-3) & (apart[1] < 1e-6)).sum())


@pytest.mark.long
def test_motions_of_three_periods_lie_on_an_isola() -> None:
    begin, _, closed = isola()
    assert (closed.status, closed.success) == (cs.results.Status.RETURNED, False)
    assert same(closed.points[0].orbit, begin)
    folds = sorted(one.value for one in closed.bifurcations if one.type == FOLD)
    values = [point.value for point in closed.points]
    assert min(values) >= folds[0] - 1e-9
    assert max(values) <= folds[-1] + 1e-9
    # By the map alone: such motions end at the fold, where the closed branch turns back.
    assert of_period_three(BESIDE_THREE.replace(delta=folds[-1] - 2e-3)) > 0
    assert of_period_three(BESIDE_THREE.replace(delta=folds[-1] + 2e-3)) == 0
    assert of_period_three(BESIDE_THREE.replace(delta=folds[0] - 2e-3)) == 0


def by_the_map(orbit: cs.results.Orbit) -> NDArray[np.complex128]:
    """Multipliers of an orbit, the largest modulus first, by differences of runs."""
    number, parameters = orbit.itinerary.period_number, orbit.parameters
    state = orbit.trajectory()(parameters.period * number)
    ends = [*(state + 1e-5 * np.eye(3)), *(state - 1e-5 * np.eye(3))]
    rows = np.repeat(parameter_rows(parameters), len(ends), axis=0)
    there = final_states(rows, np.array(ends), 0.0, number).states
    values = np.linalg.eigvals((there[:3] - there[3:]).T / 2e-5)
    return values[np.argsort(-abs(values))]


def test_an_isola_comes_back_to_the_orbit_it_began_at() -> None:
    begin, other, closed = isola()

    def near(point: cs.results.BranchPoint) -> cs.results.Orbit:
        """The orbit at the value of the begin that Newton's method finds from a point."""
        orbit = cs.orbits.solve_itinerary(
            begin.parameters, point.orbit.itinerary, list(point.orbit.z)
        )
        assert orbit.success
        assert max(abs(orbit.z - point.orbit.z)) > 1e-4
        return orbit

    # Between, it passes the one other orbit that the search has there, and no third.
    past = [point.value - closed.points[0].value for point in closed.points]
    (passing,) = (k for k in range(1, len(past) - 2) if past[k] * past[k + 1] < 0)
    again, passed = near(closed.points[-1]), near(closed.points[passing])
    assert same(again, begin)
    assert same(passed, other)
    assert not same(again, other)
    for one, known in ((begin, again), (other, passed)):
        multipliers = cs.orbits.floquet_multipliers(known)
        assert multipliers == pytest.approx(cs.orbits.floquet_multipliers(one), abs=1e-9)
        assert multipliers == pytest.approx(by_the_map(one), abs=1e-4)
    largest = [abs(cs.orbits.floquet_multipliers(one)[0]) for one in (begin, other)]
    assert largest[0] < 1 < largest[1]


def test_a_branch_that_is_not_closed_is_followed_to_both_ends() -> None:
    orbit = cs.solve_orbit(REST)
    ahead, back = cs.continue_both_ways(orbit, "alpha", (1.1, 1.3), points=4)
    assert [one.points[-1].value for one in (ahead, back)] == pytest.approx([1.3, 1.1], rel=1e-12)
    assert ahead.success
    assert back.success


def test_a_branch_reaches_an_end_next_to_its_start() -> None:
    ends = (1.2 - 1e-5, 1.3)
    ahead, back = cs.continue_both_ways(cs.solve_orbit(REST), "alpha", ends, points=4)
    assert back.points[-1].value == ends[0]
    assert [one.status for one in (ahead, back)] == 2 * [cs.results.Status.REACHED]


@pytest.mark.parametrize(
    ("parameter", "ends", "field"),
    [
        ("alpha", (2, 3), "ends"),
        ("alpha", (1.1, 1.2), "ends"),
        ("alpha", (1.1,), "ends"),
        ("alpha", 1.3, "ends"),
        ("alpha", (-1, 1.3), "alpha"),
        ("speed", (1, 3), "parameter"),
    ],
)
def test_bad_input_is_refused(parameter: str, ends: Any, field: str) -> None:
    with pytest.raises(cs.InvalidInput) as caught:
        cs.continue_both_ways(cs.solve_orbit(REST), parameter, ends)
    assert caught.value.field == field


def test_an_orbit_in_fifty_digits_is_refused() -> None:
    orbit = cs.solve_orbit(REST).refined()
    assert orbit.success
    for follow, to in ((cs.continue_orbit, 1.3), (cs.continue_both_ways, (1.1, 1.3))):
        with pytest.raises(cs.InvalidInput, match="must be in double precision") as caught:
            follow(orbit, "alpha", to)
        assert (caught.value.field, caught.value.value) == ("orbit", orbit)
