"""Orbits of the scenes: against an integrator of their own, 50 digits, and runs beside events."""

import math
import shutil
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym import inputs, orbits, results, simulate
from capsule_sym._map.backend import backend
from capsule_sym._map.drift import dragged
from capsule_sym._map.expansion import Guard
from capsule_sym._native import core_of
from capsule_sym._orbits.continuation.bifurcations import refined
from capsule_sym._orbits.continuation.records import branch_record
from capsule_sym._orbits.shooting import extrema
from capsule_sym._orbits.shooting.admissibility import inequalities
from capsule_sym._orbits.shooting.changes import rotated
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import _by_kernels, of_core, shooting
from capsule_sym._orbits.shooting.symmetry import symmetric
from capsule_sym._records import dumps
from capsule_sym.scenes import Scene
from tests.sampling import sampled, some
from tests.scenes import SCENES, Integrator, Start

STEP = 1e-7
pytestmark = pytest.mark.skipif(
    core_of(cs.scenes.slope) is None or shutil.which("cc") is None, reason="no C compiler here"
)
MOTIONS = {
    "slope": {"alpha": 0.9, "s": 0.1},
    "reaction_pulse": {"alpha": 1.5, "alpha_low": -0.3, "D": 0.4},
    "reaction": {"alpha": 0.7},
}


def parameters(name: str, **changes: float) -> inputs.SceneParameters:
    scene: Scene = getattr(cs.scenes, name)
    return scene.Parameters(**MOTIONS[name] | changes)


@lru_cache
def settled(name: str, **changes: float) -> results.Orbit:
    orbit = cs.solve_orbit(parameters(name, **changes))
    assert orbit.success, orbit.message
    return orbit


def states(
    judge: Integrator, name: str, starts: list[np.ndarray], p: inputs.SceneParameters
) -> np.ndarray:
    """Final states of the integrator's runs over a period from phase 0, and x_c's advance."""
    given = [Start(p.to_dict(), tuple(map(float, one)), 0.0) for one in starts]
    runs = judge.runs(SCENES[name], given, 1)
    assert all(run.status == "done" for run in runs)
    return np.array([[float(value) for value in run.state] for run in runs])


