"""Search from a box of starts: against brute-force runs, with an isola."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from numpy.typing import NDArray

from capsule_sym import (
    BoxSearch,
    BranchPoint,
    ContinuationSettings,
    Ending,
    InvalidInput,
    Orbit,
    Parameters,
    continue_both_ways,
    floquet_multipliers,
    search_box,
    simulate,
    solve_itinerary,
    solve_orbit,
)
from capsule_sym._map.backend import backend
from capsule_sym._native import Watch
from capsule_sym._orbits.continuation.branches.continuing import axis_within, follow_both_ways
from capsule_sym._orbits.continuation.points.kinds import FOLD
from capsule_sym._orbits.shooting.symmetry import same
from tests.finals import final_states, parameter_rows

BESIDE_THREE = Parameters(alpha=2.96, omega=0.8, delta=0.5, zeta=0.01, beta=50.0, gamma=5.0)
REST = Parameters(alpha=1.2, omega=1.5, delta=2.0, beta=50.0, gamma=5.0)
REACH = 3.0


@lru_cache
def found_with_isola() -> BoxSearch:
    return search_box(
        BESIDE_THREE,
        (REACH, REACH, 0),
        size=(4, 4, 1),
        period_numbers=(1, 3),
        along="delta",
        ends=(0.3, 0.7),
        points=5,
    )


def of_period_three(parameters: Parameters) -> int:
    """Number of starts of a grid that reach a motion of three periods, by the map alone."""
    line = np.linspace(-REACH, REACH, 16)
    x_r, v_r = (values.ravel() for values in np.meshgrid(line, line))
    states = np.stack([x_r, v_r, 0 * x_r], axis=1)
    rows = np.repeat(parameter_rows(parameters), len(states), axis=0)
    late = final_states(rows, states, 0.0, 300).states
    one, three = (final_states(rows, late, 0.0, n).states for n in (1, 3))
    apart = [abs(other - late).max(axis=1) for other in (one, three)]
    return int(((apart[0] > 1e-3) & (apart[1] < 1e-6)).sum())


def test_attractors_are_those_on_which_a_grid_settles() -> None:
    found = found_with_isola()
    assert found.success
    assert sum(found.settled) == found.starts == 16
    stable = [abs(floquet_multipliers(one)[0]) < 1 for one in found.orbits]
    assert [one.itinerary.period_number for one in found.orbits] == [1, 3, 3]
    assert [count > 0 for count in found.settled] == stable == [True, True, False]
    assert of_period_three(BESIDE_THREE) > 0


def test_the_unstable_orbit_is_a_motion_of_the_map() -> None:
    orbit = found_with_isola().orbits[-1]
    flow = orbit.system.flows[0]
    phase = float(flow.angle) / BESIDE_THREE.omega % BESIDE_THREE.period
    run = simulate(BESIDE_THREE, [float(v) for v in flow.start], phase, 5)
    marks = np.array(run.stroboscopic, dtype=float)
    assert marks[-1] == pytest.approx(marks[-4], abs=1e-8)
    assert abs(marks[-1] - marks[-2]).max() > 1e-2


def test_motions_of_three_periods_lie_on_an_isola() -> None:
    found = found_with_isola()
    (isola,) = found.isolas
    assert (isola.status, isola.success) == (Ending.RETURNED, False)
    # It is one branch: it begins with one of the two orbits, and passes the other.
    assert same(isola.points[0].orbit, found.orbits[1])
    folds = sorted(one.value for one in isola.bifurcations if one.type == FOLD)
    values = [point.value for point in isola.points]
    assert min(values) >= folds[0] - 1e-9
    assert max(values) <= folds[-1] + 1e-9
    # By the map alone: such motions end at the fold, where the closed branch turns back.
    assert of_period_three(BESIDE_THREE.replace(delta=folds[-1] - 2e-3)) > 0
    assert of_period_three(BESIDE_THREE.replace(delta=folds[-1] + 2e-3)) == 0
    assert of_period_three(BESIDE_THREE.replace(delta=folds[0] - 2e-3)) == 0
    assert "1 closed" in found.message


def by_the_map(orbit: Orbit) -> NDArray[np.complex128]:
    """Multipliers of an orbit, the largest modulus first, by differences of runs."""
    number, parameters = orbit.itinerary.period_number, orbit.parameters
    state = orbit.trajectory()(parameters.period * number)
    ends = [*(state + 1e-5 * np.eye(3)), *(state - 1e-5 * np.eye(3))]
    rows = np.repeat(parameter_rows(parameters), len(ends), axis=0)
    there = final_states(rows, np.array(ends), 0.0, number).states
    values = np.linalg.eigvals((there[:3] - there[3:]).T / 2e-5)
    return values[np.argsort(-abs(values))]


def test_an_isola_comes_back_to_the_orbit_it_began_at() -> None:
    (isola,) = found_with_isola().isolas
    begin, other = found_with_isola().orbits[1:]
    assert isola.status is Ending.RETURNED

    def near(point: BranchPoint) -> Orbit:
        """The orbit at the value of the begin that Newton's method finds from a point."""
        orbit = solve_itinerary(begin.parameters, point.orbit.itinerary, list(point.orbit.z))
        assert orbit.success
        assert max(abs(orbit.z - point.orbit.z)) > 1e-4
        return orbit

    # Between, it passes the one other orbit that the box has there, and no third.
    past = [point.value - isola.points[0].value for point in isola.points]
    (passing,) = (k for k in range(1, len(past) - 2) if past[k] * past[k + 1] < 0)
    again, passed = near(isola.points[-1]), near(isola.points[passing])
    assert same(again, begin)
    assert same(passed, other)
    assert not same(again, other)
    for one, known in ((begin, again), (other, passed)):
        multipliers = floquet_multipliers(known)
        assert multipliers == pytest.approx(floquet_multipliers(one), abs=1e-9)
        assert multipliers == pytest.approx(by_the_map(one), abs=1e-4)
    largest = [abs(floquet_multipliers(one)[0]) for one in (begin, other)]
    assert largest[0] < 1 < largest[1]


