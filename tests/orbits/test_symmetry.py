"""Orbits that are their own mirror image: followed through events that happen twice a period."""

from dataclasses import replace
from functools import lru_cache
from itertools import groupby
from typing import Any

import numpy as np
import pytest
from scipy.linalg import sqrtm
from scipy.optimize import fsolve

import capsule_sym as cs
from capsule_sym import orbits
from capsule_sym._map.backend import backend
from capsule_sym._orbits.continuation import conditions, kinds
from capsule_sym._orbits.continuation.conditions import Collapse, EventSolution, ExtendedSystem
from capsule_sym._orbits.continuation.problem import Family
from capsule_sym._orbits.shooting.equations import ShootingSystem, shooting
from capsule_sym.results import Branch, Itinerary, Orbit, Status
from tests.orbits.branches import settled
from tests.orbits.test_identity import twice

pytestmark = pytest.mark.long

SCENARIO = [kinds.ADDING, kinds.GRAZING, kinds.CROSSING, kinds.CROSSING, kinds.CORNER]


@lru_cache
def over_alpha(begin: float, end: float, **parameters: float) -> Branch:
    return cs.continue_orbit(settled(alpha=begin, **parameters), "alpha", end)


def first_slip(omega: float, zeta: float, f_b: float = 1.0) -> float:
    """Amplitude at which the force of the one spring on a capsule at rest reaches its friction."""
    damper = 2j * zeta * omega
    return f_b * abs(1 - omega**2 + damper) / abs(1 + damper)


def plain(fields: tuple[int, ...]) -> tuple[int, ...]:
    """Fields without contact, a field that follows itself taken once, cyclically."""
    once = [field for field, _ in groupby((field - 1) % 3 + 1 for field in fields)]
    return tuple(once[:-1]) if len(once) > 1 and once[0] == once[-1] else tuple(once)


def test_without_contact_a_motion_is_its_own_mirror_image() -> None:
    stick, sliding = (settled(alpha=alpha, delta=5.0) for alpha in (0.3, 0.6))
    assert len(stick.itinerary) == 1
    assert sliding.itinerary.cyclic.fields == (2, 1, 2, 3)
    assert orbits.mirror_image(stick)
    assert orbits.mirror_image(sliding)
    # The second spring is on one side only; without stiffness it is on none.
    assert not orbits.mirror_image(settled(alpha=0.6))
    assert orbits.mirror_image(settled(alpha=0.6, beta=0.0))
    assert not orbits.mirror_image(twice(sliding))


def test_a_first_half_has_the_metrics_and_the_certificate_of_its_orbit() -> None:
    whole = settled(alpha=0.6, delta=5.0)
    half = orbits.half_orbit(whole)
    assert half.itinerary.mirrored
    assert orbits.mirror_image(half)
    assert half.progression == half.average_velocity == 0.0
    one, other = cs.performance(half), cs.performance(whole)
    for name in ("work", "friction_loss", "peak_force"):
        assert getattr(one, name).value == pytest.approx(getattr(other, name).value, rel=1e-12)
    one, other = cs.certify_orbit(half), cs.certify_orbit(whole)
    assert (one["fields"], one["stable"]) == (other["fields"], other["stable"])
    run = half.trajectory()
    assert run.final[1] == pytest.approx([-value for value in run.origin[1]], abs=1e-12)
    assert run.final[1] == pytest.approx(run(run.span[1]), abs=1e-12)
    planes = [segment.source for segment in whole.motion.segments]
    ends = [(segment.source, segment.target) for segment in half.motion.segments]
    assert [source for source, _ in ends] == planes[: len(ends)]
    assert [target for _, target in ends] == planes[1 : len(ends) + 1]


