"""A figure as the value of a notebook's cell."""

import io
import pickle

import pytest
from matplotlib.figure import Figure
from PIL import Image

from capsule_sym import Parameters, plot, simulate


@pytest.mark.parametrize("own", [None, Figure])
def test_a_figure_is_the_picture_of_a_cell(own) -> None:
    """Also one of the user's own that pyplot does not know, of which IPython has no picture."""
    axes = own and own(figsize=(2, 1)).subplots(1, 2)
    figure = plot(simulate(Parameters(alpha=1.2), periods=4), axes=axes, width=2.0)
    data, size = figure._repr_png_()
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.size == pytest.approx((2 * size["width"], 2 * size["height"]), abs=1)
        assert picture.convert("L").getextrema() < (100, 256)
    assert pickle.loads(pickle.dumps(figure))._repr_png_()[0] == data
