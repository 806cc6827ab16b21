"""Branches: from end to end with every change of itinerary, through folds, and typed endings."""

import math

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._orbits.continuation import branch as branch_run
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.continuation.path import least_between, least_slope_between
from capsule_sym._orbits.shooting.closed import ClosedForms
from tests.orbits.branches import HIGH, LOW, downwards, hysteretic, settled, upwards

FIRST_FIVE = [
    (kinds.GRAZING, "L9", "F2", "F5 F2"),
    (kinds.ADDING, "L3^(2)", "F5 F2", "F5 F4 F5 F2"),
    (kinds.CORNER, "L7", "F5 F4 F5 F2", "F5 F4 F1 F2"),
    (kinds.ADDING, "L2^(2)", "F5 F4 F1 F2", "F5 F4 F1 F2 F3 F2"),
    (kinds.CORNER, "L6", "F5 F4 F1 F2 F3 F2", "F5 F4 F1 F2 F3 F6"),
]
# The itineraries of both cases are those on which the map settles from rest, run by run.
LAST_THREE = {
    3.3: [
        (kinds.SWITCHING, "L2^(3)", "F5 F4 F1 F2 F3 F6", "F5 F4 F1 F3 F2 F3 F6"),
        (kinds.GRAZING_SLIDING, "L2^(2)", "F5 F4 F1 F3 F2 F3 F6", "F5 F4 F1 F3 F6"),
        (kinds.CROSSING, "L3^(3)", "F5 F4 F1 F3 F6", "F4 F1 F3 F6"),
    ],
    3.0: [
        (kinds.CROSSING, "L3^(3)", "F5 F4 F1 F2 F3 F6", "F4 F1 F2 F3 F6"),
        (kinds.SWITCHING, "L2^(3)", "F4 F1 F2 F3 F6", "F4 F1 F3 F2 F3 F6"),
        (kinds.GRAZING_SLIDING, "L2^(2)", "F4 F1 F3 F2 F3 F6", "F4 F1 F3 F6"),
    ],
}


def text(itinerary: cs.results.Itinerary) -> str:
    return str(itinerary.rotated(itinerary.first))


def events(branch: cs.results.Branch) -> list[tuple[str, str, str, str]]:
    return [
        (one.type, one.line, text(one.itinerary_before), text(one.itinerary_after))
        for one in branch.bifurcations
    ]


@pytest.mark.parametrize("gamma", [3.3, 3.0])
def test_one_continuation_finds_all_eight_events(gamma: float) -> None:
    branch = upwards(gamma)
    assert (branch.status, branch.points[-1].value) == (cs.results.Status.REACHED, HIGH)
    assert events(branch) == FIRST_FIVE + LAST_THREE[gamma]
    values = [one.value for one in branch.bifurcations]
    assert values == sorted(values)


@pytest.mark.parametrize("gamma", [3.3, pytest.param(3.0, marks=pytest.mark.long)])
def test_the_way_back_finds_the_same_eight(gamma: float) -> None:
    there, back = upwards(gamma), downwards(gamma)
    assert back.status is cs.results.Status.REACHED
    assert back.points[-1].value == pytest.approx(LOW, rel=1e-12)
    turned = [(kind, line, b, a) for kind, line, a, b in events(back)[::-1]]
    assert turned == events(there)
    for one, other in zip(there.bifurcations, back.bifurcations[::-1], strict=True):
        assert abs(one.value - other.value) <= one.uncertainty + other.uncertainty
        assert one.uncertainty < 1e-12


@pytest.mark.parametrize("gamma", [3.3, 3.0])
def test_the_map_settles_on_the_words_on_either_side(gamma: float) -> None:
    # Runs of the map alone start beside the orbit, at 1e-6 from each value.
    for one in upwards(gamma).bifurcations:
        flow = one.orbit.system.flows[one.orbit.itinerary.first]
        state = [float(value) for value in flow.start]
        for side, itinerary in ((-1e-6, one.itinerary_before), (1e-6, one.itinerary_after)):
            parameters = cs.Parameters(alpha=one.value + side, gamma=gamma)
            phase = float(flow.angle) / parameters.omega % parameters.period
            run = cs.simulate(parameters, state, phase, 400)
            if len(itinerary) == 1:
                assert run.segments[-1].outcome is cs.results.Outcome.NEVER
                continue
            motion = run.steady(1e-8)
            assert motion is not None
            assert motion.itinerary == itinerary.rotated(itinerary.first).names, (one.type, side)


def test_every_point_is_a_motion_of_the_map() -> None:
    for point in upwards(3.3).points[::5] + hysteretic().points[::5]:
        assert point.admissibility.value > 0
        assert point.orbit.residual < 1e-12
        assert cs.orbits.is_admissible(point.orbit), point.value


