"""One look for all figures: widths of a two-column page, colours, axis labels, and saving."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, wraps
from importlib.resources import as_file, files
from inspect import signature
from io import BytesIO
from pathlib import Path
from typing import Any, Literal, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from matplotlib import rc_context, rc_params_from_file, rcParams, rcParamsDefault
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Patch

import capsule_sym
from capsule_sym._errors import InvalidInput
from capsule_sym._figures.sizes import COLUMN, FORMATS, PAGE, RESOLUTION, RESOLUTIONS
from capsule_sym._files import write_whole
from capsule_sym._parameters import CAPSULE, Scene

_Given = ParamSpec("_Given")
_Drawn = TypeVar("_Drawn")
# The explorer reads the same file.
_COLOURS = json.loads((files(__package__) / "colours.json").read_text(encoding="utf-8"))
_FIELDS: list[str] = _COLOURS["fields"]
"""The paper's hues in the palette of Okabe and Ito, which eyes of all kinds tell apart.

The last three are those of contact behind: forward, rest, backward.
"""
_PALE: float = _COLOURS["pale"]  # share of white in a paler colour, as of a low level of the drive

REGIONS: tuple[str, ...] = tuple(_COLOURS["regions"])
"""Colours of areas side by side, by their size. From Paul Tol's schemes."""

SERIES: tuple[str, ...] = tuple(_COLOURS["series"])
"""Colours of curves that are compared."""
STABLE, UNSTABLE = SERIES[:2]


@cache
def labels_of(scene: Scene) -> dict[str, str]:
    """Axis labels of a scene: what a quantity means, and its symbol."""
    facts = scene.facts
    return {
        **{name: f"{text} ${facts.TEX[name]}$" for name, text in facts.LABELS.items()},
        "x": r"displacements $x_m$, $x_c$",
        "time": r"time $\omega\tau/2\pi$ (periods)",
        "velocity": r"average velocity $\langle v_c\rangle$",
        "progression": "progression per period",
        "phase": r"phase $\tau$",
        "lyapunov": "largest Lyapunov exponent",
    }


LABELS = labels_of(CAPSULE)
"""Those of the paper's scene; states and results have the same in each."""

NO_RESULT = "no result"
"""Legend entry of what is left white where motions are drawn over parameters or starts."""
NOT_SETTLED = "#8C8C8C"
"""Colour of what has not settled within the periods of a sweep."""

# Colour and dashes of a curve of bifurcations, by its type: apart in grey too.
CURVES = {
    "grazing": ("black", (0, (1, 1.2))),
    "adding-sliding": ("#0072B2", "-"),
    "boundary-intersection crossing": ("black", "-"),
    "crossing-sliding": ("#D55E00", (0, (5, 1.2))),
    "switching-sliding": ("#009E73", (0, (4, 1, 1, 1))),
    "grazing-sliding": ("#B0307A", (0, (4, 1, 1, 1, 1, 1))),
    "fold": ("#4D4D4D", "-"),
}
DASHES = 3.0  # length of a legend entry in which dashes are told apart, in sizes of its type
OTHER_CURVE = ("#4D4D4D", (0, (9, 2)))


def field_colour(field: int, scene: Scene = CAPSULE) -> str:
    """Colour of a field's segments by its number, paler where the drive is at its low level."""
    contact, drift = scene.facts.FIELDS[field]
    colour = _FIELDS[3 * contact + 1 - drift]
    return paler(colour) if scene.facts.LEVELS[field] else colour


def paler(colour: str) -> str:
    """A colour mixed with white."""
    red, green, blue = (_PALE + (1 - _PALE) * part for part in to_rgb(colour))
    return str(to_hex((red, green, blue)))


AREAS = (*REGIONS, *map(paler, REGIONS))
"""Colours of areas, twice as many."""


_PAGES: WeakKeyDictionary[Figure, dict[tuple[str, int], str]] = WeakKeyDictionary()
OTHERS = "#dddddd"
"""Colour of areas for which none is left."""


def area_colours(figure: Figure, names: Sequence[str], again: bool = True) -> list[str]:
    """Colours of areas on a page, where a name such as an itinerary has one colour in all charts.

    A name that is there twice has a colour for each place. Where none is left, colours are used
    `again`, or the rest is grey.
    """
    known = _PAGES.setdefault(figure, {})
    keys = [(name, names[:k].count(name)) for k, name in enumerate(names)]
    for key in keys:
        left = again or len(known) < len(AREAS)
        known.setdefault(key, AREAS[len(known) % len(AREAS)] if left else OTHERS)
    return [known[key] for key in keys]


