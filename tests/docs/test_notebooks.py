"""Notebooks: kept without outputs, run cell by cell, and their values shown by more than text."""

from __future__ import annotations

import ast
import io
import json
import pickle
from pathlib import Path
from typing import Any

import pytest
from matplotlib import pyplot
from PIL import Image

from capsule_sym import Parameters, plot, simulate
from tests.examples import ROOT

NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
BOOK = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def cells(path: Path) -> list[dict[str, Any]]:
    """The cells of code."""
    found = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [one for one in found if one["cell_type"] == "code"]


def valued(source: str, names: dict[str, Any]) -> Any:
    """Run a cell; the value of its last line, None where that is no expression."""
    *before, last = ast.parse(source).body
    if not isinstance(last, ast.Expr):
        exec(source, names)
        return None
    exec(compile(ast.Module(before, []), "<cell>", "exec"), names)
    return eval(compile(ast.Expression(last.value), "<cell>", "eval"), names)


def test_there_are_notebooks() -> None:
    assert len(NOTEBOOKS) >= 3


@BOOK
def test_a_notebook_is_kept_without_outputs(path: Path) -> None:
    assert path.stat().st_size < 20_000
    for cell in cells(path):
        assert (cell["outputs"], cell["execution_count"]) == ([], None)


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[pytest.mark.long] if path.stem == "branch" else [])
        for path in NOTEBOOKS
    ],
)
def test_a_notebook_runs_and_shows_tables_and_pictures(path: Path, monkeypatch, tmp_path) -> None:
    monkeypatch.chdir(tmp_path)
    shown = []
    monkeypatch.setattr(pyplot, "show", lambda: shown.append(len(pyplot.get_fignums())))
    names: dict[str, Any] = {}
    tables, pictures = 0, 0
    for cell in cells(path):
        before = len(shown)
        value = valued("".join(cell["source"]), names)
        drawn = len(shown) > before or hasattr(value, "_repr_png_")
        assert drawn == ("image" in cell["metadata"].get("mystnb", {})), cell["source"]
        pictures += drawn
        tables += bool(getattr(value, "_repr_html_", lambda: None)() and not drawn)
    pyplot.close("all")
    assert tables >= 2
    assert pictures >= 1
    assert list(tmp_path.iterdir()) == []


def test_a_figure_is_the_picture_of_a_cell() -> None:
    figure = plot(simulate(Parameters(alpha=1.2), periods=4))
    data, size = figure._repr_png_()
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.size == pytest.approx((2 * size["width"], 2 * size["height"]), abs=1)
        assert picture.convert("L").getextrema() < (100, 256)
    assert pickle.loads(pickle.dumps(figure))._repr_png_()[0] == data