def test_a_branch_goes_on_through_folds_where_it_is_unstable() -> None:
    branch = hysteretic()
    assert branch.status is cs.results.Status.REACHED
    folds = [one for one in branch.bifurcations if one.type == kinds.FOLD]
    assert len(folds) == 2
    values = np.array([point.value for point in branch.points])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(values))))
    for fold, turn in zip(folds, turns, strict=True):
        assert fold.value == pytest.approx(values[turn + 1], abs=1e-4)
    middle = [p for p in branch.points[turns[0] + 3 : turns[1] - 1]]
    assert middle
    assert all(abs(point.multipliers[0]) > 1 for point in middle)


def test_nothing_is_found_on_the_other_side_of_a_fold() -> None:
    fold = next(one for one in hysteretic().bifurcations if one.type == kinds.FOLD)
    same = [p for p in hysteretic().points if p.orbit.itinerary == fold.orbit.itinerary]
    guess = min(same, key=lambda point: abs(point.value - fold.value)).orbit.z
    found = []
    for side in (-1e-7, 1e-7):
        parameters = fold.orbit.parameters.replace(omega=fold.value + side)
        orbit = cs.orbits.solve_itinerary(parameters, fold.orbit.itinerary, guess)
        found.append(orbit.success and max(abs(orbit.z - fold.orbit.z)) < 0.05)
    assert found == [True, False]


def test_a_period_doubling_is_where_the_period_of_the_map_doubles() -> None:
    branch = hysteretic()
    doublings = [one for one in branch.bifurcations if one.type == kinds.PERIOD_DOUBLING]
    assert len(doublings) == 2
    for one, (below, above) in zip(doublings, ((1, 2), (2, 1)), strict=True):
        for side, period_number in ((-2e-3, below), (2e-3, above)):
            parameters = one.orbit.parameters.replace(omega=one.value + side)
            start = [float(v) * (1 + 1e-4) for v in one.orbit.z[:3]]
            phase = float(one.orbit.z[3]) / parameters.omega % parameters.period
            motion = cs.simulate(parameters, start, phase, 2500).steady(1e-8)
            assert motion is not None
            assert motion.period_number == period_number


def test_a_branch_back_at_its_parameter_on_another_orbit_has_not_returned() -> None:
    orbit = settled(alpha=0.3, omega=1.6, delta=0.3, zeta=0.01, beta=30.0)
    branch = cs.continue_orbit(orbit, "omega", 0.7, points=40)
    assert branch.status is cs.results.Status.TURNED_BACK
    assert branch.points[-1].value == pytest.approx(1.6, rel=1e-12)
    assert text(branch.points[-1].orbit.itinerary) != text(orbit.itinerary)


@pytest.mark.parametrize("s", [1e-4, 1e-6, 2e-7])
@pytest.mark.parametrize("label", ["FO1", "FO2"])
def test_a_branch_that_passes_close_to_its_begin_has_not_returned(label: str, s: float) -> None:
    """Begun so near to a fold, it comes back on the other side of it: 2 s apart in durations."""
    fold = hysteretic().at(label)
    assert isinstance(fold, cs.results.Bifurcation)
    assert fold.normal_form is not None
    along = np.linalg.svd(fold.orbit.system.by_z)[2][-1]
    along /= np.linalg.norm(along[4:])
    growth = fold.normal_form.growth
    parameters = fold.orbit.parameters.replace(omega=fold.value + growth * s * s)
    orbit = cs.orbits.solve_itinerary(
        parameters, fold.orbit.itinerary, list(fold.orbit.z + s * along)
    )
    branch = cs.continue_orbit(orbit, "omega", fold.value - math.copysign(2e-3, growth), points=2)
    assert branch.status is cs.results.Status.TURNED_BACK
    assert [one.type for one in branch.bifurcations] == [kinds.FOLD]
    apart = np.linalg.norm(branch.points[-1].orbit.durations - orbit.durations)
    # The change of s by 1e-16 of omega.
    assert apart == pytest.approx(2 * s, rel=1e-3 + 1e-16 / abs(growth) / s**2)


def test_other_parameters_serve_as_well() -> None:
    for name, to in (("gamma", 3.0), ("f_b", 0.9), ("delta", 0.1), ("zeta", 0.1), ("beta", 3.0)):
        branch = cs.continue_orbit(settled(alpha=1.2), name, to, points=4)
        assert branch.status is cs.results.Status.REACHED, (name, branch.message)
        end = branch.points[-1].orbit
        again = cs.solve_orbit(end.parameters)
        assert again.success, again.message
        assert text(again.itinerary) == text(end.itinerary)
        assert again.progression == pytest.approx(end.progression, abs=1e-10)


