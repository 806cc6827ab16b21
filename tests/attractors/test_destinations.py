"""Attractors of starts, against runs of the scalar map one by one."""

import math

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._attractors.destinations import Arrivals, Cycle, KnownOrbits, known_orbits
from capsule_sym._attractors.neighbourhoods import NONE, spectral_radii, stroboscopic
from capsule_sym._orbits.shooting.search import orbit_at
from capsule_sym._orbits.shooting.symmetry import same

BISTABLE = cs.Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
# Of periods 4 and 6, the second with a small basin in the middle of the first's.
SMALL = cs.Parameters(
    alpha=0.8481742,
    omega=2.2140416,
    delta=0.2230407,
    zeta=0.0922256,
    beta=7.9475673,
    gamma=5.1480053,
)


def known(parameters: cs.inputs.SceneParameters, starts: np.ndarray) -> list[cs.results.Orbit]:
    """Orbits that single runs from starts settle on, each once."""
    found: list[cs.results.Orbit] = []
    for start in starts:
        orbit = cs.solve_orbit(parameters, start.tolist())
        if orbit.success and not any(same(orbit, other) for other in found):
            found.append(orbit)
    return found


def ends(
    parameters: cs.inputs.SceneParameters, start: np.ndarray, phase: float, periods: int
) -> np.ndarray:
    """States at phase 0 of the last periods of a single run."""
    run = cs.simulate(parameters, start.tolist(), phase, periods, keep="stroboscopic")
    return np.array(run.stroboscopic[-16:])


CHAOTIC = cs.Parameters(alpha=1.88, omega=0.32, delta=0.03, zeta=0.05, beta=17.57, gamma=7.47)


def nearest(orbits: list[cs.results.Orbit], state: np.ndarray) -> int:
    """Number of the orbit that a state at phase 0 is on, NONE if it is on none."""
    apart = [abs(stroboscopic(orbit) - state).max(axis=1).min() for orbit in orbits]
    return int(np.argmin(apart)) if min(apart) < 1e-6 else NONE


@pytest.mark.parametrize(
    "parameters",
    [BISTABLE, cs.scenes.prototype.Parameters(), cs.scenes.reaction_pulse.Parameters()],
    ids=lambda p: p.scene.shown,
)
def test_starts_lead_where_single_runs_end(parameters):
    random = np.random.default_rng(3)
    starts = random.uniform(-3, 3, (24, 3))
    phases = random.uniform(0, parameters.period, 24) * (np.arange(24) % 2)
    orbits = known(parameters, starts[:8])
    assert orbits
    groups, found = np.zeros(24, int), Arrivals.begun(starts)
    numbers = known_orbits(orbits).destination(groups, found, phases, 8192).numbers
    numbers = np.where(numbers < len(orbits), numbers, NONE)  # others may be found besides
    expected = [
        nearest(orbits, ends(parameters, *one, 2000)[-1])
        for one in zip(starts, phases, strict=True)
    ]
    assert numbers.tolist() == expected


@pytest.mark.parametrize("parameters", [BISTABLE, SMALL], ids=("bistable", "small"))
def test_states_within_a_neighbourhood_come_to_the_attractor(parameters):
    random = np.random.default_rng(1)
    orbits = [one.orbit for one in cs.attractors(parameters, {"x_r": (-3, 3)}, count=60).attractors]
    found = known_orbits(orbits)
    assert len(orbits) > 1
    for owner, cycle in enumerate(found.cycles[0]):
        for state in cycle.states:
            (axes,) = (axes for *_, centre, axes in found.near if (centre == state).all())
            within = random.normal(size=(20, 3))
            within /= np.linalg.norm(within, axis=1)[:, None]
            starts = state + within @ np.linalg.inv(axes) * 0.999
            assert (found.inside(np.zeros(20, int), starts) == owner).all()
            run = cs.simulate_many([parameters] * 20, starts, periods=300)
            assert [nearest(orbits, end) for end in run.states] == [owner] * 20


def test_where_an_orbit_is_not_closed_the_map_has_the_derivatives_itself(monkeypatch):
    orbit = cs.solve_orbit(BISTABLE)
    axes = [one[-1] for one in known_orbits([orbit]).near]

    def unclosed(self, rows, states, periods):
        return states, np.full((len(states), 3, 3), np.nan), None

    monkeypatch.setattr(KnownOrbits, "close", unclosed)
    others = [one[-1] for one in known_orbits([orbit]).near]
    np.testing.assert_allclose(others, axes, rtol=1e-6, atol=1e-6 * np.abs(axes).max())


def test_a_matrix_without_all_of_its_numbers_has_no_spectral_radius():
    rotation = 0.5 * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.1]])
    matrices = np.stack([rotation, rotation, -2 * np.eye(3)])
    matrices[1, 0, 2] = np.inf
    np.testing.assert_allclose(spectral_radii(matrices), [0.5, np.nan, 2.0])