def share(*ends: Any) -> str:
    """A share of all, or the least and the largest one, in percent."""
    return f"({' to '.join(dict.fromkeys(f'{100 * end:.3g}' for end in ends))} %)"


def blank(label: str) -> Patch:
    """Legend entry of what is left white."""
    return Patch(facecolor="white", edgecolor="0.5", label=label)


def readable(colour: Any) -> str:
    """Black or white, whichever reads better on a colour."""
    red, green, blue = to_rgb(colour)
    light = 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2
    return "black" if light > 0.22 else "white"


def mathematical(name: str) -> str:
    """The name of a surface, a line or its part, such as L2^(1), in mathematical type."""
    piece, _, part = name.partition("^")
    exponent = f"^{{{part}}}" if part else ""
    return f"${piece[0]}_{{{piece[1:]}}}{exponent}$"


@cache
def _sheet() -> dict[Any, Any]:
    """Settings of the style file."""
    with as_file(files(__package__) / "capsule.mplstyle") as path:
        return dict(rc_params_from_file(path, use_default_template=False))


@contextmanager
def figure_style(width: float | Literal["column", "page"] | None = None) -> Iterator[None]:
    """Context in which figures are made, drawn and saved in the style of the package.

    Settings of matplotlib that a style sheet or a matplotlibrc changed before stay as they are; its
    `figure.figsize` gives the width.

    Parameters
    ----------
    width : float, "column" or "page", default None
        Width of figures made meanwhile: "column" (3.35 in), "page" (7 in, as where none is given)
        or a number of inches. Figures of one's own are then as high as wide, unless they have a
        size.

    Returns
    -------
    context manager
        Context for a `with` statement. The former settings hold after it.

    Raises
    ------
    InvalidInput
        For another word, and a number that is not above 0 and finite.

    See Also
    --------
    save_figure : file of a figure.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> with cs.figures.figure_style("column"):
    ...     figure = cs.figures.plot_motion(cs.solve_orbit(cs.Parameters(alpha=0.9)))
    >>> print(figure.get_figwidth())
    3.35
    """
    ours = {name: at for name, at in _sheet().items() if rcParams[name] == rcParamsDefault[name]}
    if width is not None:
        inches = {"column": COLUMN, "page": PAGE}.get(str(width), width)
        if isinstance(inches, str) or not 0 < inches < math.inf:
            raise InvalidInput("width", width, "column, page or a number of inches > 0")
        ours["figure.figsize"] = inches, inches
    with rc_context(ours):
        try:
            yield
        finally:
            interactive = rcParams["interactive"]
    rcParams["interactive"] = interactive  # a notebook sets it with pyplot's first figure


def styled(draw: Callable[_Given, Figure]) -> Callable[_Given, Figure]:
    """Decorator of a function that draws: it runs in the style, whose width is its default."""

    @wraps(draw)
    def drawn(*given: _Given.args, **named: _Given.kwargs) -> Figure:
        with figure_style():
            named.setdefault("width", rcParams["figure.figsize"][0])
            return draw(*given, **named)

    return drawn


def of_records(draw: Callable[_Given, _Drawn]) -> Callable[_Given, _Drawn]:
    """Decorator of a function that draws records: raises InvalidInput for incomplete ones.

    For arguments that the function does not take it raises TypeError.
    """
    takes = signature(draw)
    field = next(name for name in takes.parameters if name != "axes")

    @wraps(draw)
    def drawn(*given: _Given.args, **named: _Given.kwargs) -> _Drawn:
        takes.bind(*given, **named)
        try:
            return draw(*given, **named)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            if isinstance(error, InvalidInput):
                raise
            lacks = f"without {error}" if isinstance(error, KeyError) else str(error)
            whole = "a whole one, with all that the function's documentation names"
            raise InvalidInput(field, lacks, whole) from error

    return drawn


def figure_of(drawn: Axes | Figure | SubFigure) -> Figure:
    """The figure that holds axes or a part of it, or itself."""
    figure: Figure = drawn.get_figure(root=True)  # type: ignore[assignment]
    return figure


def draw_points(axes: Axes, x: Sequence[float], y: Sequence[float], label: str) -> None:
    """Exact points: white ones with a black rim, above all curves."""
    rim: dict[str, Any] = {"markeredgecolor": "black", "markeredgewidth": 0.8}
    axes.plot(x, y, "o", color="white", zorder=5, label=label, **rim)


def bulk(values: Any, few: float = 0.1) -> tuple[float, float]:
    """Least and largest of some values, without outliers.

    The distance of an outlier from the median is over ten times the median of these distances. All
    values count if outliers are more than one and more than a share `few`, or if all others are
    equal.
    """
    away = abs(values - np.median(values))
    near = away <= 10 * np.median(away)
    told = np.sum(~near) <= max(1, few * len(values)) and np.any(away[near])
    inside = values[near] if told else values
    return float(np.min(inside)), float(np.max(inside))