@pytest.mark.parametrize(
    ("parameters", "name", "to", "types"),
    [
        # Before the corner the reversal fails, of a segment that is gone beyond the corner.
        (
            {"alpha": 1.8355913, "omega": 1.4953428, "zeta": 0.2, "beta": 10.0},
            "gamma",
            2.2,
            [(kinds.CROSSING, "L3^(3)"), (kinds.CORNER, "L6")],
        ),
        # Before the reversal fails, the drift after it touches the edge of stick.
        (
            {"alpha": 2.0179817, "omega": 1.4361025, "delta": 0.1},
            "omega",
            0.76,
            [(kinds.GRAZING_SLIDING, "L2^(2)"), (kinds.SWITCHING, "L2^(3)")],
        ),
    ],
)
def test_of_two_failures_in_a_step_the_first_counts(parameters, name, to, types) -> None:
    branch = cs.continue_orbit(settled(**parameters), name, to, points=20)
    assert branch.status is cs.results.Status.REACHED
    assert [(one.type, one.line) for one in branch.bifurcations] == types


def test_a_period_doubled_branch_ends_at_its_doubling() -> None:
    """Its value is that of the branch of half the period, and the map agrees on both sides."""
    branch = cs.continue_orbit(settled(alpha=0.05, zeta=0.005), "alpha", 0.01, points=20)
    (end,) = branch.bifurcations
    assert branch.status is cs.results.Status.PERIOD_HALVED
    assert "the two halves of F5 F2 F5 F2 become one at alpha = 0.0429036183971" in branch.message
    assert (end.type, end.itinerary_after, end.status) == (kinds.PERIOD_DOUBLING, None, "converged")
    assert end.orbit.itinerary == cs.results.Itinerary.parse("F5 F2")
    once = cs.continue_orbit(settled(alpha=0.04, zeta=0.005), "alpha", 0.044, points=5)
    (there,) = (one for one in once.bifurcations if one.type == kinds.PERIOD_DOUBLING)
    assert abs(end.value - there.value) <= end.uncertainty + there.uncertainty < 1e-12
    for side, period_number in ((-3e-4, 1), (3e-4, 2)):
        motion = cs.simulate(
            cs.Parameters(alpha=end.value + side, zeta=0.005), periods=4000
        ).steady()
        assert motion is not None
        assert motion.period_number == period_number


def test_without_that_end_a_doubled_branch_returns_to_its_own_orbit(monkeypatch) -> None:
    # Begun at the other half, it is the same orbit.
    monkeypatch.setattr(branch_run, "halved", lambda *arguments: None)
    branch = cs.continue_orbit(settled(alpha=0.045, zeta=0.005), "alpha", 0.01, points=20)
    assert branch.status is cs.results.Status.RETURNED
    first, last = (point.orbit for point in (branch.points[0], branch.points[-1]))
    assert last.durations == pytest.approx(np.roll(first.durations, 2), abs=1e-9)
    assert abs(first.durations[0] - first.durations[2]) > 1e-3


def test_two_events_that_symmetry_brings_about_at_once_are_passed_in_omega() -> None:
    # Without impact the motion is its own mirror image: both edges of stick are touched at once.
    orbit = settled(alpha=1.64431859264762, omega=1.9051752, delta=1.2, beta=0.5)
    branch = cs.continue_orbit(orbit, "omega", 1.55, points=20)
    assert branch.status is cs.results.Status.REACHED
    (one,) = branch.bifurcations
    # There the force of the one spring on a capsule at rest reaches its friction.
    damper = 2j * orbit.parameters.zeta * one.value
    force = orbit.parameters.alpha * abs(1 + damper) / abs(1 - one.value**2 + damper)
    assert force == pytest.approx(1.0, abs=1e-13)
    assert (str(one.itinerary_before), str(one.itinerary_after)) == ("F2", "F2 F1 F2 F3")


def test_an_orbit_that_its_word_does_not_admit_is_refused() -> None:
    start = settled(alpha=0.9)
    virtual = cs.orbits.solve_itinerary(cs.Parameters(alpha=0.95), start.itinerary, start.z)
    assert virtual.success, virtual.message
    branch = cs.continue_orbit(virtual, "alpha", 1.0)
    assert branch.status is cs.results.Status.NO_ADMISSIBLE_ORBIT
    assert branch.points == ()
    assert "minimum of lower in segment 4, F2 fails at alpha = 0.95" in branch.message


