"""Links to the pages of NumPy, SciPy, Matplotlib, pandas and xarray.

These packages put each name on a page that follows from it. Inventories of their names
(intersphinx) would need a network at every build.
"""

from docutils import nodes
from numpydoc.xref import DEFAULT_LINKS
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.config import Config
from sphinx.environment import BuildEnvironment
from sphinx.util.nodes import make_refnode

import capsule_sym

PAGES = {
    "numpy": "https://numpy.org/doc/stable/reference/generated/{}.html",
    "numpy.typing": "https://numpy.org/doc/stable/reference/typing.html#{}",
    "scipy": "https://docs.scipy.org/doc/scipy/reference/generated/{}.html",
    "matplotlib": "https://matplotlib.org/stable/api/_as_gen/{}.html",
    "matplotlib.style": "https://matplotlib.org/stable/api/style_api.html#{}",
    "pandas": "https://pandas.pydata.org/docs/reference/api/{}.html",
    "xarray": "https://docs.xarray.dev/en/stable/generated/{}.html",
    "pathlib": "https://docs.python.org/3/library/pathlib.html#{}",
    "concurrent.futures": "https://docs.python.org/3/library/concurrent.futures.html#{}",
}
"""Address of a name by its package or module; the most special one counts."""

OWN = ("capsule_sym", *(f"capsule_sym.{one}" for one in ("figures", "inputs", "orbits", "results")))
"""Modules of the package whose names are unique."""

SCALARS = "https://numpy.org/doc/stable/reference/arrays.scalars.html#{}"

NAMES = {
    **{name: f"numpy.typing.{name}" for name in ("ArrayLike", "NDArray")},
    **{name: f"numpy.{name}" for name in ("float64", "int64", "bool_", "ndarray")},
    "array_like": "numpy.typing.ArrayLike",
    "Figure": "matplotlib.figure.Figure",
    "SubFigure": "matplotlib.figure.SubFigure",
    "Axes": "matplotlib.axes.Axes",
    "DataFrame": "pandas.DataFrame",
    "Dataset": "xarray.Dataset",
    "Path": "pathlib.Path",
}
"""Full names of what signatures and docstrings name shortly."""


def address(name: str) -> str | None:
    """Page of a name of another package, short or in full; None if it is none of these."""
    name = NAMES.get(name.rpartition(".")[2], name)
    if name in ("numpy.float64", "numpy.int64", "numpy.bool_"):
        return SCALARS.format(name)
    modules = [module for module in PAGES if name.startswith(f"{module}.")]
    return PAGES[max(modules, key=len)].format(name) if modules else None


def _aliases(_app: Sphinx, config: Config) -> None:
    """Words in the types of docstrings that become links, also to this package's names."""
    own = {name: f"capsule_sym.{name}" for name in capsule_sym.__all__}
    full = {name: name for name in NAMES.values()}
    linked = NAMES | full | own | {"Scene": "capsule_sym.scenes.Scene"}
    plain = {word: word for word in DEFAULT_LINKS}  # int, str: known to readers
    links = {word: f":obj:`{word} <{name}>`" for word, name in linked.items()}
    config.numpydoc_xref_aliases = plain | links


def _linked(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, shown: nodes.Element
) -> nodes.Element | None:
    """A link for a name of another module of the package, or of another package."""
    objects = env.get_domain("py").objects  # type: ignore[attr-defined]
    for module in OWN:
        if (one := objects.get(name := f"{module}.{node['reftarget']}")) is not None:
            page = node["refdoc"]
            return make_refnode(app.builder, page, one.docname, one.node_id, shown, name)
    found = address(node["reftarget"])
    return nodes.reference("", "", shown, refuri=found, internal=False) if found else None


def setup(app: Sphinx) -> dict[str, bool]:
    """Link types in docstrings, and resolve names of other packages."""
    app.connect("config-inited", _aliases, priority=400)  # before numpydoc reads them, at 500
    app.connect("missing-reference", _linked)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
