"""The chart: regions between exact curves, named inside; where cells differ they are drawn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgba
from shapely import Point

from capsule_sym._figures.charts import by_area
from capsule_sym._figures.regions import Plane, by_cells, patches
from capsule_sym.figures import plot_basin, plot_chart

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


def area(regions, itinerary: str) -> float:
    return sum(region.shape().area for region in regions if region.itinerary == itinerary)


@pytest.mark.long
def test_a_region_is_bounded_by_its_curve_and_not_by_cells(results: xr.Dataset) -> None:
    plane, regions = by_cells(results, [CURVE])
    assert plane == Plane("alpha", "gamma", (0.0, 2.0), (1.0, 3.0))
    # The part left of the curve: a trapezium, to the last digit.
    assert area(regions, "F5 F2") == pytest.approx(2 * (0.75 + 0.73) / 2, abs=1e-9)
    cells = (1 / 39) * (1 / 19) + (2 / 39) * (2 / 19)
    assert area(regions, "F5 F4 F1 F2") == pytest.approx(4 - 1.48 - cells, abs=1e-9)
    # Without a curve the cells are the border, here a quarter of one in a corner.
    assert area(regions, "F2") == pytest.approx((1 / 39) * (1 / 19), rel=1e-9)
    assert area(regions, "") == pytest.approx((2 / 39) * (2 / 19), rel=1e-9)
    assert by_area(plane, regions) == ["F5 F4 F1 F2", "F5 F2", "F2"]


def test_a_curve_that_ends_in_a_meeting_closes_its_region() -> None:
    plane = Plane("alpha", "gamma", (0.0, 1.0), (0.0, 1.0))
    straight = {
        "points": [{"alpha": 0.5, "gamma": 0.0}, {"alpha": 0.5, "gamma": 1.0}],
        "codimension_two": [{"alpha": 0.5, "gamma": 0.25}],
    }
    # Followed to just before the meeting.
    short = {
        "points": [{"alpha": 0.49, "gamma": 0.25}, {"alpha": 0.0, "gamma": 0.25}],
        "codimension_two": [{"alpha": 0.5, "gamma": 0.25}],
    }
    for end in (short, {**short, "points": short["points"][::-1]}):
        cut = patches(plane, [straight, end])
        assert sorted(patch.area for patch in cut) == pytest.approx([0.125, 0.375, 0.5])


def test_regions_are_filled_and_numbered_inside(results: xr.Dataset) -> None:
    axes = plot_chart(results, [CURVE]).axes[0]
    labels = [patch.get_label() for patch in axes.patches]
    assert sorted(labels) == ["_F2", "_F5 F2", "_F5 F4 F1 F2"]  # what is unknown stays white
    names = {text.get_text(): text.get_position() for text in axes.texts}
    assert names["2"][0] < 0.74 < names["1"][0]
    assert axes.get_xlabel() == r"excitation amplitude $\alpha$"
    assert axes.get_ylabel() == r"mass ratio $\gamma$"


def test_what_has_not_settled_has_a_colour_and_says_after_how_many_periods(results) -> None:
    outcome = np.where(results["itinerary"] == 33, 3, 1)
    results["outcome"] = (("alpha", "gamma"), outcome)
    results["attractor"] = (("alpha", "gamma"), np.where(outcome == 1, 0, -1))
    results["attractor"].attrs["attractors"] = [{"itinerary": "F5 F2", "fraction": 1.0}]
    results.attrs["periods"] = 4000
    for figure in (plot_chart(results, [CURVE]), plot_basin(results)):
        key = {one.get_label(): one for one in figure.legends[0].get_patches()}
        assert key["not settled in 4,000 periods"].get_facecolor() == to_rgba("#8C8C8C")
    axes = plot_chart(results, [CURVE]).axes[0]
    looks = {patch.get_label(): patch.get_facecolor() for patch in axes.patches}
    assert looks["_not settled in 4,000 periods"] == to_rgba("#8C8C8C")


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
    assert [text.get_text() for text in figure.axes[0].texts] == [str(k) for k in range(1, 19)]
    colours = {patch.get_label(): patch.get_facecolor() for patch in figure.axes[0].patches}
    assert len(set(colours.values())) == 19
    assert colours["_F19"] == colours["_F20"] == colours["_F21"]


def test_curves_and_their_points_lie_on_top(results: xr.Dataset) -> None:
    figure = plot_chart(results, [CURVE], levels=(1.5,))
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert [list(v) for v in lines["crossing-sliding"].get_data()] == [[0.75, 0.73], [1.0, 3.0]]
    assert [list(v) for v in lines["codimension-two point"].get_data()] == [[0.74], [2.0]]
    (level,) = [line for line in figure.axes[0].lines if list(line.get_ydata()) == [1.5, 1.5]]
    assert level.is_dashed()
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    assert shown == [r"mass ratio $\gamma$ = 1.5", *KEY[:2], *NUMBERED, WHITE]


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


@pytest.mark.long
def test_cells_that_differ_bound_their_regions() -> None:
    """Stripes that slope by one cell a column, three cells thick; each point is in its own."""
    codes = 11 * (1 + (np.arange(30)[:, None] + np.arange(20)) // 3 % 2)
    flags = {"flag_values": [11, 22], "flag_meanings": "F5_F2 F2"}
    over = {"alpha": np.linspace(0, 2, 30), "gamma": np.linspace(1, 3, 20)}
    results = xr.Dataset({"itinerary": (tuple(over), codes, flags)}, coords=over)
    _, regions = by_cells(results, [])
    assert sum(region.shape().area for region in regions) == pytest.approx(4.0)
    for i, alpha in enumerate(over["alpha"][1:-1], 1):
        for j, gamma in enumerate(over["gamma"][1:-1], 1):
            (own,) = (one for one in regions if one.shape().contains(Point(alpha, gamma)))
            assert own.itinerary == ("F5 F2" if codes[i, j] == 11 else "F2")