@pytest.mark.parametrize(
    "orbits",
    [
        [],
        [cs.orbits.solve_itinerary(cs.Parameters(zeta=0.0), cs.results.Itinerary.parse("F2"))],
        [cs.solve_orbit(BISTABLE), cs.solve_orbit(cs.Parameters())],
        [cs.solve_orbit(cs.Parameters(), periods=1)],
    ],
    ids=("none", "neutral", "two parameter sets", "no orbit"),
)
def test_other_orbits_are_refused(orbits):
    with pytest.raises(cs.InvalidInput, match="orbits"):
        known_orbits(orbits)


def test_a_neighbourhood_near_a_fold_shrinks_on_the_way_to_the_saddle() -> None:
    system = cs.Parameters(
        alpha=0.88065606, omega=2.5, delta=0.2, zeta=0.0310785, beta=4.2171892, gamma=2.789994
    )
    branch = cs.continue_orbit(cs.solve_orbit(system), "delta", 0.9)
    (fold,) = (one.value for one in branch.bifurcations if one.type == "fold")
    beside = system.replace(delta=fold - 1e-4)
    near = [one.orbit for one in branch.points if fold - 5e-4 < one.value < fold]
    number = near[0].itinerary.period_number
    both = [orbit_at(beside, stroboscopic(one)[0].tolist(), number) for one in near]
    found = sorted(filter(None, both), key=lambda one: abs(one.multipliers[0]))
    orbit, saddle = found[0], stroboscopic(found[-1])
    rate = abs(orbit.multipliers[0])
    assert rate < 1 < abs(found[-1].multipliers[0])
    ellipsoids = known_orbits([orbit]).near
    assert ellipsoids
    for _, _, centre, axes in ellipsoids:
        way = min(saddle - centre, key=np.linalg.norm)
        start = centre + way / np.linalg.norm(way @ axes)  # on the ellipsoid
        end = ends(beside, start, 0.0, number)[-1]
        # The linear map shrinks the norm by q = (1 + rate)/2; half of what is left is the map's.
        assert np.linalg.norm((end - centre) @ axes) < (1 + (1 + rate) / 2) / 2


def test_a_slow_orbit_of_several_periods_is_approached() -> None:
    """A run comes ten times as near in the time that follows from the multiplier of one period."""
    p = cs.Parameters(alpha=0.42, omega=3.08, delta=0.004, zeta=0.002, beta=1.3, f_b=5.0)
    orbit = cs.solve_orbit(p, (-0.057, 0.053, 0.0))
    assert orbit.itinerary.period_number == 5
    assert 0.97 < abs(orbit.multipliers[0]) < 0.99
    known, marks = KnownOrbits(np.array([[*p.to_dict().values()]]), p.scene), stroboscopic(orbit)
    (found,) = known.approached(marks[:1] + np.array([1e-4, 0.0, 0.0]))
    assert found is not None
    assert found.same(Cycle(marks, float(abs(orbit.multipliers[0]))))
    assert found.rate**5 == pytest.approx(abs(orbit.multipliers[0]), rel=1e-9)


@pytest.mark.parametrize("periods", [2, 3, 5, 12, 13, 29])
def test_a_run_that_does_not_settle_is_followed_for_all_periods(periods: int) -> None:
    known = KnownOrbits(np.array([[*CHAOTIC.to_dict().values()]]), CHAOTIC.scene)
    start = np.array([[0.1, 0.2, 0.0]])
    found = known.destination(np.zeros(1, int), Arrivals.begun(start), 0.0, periods)
    assert found.numbers.tolist() == [NONE]
    run = cs.simulate(CHAOTIC, start[0].tolist(), periods=periods, keep="final")
    assert found.states[0] == pytest.approx(run.final[1], abs=1e-9)


@pytest.mark.parametrize(("share", "found"), [(0.7, True), (1.1, False)])
def test_an_orbit_is_approached_if_a_run_comes_ten_times_as_near_in_time(share, found) -> None:
    """At rest the mass swings, and exp(-zeta t) is left: a tenth of it after 2^15 periods or so."""
    omega = 0.8
    wait = share * 2**16  # periods in which a hundredth is left
    zeta = math.log(100) / wait / (2 * math.pi / omega)
    p = cs.Parameters(alpha=0.005, omega=omega, zeta=zeta, delta=1.0)
    known = KnownOrbits(np.array([[*p.to_dict().values()]]), p.scene)
    orbit = cs.orbits.solve_itinerary(p, cs.results.Itinerary.parse("F2"))
    start = stroboscopic(orbit) + np.array([1e-3, 0.0, 0.0])
    assert (known.approached(start)[0] is not None) == found