@pytest.mark.parametrize(("begin", "end"), [(0.1, 2.0), (2.0, 0.1)])
def test_a_gap_beyond_the_reach_of_stick_is_passed_both_ways(begin: float, end: float) -> None:
    branch = over_alpha(begin, end, delta=1.2)
    assert branch.status is Status.REACHED
    found = sorted(branch.bifurcations, key=lambda one: one.value)
    assert [one.type for one in found] == SCENARIO
    assert [one.symmetry for one in found] == ["kept", "broken", "", "", ""]
    expected = first_slip(found[0].orbit.parameters.omega, found[0].orbit.parameters.zeta)
    assert abs(found[0].value - expected) < 8 * 2**-53 + found[0].uncertainty
    # Started beside the orbit the certified map alone settles on the itineraries on either side.
    for one in found:
        itineraries = [one.itinerary_before, one.itinerary_after][:: 1 if end > begin else -1]
        flow = one.orbit.system.flows[0]
        for side, itinerary in zip((-1e-6, 1e-6), itineraries, strict=True):
            parameters = cs.Parameters(alpha=one.value + side, delta=1.2)
            phase = float(flow.angle) / parameters.omega % parameters.period
            run = cs.simulate(parameters, [float(v) for v in flow.start], phase, 200)
            motion = run.steady(1e-9)
            assert motion is not None
            assert motion.itinerary == itinerary.cyclic.names, (one.type, side)


def test_what_never_sticks_is_reached_and_left() -> None:
    up, down = over_alpha(0.5, 1.5, delta=5.0), over_alpha(1.5, 0.5, delta=5.0)
    for branch in (up, down):
        assert branch.status is Status.REACHED
        assert [one.type for one in branch.bifurcations] == [kinds.CROSSING]
    one, other = up.bifurcations[0], down.bifurcations[0]
    assert (str(one.itinerary_before), str(one.itinerary_after)) == ("F2 F1 F2 F3", "F1 F3")
    assert (str(other.itinerary_before), str(other.itinerary_after)) == ("F1 F3", "F2 F1 F2 F3")
    assert abs(one.value - other.value) <= one.uncertainty + other.uncertainty < 1e-12
    assert one.value == pytest.approx(never_sticking(), abs=1e-12)


def never_sticking() -> float:
    """The least amplitude without stick of the free capsule, from its equations of motion.

    Half a period of drift is a linear system: its end is the reversed start. At the least amplitude
    the force of the spring is f_b where the drift begins.
    """
    parameters = cs.Parameters(delta=5.0)
    omega, zeta, gamma = parameters.omega, parameters.zeta, parameters.gamma
    half = np.pi / omega
    # x_r'' + (1 + 1/gamma)(x_r + 2 zeta v_r) = alpha cos(omega tau) + s f_b / gamma, s = sign v_c
    k = 1 + 1 / gamma
    matrix = np.array([[0.0, 1.0], [-k, -2 * zeta * k]])
    values, vectors = np.linalg.eig(matrix)
    carried = ((vectors * np.exp(values * half)) @ np.linalg.inv(vectors)).real
    rest = np.array([1 / (gamma * k), 0.0])  # where a drift with s = 1 would come to rest

    def forced(angle: float) -> np.ndarray:
        """x_r and v_r of the response to the forcing alone, of amplitude 1."""
        x = np.exp(1j * angle) / (k - omega**2 + 2j * zeta * omega * k)
        return np.array([x.real, (1j * omega * x).real])

    # Half a period from v_c = 0 with s = 1: the state is reversed, v_c is 0 again.
    free = np.linalg.solve(carried + np.eye(2), -2 * rest)

    def conditions(unknowns: np.ndarray) -> list[float]:
        alpha, angle = unknowns
        x, v = rest + free + alpha * forced(angle)
        # gamma v_c' = x_r + 2 zeta v_r - s f_b, and v_m + gamma v_c changes by forcing and friction
        momentum = 2 * v - (2 * alpha / omega) * np.sin(angle) - half
        return [x + 2 * zeta * v - 1, momentum]

    found, _, status, message = fsolve(conditions, [1.0, -1.0], xtol=1e-14, full_output=True)
    assert status == 1, message
    return float(found[0])


