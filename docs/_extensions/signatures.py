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


def _home(_app: Sphinx, module: str, name: str) -> str | None:
    """The module in which a public function, or the class of a member, is defined."""
    public = inspect.unwrap(getattr(import_module(module), name.partition(".")[0], None))
    home: str | None = getattr(public, "__globals__", {}).get("__name__")
    return home or getattr(public, "__module__", None)


def setup(app: Sphinx) -> dict[str, bool]:
    """Have every signature shortened, and sources linked."""
    app.connect("autodoc-process-signature", _process)
    app.connect("autodoc-process-docstring", _untold)
    app.connect("doctree-resolved", _attributes)
    app.connect("viewcode-follow-imported", _home)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
