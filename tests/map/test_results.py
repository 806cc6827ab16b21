"""Results of a trajectory: states at many times in few calls, and a repr that fits a line."""

import math
from typing import Any

import numpy as np
import pytest

import capsule_sym as cs
from capsule_sym._native import core
from capsule_sym._orbits.shooting.orbit import NoOrbit

KEPT = ("segments", "stroboscopic")


def test_no_times_give_no_states() -> None:
    run = cs.simulate(cs.Parameters(), periods=2)
    assert run([]).shape == (0, 3)
    assert run.position(np.empty((2, 0))).shape == (2, 0)


def test_reprs_fit_a_line() -> None:
    run = cs.simulate(cs.Parameters(), periods=60)
    orbit = cs.solve_orbit(cs.Parameters())
    assert orbit.success, orbit.message
    near = cs.orbits.solve_itinerary(cs.Parameters(alpha=0.94), orbit.itinerary, list(orbit.z))
    assert near.success, near.message
    branch = cs.continue_orbit(near, "alpha", 0.943, points=2)
    ends = (cs.results.Status.REACHED, ""), (cs.results.Status.REACHED, "")
    curve = cs.results.Curve("grazing", ("alpha", "gamma"), (), (), ends)
    none = NoOrbit(cs.results.Status.SINGULAR, "", orbit.itinerary, orbit.values, 1.0)
    parts = [run, run.segments[0], run.segments[-1], run.steady(), orbit, orbit.itinerary]
    parts += [orbit.system, orbit.system.flows[0], branch, branch.points[0]]
    parts += [branch.bifurcations[0], none, curve]
    for part in parts:
        text = repr(part)
        assert len(text) < 1000, text
        assert type(part).__name__ in text
    assert f"{len(run.segments)} segments" in repr(run)
    assert "F5 F4 F1 F2" in repr(run.steady())
    assert (
        repr(cs.simulate(cs.Parameters(), periods=9, max_segments=2)).count("after 2 segments") == 1
    )


@pytest.mark.parametrize(
    ("tolerance", "allowed"),
    [
        *((one, "a finite number > 0") for one in (math.inf, 0.0, -1e-9)),
        *((one, "a number") for one in (math.nan, True, "1e-9", None)),
    ],
)
def test_a_tolerance_that_is_none_is_refused(tolerance: Any, allowed: str) -> None:
    with pytest.raises(cs.InvalidInput, match=rf"^tolerance = .*: must be {allowed}$"):
        cs.simulate(cs.Parameters(), periods=2).steady(tolerance)


def test_arrays_that_a_result_keeps_are_read_only() -> None:
    """And what a caller gave, or gets as a copy, stays the caller's."""
    rows = np.array([[*cs.Parameters().to_dict().values()]])
    for backend in ("c", "numpy") if core is not None else ("numpy",):
        runs = {
            keep: cs.simulate(cs.Parameters(), periods=3, keep=keep, backend=backend)
            for keep in KEPT
        }
        kept = [runs["segments"].records, runs["stroboscopic"].stroboscopic]
        kept += [runs["stroboscopic"].stroboscopic_periods]
        for array in kept:
            with pytest.raises(ValueError, match="read-only"):
                array[...] = array[0]
    many = cs.simulate_many(rows, periods=3, keep="stroboscopic")
    for array in (
        many.parameters,
        many.states,
        many.advances,
        many.status,
        many.offsets,
        many.kept,
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = array[0]
    rows[0, 0] = 2.0
    assert many.parameters[0, 0] == cs.Parameters().alpha
    with pytest.raises(ValueError, match="read-only"):
        runs["segments"].columns["x_r"][:] = 9.0


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
def test_a_run_of_which_the_end_is_kept_takes_the_steps_of_one_that_keeps_all() -> None:
    """Some have more segments than are written at a time; 106 bits decide some switches."""
    low, high = (0.3, 0.3, 0, 0, 0, 1, 1), (3, 2, 1, 0.3, 9, 4, 1)
    rows = np.random.default_rng(5).uniform(low, high, (30, 7)).tolist()
    drawn = [(cs.Parameters(*row), (row[2] - 0.2, 0.0, 0.0), 60) for row in rows]
    drawn.append((cs.Parameters(alpha=3.0, omega=1.3, delta=0.1, f_b=0.2), (0.1, 0.5, 0.0), 400))
    longest = 0
    for parameters, state, periods in drawn:
        whole = cs.simulate(parameters, state, periods=periods, backend="c")
        end = cs.simulate(parameters, state, periods=periods, keep="final", backend="c")
        assert (end.final, end.advance, end.status) == (whole.final, whole.advance, whole.status)
        assert end.statistics == whole.statistics
        longest = max(longest, whole.statistics.segments)
    assert longest > 1024