def on_page(figure: Figure) -> tuple[int, int]:
    """Width and height of a figure in dots of a page, 96 in each inch."""
    across, down = (round(96 * float(inches)) for inches in figure.get_size_inches())
    return across, down


_ABOUT: WeakKeyDictionary[Any, dict[str, Any]] = WeakKeyDictionary()


def describe(drawn: Figure | SubFigure, title: str, **about: Any) -> Figure:
    """Keep with a figure what it shows, for the metadata of its file: a title, and values by name.

    Gives the whole figure. Values are plain data for JSON, or have `to_dict`, as parameters do.
    """
    figure = figure_of(drawn)
    plain = {k: v.to_dict() if hasattr(v, "to_dict") else v for k, v in about.items()}
    _ABOUT[figure] = {**_ABOUT.get(figure, {}), **plain, "title": title}
    return figure


def save_figure(figure: Figure, path: str | Path, *, dpi: float | None = None) -> None:
    """Write a figure as PNG, SVG or PDF, by the ending of the path; equal figures, equal bytes.

    The file's metadata describe the figure: `Title`, and `Description` (PDF: `Subject`), a JSON
    object, which has the parameters of motions, branches, attractors and shocks. Missing folders
    are made. A file is replaced only once the new one is whole.

    Parameters
    ----------
    figure : Figure of Matplotlib
        Figure to write.
    path : str or path
        File to write, with the ending .png, .svg or .pdf.
    dpi : float, optional, 30 to 2400
        Resolution of a PNG, and of what is dots in the others, as a number of dots per inch. The
        default is 300.

    Returns
    -------
    None
        The result is the file.

    Raises
    ------
    InvalidInput
        For another ending or resolution, and for a path that cannot be written.

    See Also
    --------
    figure_style : width of figures.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import capsule_sym as cs
    >>> figure = cs.figures.plot_motion(cs.solve_orbit(cs.Parameters(alpha=0.9)))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     cs.figures.save_figure(figure, f"{folder}/motion.svg")
    ...     print([path.name for path in Path(folder).iterdir()])
    ['motion.svg']
    """
    kind = check_ending(Path(path))
    check_resolution(dpi)
    with figure_style():
        drawn = BytesIO()  # a file that cannot be written is none of matplotlib's business
        about = _metadata(figure, kind)
        # The file has no date, and matplotlib raises for one that is no number.
        epoch = os.environ.pop("SOURCE_DATE_EPOCH", None)
        try:
            figure.savefig(drawn, format=kind[1:], metadata=about, dpi=dpi or RESOLUTION)
        finally:
            if epoch is not None:
                os.environ["SOURCE_DATE_EPOCH"] = epoch
    write_whole(path, drawn.getvalue())


def _metadata(figure: Figure, kind: str) -> dict[str, Any]:
    about = dict(_ABOUT.get(figure, {}))
    names = {
        ".png": ("Description", "Software"),
        ".svg": ("Description", "Creator", "Date"),
        ".pdf": ("Subject", "Creator", "CreationDate"),
    }
    text, program, *date = names[kind]
    found = {"Title": about.pop("title", ""), text: about and json.dumps(about, sort_keys=True)}
    found[program] = f"capsule-sym {capsule_sym.__version__}"
    return {name: value for name, value in found.items() if value} | dict.fromkeys(date)


def check_resolution(dpi: float | None) -> None:
    """Raise InvalidInput for a resolution outside RESOLUTIONS; None, the default, is allowed."""
    low, high = RESOLUTIONS
    if dpi is not None and not low <= dpi <= high:
        raise InvalidInput("dpi", dpi, f"in [{low:g}, {high:g}]")


def check_ending(path: Path) -> str:
    """The ending of a picture's path, in lower case; raises InvalidInput unless in FORMATS."""
    if path.suffix.lower() not in FORMATS:
        raise InvalidInput("out", str(path), f"a file name that ends in {', '.join(FORMATS)}")
    return path.suffix.lower()


GREY, RED = "#707070", "#c03030"
LOOKS = {
    # As in Fig. 7: L2 dashed grey, L6 and L7 solid black, L3 dashed red.
    "L1": ("--", "#3070c0"),
    "L2": ("--", GREY),
    "L3": ("--", RED),
    "L4": ("--", "#8a5a00"),
    **dict.fromkeys(("L5", "L6", "L7", "L8", "L10"), ("-", "black")),
}
"""Line style and colour of the lines on P1 = 0."""
