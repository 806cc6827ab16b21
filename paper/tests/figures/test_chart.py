"""The chart of the case study: cells below exact curves."""

from __future__ import annotations

import numpy as np
import pytest

from capsule_sym import Parameters
from capsule_sym._sweeps.itineraries import texts
from capsule_sym.figures import plot_chart
from paper.study import data
from tests.figures import untracked


@pytest.mark.long
def test_cells_have_itineraries_and_a_curve_bounds_them(monkeypatch) -> None:
    monkeypatch.setattr(data, "ALPHA", (0.2, 0.45))
    monkeypatch.setattr(data, "GAMMA", (2.5, 3.5))
    cells = data.plane_cells(Parameters(), (12, 6))
    # Adding-sliding on L3^(2) does not depend on gamma.
    below = np.array(["F5 F2", "F5 F4 F5 F2"])[(cells["alpha"].values > 0.36877972418).astype(int)]
    found = [[texts(cells)[code] for code in row] for row in cells["itinerary"].values.tolist()]
    assert found == [[text] * 6 for text in below]
    (curve,) = data.plane_curves(untracked, Parameters(alpha=0.2))
    figure = plot_chart(cells, [curve])
    assert {"1  F5 F2", "2  F5 F4 F5 F2"} <= {
        text.get_text() for text in figure.legends[0].get_texts()
    }
