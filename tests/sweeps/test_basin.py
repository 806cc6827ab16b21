"""Basins: attractors are closed orbits, and each cell's is the one that its run is on."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from capsule_sym import InvalidInput, Parameters, run_basin, simulate
from capsule_sym._native import check_time, present
from capsule_sym.inputs import Axis, Sweep
from capsule_sym.results import open_results

# Two motions coexist here, of one and of two excitation periods.
TWO = Parameters(1.139284451807824, 1.2060847203112472, 0.01003369298122625, 0.05188929819462264,
                 19.46036985549087, 1.784593529535103)  # fmt: skip
AXES = (Axis.linear("x_r", -2.0, 2.0, 9), Axis.linear("v_r", -2.0, 2.0, 8))


@pytest.mark.long
def test_every_cell_has_the_attractor_that_its_run_stays_on(tmp_path: Path) -> None:
    _, found = run_basin(Sweep(AXES, TWO), tmp_path / "store")
    assert {attractor.period_number for attractor in found.attractors} == {1, 2}
    assert [a.count for a in found.attractors] == sorted(a.count for a in found.attractors)[::-1]
    assert sum(attractor.count for attractor in found.attractors) == 72
    for number, attractor in enumerate(found.attractors):
        assert attractor.orbit.residual < 1e-13
        assert attractor.multiplier < 1
        # The map itself, started on the orbit, comes back to it.
        for state in attractor.states:
            run = simulate(TWO, tuple(state.tolist()), periods=attractor.period_number)
            np.testing.assert_allclose(run.final[1], state, rtol=0, atol=1e-12)
        rows, columns = np.nonzero(found.numbers == number)
        assert len(rows) == attractor.count
        for i, j in list(zip(rows, columns, strict=True))[:4]:
            start = (AXES[0].values[i, 0], AXES[1].values[j, 0], 0.0)
            run = simulate(TWO, start, periods=700)
            last = np.array(run.final[1], dtype=float)
            assert np.abs(attractor.states - last).max(axis=1).min() < 1e-10
    with open_results(tmp_path / "store") as results:
        np.testing.assert_array_equal(results["attractor"], found.numbers)
        assert results["attractor"].dims == ("x_r", "v_r")
        assert [a["itinerary"] for a in results["attractor"].attrs["attractors"]] == [
            attractor.itinerary for attractor in found.attractors
        ]


def test_an_attractor_without_contact_goes_nowhere(tmp_path: Path) -> None:
    sweep = Sweep((Axis.linear("x_r", 0.0, 1.0, 2),), Parameters(alpha=2.0, beta=0.0, delta=1e6))
    _, found = run_basin(sweep, tmp_path / "store")
    assert [(one.itinerary, one.progression) for one in found.attractors] == [("F1 F3", 0.0)]


def test_a_finished_basin_can_be_run_again(tmp_path: Path) -> None:
    _, first = run_basin(Sweep(AXES, TWO, periods=100), tmp_path / "store")
    summary, second = run_basin(Sweep(AXES, TWO, periods=100), tmp_path / "store", resume=True)
    assert summary.computed == 0
    np.testing.assert_array_equal(first.numbers, second.numbers)


def test_a_basin_whose_time_is_over_among_its_attractors_goes_on(tmp_path, monkeypatch) -> None:
    sweep = Sweep(AXES, TWO, periods=100)
    _, whole = run_basin(sweep, tmp_path / "whole")

    def late(*given: Any) -> None:
        present().stop()
        check_time()

    with monkeypatch.context() as patch:
        patch.setattr("capsule_sym._sweeps.basin.identify", late)
        summary, found = run_basin(sweep, tmp_path / "store", max_seconds=1e9)
    assert (summary.status, summary.computed) == ("time-limit", sweep.size)
    assert found.attractors == ()
    with open_results(tmp_path / "store") as results:
        assert "attractor" not in results
    summary, found = run_basin(sweep, tmp_path / "store", resume=True)
    assert (summary.success, summary.computed) == (True, 0)
    np.testing.assert_array_equal(found.numbers, whole.numbers)


def test_a_basin_has_axes_over_the_start_alone(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="axis = 'alpha'"):
        run_basin(Sweep((Axis.of("alpha", [1.0]),)), tmp_path / "store")