@pytest.mark.parametrize("name", MOTIONS)
def test_an_orbit_closes_and_its_multipliers_are_those_of_differences(name, judge) -> None:
    orbit = settled(name)
    p, period = orbit.parameters, orbit.parameters.period
    begin = orbit.trajectory()(
        math.ceil(float(orbit.trajectory().origin[0].phase) / period) * period
    )
    x = np.array(begin, dtype=float)
    moved = [x + sign * STEP * unit for unit in np.eye(3) for sign in (1, -1)]
    ends = states(judge, name, [x, *moved], p)
    assert np.abs(ends[0, :3] - x).max() < 1e-12
    assert ends[0, 3] == pytest.approx(float(orbit.progression), abs=1e-12)
    slopes = (ends[1::2, :3] - ends[2::2, :3]).T / (2 * STEP)
    if not np.any(x[2]):
        slopes[:, 2] = 0.0  # at rest v_c is kept at 0, and no motion begins beside it
    expected = np.sort_complex(np.linalg.eigvals(slopes))
    assert np.sort_complex(orbit.multipliers) == pytest.approx(expected, abs=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("name", MOTIONS)
def test_gradients_are_differences_of_fifty_digits(name: str) -> None:
    orbit = settled(name)
    found, step = cs.performance(orbit), 1e-12
    assert abs(found.imbalance) < 1e-13
    exact = orbit.refined()
    assert exact.success
    names = orbit.scene.facts.PARAMETERS
    for parameter in {"omega", "s", "f_minus", "D", "alpha_low"}.intersection(names):
        ends, k = [], names.index(parameter)
        for sign in (1, -1):
            values = list(exact.values)
            values[k] += sign * step
            moved = orbits.solve_itinerary(values, exact.itinerary, list(exact.z), backend="mpmath")
            assert moved.success
            ends.append(moved.average_velocity)
        slope = float((ends[0] - ends[1]) / (2 * step))
        assert found.velocity.gradient[parameter] == pytest.approx(slope, rel=1e-9, abs=1e-11)


def test_many_performances_are_those_of_one_by_one() -> None:
    orbit = settled("slope")
    begin = orbit.trajectory()(orbit.parameters.period)
    rows = [list(orbit.parameters.to_dict().values())]
    many = cs.performance_many(rows, [begin], gradients=True, scene=cs.scenes.slope)
    one = cs.performance(orbit)
    assert many.closed.all()
    assert many.itinerary(0) == orbit.motion.itinerary
    assert many["work"][0] == pytest.approx(one.work.value, rel=1e-12)
    gradient = [*one.work.gradient.values()]
    assert many.gradients[0, 2] == pytest.approx(gradient, rel=1e-9, abs=1e-12)


def test_the_orbits_of_random_starts_hold_the_stable_one() -> None:
    orbit = settled("slope")
    found = cs.search_orbits(orbit.parameters, 5, period_numbers=(1,), transient=20)
    assert [one.itinerary for one in found].count(orbit.itinerary.cyclic) == 1


@lru_cache
def branch(name: str, parameter: str, to: float) -> results.Branch:
    return cs.continue_orbit(settled(name), parameter, to, points=20)


BRANCHES = [
    ("slope", "s", 0.4),
    ("slope", "alpha", 0.5),
    ("reaction_pulse", "alpha", 0.5),
    ("reaction_pulse", "alpha", 2.5),
    ("reaction_pulse", "D", 0.6),
    ("reaction", "alpha", 1.5),
]


@pytest.mark.long
@sampled
@pytest.mark.parametrize(("name", "parameter", "to"), some(BRANCHES, 2))
def test_on_both_sides_of_a_bifurcation_runs_have_its_itineraries(name, parameter, to) -> None:
    """A run that settles slightly before or beyond confirms the branch."""
    found, judged = branch(name, parameter, to), 0
    assert found.success, found.message
    for one in found.bifurcations:
        if one.itinerary_after in (None, one.itinerary_before):
            continue
        assert one.uncertainty < 1e-11
        apart = 1e-4 * math.copysign(1, to - one.interval[0])
        for side, itinerary in ((-1, one.itinerary_before), (1, one.itinerary_after)):
            at = {parameter: one.value + side * apart}
            orbit = cs.solve_orbit(parameters(name, **at))
            assert orbit.success, (one, orbit.message)
            assert orbit.itinerary.cyclic == itinerary.cyclic, one
            judged += 1
    assert judged


def test_a_switch_that_meets_an_edge_is_followed_in_two_parameters() -> None:
    """Of a curve in alpha and D any point is found by a branch in alpha alone, too."""
    found = branch("reaction_pulse", "alpha", 0.5)
    event = next(one for one in found.bifurcations if one.type == "edge")
    ranges = ((event.value - 0.1, event.value + 0.1), (0.38, 0.42))
    curve = cs.continue_bifurcation(event, "D", ranges, points=5)
    alpha, share = curve.points[-1].values
    assert share != pytest.approx(0.4, abs=1e-3)
    other = cs.solve_orbit(parameters("reaction_pulse", alpha=alpha + 0.02, D=share))
    assert other.success
    again = cs.continue_orbit(other, "alpha", alpha - 0.02, points=5)
    nearest = min((one for one in again.bifurcations), key=lambda one: abs(one.value - alpha))
    assert nearest.type == "edge"
    assert nearest.value == pytest.approx(alpha, abs=1e-10)


def bisected(p: inputs.SceneParameters, name: str, ends: tuple[float, float]) -> float:
    """The value between two at which the itinerary of settled runs changes, by bisection."""
    first, other = ends
    before = cs.solve_orbit(p.replace(**{name: first})).itinerary.cyclic
    for _ in range(30):
        middle = (first + other) / 2
        same = cs.solve_orbit(p.replace(**{name: middle})).itinerary.cyclic == before
        first, other = (middle, other) if same else (first, middle)
    return (first + other) / 2


KINKED = {"alpha": 0.62, "D": 0.5, "omega": 2.5, "delta_1": 1.9, "delta_2": 0.02, "zeta": 1.45}
KINKED |= {"beta_1": 2.3, "beta_2": 1.5, "gamma": 2.9, "s": -0.06, "f_plus": 1.0, "f_minus": 1.1}


@pytest.mark.long
def test_a_slip_about_an_edge_begins_where_the_pull_on_the_capsule_is_greatest_there() -> None:
    """The pull has a kink at an edge, and its extremum at rest may be that."""
    p = cs.scenes.prototype.Parameters(**KINKED)
    expected = bisected(p, "f_plus", (0.7, 0.69))
    itineraries = ["F2 F11", "F2 F1 F10 F11"]
    for ends in ((1.0, 0.67), (0.67, 1.0)):
        found = cs.continue_orbit(
            cs.solve_orbit(p.replace(f_plus=ends[0])), "f_plus", ends[1], points=10
        )
        assert found.success, found.message
        (event,) = found.bifurcations
        assert (event.type, event.line) == ("edge", "at friction bound forward")
        assert event.value == pytest.approx(expected, abs=2e-9)
        assert [str(event.itinerary_before), str(event.itinerary_after)] == itineraries
        itineraries.reverse()
        assert event.uncertainty < 1e-13
        assert event.multipliers == pytest.approx(event.multipliers_without, abs=1e-12)
        exact = refined(event).orbit.values[p.scene.facts.PARAMETERS.index("f_plus")]
        assert float(exact) == pytest.approx(event.value, abs=4 * event.uncertainty)
    curve = cs.continue_bifurcation(event, "alpha", ((0.5, 1.0), (0.5, 0.9)), points=5)
    bound, alpha = curve.points[-1].values
    again = bisected(p.replace(alpha=alpha), "f_plus", (bound + 1e-3, bound - 1e-3))
    assert bound == pytest.approx(again, abs=1e-10)


TOGETHER = [
    # Both drifts last as long, so that both slips meet an edge at once.
    ({"alpha": 1, "alpha_low": 0, "D": 0.5, "omega": 1.5, "delta": 1, "zeta": 0.5, "beta": 5,
      "gamma": 3, "f_b": 1.15}, "f_b", 1.18),
    # The half of a motion that is its own mirror image ends at an edge that breaks rest.
    ({"alpha": 0.5, "alpha_low": -0.5, "D": 0.5, "omega": 1.365, "delta": 1, "zeta": 0.1,
      "beta": 5, "gamma": 2, "f_b": 1}, "omega", 1.37),
    # The pull has a kink where the mass leaves the stop, and is least there.
    ({"alpha": 1, "alpha_low": -0.695, "D": 0.5, "omega": 0.7, "delta": 0.02, "zeta": 0.1,
      "beta": 15, "gamma": 1, "f_b": 1}, "alpha_low", -0.694),
    # The edge takes the pull from one bound right to the other.
    ({"alpha": 2, "D": 0.598, "omega": 0.6}, "D", 0.6),
]  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize(("values", "parameter", "to"), TOGETHER)
def test_events_that_happen_together_are_crossed_as_one(values, parameter, to) -> None:
    p = cs.scenes.reaction_pulse.Parameters(**values)
    ends = cs.solve_orbit(p), cs.solve_orbit(p.replace(**{parameter: to}))
    expected = bisected(p, parameter, (values[parameter], to))
    for begin, end in (ends, ends[::-1]):
        found = cs.continue_orbit(begin, parameter, end.value(parameter), points=5)
        assert found.success, found.message
        (event,) = found.bifurcations
        assert event.itinerary_after is not None
        sides = event.itinerary_before.cyclic, event.itinerary_after.cyclic
        assert sides == (begin.itinerary.cyclic, end.itinerary.cyclic)
        assert event.value == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize(
    ("values", "at_end"),
    [
        (TOGETHER[1][0], {("edge", Guard.UPPER), ("edge", Guard.LOWER)}),
        ({"alpha": 3.4, "alpha_low": -3.4, "D": 0.5, "omega": 0.7, "delta": 9, "zeta": 0.4,
          "beta": 5, "gamma": 2, "f_b": 1}, {("edge", Guard.DRIFT)}),
    ],
)  # fmt: skip
def test_a_half_begun_anywhere_has_the_inequalities_of_the_whole_motion(values, at_end) -> None:
    """Those of the gap aside, each comes twice in the whole motion, also where the half ends."""
    orbit = cs.solve_orbit(cs.scenes.reaction_pulse.Parameters(**values))
    n, met = len(orbit.itinerary) // 2, set[tuple[str, Guard | None]]()
    with backend("numpy", orbit.scene) as numbers:

        def of(itinerary: results.Itinerary, z: Any) -> list[float]:
            system = shooting(numbers, orbit.values, itinerary, z)
            found = inequalities(numbers, itinerary, system)
            met.update((one.kind, one.guard) for one in found if one.segment == n - 1)
            return sorted(float(one.value) for one in found if one.guard is not Guard.GAP)

        expected = of(orbit.itinerary, orbit.z)
        met.clear()
        for k in range(2 * n):
            turned = rotated(numbers, orbit.itinerary, orbit.z, orbit.system, k)
            segments = turned.itinerary.segments[:n]
            half = of(
                replace(turned.itinerary, segments=segments, mirrored=True), turned.z[: 4 + n]
            )
            assert sorted(2 * half) == pytest.approx(expected, abs=1e-11)
    assert at_end <= met


def test_at_an_edge_each_side_has_derivatives_of_its_own() -> None:
    """Differences of orbits on one side alone, a parabola through three of them."""
    found = branch("reaction_pulse", "alpha", 0.5)
    event = next(one for one in found.bifurcations if one.type == "edge")
    beside = event.orbit_without
    assert beside is not None
    for orbit in (event.orbit, beside):
        whole = str(orbit.itinerary.cyclic)
        side = 1 if whole == str(event.itinerary_before.cyclic) else -1
        assert side == 1 or whole == str(event.itinerary_after.cyclic)
        step = 1e-4 * side
        first, second = (
            float(settled("reaction_pulse", alpha=event.value + k * step).average_velocity)
            for k in (1, 2)
        )
        now = float(orbit.average_velocity)
        slope = (4 * first - second - 3 * now) / (2 * step)
        assert cs.performance(orbit).velocity.gradient["alpha"] == pytest.approx(slope, rel=1e-5)


ALIKE = {"delta_1": 0.5, "delta_2": 0.5, "beta_1": 3, "beta_2": 3, "gamma": 2, "omega": 0.9}
MIRRORED = {**ALIKE, "zeta": 0.05, "D": 0.5, "s": 0, "f_plus": 1, "f_minus": 1}


def test_motions_between_stops_alike_are_followed_by_their_halves() -> None:
    """A multiplier -1 of the half's map is 1 for the whole motion: its symmetry breaks."""
    p = cs.scenes.prototype.Parameters(**MIRRORED, alpha=0.9, alpha_low=-0.9)
    orbit = cs.solve_orbit(p)
    half = orbits.half_orbit(orbit)
    assert half is not None
    assert half.itinerary.whole.cyclic == orbit.itinerary.cyclic
    run, whole = half.trajectory(), {s.name: s for s in orbit.motion.segments}
    assert run.final[1] == pytest.approx(run(run.span[1]), abs=1e-12)
    for segment in half.motion.segments:
        same = whole[segment.name]
        assert (segment.source, segment.target) == (same.source, same.target)
        assert segment.mode == p.scene.facts.MODES[segment.field - 1]
    assert half.multipliers == pytest.approx(orbit.multipliers, abs=1e-9)
    found = cs.continue_orbit(orbit, "alpha", 1.1, ties={"alpha_low": "-1*alpha"}, points=10)
    assert [one.type for one in found.bifurcations] == ["symmetry breaking"]
    assert found.bifurcations[0].multipliers[0] == pytest.approx(1, abs=1e-7)
    # With the high level alone no motion has an image, and the branch is of whole motions.
    other = cs.continue_orbit(orbit, "alpha", 0.95, points=10)
    assert {one.symmetry for one in other.bifurcations} <= {""}
    assert not any(one.orbit.itinerary.mirrored for one in other.points)


@lru_cache
def broken() -> results.Branch:
    p = cs.scenes.prototype.Parameters(**MIRRORED, alpha=0.9, alpha_low=-0.9)
    return cs.continue_orbit(
        cs.solve_orbit(p), "alpha", 1.1, ties={"alpha_low": "-1*alpha"}, points=10
    )


@pytest.mark.long
def test_two_branches_of_mirror_images_leave_where_a_symmetry_breaks(judge: Integrator) -> None:
    (breaking,) = broken().bifurcations
    itself, one, other = cs.continue_from(broken(), "SB1", 1.1, points=10)
    assert [b.origin for b in (itself, one, other)] == ["SB1.1", "SB1.2", "SB1.3"]
    assert orbits.half_orbit(itself.points[-1].orbit) is not None
    assert [b.status for b in (one, other)] == [results.Status.REACHED, results.Status.REACHED]
    ends = [branch.points[-1].orbit for branch in (one, other)]
    assert ends[0].average_velocity == pytest.approx(-ends[1].average_velocity, abs=1e-12)
    assert abs(ends[0].average_velocity) > 0.01
    assert ends[0].multipliers == pytest.approx(ends[1].multipliers, abs=1e-9)
    for orbit in ends:
        begin = tuple(np.array(orbit.trajectory()(orbit.parameters.period), dtype=float))
        (run,) = judge.runs(SCENES["prototype"], [Start(orbit.parameters.to_dict(), begin)], 1)
        assert np.array([*map(float, run.state[:3])]) == pytest.approx(begin, abs=1e-11)
    # The distance of the orbits beside the point is that of the half's normal form.
    form = breaking.normal_form
    assert form is not None
    assert (form.order, form.scenario) == (2, "supercritical")
    first, second = np.split(one.points[1].orbit.durations.astype(float), 2)
    apart = float(np.linalg.norm(first - second)) / 2
    grown = one.points[1].value - breaking.value
    assert form.growth * apart**2 == pytest.approx(grown, rel=1e-2)


@pytest.mark.long
def test_a_branch_ends_where_its_orbits_become_their_own_mirror_images() -> None:
    (_, one, _) = cs.continue_from(broken(), "SB1", 0.98, points=10)
    (back,) = cs.continue_from(one, "EP2", 0.93, points=10)
    (breaking,) = broken().bifurcations
    assert back.status is results.Status.SYMMETRIC
    assert back.bifurcations[-1].type == "symmetry breaking"
    assert back.bifurcations[-1].value == pytest.approx(breaking.value, abs=1e-11)


def test_a_doubled_branch_of_pulses_goes_on_from_its_file(tmp_path: Path) -> None:
    """At the end of a doubled branch, that of half the period begins."""
    p = cs.scenes.reaction_pulse.Parameters(
        alpha=0.76, alpha_low=-0.03, D=0.4, omega=0.76, zeta=0.01, beta=12.6
    )
    to, path = 0.74, tmp_path / "branch.json"
    doubled = cs.continue_orbit(cs.solve_orbit(p), "omega", to)
    assert doubled.status is results.Status.PERIOD_HALVED
    path.write_text(dumps(branch_record(doubled)))
    (found,) = cs.continue_from(path, "PD1", to, points=3)
    there = cs.solve_orbit(p.replace(omega=to))
    end = found.points[-1].orbit
    assert end.itinerary.period_number == there.itinerary.period_number == 1
    assert end.progression == pytest.approx(there.progression, abs=1e-10)


def test_both_stops_and_edges_are_in_an_orbit_between_two_stops(judge: Integrator) -> None:
    changes = {"beta_1": 9, "delta_2": 0.3, "s": 0.1, "alpha": 2.2, "alpha_low": -1.2, "D": 0.45}
    orbit = cs.solve_orbit(cs.scenes.prototype.Parameters(**MIRRORED | changes))
    assert orbit.success
    guards = {segment.guard for segment in orbit.itinerary.segments}
    assert guards == set(Guard) - {Guard.LOWER}
    found = cs.performance(orbit)
    assert abs(found.imbalance) < 1e-12
    begin = np.array(orbit.trajectory()(2 * orbit.parameters.period), dtype=float)
    start = Start(orbit.parameters.to_dict(), tuple(begin.tolist()), 0.0)
    run = judge.runs(SCENES["prototype"], [start], orbit.itinerary.period_number)[0]
    assert np.array([*map(float, run.state[:3])]) == pytest.approx(begin, abs=1e-11)
    assert {segment.event for segment in run.segments} >= {"F", "B", "R", "D"}


def test_motions_have_images_by_the_values_of_parameters() -> None:
    slope = cs.scenes.slope.Parameters
    assert symmetric(slope(s=0, f_plus=1, f_minus=1))
    assert not symmetric(slope(s=0.1, f_plus=1, f_minus=1))
    assert not symmetric(slope(s=0, f_plus=1.1, f_minus=1))
    pulses = cs.scenes.reaction_pulse.Parameters
    assert symmetric(pulses(alpha=1, alpha_low=-1, D=0.5))
    assert not symmetric(pulses(alpha=1, alpha_low=-1, D=0.4))
    assert not symmetric(pulses(alpha=1, alpha_low=0, D=0.5))


def test_an_itinerary_is_of_the_fields_of_its_scene() -> None:
    pulses = results.Itinerary.parse("F5 F11 F8 F2", scene=cs.scenes.reaction_pulse)
    assert pulses.fields == (5, 11, 8, 2)
    assert str(pulses) == "F5 F11 F8 F2"
    with pytest.raises(cs.InvalidInput, match="fields from 1 to 6"):
        results.Itinerary.of((5, 11))
    with pytest.raises(cs.InvalidInput, match="one of the fields of slope"):
        orbits.solve_itinerary(cs.scenes.slope.Parameters(), pulses, [0.0] * 8)


def test_a_text_of_many_digits_is_refused_at_once() -> None:
    text = "1" * 40 + "x"  # its digits part into numbers in 2^39 ways
    with pytest.raises(cs.InvalidInput) as caught:
        results.Itinerary.parse(text, scene="prototype")
    assert (caught.value.field, caught.value.value) == ("itinerary", text)
    assert results.Itinerary.parse("F1F4,13 F10", scene="prototype").fields == (1, 4, 13, 10)


def test_the_jacobian_of_a_run_is_that_of_differences(judge: Integrator) -> None:
    for name in MOTIONS:
        p, x = parameters(name), np.array([0.31, -0.2, 0.4])
        found = orbits.jacobian(simulate(p, tuple(x), periods=1))
        moved = [x + sign * STEP * unit for unit in np.eye(3) for sign in (1, -1)]
        ends = states(judge, name, moved, p)[:, :3]
        slopes = (ends[0::2] - ends[1::2]).T / (2 * STEP)
        assert found == pytest.approx(slopes, abs=1e-6)


TWO_STOPS = {"beta_1": 9, "delta_2": 0.3, "s": 0.1, "alpha": 2.2, "alpha_low": -1.2, "D": 0.45}
PULSED = {
    "two stops": cs.scenes.prototype.Parameters(**MIRRORED | TWO_STOPS),
    "half": cs.scenes.prototype.Parameters(**MIRRORED, alpha=0.9, alpha_low=-0.9),
    "half at rest": cs.scenes.prototype.Parameters(**MIRRORED, alpha=0.1, alpha_low=-0.1),
    "rest that an edge breaks": cs.scenes.reaction_pulse.Parameters(
        alpha=0.8, alpha_low=-0.72, D=0.4
    ),
}


@lru_cache
def pulsed(name: str) -> results.Orbit:
    orbit = cs.solve_orbit(PULSED[name])
    assert orbit.success, orbit.message
    return (orbits.half_orbit(orbit) or orbit) if name.startswith("half") else orbit


@sampled
@pytest.mark.parametrize("name", some(PULSED, 2))
def test_core_and_kernels_give_the_same_equations_of_a_pulsed_orbit(name: str) -> None:
    """Also of halves, whose images are at the other level, and begun at each of their segments."""
    orbit = pulsed(name)
    assert orbit.itinerary.mirrored == name.startswith("half")
    off = 1e-3 * np.random.default_rng(0).normal(size=len(orbit.z))
    with backend("numpy", orbit.scene) as numbers:
        forms = ClosedForms(numbers, orbit.values)
        for first in range(len(orbit.itinerary)):
            begun = rotated(numbers, orbit.itinerary, orbit.z, orbit.system, first)
            assert np.abs(shooting(numbers, orbit.values, *begun[:2]).residual).max() < 1e-12
            z = begun.z + off
            found = forms.evaluated(begun.itinerary, z)
            assert found is not None
            native = of_core(forms.values, begun.itinerary, z, found)
            plain = _by_kernels(forms, begun.itinerary, z)
            for kind in ("residual", "by_z", "by_p", "advance_by"):
                one, other = getattr(native, kind), getattr(plain, kind)
                assert one == pytest.approx(other, abs=1e-14 * (1 + abs(other).max())), kind


@sampled
@pytest.mark.parametrize("name", some(PULSED, 2))
def test_the_core_solves_a_pulsed_orbit_as_fifty_digits_do_and_the_integrator_closes_it(
    name, judge
) -> None:
    z = pulsed(name).z + 1e-4 * np.random.default_rng(1).normal(size=len(pulsed(name).z))
    found = orbits.solve_itinerary(pulsed(name).parameters, pulsed(name).itinerary, list(z))
    assert found.success
    exact = found.refined()
    assert exact.success
    assert found.z == pytest.approx(exact.z.astype(float), abs=1e-12)
    whole = orbits.whole_orbit(found)
    run, p = whole.trajectory(), whole.parameters
    x = np.array(run(p.period if run.origin[0].phase else 0.0), dtype=float)
    start, periods = Start(p.to_dict(), tuple(x.tolist()), 0.0), whole.itinerary.period_number
    end = [float(value) for value in judge.runs(SCENES[p.scene.name], [start], periods)[0].state]
    assert end == pytest.approx([*x, periods * float(whole.progression)], abs=1e-11)


def test_a_slip_after_rest_that_an_edge_breaks_has_one_zero_at_its_start() -> None:
    itinerary = pulsed("rest that an edge breaks").itinerary
    assert itinerary.fields == (5, 4, 5, 2, 8, 3, 2)
    assert itinerary.segments[4].guard is Guard.EDGE
    assert itinerary.zeros(5) == 1


def test_an_itinerary_has_two_edges_a_period() -> None:
    with pytest.raises(cs.InvalidInput, match="half the number of edges of the drive, here 2"):
        results.Itinerary.parse("F1 F7", 2, cs.scenes.reaction_pulse)


PEAKS = {"reaction": {}, "reaction_pulse": {"alpha": 1.8, "alpha_low": -0.1, "omega": 0.6}}


@pytest.mark.long
@pytest.mark.parametrize("name", PEAKS)
def test_peaks_of_a_drive_that_reacts_are_those_of_fifty_digits_and_of_samples(
    name, monkeypatch
) -> None:
    """By the core, and by the expansions of the reference map, which has none of its extrema."""
    orbit = cs.solve_orbit(getattr(cs.scenes, name).Parameters(**PEAKS[name]))
    found, exact = cs.performance(orbit), cs.performance(orbit.refined())
    monkeypatch.setattr(extrema, "_by_core", lambda *_: None)
    without = cs.performance(orbit)
    run, p = orbit.trajectory(), orbit.parameters.to_dict()
    begin = float(run.origin[0].phase)
    x = run(begin + orbit.parameters.period * np.linspace(0, 1, 20_001))
    force = x[:, 0] + 2 * p["zeta"] * x[:, 1] + p["beta"] * np.maximum(x[:, 0] - p["delta"], 0)
    assert found.peak_force.value == pytest.approx(abs(force).max(), rel=1e-7)
    for metric in ("work", "peak_force", "peak_contact"):
        one, other = getattr(found, metric), getattr(exact, metric)
        gradient = {key: float(value) for key, value in other.gradient.items()}
        for mine in (one, getattr(without, metric)):
            assert mine.value == pytest.approx(float(other.value), rel=1e-13)
            assert mine.gradient == pytest.approx(gradient, rel=1e-11, abs=1e-12)


def test_an_orbit_that_begins_at_the_stop_behind_does_not_depend_on_the_one_in_front() -> None:
    """Its start is held to the surface of the stop that it begins at."""
    p = cs.scenes.prototype.Parameters(
        alpha=0.6557658209124334, D=0.5, omega=0.3189276737630118, delta_1=2.68, delta_2=0.02,
        zeta=0.05, beta_1=30, beta_2=1.5, gamma=2.2539, s=0.011889, f_plus=0.8943, f_minus=1.4997,
    )  # fmt: skip
    orbit = cs.solve_orbit(p)
    assert orbit.itinerary.fields[0] == 17
    found, far = cs.performance(orbit), cs.performance(cs.solve_orbit(p.replace(delta_1=2.5)))
    assert found.work.gradient["delta_1"] == 0
    assert found.work.value == pytest.approx(far.work.value, rel=1e-12)


DRAGGED = [
    ("prototype", {}, "D", 0.5, 1),  # alpha D = f_plus
    ("prototype", {"alpha_low": -0.5, "s": 0.5, "D": 0.4}, "s", 1.5, -1),  # s + .3 - .8 = f_minus
    ("slope", {"s": 0.7}, "s", 0.934, -1),  # s = f_minus: a cosine has no mean
    ("slope", {"s": -0.7}, "s", -1.066, 1),  # there each segment but one has duration 0
]


@sampled
@pytest.mark.parametrize(("name", "changes", "parameter", "limit", "way"), some(DRAGGED, 1))
def test_where_the_mean_force_exceeds_friction_the_device_is_dragged(
    name, changes, parameter, limit, way, judge
) -> None:
    """The integrator's momentum grows by the excess times the time, and branches end before."""
    scene: Scene = getattr(cs.scenes, name)
    begin, beyond = scene.Parameters(**changes), limit * 1.5
    found = cs.continue_orbit(cs.solve_orbit(begin), parameter, beyond, points=10)
    assert (found.status, found.success) == (results.Status.DRAGGED, False)
    assert "reaches friction" in found.message
    assert found.bifurcations[-1].value == pytest.approx(limit, rel=1e-12)
    assert len(found.points) < 200
    past = begin.replace(**{parameter: beyond})
    none = cs.solve_orbit(past)
    assert none.status == "not-periodic"
    assert f"drags the device {'forward' if way > 0 else 'backward'}" in none.message
    start = Start(past.to_dict(), (0.0, 0.0, 0.0), 0.0)
    states = [judge.runs(SCENES[name], [start], n)[0].state for n in (12, 13)]
    momenta = [float(state[1] + (1 + past.gamma) * state[2]) for state in states]
    bound = past.f_plus if way > 0 else -past.f_minus
    mean = past.D * past.alpha + (1 - past.D) * past.alpha_low if name == "prototype" else 0
    excess = mean - past.s - bound
    assert momenta[1] - momenta[0] == pytest.approx(excess * past.period, rel=1e-9)
    assert way * excess > 0


def test_a_mean_force_at_the_bound_drags_nothing_however_large_its_terms() -> None:
    """.76 x 33.1 - .24 x 104.775 + .14 is .15, but for the roundings of what cancels."""
    p = cs.scenes.prototype.Parameters(
        D=0.76, alpha=33.1, alpha_low=-104.775, s=-0.14, f_plus=0.15, f_minus=1
    )
    assert dragged(p) == ""
    assert "forward" in dragged(p.replace(f_plus=0.15 - 1e-11))


def test_a_drive_that_reacts_drags_nothing() -> None:
    """Its force on both bodies together is 0, whatever its mean."""
    assert dragged(cs.scenes.reaction_pulse.Parameters(alpha=9, alpha_low=8, D=0.9)) == ""
    assert cs.solve_orbit(parameters("reaction_pulse", alpha=3, alpha_low=2.5)).success