def test_a_branch_that_is_not_closed_is_followed_to_both_ends() -> None:
    orbit = solve_orbit(REST)
    ahead, back = continue_both_ways(orbit, "alpha", (1.1, 1.3), points=4)
    assert [one.points[-1].value for one in (ahead, back)] == pytest.approx([1.3, 1.1], rel=1e-12)
    assert ahead.success
    assert back.success


def test_a_fold_leads_to_the_other_orbit_at_the_same_value() -> None:
    found = search_box(REST, (2.0, 2.0, 0), size=(5, 5, 1), period_numbers=(1,))
    drifting = next(one for one in found.orbits if len(one.itinerary) == 4)
    unstable = next(one for one in found.orbits if abs(floquet_multipliers(one)[0]) > 1)
    axis = axis_within(drifting.parameters, drifting.values, "alpha", (0.8, 1.3))
    with backend("numpy") as numbers:
        _, passed = follow_both_ways(numbers, drifting, axis, 10, ContinuationSettings(), Watch())
    assert any(same(one, unstable) for one in passed)


def test_what_does_not_settle_is_told() -> None:
    # Chaotic: no orbit attracts.
    chaotic = Parameters(alpha=0.08, omega=1.1, delta=0.1, zeta=0.02, beta=10.0, gamma=3.0)
    found = search_box(chaotic, (1, 1, 0), size=(2, 1, 1), period_numbers=(1,), periods=20)
    assert found.open + sum(found.settled) == found.starts == 2
    assert f"{found.open} on none of these" in found.message


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"box": (1, 1)}, "box"),
        ({"box": (1, 1, -1)}, "box"),
        ({"box": (1, 1, float("nan"))}, "box"),
        ({"size": (0, 1, 1)}, "size"),
        ({"size": (1000, 1000, 1)}, "size"),
        ({"period_numbers": (17,)}, "period_numbers"),
        ({"along": "alpha"}, "ends"),
        ({"along": "alpha", "ends": (2, 3)}, "ends"),
        ({"along": "speed", "ends": (1, 3)}, "parameter"),
    ],
)
def test_bad_input_is_refused(arguments: dict[str, object], field: str) -> None:
    given = {"box": (1, 1, 0), "size": (1, 1, 1), "period_numbers": (1,), **arguments}
    with pytest.raises(InvalidInput) as caught:
        search_box(REST, **given)  # type: ignore[arg-type]
    assert caught.value.field == field
