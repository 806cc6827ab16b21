"""The smallest knock that loses a motion, beside random knocks, single runs and theory."""

import math
from functools import partial

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._attractors.destinations import KnownOrbits
from capsule_sym._attractors.smallest import KnockSearch

BISTABLE = cs.Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
# Two motions of two excitation periods and of one.
DOUBLE = cs.Parameters(
    alpha=1.0663, omega=2.1903, delta=0.6909, zeta=0.029, beta=28.0035, gamma=6.8652
)
# Beside the boundary of this motion without slip, rounding decides between two motions.
STUCK = cs.Parameters(
    alpha=0.4504, omega=1.3857, delta=0.6834, zeta=0.0792, beta=20.8794, gamma=6.8539
)
# Other parts of the boundary are far from the nearest one.
TONGUES = cs.Parameters(
    alpha=0.3364, omega=2.3862, delta=0.2044, zeta=0.0254, beta=18.7293, gamma=2.0233
)


@pytest.fixture(scope="module")
def shock() -> cs.results.Shock:
    return cs.minimal_shock(cs.solve_orbit(BISTABLE), samples=500, max_seconds=math.inf)


def on_motion(orbit: cs.results.Orbit, time: float) -> np.ndarray:
    """A motion's state, by a run that has long settled on it."""
    period = orbit.parameters.period
    run = cs.simulate(orbit.parameters, periods=400)
    whole, phase = divmod(time, period)
    run = cs.simulate(orbit.parameters, run.final[1], periods=int(whole) + 1)
    return run(whole * period + phase)


def comes_back(orbit: cs.results.Orbit, time: float, state: np.ndarray) -> bool:
    """True if a run ends on the motion, by the scalar map."""
    phase = math.fmod(time, orbit.parameters.period)
    run = cs.simulate(orbit.parameters, state.tolist(), phase, 400)
    own = [cs.simulate(orbit.parameters, periods=400 + k).final[1] for k in range(2)]
    return min(abs(np.array(run.final[1]) - np.array(one)).max() for one in own) < 1e-6


def losses(orbit: cs.results.Orbit, size: float, count: int, seed: int) -> int:
    """Number of random knocks of a size, at random times, that lose the motion from rest."""
    random = np.random.default_rng(seed)
    period, number = orbit.parameters.period, orbit.itinerary.period_number
    settled = cs.simulate(orbit.parameters, periods=400 * number)
    run = cs.simulate(orbit.parameters, settled.final[1], periods=number)
    marks = np.array(run.stroboscopic)
    times = random.uniform(0, number * period, count)
    knocks = random.normal(size=(count, 3))
    states = run(times) + size * knocks / np.linalg.norm(knocks, axis=1)[:, None]
    # Long enough for what comes back to shrink by e^20.
    length = max(100, math.ceil(-20 / math.log(max(abs(orbit.multipliers)))))
    ends = cs.simulate_many([orbit.parameters] * count, states, times % period, length).states
    return int((abs(ends[:, None] - marks).max(axis=2).min(axis=1) > 1e-6).sum())


@pytest.mark.long
def test_the_motion_comes_back_from_a_smaller_knock_and_is_lost_after_a_larger_one(shock) -> None:
    assert shock.status == "found"
    assert shock.knock is not None
    assert shock.phase is not None
    assert shock.size == pytest.approx(np.linalg.norm(shock.knock), rel=1e-14)
    start = on_motion(shock.orbit, shock.phase)
    np.testing.assert_allclose(shock.start, start, rtol=0, atol=1e-9)
    assert comes_back(shock.orbit, shock.phase, start + (1 - 3e-6) * shock.knock)
    assert not comes_back(shock.orbit, shock.phase, start + (1 + 1e-8) * shock.knock)
    lost = cs.simulate(BISTABLE, start + (1 + 1e-3) * shock.knock, shock.phase, 400)
    assert shock.attractor is not None
    assert shock.attractor.progression == pytest.approx(lost.steady().progression, rel=1e-9)


@pytest.mark.long
def test_no_random_knock_that_is_smaller_loses_the_motion(shock: cs.results.Shock) -> None:
    assert losses(shock.orbit, (1 - 1e-4) * shock.size, 2000, 1) == 0
    assert losses(shock.orbit, 1.5 * shock.size, 2000, 1) > 20


@pytest.mark.long
@pytest.mark.parametrize("parameters", [BISTABLE, DOUBLE, STUCK, TONGUES])
def test_no_one_of_a_hundred_thousand_knocks_is_smaller(parameters: cs.Parameters) -> None:
    found = cs.minimal_shock(cs.solve_orbit(parameters), max_seconds=math.inf)
    assert found.status == "found"
    assert losses(found.orbit, (1 - 1e-4) * found.size, 100_000, 2) == 0
    assert losses(found.orbit, 1.05 * found.size, 100_000, 2) > 0


