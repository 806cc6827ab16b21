"""All attractors of a box: against single runs, by symmetry, and in fractions."""

from dataclasses import replace

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._attractors.attractor import interval
from capsule_sym._attractors.neighbourhoods import NONE
from capsule_sym._native import check_time, present
from tests.attractors.test_destinations import BISTABLE, SMALL

CHAOTIC = cs.Parameters(alpha=1.88, omega=0.32, delta=0.03, zeta=0.05, beta=17.57, gamma=7.47)
# Drive, stops and friction are alike both ways.
BROKEN = cs.scenes.prototype.Parameters().replace(
    alpha=1.61,
    alpha_low=-1.61,
    D=0.5,
    omega=1.386,
    delta_1=0.985,
    delta_2=0.985,
    zeta=0.01,
    beta_1=192.0,
    beta_2=192.0,
    gamma=1.97,
)
BOX = {"x_r": (-2.0, 2.0), "v_r": (-2.0, 2.0)}


@pytest.mark.parametrize(
    ("parameters", "least"),
    [
        (BISTABLE, 2),
        (SMALL, 2),
        (cs.scenes.prototype.Parameters(), 1),
        (cs.scenes.slope.Parameters(), 1),
    ],
    ids=("bistable", "small", "prototype", "slope"),
)
def test_every_start_has_the_attractor_that_its_run_stays_on(parameters, least):
    found = cs.attractors(parameters, BOX | {"v_c": (-1.0, 1.0), "phase": (0.0, 1.0)}, count=60)
    assert len(found.attractors) >= least
    for one in found.attractors:
        assert one.orbit.success
        assert one.multiplier < 1
        assert one.count == (found.numbers == found.attractors.index(one)).sum()
    for i in range(0, 60, 6):
        run = cs.simulate(parameters, found.states[i], found.phases[i], 2000)
        last = np.array(run.final[1], dtype=float)
        apart = [abs(one.states - last).max(axis=1).min() for one in found.attractors]
        nearest = int(np.argmin(apart))
        assert found.numbers[i] == (nearest if apart[nearest] < 1e-8 else NONE)


def test_the_two_motions_of_the_basins_page_are_found():
    found = cs.attractors(BISTABLE, BOX)
    assert found.success
    assert found.message == "400 starts lead to 2 attractors"
    itineraries = [one.itinerary for one in found.attractors]
    assert itineraries == ["F5 F4 F1 F4 F1 F3 F2 F3 F6 F4 F1 F2 F3 F6", "F4 F1 F4 F1 F3 F6 F3 F6"]
    # Of a basin of 200 x 200 starts in this box, 23,267 cells lead to the first.
    low, high = found.attractors[0].interval
    assert low < 23267 / 40000 < high
    assert found.columns["fraction"].sum() == 1.0


@pytest.mark.long
def test_each_cell_of_a_basin_has_the_attractor_that_its_start_has_here(tmp_path):
    axes = cs.inputs.Axis.linear("x_r", -2.0, 2.0, 8), cs.inputs.Axis.linear("v_r", -2.0, 2.0, 7)
    _, basin = cs.run_basin(cs.inputs.Sweep(axes, BISTABLE, periods=300), tmp_path / "store")
    grid = np.meshgrid(*(axis.values[:, 0] for axis in axes), indexing="ij")
    found = cs.attractors(BISTABLE, np.stack([*map(np.ravel, grid), np.zeros(56)], axis=1))
    assert [one.itinerary for one in found.attractors] == [
        one.itinerary for one in basin.attractors
    ]
    np.testing.assert_array_equal(found.numbers, basin.numbers.ravel())


def test_mirror_images_are_two_attractors():
    """Between two stops alike the symmetry breaks: two orbits, each the other's image."""
    found = cs.attractors(BROKEN, {"x_r": (-3.0, 3.0), "v_r": (-3.0, 3.0)}, count=60)
    assert len(found.attractors) == 2
    one, other = (one.states for one in found.attractors)
    run = cs.simulate(BROKEN, one[0], periods=1)
    half = run(BROKEN.period / 2)
    np.testing.assert_allclose(-half, other[0], atol=1e-9)


