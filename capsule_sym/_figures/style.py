"""One look for all figures: widths of a two-column page, colours, axis labels, and saving."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput, NotInstalled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Colours = Literal["safe", "paper"]
COLUMN, PAGE = 3.54, 7.48
"""Widths of a column and of a page of print, in inches."""

FORMATS = (".png", ".svg", ".pdf")

_FIELDS: dict[str, tuple[str, ...]] = {
    # The hues of the paper in the palette of Okabe and Ito, which eyes of all kinds tell apart.
    "safe": ("#0072B2", "#D55E00", "#CC79A7", "#009E73", "#000000", "#E69F00"),
    "paper": ("blue", "red", "magenta", "green", "black", "orange"),
}

LABELS = {
    "x_r": "relative displacement $x_r$",
    "v_r": "relative velocity $v_r$",
    "v_c": "capsule velocity $v_c$",
    "x": r"displacements $x_m$, $x_c$",
    "time": r"time $\omega\tau/2\pi$ (periods)",
    "alpha": r"excitation amplitude $\alpha$",
    "omega": r"excitation frequency $\omega$",
    "delta": r"gap $\delta$",
    "zeta": r"damping ratio $\zeta$",
    "beta": r"stiffness ratio $\beta$",
    "gamma": r"mass ratio $\gamma$",
    "f_b": "friction bound $f_b$",
    "velocity": r"average velocity $\langle v_c\rangle$",
}
"""Axis labels: what a quantity means, and its symbol."""

SEAMLESS: dict[str, Any] = {"linewidth": 0, "antialiased": False, "rasterized": True}
"""Options of areas side by side: as pixels without antialiasing no seam shows between them."""


def field_colour(field: int, colours: Colours = "safe") -> str:
    """Colour of the segments of field F1 to F6 (1 to 6).

    "paper" are those of Fig. 7; raises InvalidInput for a set that does not exist.
    """
    if colours not in _FIELDS:
        raise InvalidInput("colours", colours, f"one of {', '.join(_FIELDS)}")
    return _FIELDS[colours][field - 1]


def mathematical(name: str) -> str:
    """The name of a surface, a line or its part, such as L2^(1), in mathematical type."""
    piece, _, part = name.partition("^")
    exponent = f"^{{{part}}}" if part else ""
    return f"${piece[0]}_{{{piece[1:]}}}{exponent}$"


@contextmanager
def styled() -> Iterator[None]:
    """The style file in force, for making, drawing and saving a figure."""
    try:
        import matplotlib
    except ModuleNotFoundError as missing:
        raise NotInstalled(missing) from missing
    with (
        as_file(files(__package__) / "capsule.mplstyle") as path,
        matplotlib.rc_context(fname=path),
    ):
        yield


def new_figure(width: float, height: float, **options: Any) -> Figure:
    """An empty figure, sizes in inches, that no global list of figures keeps."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), **options)


def draw_points(axes: Axes, x: Sequence[float], y: Sequence[float], label: str) -> None:
    """Exact points: white ones with a black rim, above all curves."""
    rim: dict[str, Any] = {"markeredgecolor": "black", "markeredgewidth": 0.8}
    axes.plot(x, y, "o", color="white", zorder=5, label=label, **rim)


def column_edges(middles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Edges, shape (n + 1,), of columns that meet halfway between their middles, shape (n,)."""
    return np.concatenate([middles[:1], (middles[1:] + middles[:-1]) / 2, middles[-1:]])


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, SVG or PDF, by the ending of the path; equal figures, equal bytes.

    Raises InvalidInput for another ending and for a path that cannot be written.
    """
    kind = check_ending(path)
    dated = {".svg": "Date", ".pdf": "CreationDate"}
    metadata = {dated[kind]: None} if kind in dated else None
    with styled():
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            figure.savefig(path, metadata=metadata)
        except OSError as error:
            raise InvalidInput("out", str(path), f"writable ({error.strerror})") from error


def check_ending(path: Path) -> str:
    """The ending of a picture's path, in lower case; raises InvalidInput unless in FORMATS."""
    if path.suffix.lower() not in FORMATS:
        raise InvalidInput("out", str(path), f"a file name that ends in {', '.join(FORMATS)}")
    return path.suffix.lower()


GREY, RED = "#888888", "#c03030"
LOOKS = {
    # As in Fig. 7: L2 dashed grey, L6 and L7 solid black, L3 dashed red.
    "L1": ("--", "#3070c0"),
    "L2": ("--", GREY),
    "L3": ("--", RED),
    "L4": ("--", "#8a5a00"),
    "L5": ("-", "black"),
    "L6": ("-", "black"),
    "L7": ("-", "black"),
    "L8": ("-", "black"),
    "L10": ("-", "black"),
}
"""Line style and colour of the lines on P1 = 0."""
