"""Normal forms: balls, 50-digit motions and orbits beside a bifurcation give the same."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._enclosures.numbers.balls import precision
from capsule_sym._enclosures.orbits.events import prove_event
from capsule_sym._map.backend import backend
from capsule_sym._orbits.continuation.kinds import NON_SMOOTH_FOLD, PERSISTENCE, SUPERCRITICAL
from capsule_sym._orbits.shooting.equations import PARAMETERS, shooting
from capsule_sym._orbits.shooting.taylor import residual_series
from tests.orbits.branches import hysteretic, upwards

pytestmark = pytest.mark.long


@lru_cache
def _collisions() -> dict[str, cs.results.Bifurcation]:
    found = {f"alpha {one.label}": one for one in upwards(3.3).bifurcations}
    found |= {f"omega {one.label}": one for one in hysteretic().bifurcations}
    return {name: one for name, one in found.items() if one.segment is not None}


ALPHA = ("GR1", "AS1", "BI1", "AS2", "BI2", "SS1", "GS1", "CS1")
OMEGA = ("GS1", "BI1", "BI2", "AS1", "CS1", "BI3", "GR1", "AS2", "AS3")
EACH = [f"alpha {label}" for label in ALPHA] + [f"omega {label}" for label in OMEGA]


@pytest.mark.parametrize("name", EACH[: len(ALPHA)])
def test_the_parameter_grows_as_ball_arithmetic_proves(name: str) -> None:
    one = _collisions()[name]
    form = one.normal_form
    assert form is not None
    with precision(256):
        event = prove_event(one.orbit, (one.segment,), (one.parameter,))
        expected = float(event.coefficient)
    assert form.order == event.order
    # The ball is right up to the order of a duration of 1e-12 only.
    assert form.growth == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("name", EACH)
def test_both_itineraries_persist(name: str) -> None:
    assert _collisions()[name].normal_form.scenario == PERSISTENCE


def test_a_scenario_is_left_open_where_the_branch_ends() -> None:
    one = _collisions()["alpha GS1"]
    assert replace(one, itinerary_after=None, multipliers_after=()).normal_form.scenario == ""


def test_two_itineraries_with_their_orbits_on_one_side_make_a_non_smooth_fold() -> None:
    # By det(I - M): of multipliers on both sides of 1 an odd number is beyond it.
    one = _collisions()["alpha GS1"]
    scenarios = [
        replace(one, multipliers_before=(0.5, 0), multipliers_after=after).normal_form.scenario
        for after in ((1.5, 0), (-1.5, 0), (0.3 + 1j, 0.3 - 1j), (1.5, 1.2))
    ]
    assert scenarios == [NON_SMOOTH_FOLD, PERSISTENCE, PERSISTENCE, PERSISTENCE]


FOLDS = ("FO1", "FO2")


@pytest.mark.parametrize("label", FOLDS)
def test_two_orbits_lie_beside_a_fold_where_its_normal_form_says(label: str) -> None:
    one = hysteretic().at(label)
    form = one.normal_form
    s = 1e-4
    beside = [point for point in _both_sides(one, one.value + form.growth * s * s, s)]
    apart = (beside[0].durations - beside[1].durations) / 2
    assert np.linalg.norm(apart) == pytest.approx(s, rel=1e-2)
    slopes = [_nearest(orbit, 1) - 1 for orbit in beside]
    assert sorted(slopes) == pytest.approx(
        [-2 * form.coefficient * s, 2 * form.coefficient * s], rel=1e-2
    )
    # On the other side there is none.
    assert not any(o.success for o in _both_sides(one, one.value - form.growth * s * s, s))


def _both_sides(one: cs.results.Bifurcation, value: float, s: float) -> list:
    """The orbits at a value of omega that Newton's method finds from both sides of a fold."""
    values = list(one.orbit.values)
    values[PARAMETERS.index("omega")] = value
    along = np.linalg.svd(one.orbit.system.by_z)[2][-1]
    along /= np.linalg.norm(along[4:])
    return [
        cs.orbits.solve_itinerary(values, one.orbit.itinerary, list(one.orbit.z + side * s * along))
        for side in (-1, 1)
    ]