def test_states_of_a_motion_at_any_phase_lead_to_it():
    orbit = cs.solve_orbit(BISTABLE)
    run = orbit.trajectory()
    times = np.linspace(*run.span, 5)
    found = cs.attractors(BISTABLE, run(times), phases=times % BISTABLE.period)
    assert (found.starts, found.numbers.tolist()) == (5, [0] * 5)
    assert found.attractors[0].progression == pytest.approx(orbit.progression)


def test_chaos_is_counted_as_unsettled():
    found = cs.attractors(CHAOTIC, BOX, count=20, periods=300)
    assert found.success
    assert found.unsettled == 20
    assert "20 have not settled within 300 excitation periods" in found.message


def test_an_attractor_that_no_start_reaches_is_not_counted_in_the_message():
    found = cs.attractors(BISTABLE, BOX, count=20)
    other = replace(found.attractors[0], count=0, fraction=0.0)
    more = replace(found, attractors=(*found.attractors, other))
    assert more.message == found.message == "20 starts lead to 2 attractors"


def test_the_interval_of_a_fraction_is_that_of_clopper_and_pearson():
    # Of no event in n trials the interval ends at 1 - (0.05/2)^(1/n).
    assert interval(0, 20) == pytest.approx((0.0, 1 - 0.025 ** (1 / 20)), abs=1e-12)


@pytest.mark.parametrize(
    ("starts", "how", "named"),
    [
        ({"x_r": 1.0}, {}, "extent"),
        ({"x_r": (1.0, 1.0)}, {}, "extent"),
        ({"y": (0.0, 1.0)}, {}, "x_r, v_r, v_c, phase"),
        ({"x_r": (1.0, 0.0)}, {}, r"\(low, high\)"),
        ({"x_r": (0.0, float("nan"))}, {}, r"\(low, high\)"),
        ({"x_r": "0:1"}, {}, r"\(low, high\)"),
        (BOX, {"count": 0}, "count"),
        (BOX, {"periods": 1}, "periods"),
        (BOX, {"threads": 0}, "threads"),
        (BOX, {"max_seconds": 0.0}, "max_seconds"),
        ([[0.0, 1.0]], {}, "starts"),
        ([], {}, "starts"),
        (BOX | {"phase": (0.0, 100.0)}, {}, "phases"),
        (BOX, {"phases": [0.0, 1.0]}, "phases"),
    ],
)
def test_bad_input_is_refused(starts, how, named):
    with pytest.raises(cs.InvalidInput, match=named):
        cs.attractors(cs.Parameters(), starts, **how)


def test_what_is_done_of_many_starts_is_kept_where_the_work_is_stopped(monkeypatch):
    monkeypatch.setattr("capsule_sym._attractors.destinations._BLOCK", 16)
    whole = cs.attractors(BISTABLE, BOX, count=64)

    def stop(done, total):
        if done >= 32:
            present().stop()

    part = cs.attractors(BISTABLE, BOX, count=64, max_seconds=1e9, progress=stop)
    assert part.status == "time-limit"
    assert "interrupted" in part.message
    assert np.count_nonzero(part.numbers != NONE) >= 32
    states = [one.states for one in whole.attractors]
    for one in part.attractors:
        assert any(one.states.shape == s.shape and np.allclose(one.states, s) for s in states)


def test_an_orbit_that_is_not_solved_in_time_has_no_starts(monkeypatch):
    def late(*_):
        present().stop()
        check_time()

    monkeypatch.setattr("capsule_sym._attractors.attractors.closed_orbit", late)
    found = cs.attractors(BISTABLE, BOX, count=64, max_seconds=1e9)
    assert (found.status, found.attractors) == ("time-limit", ())
    assert (found.numbers == NONE).all()


def test_the_end_of_the_time_gives_what_is_found():
    found = cs.attractors(BISTABLE, BOX, count=50, max_seconds=1e-9)
    assert found.status == "time-limit"
    assert found.unsettled == 50
