"""Settings of continuations: refused where wrong, and felt where changed."""

from collections.abc import Callable

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._orbits.continuation.points.kinds import GRAZING, PERIOD_DOUBLING
from tests.orbits.branches import hysteretic, settled, upwards


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("first_step", 0.0, "above 0 and at most 10"),
        ("first_step", -1.0, "above 0 and at most 10"),
        ("largest_step", float("nan"), "above 0 and at most 100"),
        ("largest_step", float("inf"), "above 0 and at most 100"),
        ("newton_tolerance", "small", "above 0 and at most 0.001"),
        ("newton_steps", 2.5, "a whole number from 1 to 100"),
        ("newton_steps", True, "a whole number from 1 to 100"),
        ("most_points", 0, "a whole number from 1 to 1000000"),
        ("neighbour_shares", (), "one number or more, each above 0 and at most 1"),
        ("neighbour_shares", 0.1, "one number or more, each above 0 and at most 1"),
        ("doubled_distances", (1e-3, 2.0), "one number or more, each above 0 and at most 1"),
        ("least_step", 0.1, "at most first_step = 0.01"),
    ],
)
def test_a_value_out_of_range_is_refused(name: str, value: object, allowed: str) -> None:
    with pytest.raises(cs.InvalidInput) as caught:
        cs.inputs.ContinuationSettings(**{name: value})  # type: ignore[arg-type]
    assert (caught.value.field, caught.value.value) == (name, value) or value != value
    assert allowed in caught.value.allowed


def test_numbers_of_numpy_are_taken_and_lists_are_not_kept() -> None:
    shares = [1, np.float64(0.5)]
    chosen = cs.inputs.ContinuationSettings(
        newton_steps=np.int64(5), first_step=np.float32(0.5), neighbour_shares=shares
    )
    shares.append(1)
    assert (chosen.newton_steps, chosen.first_step, chosen.neighbour_shares) == (5, 0.5, (1, 0.5))
    assert type(chosen.newton_steps) is int
    assert set(map(type, chosen.neighbour_shares)) == {float}


CALLS: dict[str, Callable[..., object]] = {
    "continue_orbit": lambda **k: cs.continue_orbit(settled(alpha=0.9), "alpha", 0.95, **k),
    "continue_both_ways": lambda **k: cs.continue_both_ways(
        settled(alpha=0.9), "alpha", (0.8, 1.0), **k
    ),
    "continue_from": lambda **k: cs.continue_from(upwards(3.3), "EP2", 1.9, **k),
    "period_doubling_cascade": lambda **k: cs.orbits.period_doubling_cascade(hysteretic(), 1, **k),
    "continue_bifurcation": lambda **k: cs.continue_bifurcation(
        upwards(3.3).bifurcations[0], "gamma", ((0.001, 2.0), (3.0, 3.3)), **k
    ),
    "curves_from": lambda **k: cs.orbits.curves_from(
        cs.results.Curve(
            GRAZING, ("alpha", "gamma"), (), (), ((cs.results.Status.REACHED, ""),) * 2
        ),
        ((0, 2), (3, 4)),
        **k,
    ),
}


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("given", [{}, None, "fine"])
def test_what_is_no_settings_is_refused_at_the_door(name: str, given: object) -> None:
    with pytest.raises(cs.InvalidInput, match=r"settings = .* must be a ContinuationSettings"):
        CALLS[name](settings=given)


def steps(**settings: float) -> int:
    chosen = cs.inputs.ContinuationSettings(**settings)  # type: ignore[arg-type]
    branch = cs.continue_orbit(settled(alpha=0.9), "alpha", 0.95, points=1, settings=chosen)
    assert branch.status is cs.results.Status.REACHED
    return len(branch.points)


@pytest.mark.long
def test_smaller_steps_make_more_points() -> None:
    """As many as the length of the branch over that of a step; twice as many if it is halved."""
    few, many, most = (steps(first_step=size, largest_step=size) for size in (0.02, 0.01, 0.005))
    assert 1.8 < (many - 2) / (few - 2) < 2.2
    assert 1.8 < (most - 2) / (many - 2) < 2.2
    assert steps(least_cosine=1 - 1e-6) > 2 * steps()


def test_a_larger_tolerance_of_newtons_method_is_less_exact() -> None:
    """Its square is left as an error, which the residual has."""

    def residual(tolerance: float) -> float:
        chosen = cs.inputs.ContinuationSettings(
            newton_tolerance=tolerance, residual_tolerance=tolerance, rounding_step=1e-16
        )
        branch = cs.continue_orbit(settled(alpha=0.9), "alpha", 0.95, points=2, settings=chosen)
        return max(float(point.orbit.residual) for point in branch.points)

    assert residual(1e-13) < 1e-13 < 1e-9 < residual(1e-3)


def test_settings_reach_all_that_follows() -> None:
    two = cs.inputs.ContinuationSettings(most_points=2, most_curve_points=2)
    one = next(one for one in upwards(3.3).bifurcations if one.type == GRAZING)
    curve = cs.continue_bifurcation(one, "gamma", ((0.001, 2.0), (3.0, 3.3)), settings=two)
    assert len(curve.points) == 3  # two of each half, the first of which they share
    (branch, *_) = cs.continue_from(upwards(3.3), one.label, 2.0, settings=two)
    assert branch.status is cs.results.Status.TOO_MANY_POINTS
    cascade = cs.orbits.period_doubling_cascade(hysteretic(), 1, settings=two)
    assert {found.status for found in cascade} == {cs.results.Status.TOO_MANY_POINTS}
    # So near to the orbit that doubles the halves are not told apart from rounding.
    near = cs.inputs.ContinuationSettings(doubled_distances=(1e-12,))
    lost = cs.orbits.period_doubling_cascade(hysteretic(), 1, settings=near)
    doublings = [one for one in hysteretic().bifurcations if one.type == PERIOD_DOUBLING]
    assert len(lost) == len(doublings)
    assert {found.status for found in lost} == {cs.results.Status.NOT_CONVERGED}
