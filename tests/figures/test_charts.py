"""The chart of itineraries: regions by area, names inside them, exact curves and points on top."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr

from capsule_sym import Parameters
from capsule_sym._figures.charts import chart, regions
from capsule_sym._study.data import Range, Store

CODES = {11: "F5_F2", 22: "F5_F4_F1_F2", 33: "F2"}


@pytest.fixture
def results() -> xr.Dataset:
    """Two large regions left and right, a corner that is too small for a name, one cell unknown."""
    itinerary = np.full((40, 20), 22)
    itinerary[:15] = 11
    itinerary[-1, -1] = 33
    itinerary[20, 10] = -1
    flags = {"flag_values": list(CODES), "flag_meanings": " ".join(CODES.values())}
    return xr.Dataset(
        {"itinerary": (("alpha", "gamma"), itinerary, flags)},
        coords={"alpha": np.linspace(0, 2, 40), "gamma": np.linspace(1, 3, 20)},
    )


CURVE: dict[str, Any] = {
    "type": "crossing-sliding",
    "points": [{"alpha": 0.75, "gamma": 1.0}, {"alpha": 0.8, "gamma": 3.0}],
    "codimension_two": [{"alpha": 0.77, "gamma": 2.0}],
}


def test_words_are_numbered_by_area(results: xr.Dataset) -> None:
    numbers, itineraries = regions(results)
    assert itineraries == ["5412", "52", "2"]
    assert set(numbers[:15].flat) == {1}
    assert numbers[-1, -1] == 2
    assert numbers[20, 10] == -1


def test_regions_are_filled_and_named_inside(results: xr.Dataset) -> None:
    axes = chart(results).axes[0]
    (mesh,) = axes.collections
    drawn = mesh.get_array()
    assert drawn.shape == (20, 40)
    assert drawn[0, 0] == 1
    assert drawn.mask[10, 20]
    assert drawn.mask.sum() == 1
    names = {text.get_text(): text.get_position() for text in axes.texts}
    assert set(names) == {"5412", "52"}
    assert names["52"][0] < 2 * 15 / 40 < names["5412"][0]
    assert axes.get_xlabel() == r"excitation amplitude $\alpha$"
    assert axes.get_ylabel() == r"mass ratio $\gamma$"


def test_curves_and_their_points_lie_on_top(results: xr.Dataset) -> None:
    figure = chart(results, [CURVE], levels=(1.5,))
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert [list(v) for v in lines["crossing-sliding"].get_data()] == [[0.75, 0.8], [1.0, 3.0]]
    assert [list(v) for v in lines["two conditions"].get_data()] == [[0.77], [2.0]]
    (level,) = [line for line in figure.axes[0].lines if list(line.get_ydata()) == [1.5, 1.5]]
    assert level.is_dashed()
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    assert shown == ["crossing-sliding", "two conditions"]


def test_a_chart_is_computed_once_and_meets_its_curves(store: Store, monkeypatch) -> None:
    first, second = Range("alpha", 0.2, 0.8, 24), Range("gamma", 2.5, 3.5, 8)
    with store.chart(Parameters(), first, second) as results:
        numbers, itineraries = regions(results)
    monkeypatch.setattr("capsule_sym._sweeps.refine", lambda *_, **__: pytest.fail("again"))
    with store.chart(Parameters(), first, second) as again:
        assert np.array_equal(regions(again)[0], numbers)
    assert {"52", "5452", "5412"} <= set(itineraries)
    curves = store.curves(Parameters(), first, second)
    (adding,) = [one for one in curves if one["type"] == "adding-sliding"]
    alphas = np.linspace(first.low, first.high, first.cells)
    for row, gamma in enumerate(np.linspace(second.low, second.high, second.cells)):
        edge = np.interp(gamma, *np.array([(p["gamma"], p["alpha"]) for p in adding["points"]]).T)
        stuck = numbers[:, row] == itineraries.index("52")
        assert np.all(alphas[stuck] < edge + 1e-9)
        assert np.all(stuck[alphas < edge - 1e-9])
