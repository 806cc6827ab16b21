"""A figure as the value of a notebook's cell."""

import io
import pickle

import pytest
from PIL import Image

from capsule_sym import Parameters, plot, simulate


def test_a_figure_is_the_picture_of_a_cell() -> None:
    figure = plot(simulate(Parameters(alpha=1.2), periods=4), width=2.0)
    data, size = figure._repr_png_()
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.size == pytest.approx((2 * size["width"], 2 * size["height"]), abs=1)
        assert picture.convert("L").getextrema() < (100, 256)
    assert pickle.loads(pickle.dumps(figure))._repr_png_()[0] == data
