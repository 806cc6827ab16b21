"""Basins: attractors are closed orbits, and each cell's is the one that its run is on."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from capsule_sym import (
    Axis,
    InvalidInput,
    Orbit,
    Parameters,
    Sweep,
    open_results,
    run_basin,
    simulate,
    solve_orbit,
)
from capsule_sym._native import present
from capsule_sym._sweeps import basin, itineraries
from capsule_sym._sweeps.basin import NONE, identify
from capsule_sym._sweeps.itineraries import NotSolved, code, orbit_at_end

# Two motions coexist here, of one and of two excitation periods.
TWO = Parameters(1.139284451807824, 1.2060847203112472, 0.01003369298122625, 0.05188929819462264,
                 19.46036985549087, 1.784593529535103)  # fmt: skip
AXES = (Axis.linear("x_r", -2.0, 2.0, 9), Axis.linear("v_r", -2.0, 2.0, 8))


def test_every_cell_has_the_attractor_that_its_run_stays_on(tmp_path: Path) -> None:
    _, found = run_basin(Sweep(AXES, TWO), tmp_path / "store")
    assert {attractor.period_number for attractor in found.attractors} == {1, 2}
    assert [a.share for a in found.attractors] == sorted(a.share for a in found.attractors)[::-1]
    assert sum(attractor.cells for attractor in found.attractors) == 72
    for number, attractor in enumerate(found.attractors):
        assert attractor.residual < 1e-13
        assert attractor.multiplier < 1
        # The map itself, started on the orbit, comes back to it.
        for state in attractor.states:
            run = simulate(TWO, tuple(state.tolist()), periods=attractor.period_number)
            np.testing.assert_allclose(run.final[1], state, rtol=0, atol=1e-12)
        rows, columns = np.nonzero(found.numbers == number)
        assert len(rows) == attractor.cells
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


def test_a_basin_whose_time_is_over_among_its_attractors_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sweep = Sweep(AXES, TWO, periods=100)
    _, whole = run_basin(sweep, tmp_path / "whole")

    def late(*given: Any) -> Orbit:
        present().stop()
        return solve_orbit(*given)

    with monkeypatch.context() as patch:
        patch.setattr(itineraries, "solve_orbit", late)
        summary, found = run_basin(sweep, tmp_path / "store", max_seconds=1e9)
    assert (summary.status, summary.computed) == ("time-limit", sweep.size)
    assert found.attractors == ()
    with open_results(tmp_path / "store") as results:
        assert "attractor" not in results
    summary, found = run_basin(sweep, tmp_path / "store", resume=True)
    assert (summary.success, summary.computed) == (True, 0)
    np.testing.assert_array_equal(found.numbers, whole.numbers)


def results_of(ends: list[list[float]], itinerary: int) -> xr.Dataset:
    count = len(ends)
    return xr.Dataset(
        {
            "outcome": ("x_r", np.ones(count, np.int8)),
            "itinerary": ("x_r", np.full(count, itinerary)),
            "period_number": ("x_r", np.ones(count, np.int16)),
            "final": (("x_r", "component"), np.array(ends)),
        }
    )


class FakeOrbits:
    """Orbits of one itinerary on a line: Newton's method leads to the nearest of some places."""

    def __init__(self, places: list[float], fails: tuple[float, ...] = ()) -> None:
        self.places, self.fails, self.asked = places, fails, 0

    def __call__(self, parameters: Any, end: Any, period_number: int, itinerary: int) -> float:
        self.asked += 1
        if end[0] in self.fails:
            raise NotSolved("no orbit")
        return min(self.places, key=lambda place: abs(place - end[0]))


@pytest.fixture
def on_a_line(monkeypatch: pytest.MonkeyPatch) -> Any:
    def install(orbits: FakeOrbits) -> FakeOrbits:
        monkeypatch.setattr(basin, "orbit_at_end", orbits)
        monkeypatch.setattr(basin, "_stroboscopic", lambda place: np.array([[place, 0.0, 0.0]]))
        monkeypatch.setattr(
            basin,
            "_attractor",
            lambda place, states, cells, total: (place, cells),
        )
        return orbits

    return install


def test_two_orbits_of_one_word_are_told_apart_however_near(on_a_line: Any) -> None:
    """A threshold on distance alone would merge these; Newton's method from the ends does not."""
    orbits = on_a_line(FakeOrbits([0.0, 1e-6]))
    chance = np.random.default_rng(3)
    which = chance.integers(0, 2, 500)
    ends = which * 1e-6 + chance.uniform(-2e-7, 2e-7, 500)
    found = identify(TWO, results_of([[x, 0.0, 0.0] for x in ends], 5))
    places = [place for place, _ in found.attractors]
    assert sorted(places) == [0.0, 1e-6]
    assert (found.numbers != NONE).all()
    assert [places[n] for n in found.numbers] == (which * 1e-6).tolist()
    # Few ends need Newton's method: the others lie nearer to an orbit than one that leads there.
    assert orbits.asked < 10


def test_ends_that_close_no_orbit_have_no_attractor(on_a_line: Any) -> None:
    on_a_line(FakeOrbits([0.0], fails=(0.5, 0.25)))
    ends = [[x, 0.0, 0.0] for x in (0.5, 0.1, 0.25, 0.2, 0.0)]
    found = identify(TWO, results_of(ends, 5))
    assert found.numbers.tolist() == [NONE, 0, NONE, 0, 0]
    assert found.attractors == ((0.0, 3),)


def test_cells_without_a_periodic_motion_have_no_attractor(on_a_line: Any) -> None:
    on_a_line(FakeOrbits([0.0]))
    results = results_of([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]], 5)
    results["period_number"][1] = 0
    assert identify(TWO, results).numbers.tolist() == [0, NONE]


def test_an_orbit_of_another_word_is_not_taken() -> None:
    motion = simulate(Parameters(), periods=300).final[1]
    assert orbit_at_end(Parameters(), motion, 1, code("F5 F4 F1 F2")).itinerary.period_number == 1
    with pytest.raises(
        NotSolved, match="the orbit's itinerary is F5 F4 F1 F2, its period number 1"
    ):
        orbit_at_end(Parameters(), motion, 1, code("F5 F2"))


def test_a_basin_has_axes_over_the_start_alone(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="axis = 'alpha'"):
        run_basin(Sweep((Axis.of("alpha", [1.0]),)), tmp_path / "store")
