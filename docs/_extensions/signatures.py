"""Signatures as they are written: by the aliases of array types, which Sphinx spells out."""

import inspect
import re
from importlib import import_module
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx

_ARRAYS = r"_SupportsArray\[dtype\[Any\]\]"
_ARRAY_LIKE = re.compile(
    rf"_Buffer \| {_ARRAYS} \| _NestedSequence\[{_ARRAYS}\]"
    r" \| complex \| bytes( \| str)? \| _NestedSequence\[complex \| bytes \| str\]"
)

# Addresses of types of other packages: an inventory would need a network at every build.
_NUMPY = "https://numpy.org/doc/stable/reference"
_MATPLOTLIB, _PANDAS = "https://matplotlib.org/stable/api", "https://pandas.pydata.org/docs"
_PYTHON = "https://docs.python.org/3/library"
_OUTSIDE = {
    "ArrayLike": f"{_NUMPY}/typing.html#numpy.typing.ArrayLike",
    "NDArray": f"{_NUMPY}/typing.html#numpy.typing.NDArray",
    "float64": f"{_NUMPY}/arrays.scalars.html#numpy.float64",
    "int64": f"{_NUMPY}/arrays.scalars.html#numpy.int64",
    "bool_": f"{_NUMPY}/arrays.scalars.html#numpy.bool_",
    "Figure": f"{_MATPLOTLIB}/_as_gen/matplotlib.figure.Figure.html",
    "SubFigure": f"{_MATPLOTLIB}/_as_gen/matplotlib.figure.SubFigure.html",
    "Axes": f"{_MATPLOTLIB}/_as_gen/matplotlib.axes.Axes.html",
    "DataFrame": f"{_PANDAS}/reference/api/pandas.DataFrame.html",
    "Dataset": "https://docs.xarray.dev/en/stable/generated/xarray.Dataset.html",
    "Path": f"{_PYTHON}/pathlib.html#pathlib.Path",
    "Executor": f"{_PYTHON}/concurrent.futures.html#concurrent.futures.Executor",
}


def shortened(text: str) -> str:
    """A signature, or a part of one, with the names of NumPy's aliases.

    Defaults that are not Python, such as <factory>, become `...`, so that Sphinx can read the rest.
    """
    text = re.sub(r"<\w[^<>]*(<\w+>)?>", "...", text)
    text = re.sub(r"~(?:numpy|typing)\.(?:\w+\.)*", "", text)  # of `~a.b` only b is shown
    text = _ARRAY_LIKE.sub("ArrayLike", text)
    return re.sub(r"ndarray\[tuple\[Any, \.\.\.\], dtype\[(\w+)\]\]", r"NDArray[\1]", text)


def _process(
    _app: Sphinx, _what: str, _name: str, _object: Any, _options: Any, text: str | None, gives: Any
) -> tuple[str | None, Any]:
    return text and shortened(text), gives and shortened(gives)


def _untold(
    _app: Sphinx, _what: str, _name: str, _object: Any, _options: Any, lines: list[str]
) -> None:
    """Text without Python's own docstrings of a named tuple's fields."""
    lines[:] = [line for line in lines if not line.startswith("Alias for field number ")]


def _attributes(_app: Sphinx, document: nodes.document, _name: str) -> None:
    """Types of attributes, which are no part of a signature."""
    for node in document.findall(addnodes.desc_annotation):
        if (text := shortened(node.astext())) != node.astext():
            node[:] = [nodes.Text(text)]


def _linked(
    _app: Sphinx, _env: Any, node: addnodes.pending_xref, shown: nodes.Element
) -> nodes.Element | None:
    """A link to the page of a type of another package."""
    address = _OUTSIDE.get(node["reftarget"].rpartition(".")[2])
    return nodes.reference("", "", shown, refuri=address, internal=False) if address else None


def _home(_app: Sphinx, module: str, name: str) -> str | None:
    """The module in which a public function, or the class of a member, is defined."""
    public = inspect.unwrap(getattr(import_module(module), name.partition(".")[0], None))
    home: str | None = getattr(public, "__globals__", {}).get("__name__")
    return home or getattr(public, "__module__", None)


def setup(app: Sphinx) -> dict[str, bool]:
    """Have every signature shortened, types of other packages and sources linked."""
    app.connect("autodoc-process-signature", _process)
    app.connect("autodoc-process-docstring", _untold)
    app.connect("doctree-resolved", _attributes)
    app.connect("missing-reference", _linked)
    app.connect("viewcode-follow-imported", _home)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
