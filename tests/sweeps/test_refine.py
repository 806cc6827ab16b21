"""Refined charts: what is left out is what it is taken for, and the boundaries are sharp."""

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from capsule_sym import Axis, InvalidInput, Sweep, open_results, refine_sweep, run_sweep
from capsule_sym._native import live, present
from capsule_sym._sweeps import execution as execution_module
from capsule_sym._sweeps.cells import Block
from capsule_sym._sweeps.quantities import CellOutcome
from tests.sampling import sampled, some
from tests.sweeps import chart

DISK = (0.9, 2.6, 0.55, 1.1)  # centre and half axes, in alpha and gamma


def disk(part: Sweep, *_: object) -> Block:
    """A motion of one kind in an ellipse, of another outside, in place of the map."""
    rows, _, _ = part.columns()
    x, y, a, b = DISK
    inside = ((rows[:, 0] - x) / a) ** 2 + ((rows[:, 5] - y) / b) ** 2 < 1
    columns = {
        "outcome": np.full(part.size, CellOutcome.CONVERGED, np.int8),
        "itinerary": np.where(inside, 7, 11),
        "period_number": np.ones(part.size, np.int16),
    }
    kept = {"F5 F2": (7, int(inside.sum())), "F2": (11, int((~inside).sum()))}
    itineraries = {t: v for t, v in kept.items() if v[1]}
    return Block(columns, itineraries, {}, part.parameters.scene.digest, live())


@pytest.mark.long
def test_a_smooth_boundary_costs_its_length_not_the_area(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(execution_module, "compute", disk)
    count = 97
    axes = (Axis.linear("alpha", 0.0, 2.0, count), Axis.linear("gamma", 1.0, 5.0, count))
    sweep = Sweep(axes)
    found = refine_sweep(sweep, tmp_path / "chart", stride=8)
    with open_results(tmp_path / "chart") as results:
        expected = disk(sweep).columns["itinerary"].reshape(sweep.shape)
        np.testing.assert_array_equal(results["itinerary"], expected)
        computed = results["computed"].values
        assert found.fraction == computed.mean() == results.attrs["fraction_computed"]
        # Every point beside one of the other kind was computed, not inferred.
        for axis in (0, 1):
            edge = np.diff(expected, axis=axis) != 0
            here = np.take(computed, range(count - 1), axis=axis)
            there = np.take(computed, range(1, count), axis=axis)
            assert (here & there)[edge].all()
        assert results["itinerary"].attrs["flag_meanings"] == "F5_F2 F2"
    assert found.fraction < 0.25
    assert sum(r.computed for r in found.rounds) == computed.sum()


@pytest.mark.parametrize("shape", [pytest.param((30, 21), marks=pytest.mark.long), (17, 2)])
def test_a_refined_chart_is_the_full_one(shape: tuple[int, int], tmp_path: Path) -> None:
    sweep = chart(*shape, periods=60, compute=("itinerary",), chunk=())
    refine_sweep(sweep, tmp_path / "refined", stride=4)
    run_sweep(sweep, tmp_path / "full")
    with open_results(tmp_path / "refined") as refined, open_results(tmp_path / "full") as full:
        same = np.ones(shape, bool)
        for name in ("outcome", "itinerary", "period_number"):
            same &= refined[name].values == full[name].values
        # Exact wherever computed; a spot smaller than the stride may be passed over elsewhere.
        assert same[refined["computed"].values].all()
        assert same.mean() > 0.98
        np.testing.assert_array_equal(refined["gamma"], full["gamma"])


@sampled
@pytest.mark.parametrize("first", some([0, 1], 1))
def test_a_chart_along_one_axis_is_refined_too(first, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(execution_module, "compute", disk)
    axes = Axis.linear("alpha", 0.0, 2.0, 97), Axis.of("gamma", [3.1])
    sweep = Sweep(axes[first:] + axes[:first])
    refine_sweep(sweep, tmp_path / "chart", stride=16)
    expected = disk(sweep).columns["itinerary"].reshape(sweep.shape)
    assert len(np.unique(expected)) == 2
    with open_results(tmp_path / "chart") as results:
        np.testing.assert_array_equal(results["itinerary"], expected)
        assert results["computed"].values.mean() < 0.5


@pytest.mark.long
@sampled
@pytest.mark.parametrize("interrupted", some([True, False], 1))
def test_a_refinement_that_is_interrupted_or_whose_time_is_over_goes_on(
    interrupted, tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(execution_module, "compute", disk)
    sweep = Sweep((Axis.linear("alpha", 0.0, 2.0, 33), Axis.linear("gamma", 1.0, 5.0, 33)))
    whole = refine_sweep(sweep, tmp_path / "whole", stride=8)
    first, store = whole.rounds[0].computed, tmp_path / "store"

    def stop(done: int, total: int) -> None:
        if total != first and done:
            if interrupted:
                raise KeyboardInterrupt
            present().stop()

    done = first
    with pytest.raises(KeyboardInterrupt) if interrupted else nullcontext():
        part = refine_sweep(sweep, store, stride=8, progress=stop, max_seconds=1e9)
        assert (part.success, part.status, len(part.rounds)) == (False, "time-limit", 2)
        done = part.statistics["computed"]
        assert first < done == sum(part.outcomes.values()) == round(part.fraction * 33 * 33)
    assert not (store / "chart.zarr").exists()
    rest = refine_sweep(sweep, store, stride=8, resume=True)
    assert rest.success
    computed, left = rest.statistics["computed"], whole.statistics["computed"] - done
    assert (0 < computed < left) if interrupted else (computed == left)
    with open_results(store) as one, open_results(tmp_path / "whole") as other:
        assert one.identical(other)


def test_what_cannot_be_refined_is_refused(tmp_path: Path) -> None:
    one = Axis.linear("alpha", 0.1, 1.0, 4)
    pair = Axis.sobol({"gamma": (1, 5), "beta": (1, 2)}, 4, seed=1)
    for axes in ((one,), (one, pair)):
        with pytest.raises(InvalidInput, match="two, of one quantity each"):
            refine_sweep(Sweep(axes), tmp_path / "store")
    for stride in (0, 3, 2.0, True):
        with pytest.raises(InvalidInput, match="a power of two"):
            refine_sweep(chart(), tmp_path / "store", stride=stride)  # type: ignore[arg-type]
