"""The chart: cells in the colours of their itineraries, numbered inside, below exact curves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgba

from capsule_sym import InvalidInput
from capsule_sym.figures import plot_basin, plot_chart, plot_metric

WHITE = "no result"
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
    "points": [{"alpha": 0.75, "gamma": 1.0}, {"alpha": 0.73, "gamma": 3.0}],
    "codimension_two": [{"alpha": 0.74, "gamma": 2.0}],
}


def test_what_has_not_settled_has_a_colour_and_says_after_how_many_periods(results) -> None:
    outcome = np.where(results["itinerary"] == 33, 3, 1)
    results["outcome"] = (("alpha", "gamma"), outcome)
    results["attractor"] = (("alpha", "gamma"), np.where(outcome == 1, 0, -1))
    results["attractor"].attrs["attractors"] = [{"itinerary": "F5 F2", "fraction": 1.0}]
    results.attrs["periods"] = 4000
    for figure in (plot_chart(results, [CURVE]), plot_basin(results)):
        key = {one.get_label(): one for one in figure.legends[0].get_patches()}
        assert key["not settled in 4,000 periods"].get_facecolor() == to_rgba("#8C8C8C")


def test_curves_and_their_points_lie_on_top(results: xr.Dataset) -> None:
    figure = plot_chart(results, [CURVE], levels=(1.5,))
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert [list(v) for v in lines["crossing-sliding"].get_data()] == [[0.75, 0.73], [1.0, 3.0]]
    assert [list(v) for v in lines["codimension-two point"].get_data()] == [[0.74], [2.0]]
    (level,) = [line for line in figure.axes[0].lines if list(line.get_ydata()) == [1.5, 1.5]]
    assert level.is_dashed()
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    assert shown == [r"mass ratio $\gamma$ = 1.5", *KEY[:2], *NUMBERED, WHITE]


@pytest.mark.parametrize("draw", [plot_chart, plot_metric])
@pytest.mark.parametrize("lacks", ["type", "points", "codimension_two"])
def test_a_curve_that_lacks_something_is_one_line(results: xr.Dataset, lacks: str, draw) -> None:
    results["velocity"] = results["itinerary"] * 0.5
    broken = {name: value for name, value in CURVE.items() if name != lacks}
    with pytest.raises(InvalidInput, match=f"curve = \"without '{lacks}'\": must be a whole one"):
        draw(results, curves=[CURVE, broken])


@pytest.mark.parametrize("draw", [plot_chart, plot_metric, plot_basin])
def test_an_axis_of_several_quantities_is_refused(results: xr.Dataset, draw) -> None:
    """The cells of a random design have no order."""
    results["velocity"] = results["itinerary"] * 0.5
    results["attractor"] = results["itinerary"].copy(data=np.zeros((40, 20), int))
    results["attractor"].attrs["attractors"] = [{"itinerary": "F5 F2", "fraction": 1.0}]
    draw(results)
    sample = results.rename_dims(alpha="sample").reset_index("alpha")
    with pytest.raises(InvalidInput, match=r"axis = 'sample': must be a quantity"):
        draw(sample)


KEY = "crossing-sliding", "codimension-two point"
NUMBERED = "1  F5 F4 F1 F2", "2  F5 F2", "3  F2"


def test_what_is_not_there_is_not_in_the_legend(results: xr.Dataset) -> None:
    figure = plot_chart(results, [{**CURVE, "codimension_two": []}])
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    assert shown == ["crossing-sliding", *NUMBERED, WHITE]
    settled = results.where(results["itinerary"] >= 0, 22)  # no cell is white
    settled["itinerary"] = settled["itinerary"].astype(int).assign_attrs(results["itinerary"].attrs)
    (legend,) = plot_chart(settled).legends
    assert [text.get_text() for text in legend.get_texts()] == [*NUMBERED]


def cells_of(axes: Any) -> Any:
    """Colours of the cells of a chart, by both axes."""
    (mesh,) = axes.collections
    return mesh.get_array().swapaxes(0, 1)


def test_cells_have_the_colour_of_their_itinerary_and_areas_their_number(results) -> None:
    figure = plot_chart(results, [CURVE])
    (axes,) = figure.axes
    colours = cells_of(axes)
    key = {one.get_label(): one.get_facecolor() for one in figure.legends[0].get_patches()}
    for (i, j), code in np.ndenumerate(results["itinerary"].values):
        shown = [key[one] for one in NUMBERED if one[3:] == CODES.get(code, "").replace("_", " ")]
        assert [tuple(colours[i, j])] == shown or (code == -1 and (colours[i, j] == 1).all())
    names = {text.get_text(): text.get_position() for text in axes.texts}
    assert {"1", "2"} <= names.keys()
    assert names["2"][0] < 0.74 < names["1"][0]
    assert axes.get_xlabel() == r"excitation amplitude $\alpha$"
    assert axes.get_ylabel() == r"mass ratio $\gamma$"


@pytest.mark.long
def test_of_a_crowd_of_itineraries_the_largest_have_numbers_and_the_others_are_grey() -> None:
    """21 columns, of 22 - k cells the k-th: 18 colours, each once, and 3 that are one grey."""
    order = np.repeat(np.arange(21), range(22, 1, -1))
    flags = {"flag_values": range(1, 22), "flag_meanings": " ".join(f"F{k}" for k in range(1, 22))}
    results = xr.Dataset(
        {"itinerary": (("alpha", "gamma"), np.tile(order[:, None] + 1, 20), flags)},
        coords={"alpha": np.linspace(0, 2, len(order)), "gamma": np.linspace(1, 3, 20)},
    )
    figure = plot_chart(results)
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    assert shown == [*(f"{k}  F{k}" for k in range(1, 19)), "3 other itineraries"]
    colours = [tuple(one) for one in cells_of(figure.axes[0])[:, 0]]
    assert len({*colours}) == 19
    assert len({*colours[-9:]}) == 1  # of 4, 3 and 2 cells