def _nearest(orbit, value: float) -> float:
    return float(min(cs.orbits.floquet_multipliers(orbit).real, key=lambda one: abs(one - value)))


class _Still(cs.inputs.ParameterPath):
    """A parameter that has no effect."""

    def along(self, by_p: np.ndarray, value: float) -> np.ndarray:
        return 0 * by_p[:, 0]

    def placed(self, values: list[float], value: float) -> list[float]:
        return list(values)


@pytest.mark.parametrize("label", ["FO1", "PD1", "GS1"])
def test_there_is_no_normal_form_in_a_parameter_without_effect(label: str) -> None:
    assert replace(hysteretic().at(label), path=_Still("omega")).normal_form is None


def test_there_is_no_normal_form_where_the_equations_are_not_solved() -> None:
    assert hysteretic().at("FO1").normal_form is not None
    assert (
        replace(hysteretic().at("FO1"), status=cs.results.Status.NOT_CONVERGED).normal_form is None
    )


@pytest.mark.parametrize("label", ["PD1", "PD2"])
def test_a_doubled_orbit_lies_where_the_normal_form_says(label: str) -> None:
    branch = hysteretic()
    one = branch.at(label)
    form = one.normal_form
    assert form.scenario == SUPERCRITICAL
    found = cs.continue_from(branch, label, one.value + np.sign(form.growth) * 1e-4, points=10)
    doubled = next(b for b in found if b.points[0].orbit.itinerary.period_number == 2)
    point = doubled.points[0]
    n = len(point.orbit.itinerary) // 2
    s = np.linalg.norm(point.orbit.durations[:n] - point.orbit.durations[n:]) / 2
    assert 1e-6 < s < 0.05
    assert point.value - one.value == pytest.approx(form.growth * s * s, rel=2e-2)
    # The map's second iterate s -> s + 2 e s - 2 c s^3 has there the derivative 1 - 4 c s^2.
    assert _nearest(point.orbit, 1) == pytest.approx(
        1 - 4 * form.coefficient * s * s, abs=0.1 * s * s
    )


@pytest.mark.parametrize("name", ["alpha AS1", "omega PD2"])
def test_derivatives_along_a_curve_are_those_of_differences_in_fifty_digits(name: str) -> None:
    branch, label = name.split()
    orbit = (upwards(3.3) if branch == "alpha" else hysteretic()).at(label).orbit
    random = np.random.default_rng(1)
    curve = 0.1 * random.normal(size=(4, len(orbit.z)))
    curve[0] = orbit.z
    curve[1:, 4:] = np.where(orbit.durations == 0, 0.03, curve[1:, 4:])
    curve[0, 4:] = np.where(orbit.durations == 0, 0.2, curve[0, 4:])
    with backend("numpy") as numbers:
        system = shooting(numbers, orbit.values, orbit.itinerary, curve[0])
        at = type(orbit)(orbit.values, orbit.itinerary, curve[0], system, "numpy")
        found = residual_series(at, curve)
    with backend("mpmath") as numbers:
        number = np.vectorize(numbers.number)
        values, exact = number(orbit.values), number(curve)
        h = numbers.number(10) ** -8

        def residual(k: int) -> np.ndarray:
            z = sum(row * (k * h) ** power for power, row in enumerate(exact))
            return shooting(numbers, tuple(values), orbit.itinerary, z).residual

        ends = {k: residual(k) for k in (-2, -1, 0, 1, 2)}
    expected = [
        (8 * (ends[1] - ends[-1]) - (ends[2] - ends[-2])) / (12 * h),
        (ends[1] - 2 * ends[0] + ends[-1]) / h**2 / 2,
        (ends[2] - 2 * (ends[1] - ends[-1]) - ends[-2]) / (2 * h**3) / 6,
    ]
    for row, other in zip(found[1:], expected, strict=True):
        assert np.allclose(row, other.astype(float), rtol=1e-10, atol=1e-11)