def test_a_word_that_the_map_does_not_follow_ends_the_branch(monkeypatch) -> None:
    monkeypatch.setattr(branch_run, "is_admissible", lambda orbit: False)
    monkeypatch.setattr(branch_run.BranchRun, "beyond", lambda *arguments: None)
    branch = cs.continue_orbit(settled(alpha=0.9), "alpha", 1.0)
    assert branch.status is cs.results.Status.NO_ADMISSIBLE_ORBIT
    assert "the map has another itinerary" in branch.message
    assert branch.bifurcations[-1].itinerary_after is None


def test_newton_that_fails_ends_the_branch(monkeypatch) -> None:
    monkeypatch.setattr(
        "capsule_sym._orbits.continuation.problem.Family.corrected", lambda *arguments: None
    )
    branch = cs.continue_orbit(settled(alpha=0.9), "alpha", 1.0)
    assert branch.status is cs.results.Status.NOT_CONVERGED
    assert "alpha = 0.9" in branch.message


def test_too_many_points_end_the_branch(monkeypatch) -> None:
    monkeypatch.setattr(branch_run, "_MOST_POINTS", 5)
    branch = cs.continue_orbit(settled(alpha=0.9), "alpha", 1.0)
    assert (branch.status, len(branch.points)) == (cs.results.Status.TOO_MANY_POINTS, 5)


@pytest.mark.parametrize(
    ("parameter", "to", "points", "field"),
    [
        ("speed", 1.0, 10, "parameter"),
        ("alpha", 0.9, 10, "to"),
        ("alpha", -1.0, 10, "alpha"),
        ("gamma", 0.0, 10, "gamma"),
        ("alpha", float("nan"), 10, "to"),
        ("alpha", 1.0, 0, "points"),
        ("alpha", 1.0, 2.5, "points"),
        ("alpha", 1.0, 10_000_000, "points"),
    ],
)
def test_bad_input_is_refused(parameter: str, to: float, points: int, field: str) -> None:
    with pytest.raises(cs.InvalidInput) as caught:
        cs.continue_orbit(settled(alpha=0.9), parameter, to, points=points)
    assert caught.value.field == field


def test_an_orbit_that_was_not_found_is_refused() -> None:
    there = settled(alpha=1.2)
    none = cs.orbits.solve_itinerary(cs.Parameters(alpha=0.1), there.itinerary, there.z)
    assert not none.success
    with pytest.raises(cs.InvalidInput, match=r"orbit = <NoOrbit .*an Orbit, as solve_orbit"):
        cs.continue_orbit(none, "alpha", 1.0)


@pytest.mark.long
@pytest.mark.parametrize("gamma", [3.3, 3.0])
def test_two_hundred_points_take_few_evaluations(gamma, monkeypatch) -> None:
    start, count, evaluated = settled(alpha=LOW, gamma=gamma), 0, ClosedForms.evaluated

    def counted(*arguments: object) -> object:
        nonlocal count
        count += 1
        return evaluated(*arguments)

    monkeypatch.setattr(ClosedForms, "evaluated", counted)
    branch = cs.continue_orbit(start, "alpha", HIGH, points=160)
    # Four evaluations a point: Newton's method needs no more from a good guess.
    assert 0 < count < 4 * 250
    assert len(branch.points) >= 200
    assert len(branch.bifurcations) == 8


@pytest.mark.parametrize(
    ("away", "begin", "end", "points"),
    [(1e-3, 0.06, 0.04, 40), (1e-5, 0.06, 0.04, 10), (1e-6, 0.049, 0.046, 1)],
)
def test_two_folds_within_one_step_are_both_found(away, begin, end, points) -> None:
    """Beside a cusp two folds are as near to each other as the power 3/2 of the distance."""
    zeta = 0.194951952797834 - away
    start = settled(alpha=begin, omega=1.1, delta=0.1, beta=10.0, gamma=3.0, zeta=zeta)
    branch = cs.continue_orbit(start, "alpha", end, points=points)
    first, last = (one.value for one in branch.bifurcations if one.type == kinds.FOLD)
    # By folds further away, 4e-3 from the cusp, which no step misses: 0.1215.
    assert last - first == pytest.approx(0.1202 * away**1.5, rel=0.02)


def test_the_least_value_of_a_cubic_between_two_points() -> None:
    # (t - 0.4)(t - 0.5)(t + 1), of one sign at both ends, and its derivative.
    cubic = np.poly([0.4, 0.5, -1.0])
    derivative = np.polyder(cubic)
    ends, slopes = (np.polyval(one, [0.0, 1.0]) for one in (cubic, derivative))
    t = np.linspace(0, 1, 100_001)
    assert least_between(ends, slopes) == pytest.approx(np.polyval(cubic, t).min(), abs=1e-9)
    least = least_slope_between(ends[1] - ends[0], slopes)
    assert least == pytest.approx(np.polyval(derivative, t).min(), abs=1e-9)