def test_a_spring_without_stiffness_does_not_matter() -> None:
    branch, far = over_alpha(0.1, 1.5, beta=0.0), over_alpha(0.1, 1.5, delta=50.0)
    assert branch.status is far.status is Status.REACHED
    assert [one.type for one in branch.bifurcations] == [kinds.ADDING, kinds.CROSSING]
    for one, other in zip(branch.bifurcations, far.bifurcations, strict=True):
        assert abs(one.value - other.value) <= one.uncertainty + other.uncertainty
    for point in branch.points[::10]:
        motion = settled(alpha=point.value, beta=0.0).itinerary.cyclic.fields
        itineraries = [plain(motion[i:] + motion[:i]) for i in range(len(motion))]
        assert point.orbit.itinerary.fields in itineraries


def test_a_curve_of_pairs_is_the_closed_form() -> None:
    one = over_alpha(0.1, 2.0, delta=1.2).bifurcations[0]
    for second, ends in (("gamma", (1.0, 5.0)), ("zeta", (0.01, 0.3)), ("omega", (0.5, 1.5))):
        curve = cs.continue_bifurcation(one, second, ((0.05, 2.0), ends), points=8)
        assert [ending for ending, _ in curve.endings] == [Status.REACHED, Status.REACHED]
        for point in curve.points:
            values = dict(zip(curve.parameters, point.values, strict=True))
            base = {"omega": one.orbit.parameters.omega, "zeta": one.orbit.parameters.zeta}
            slip = first_slip(**{name: values.get(name, base[name]) for name in base})
            assert values["alpha"] == pytest.approx(slip, abs=1e-13)