# Sizes by descent on differences of the radii of the stable manifold of the edge state, below
# which a million random knocks lose no motion.
@pytest.mark.parametrize(
    ("parameters", "size"),
    [
        (BISTABLE, 0.23390607),
        pytest.param(DOUBLE, 0.38181794, marks=pytest.mark.long),
        pytest.param(STUCK, 0.36798439, marks=pytest.mark.long),
        pytest.param(TONGUES, 0.12225630, marks=pytest.mark.long),
    ],
)
def test_the_size_is_that_of_the_stable_manifold(
    parameters: cs.Parameters, size: float, shock: cs.results.Shock
) -> None:
    found = (
        shock
        if parameters == BISTABLE
        else cs.minimal_shock(cs.solve_orbit(parameters), max_seconds=math.inf)
    )
    assert found.size == pytest.approx(size, rel=found.accuracy)


def test_runs_return_are_lost_or_are_left_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """Knocks from all over, by the scalar map; runs that do not finish do not count as lost."""
    orbit, random = cs.solve_orbit(BISTABLE), np.random.default_rng(5)
    search = KnockSearch(orbit, np.eye(3), None, None, 0)
    points = np.column_stack([random.uniform(0, 1, 12), random.uniform(-2, 2, (12, 3))])
    times, _, states = search.starts(points)
    lost = [not comes_back(orbit, *one) for one in zip(times.tolist(), states, strict=True)]
    assert set(lost) == {True, False}
    assert search.lost(points).tolist() == lost
    before = search.patience
    assert before < search.periods
    assert search.stays_lost(points[lost])
    assert search.patience == before
    assert not search.stays_lost(points)
    assert search.patience == search.periods
    cut = lambda *given: (np.empty(0, int), np.empty((0, 2, 3)))  # noqa: E731
    monkeypatch.setattr(KnownOrbits, "_marks", cut)
    assert not search.lost(points).any()


@pytest.mark.long
def test_weights_scale_the_size_and_forbid_components(shock: cs.results.Shock) -> None:
    search = partial(cs.minimal_shock, shock.orbit, samples=500, max_seconds=math.inf)
    heavy = search(weights=(64.0, 64.0, 64.0))  # which rounds nothing
    assert heavy.size == pytest.approx(64 * shock.size, rel=1e-9)
    np.testing.assert_allclose(heavy.knock, shock.knock, rtol=0, atol=1e-5)
    fast = search(weights=(math.inf, 1.0, 1.0))
    assert fast.knock is not None
    assert fast.knock[0] == 0
    assert fast.size > shock.size
    assert not comes_back(shock.orbit, fast.phase, fast.start + (1 + 1e-8) * fast.knock)
    assert comes_back(shock.orbit, fast.phase, fast.start + (1 - 3e-6) * fast.knock)


def test_a_motion_without_contact_is_never_lost() -> None:
    """The energy of the difference of two motions without contact never grows."""
    found = cs.minimal_shock(
        cs.solve_orbit(cs.Parameters(alpha=2.0, beta=0.0, delta=1e6)), samples=500
    )
    assert (found.status, found.knock, found.attractor) == ("not-lost", None, None)
    assert found.success
    with pytest.raises(cs.InvalidInput, match="a result with a knock"):
        _ = found.runs


def test_results_are_records(shock: cs.results.Shock) -> None:
    record = shock.to_dict()
    assert (record["status"], record["accuracy"]) == ("found", 1e-4)
    assert list(record["knock"]) == ["x_r", "v_r", "v_c"]
    assert record["state"]["x_r"] == record["start"]["x_r"] + record["knock"]["x_r"]
    assert record["weights"] == [1.0, 1.0, 1.0]
    for run, share in zip(shock.runs, (0.999, 1.001), strict=True):
        np.testing.assert_allclose(run(run.span[0]), shock.start + share * shock.knock, atol=1e-12)


def test_after_its_time_a_search_tells_what_it_found() -> None:
    found = cs.minimal_shock(cs.solve_orbit(BISTABLE), max_seconds=1e-9)
    assert (found.status, found.success, found.knock) == ("time-limit", False, None)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("weights", (1.0, 1.0)),
        ("weights", (math.inf, math.inf, math.inf)),
        ("weights", (1.0, 0.0, 1.0)),
        ("weights", (1.0, math.nan, 1.0)),
        ("largest", 0.0),
        ("largest", math.inf),
        ("samples", 1),
        ("periods", 1),
        ("seed", -1),
    ],
)
def test_values_that_are_not_allowed_are_refused(field: str, value: object) -> None:
    with pytest.raises(cs.InvalidInput, match=field):
        cs.minimal_shock(cs.solve_orbit(BISTABLE), **{field: value})


def test_an_unstable_motion_is_refused() -> None:
    known = [one for one in cs.search_orbits(BISTABLE, 30) if abs(one.multipliers[0]) > 1]
    with pytest.raises(cs.InvalidInput, match="stable"):
        cs.minimal_shock(known[0])
