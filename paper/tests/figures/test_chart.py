"""The chart of the case study: regions between exact curves."""

from __future__ import annotations

import pytest

from capsule_sym import Parameters
from capsule_sym._figures.charts import draw_regions
from capsule_sym._figures.regions import Plane, patches
from paper.study.data import by_samples, plane_curves, plane_regions, samples
from tests.figures import untracked
from tests.figures.test_charts import CURVE, area


def test_samples_lie_in_their_faces_and_the_most_frequent_itinerary_names_them() -> None:
    plane = Plane("alpha", "gamma", (0.0, 2.0), (1.0, 3.0))
    cut = patches(plane, [CURVE])
    found = samples(plane, cut, 8)
    assert {number for number, _, _ in found} == {0, 1}
    for number, alpha, gamma in found:
        left = alpha < 0.75 - 0.01 * (gamma - 1)
        assert left == (cut[number].centroid.x < 0.4)
    said = [(number, "F2" if place else "F5 F2") for place, (number, _, _) in enumerate(found)]
    assert {region.itinerary for region in by_samples(plane, cut, said)} == {"F2"}


@pytest.mark.long
def test_regions_have_itineraries_and_their_curve_bounds_them(monkeypatch) -> None:
    monkeypatch.setattr("paper.study.data._ACROSS", 6)
    plane = Plane("alpha", "gamma", (0.2, 0.45), (2.5, 3.5))
    regions = plane_regions(untracked, Parameters(), plane)
    assert sorted(region.itinerary for region in regions) == ["F5 F2", "F5 F4 F5 F2"]
    # Adding-sliding on L3^(2) does not depend on gamma.
    assert area(regions, "F5 F2") == pytest.approx(0.36877972418 - 0.2, abs=1e-8)
    (curve,) = plane_curves(untracked, Parameters(), plane)
    figure = draw_regions(plane, regions, [curve])
    assert {patch.get_label() for patch in figure.axes[0].patches} == {"_F5 F2", "_F5 F4 F5 F2"}