def test_a_curve_goes_on_in_pairs_where_the_spring_is_no_longer_touched() -> None:
    branch = over_alpha(0.1, 2.0, delta=1.2)
    one = next(one for one in branch.bifurcations if one.type == kinds.CROSSING)
    curve = cs.continue_bifurcation(one, "delta", ((0.1, 2.0), (1.0, 5.0)), points=10)
    assert [ending for ending, _ in curve.endings] == [Status.REACHED, Status.REACHED]
    assert [m.types for m in curve.codimension_two] == [(kinds.CROSSING, kinds.GRAZING)]
    alpha, delta = curve.codimension_two[0].values
    assert alpha == pytest.approx(never_sticking(), abs=1e-12)
    orbit = settled(alpha=alpha - 1e-9, delta=50.0)
    run, period = orbit.trajectory(), orbit.parameters.period
    times = float(run.origin[0].phase) + period * np.linspace(1e-9, 1 - 1e-9, 20_001)
    assert delta == pytest.approx(run(times)[:, 0].max(), abs=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_it_does_so_however_durations_are_rounded(seed, monkeypatch) -> None:
    """A segment lasts as the third power of another there: its duration is soon below rounding."""
    random, evaluate = np.random.default_rng(seed), conditions.shooting

    def rounded(*given: Any) -> ShootingSystem:
        system = evaluate(*given)
        noise, added = 1e-16 * random.normal(size=(2, *system.residual.shape))
        residual = system.residual * (1 + 2 * noise) + added
        return replace(system, residual=residual, by_z=system.by_z * (1 + 2 * noise))

    branch = over_alpha(0.1, 2.0, delta=1.2)
    one = next(one for one in branch.bifurcations if one.type == kinds.CROSSING)
    monkeypatch.setattr(conditions, "shooting", rounded)
    curve = cs.continue_bifurcation(one, "delta", ((0.1, 2.0), (1.0, 5.0)), points=10)
    assert [ending for ending, _ in curve.endings] == [Status.REACHED, Status.REACHED]


def test_a_zero_of_rounding_beside_a_point_is_no_other_point(monkeypatch) -> None:
    """The stick that lasts as the third power of the contact is 0 to rounding before the contact.

    Newton's method seldom ends there; here it always does.
    """
    solved = Family.solved
    found: list[EventSolution | None] = []

    def ended(
        family: Family,
        orbit: Orbit,
        names: tuple[str, ...],
        segments: tuple[int, ...] = (),
        collapse: Collapse | None = None,
    ) -> EventSolution | None:
        if orbit.itinerary.fields != (1, 4, 1, 2, 3, 2) or segments != (3, 5):
            return solved(family, orbit, names, segments, collapse)
        beside = family.corrected_at(family.unknowns(orbit), kinds.DURATIONS + 1, 1.5e-5)
        assert beside is not None
        at, free = beside.at.orbit, tuple(axis.path for axis in family.axes)
        system = ExtendedSystem(family.numbers, at.values, free, at.itinerary, segments)
        unknowns = system.unknowns(at)
        found.append(system._solution(system.evaluate(unknowns), unknowns, 1))
        return found[-1]

    branch = over_alpha(0.1, 2.0, delta=1.2)
    one = next(one for one in branch.bifurcations if one.type == kinds.CROSSING)
    monkeypatch.setattr(Family, "solved", ended)
    curve = cs.continue_bifurcation(one, "delta", ((0.1, 2.0), (1.0, 5.0)), points=10)
    assert found[0] is not None
    assert [ending for ending, _ in curve.endings] == [Status.REACHED, Status.REACHED]
    assert [m.types for m in curve.codimension_two] == [(kinds.CROSSING, kinds.GRAZING)]


def test_half_a_motion_has_the_equations_of_the_whole() -> None:
    for orbit in (settled(alpha=a, delta=5.0) for a in (0.3, 0.6, 1.5)):
        half = orbits.half_orbit(orbit)
        assert half is not None
        again = orbits.whole_orbit(half)
        assert str(half.itinerary) == str(again.itinerary) == str(orbit.itinerary)
        assert again.residual < 1e-13
        assert again.z == pytest.approx(orbit.z, abs=1e-12)
        assert np.sort(abs(orbits.floquet_multipliers(half))) == pytest.approx(
            np.sort(abs(orbits.floquet_multipliers(orbit)))
        )
        # Its derivatives are those of finite differences.
        with backend("numpy") as numbers:
            for k in range(len(half.z)):
                step = np.zeros(len(half.z))
                step[k] = 1e-6
                ends = [
                    shooting(numbers, half.values, half.itinerary, half.z + s * step)
                    for s in (1, -1)
                ]
                slope = (ends[0].residual - ends[1].residual) / 2e-6
                assert half.system.by_z[:, k] == pytest.approx(slope, abs=1e-7)
    assert orbits.half_orbit(settled(alpha=0.6)) is None


def test_a_half_word_ends_in_the_image_of_its_first_field() -> None:
    itinerary = Itinerary.of((1, 2), mirrored=True)
    assert itinerary.whole == Itinerary.of((1, 2, 3, 2))
    assert itinerary.rotated(1).whole == Itinerary.of((2, 3, 2, 1))
    assert [itinerary.neighbour(i) for i in (-1, 0, 1, 2)] == [2, 1, 2, 3]
    assert Itinerary.of((1,), mirrored=True).whole == Itinerary.of((1, 3))
    assert Itinerary.of((2,), mirrored=True).whole == Itinerary.of((2,))


def test_no_multiplier_of_a_motion_without_contact_exceeds_one() -> None:
    # The energy of the difference of two motions never grows: see the module.
    random = np.random.default_rng(5)
    for _ in range(10):
        alpha, omega, zeta, gamma = random.uniform([0.3, 0.3, 0.005, 0.3], [3, 3, 0.3, 10])
        orbit = settled(alpha=alpha, omega=omega, zeta=zeta, gamma=gamma, delta=50.0)
        energy = np.array([[1, 0, 0], [0, 1, 1], [0, 1, 1 + gamma]])
        root = sqrtm(energy)
        carried = root @ orbits.monodromy_matrix(orbit) @ np.linalg.inv(root)
        assert np.linalg.norm(carried, 2) <= 1 + 1e-12
