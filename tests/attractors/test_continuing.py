"""Attractors along a parameter: births and deaths are where runs of the map begin to behave so."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from capsule_sym import InvalidInput, Parameters, attractors, continue_attractors, simulate
from capsule_sym._attractors import links, neighbourhoods
from capsule_sym._orbits.continuation.parameter_paths import parameter_path
from tests.attractors.test_attractors import BOX
from tests.attractors.test_destinations import BISTABLE

ALPHAS = np.linspace(1.95, 2.2, 6)


@pytest.fixture(scope="module")
def found():
    return continue_attractors(BISTABLE, "alpha", ALPHAS, BOX, count=60, periods=2048)


def repeats(alpha, state, periods=3000):
    """After how many periods a single run, settled from a state, repeats itself."""
    run = simulate(BISTABLE.replace(alpha=alpha), state, periods=periods, keep="stroboscopic")
    marks = np.array(run.stroboscopic, dtype=float)
    change = abs(marks[-5:-1] - marks[-1]).max(axis=1)[::-1]
    return 1 + int(np.argmax(change < 1e-4)), marks[-1]


def test_a_doubling_is_where_runs_begin_to_repeat_after_two_periods(found):
    (doubled,) = (one for one in found.branches if one.death and one.death.value > 2.1)
    (single,) = (one for one in found.branches if one.birth and one.birth.value > 2.1)
    assert doubled.death.type == single.birth.type == "period doubling"
    assert doubled.death.value == pytest.approx(single.birth.value, abs=1e-10)
    assert [len(doubled.cycles[-1].states), len(single.cycles[0].states)] == [2, 1]
    at = single.birth.value
    assert repeats(at - 2e-3, doubled.cycles[-1].states[0])[0] == 2
    assert repeats(at + 2e-3, single.cycles[0].states[0])[0] == 1


def test_a_fold_is_where_runs_leave_an_orbit_that_is_no_more(found):
    (one,) = (one for one in found.branches if one.death and one.death.type == "fold")
    state = one.cycles[-1].states[0]
    for alpha in np.linspace(one.values[-1], one.death.value - 1e-4, 12):
        number, end = repeats(alpha, state)
        assert number == 2
        assert abs(end - state).max() < 0.1 or abs(end - one.cycles[-1].states[1]).max() < 0.1
        state = end
    _, end = repeats(one.death.value + 1e-4, state)
    assert abs(end - state).max() > 0.1


def test_fractions_are_those_of_each_value_alone(found):
    assert found.status == "finished"
    for i in (0, 5):
        alone = attractors(BISTABLE.replace(alpha=ALPHAS[i]), BOX, count=60, periods=2048)
        here = found.columns["alpha"] == ALPHAS[i]
        counts = sorted(one.count for one in alone.attractors)
        assert sorted(n for n in found.columns["count"][here].tolist() if n) == counts
        low = sorted(one.interval for one in alone.attractors)[0][0]
        assert low in found.columns["fraction_low"]
    total = np.zeros(6, int)
    np.add.at(total, np.searchsorted(ALPHAS, found.columns["alpha"]), found.columns["count"])
    assert (total + found.unsettled == 60).all()


def test_an_attractor_to_which_no_start_leads_stays_the_same_one():
    few = continue_attractors(
        BISTABLE, "alpha", np.linspace(1.8, 1.95, 6), BOX, count=9, periods=2048
    )
    (small,) = (one for one in few.branches if len(one.cycles[0].states) == 2 and not one.birth)
    assert small.counts.min() == 0
    assert small.counts.max() > 0
    assert len(small.values) == 6
    assert small.fractions[small.counts == 0].max() == 0
    orbit = small.orbit(3)
    assert orbit.success
    assert orbit.parameters.alpha == small.values[3]


@pytest.mark.parametrize(
    ("name", "values", "how", "named"),
    [
        ("alpha", [1.0], {}, "values"),
        ("alpha", [1.0, 1.0], {}, "values"),
        ("alpha", [2.0, 1.0], {}, "values"),
        ("alpha", ["a", "b"], {}, "values"),
        ("alpha", [-1.0, 1.0], {}, "alpha"),
        ("alpha", np.linspace(1.0, 2.0, 100_001), {"count": 100}, "at most 100,000 values"),
        ("beth", [1.0, 2.0], {}, "parameter"),
        ("alpha", [1.0, 2.0], {"count": 0}, "count"),
        ("alpha", [1.0, 2.0], {"periods": 0}, "periods"),
    ],
)
def test_bad_input_is_refused(name, values, how, named):
    with pytest.raises(InvalidInput, match=named):
        continue_attractors(Parameters(), name, values, BOX, **how)


def test_the_end_of_the_time_gives_what_is_found():
    late = continue_attractors(BISTABLE, "alpha", ALPHAS, BOX, count=20, max_seconds=1e-9)
    assert late.status == "time-limit"
    assert late.unsettled.tolist() == [20] * 6
    assert not late.success


@pytest.mark.long
def test_a_doubling_is_found_where_border_collisions_hide_it():
    """The doubled orbit passes a border collision so near that its branch comes back unseen."""
    system = Parameters(alpha=1.88, delta=0.03, zeta=0.05, beta=17.57, gamma=7.47)
    found = continue_attractors(system, "omega", [0.3444444, 0.3487], BOX, count=20, periods=2048)
    (doubled,) = (one for one in found.branches if one.death)
    (single,) = (one for one in found.branches if one.birth)
    assert doubled.death.type == single.birth.type == "period doubling"
    assert doubled.death.value == pytest.approx(single.birth.value, abs=1e-12)
    assert len(doubled.cycles[0].states) == 2 * len(single.cycles[0].states)


def test_where_a_doubled_orbit_turns_back_the_doubling_is_sought_on_that_of_half_the_period(
    monkeypatch,
):
    """Between 1 and 2 an orbit turns at 1.5, and that of half its period doubles beside it."""
    line = links.Links(BISTABLE, parameter_path("alpha", None), np.array([1.0, 2.0]), None)
    marks, halves, asked = [np.zeros((2, 3))], ["half"], []
    monkeypatch.setattr(links, "stroboscopic", lambda orbit: marks[0])
    monkeypatch.setattr(links, "orbit_at", lambda *given: asked.append(given) or halves[0])

    def sought(value, *turns):
        one = SimpleNamespace(value=value, multipliers_after=[-1.1])
        found = SimpleNamespace(bifurcations=[one])
        line._branch = lambda orbit, to: found if (orbit, to) == ("half", 1.0) else None
        branch = SimpleNamespace(points=[SimpleNamespace(value=at, orbit=None) for at in turns])
        return line._doubling(branch, (0, 0), 1) is one

    assert sought(1.5004, 1.0, 1.5, 1.2)
    parameters, state, periods = asked[0]
    assert (parameters.alpha, state, periods) == (pytest.approx(1.501), [0.0, 0.0, 0.0], 1)
    assert not sought(1.502, 1.0, 1.5, 1.2)  # another one, too far from the turn
    assert not sought(1.9999, 1.0, 1.9999)  # no room between the turn and the next value
    marks[0] = np.zeros((3, 3))
    assert not sought(1.5004, 1.0, 1.5, 1.2)
    marks[0], halves[0] = np.zeros((2, 3)), None
    assert not sought(1.5004, 1.0, 1.5, 1.2)


def test_without_the_core_orbits_close_by_their_equations(monkeypatch):
    def found():
        return continue_attractors(BISTABLE, "alpha", [2.3, 2.4], BOX, count=6, periods=512)

    with_core = found().to_dict()
    monkeypatch.setattr(neighbourhoods, "core_of", lambda scene: None)
    without = found().to_dict()
    for one, other in zip(with_core["attractors"], without["attractors"], strict=True):
        assert one["count"] == other["count"]
        assert one["itinerary"] == other["itinerary"]
        np.testing.assert_allclose(one["progression"], other["progression"], atol=1e-9)


def test_values_have_to_be_finite() -> None:
    infinite, start = [1.0, np.inf, np.inf], [[0.0, 0.0, 0.0]]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(InvalidInput, match="values"):
            continue_attractors(Parameters(), "omega", infinite, start)
