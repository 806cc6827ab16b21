"""Measured time series for a fit, from arrays or text files.

Of a file the separator, decimal mark, header and units are detected.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from unicodedata import normalize

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._errors import InvalidInput
from capsule_sym._map import evaluation

OF_STATE = {
    "x_r": (1.0, 0.0, 0.0, 0.0),
    "v_r": (0.0, 1.0, 0.0, 0.0),
    "v_c": (0.0, 0.0, 1.0, 0.0),
    "x_c": (0.0, 0.0, 0.0, 1.0),
    "x_m": (1.0, 0.0, 0.0, 1.0),
    "v_m": (0.0, 1.0, 1.0, 0.0),
}
"""Measurable quantities, as combinations of (x_r, v_r, v_c, x_c)."""
_LARGEST = 1e50  # of a column, in its unit: squares and products of larger values would overflow
ALLOWED = f"t and one or more of {', '.join(OF_STATE)}"


@dataclass(frozen=True, eq=False)
class Measured:
    """Measured values: `values` (n,) of the quantity `OF_STATE[names[column]]` at `times` (n,).

    In order of time, without gaps.
    """

    names: tuple[str, ...]
    times: NDArray[np.float64]
    column: NDArray[np.int64]
    values: NDArray[np.float64]
    begin: float
    """First of the table's times, even if it has gaps only."""


def measured(table: Mapping[str, ArrayLike]) -> Measured:
    """Measured series from columns: times `t` and one or more of x_r, x_c, x_m, v_r, v_c, v_m.

    A value that is nan, masked or pandas' NA is a gap. Raises InvalidInput for columns that are
    missing, unknown, repeated, of other length, empty, infinite, above 1e50 or constant, and for
    times that are missing or not ascending.
    """
    check_names(table)
    names = [name for name in OF_STATE if name in table]
    columns = {name: evaluation.real(name, table[name], "real numbers") for name in ("t", *names)}
    if columns["t"].ndim != 1:
        raise InvalidInput("t", columns["t"].shape, "a column of times")
    for name, values in columns.items():
        if values.shape != columns["t"].shape:
            raise InvalidInput(name, values.shape, f"{len(columns['t'])} values, one for each time")
    check_values(columns, range(1, len(columns["t"]) + 1))
    for name in names:
        there = columns[name][np.isfinite(columns[name])]
        size, varies = (np.abs(there).max(), np.ptp(there)) if len(there) else (0.0, 0.0)
        if not varies:
            raise InvalidInput(name, "constant" if len(there) else "empty", "a column that varies")
        if size > _LARGEST or varies < 1 / _LARGEST:
            told = f"at most {_LARGEST:g} in size, and of values that differ by {1 / _LARGEST:g}"
            raise InvalidInput(name, float(size), told)
    values = np.stack([columns[name] for name in names], axis=1)
    row, column = np.nonzero(np.isfinite(values))
    times = columns["t"]
    return Measured(tuple(names), times[row], column, values[row, column], float(times[0]))


def about_trend(times: Vector, values: Vector) -> Vector:
    """Values without their linear trend in time."""
    return values - np.polynomial.Polynomial.fit(times, values, 1)(times)


def check_names(names: Iterable[str]) -> None:
    """Raises InvalidInput for columns that are unknown, repeated, or missing."""
    every = list(names)
    for name in every:
        if name != "t" and name not in OF_STATE:
            raise InvalidInput("column", name, ALLOWED)
        if every.count(name) > 1:
            raise InvalidInput("column", name, "there once")
    if "t" not in every or len(every) < 2:
        raise InvalidInput("columns", ", ".join(every) or "none", ALLOWED)


def check_values(columns: Mapping[str, NDArray[np.float64]], rows: Sequence[int]) -> None:
    """Raises InvalidInput for an infinite value, and a time that is nan or not above the last one.

    It has the number of the row, one of `rows`.
    """
    for name, values in columns.items():
        wrong = np.isinf(values) if name != "t" else ~np.isfinite(values)
        if wrong.any():
            at = int(np.argmax(wrong))
            allowed = "a finite number" if name == "t" else "finite, or nan for a gap"
            raise InvalidInput(f"{name} in row {rows[at]}", float(values[at]), allowed)
    times = columns["t"]
    if (falls := np.diff(times) <= 0).any():
        at = int(np.argmax(falls)) + 1
        allowed = f"after {float(times[at - 1])!r}"
        raise InvalidInput(f"t in row {rows[at]}", float(times[at]), allowed)


_SEPARATORS = "\t;|,"
_COMMENTS = "#", "%", "//", "sep="  # the last one is for spreadsheets alone
_HEAD = re.compile(
    rf"(t|time|{'|'.join(OF_STATE)})(?:[\s_\[(/]+(?:in\s)?([^\])]*)[\])]?)?", re.IGNORECASE
)
_TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "μs": 1e-6, "min": 60.0}
_LENGTHS = {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "μm": 1e-6, "nm": 1e-9}
_SPEEDS = {f"{x}/{t}": a / b for x, a in _LENGTHS.items() for t, b in _TIMES.items()}
_GAPS = ("", "nan", "na", "n/a", "<na>", "null", "none", "-", "--", "#n/a")


class Measurements(dict[str, NDArray[np.float64]]):
    """Columns (n,) by name, nan for a gap; in SI units where the file names a multiple of them."""

    units: Mapping[str, str]
    """Units that the file names, by column."""

    @property
    def message(self) -> str:
        """Number of rows, and the columns with their units, as a sentence."""
        named = [f"{name} in {self.units[name]}" if self.units[name] else name for name in self]
        count = len(next(iter(self.values()), ()))
        return f"{count:,} row{'s' * (count != 1)}: {', '.join(named)}"


def read_measured(path: str | PathLike[str]) -> Measurements:
    r"""Columns (n,) of a text file by name, nan for a gap, and a `message` on them.

    Separator, decimal comma, encoding and comments are detected. The columns are `t`, or `time`,
    and one or more of x_r, v_r, v_c, x_c, x_m, v_m, in any order. Thousands separators are not
    read.

    A header may name units, as in "x_m [mm]". Multiples of s, m and m/s become SI units; others are
    kept.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    Measurements
        Mapping of names to arrays of shape (n,), in SI units where the file names a multiple of
        them. `units` has the units that the file names, `message` the number of rows and the
        columns.

    Raises
    ------
    InvalidInput
        For a file that cannot be read, and for a column that is missing, unknown or repeated. For a
        value that is not allowed, with its row in the file. Also for a unit of another quantity,
        and for a file with both decimal commas and decimal points.

    See Also
    --------
    fit : fit to these columns.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import capsule_sym as cs
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "run.csv")
    ...     _ = file.write_text("t [s];x_m [mm]\n0;0\n0,5;\n1;2,5\n")
    ...     data = cs.inputs.read_measured(file)
    >>> print(data.message)
    3 rows: t in s, x_m in mm
    >>> print(data["x_m"])  # in metres
    [0.        nan 0.0025]
    """
    (first, head), *body = _rows(Path(path))
    head = head[: max((k for k, cell in enumerate(head, 1) if cell), default=0)]
    matches = [_HEAD.fullmatch(normalize("NFKC", cell)) for cell in head]
    if not any(matches):
        raise InvalidInput(f"header in row {first}", ",".join(head), ALLOWED)
    names = [m[1].lower() if m else cell for m, cell in zip(matches, head, strict=True)]
    names = ["t" if name == "time" else name for name in names]
    check_names(names)
    for k, row in body:
        if len(row) < len(head) or any(row[len(head) :]):
            raise InvalidInput(f"row {k}", " ".join(row), f"{len(head)} values, as in the header")
    cells = "".join(cell for _, row in body for cell in row)
    mark = "," if cells.count(",") > cells.count(".") else "."
    found, units = Measurements(), dict[str, str]()
    for place, (name, match) in enumerate(zip(names, matches, strict=True)):
        unit = ((match[2] if match else "") or "").strip()
        known = _TIMES if name == "t" else _LENGTHS if name[0] == "x" else _SPEEDS
        plain = unit.replace(" ", "")
        if plain in _TIMES | _LENGTHS | _SPEEDS and plain not in known:
            raise InvalidInput(f"unit of {name}", unit, f"one of {', '.join(known)}")
        values = [_value(f"{name} in row {k}", row[place], mark) for k, row in body]
        found[name], units[name] = np.array(values) * known.get(plain, 1.0), unit
    check_values(found, [k for k, _ in body])
    found.units = units
    return found


def _rows(file: Path) -> list[tuple[int, list[str]]]:
    """Cells of the header and of each row of numbers below it, with their row in the file."""
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InvalidInput("file", str(file), f"readable ({error.strerror})") from error
    try:
        text = data.decode("utf-16" if b"\0" in data else "utf-8")
    except UnicodeDecodeError:
        text = data.decode("cp1252", "replace")
    text = text.lstrip("\ufeff")
    every = [(k, line.strip(" ")) for k, line in enumerate(text.splitlines(), 1) if line.strip()]
    lines = [(k, line) for k, line in every if not line.startswith(_COMMENTS)]
    if lines and re.match(r"[-+.\d]", lines[0][1]):
        # The header may be the last comment above the numbers, as NumPy writes it.
        above = [(k, line.lstrip("#%/ ")) for k, line in every if k < lines[0][0]]
        lines = above[-1:] + lines
    if not lines:
        raise InvalidInput("columns", "none", ALLOWED)
    head = re.sub(r"\s+(?=[\[(])", "", lines[0][1])
    bare = re.sub(r"\[.*?\]|\(.*?\)", "", head)
    separator = next((one for one in _SEPARATORS if one in bare), " ")
    lines[0] = lines[0][0], head
    split = [csv.reader([line], delimiter=separator, skipinitialspace=True) for _, line in lines]
    try:
        cells = [[cell.strip() for cell in next(row)] for row in split]
    except csv.Error as error:  # a cell of more than 131,072 characters
        raise InvalidInput("file", str(file), f"a table of numbers ({error})") from error
    return [(k, row) for (k, _), row in zip(lines, cells, strict=True)]


_MARKS = {",": "comma", ".": "point"}


def _value(field: str, cell: str, mark: str) -> float:
    """Number in a cell with the file's decimal mark, nan for a gap; raises InvalidInput."""
    if cell.lower() in _GAPS:
        return math.nan
    if any(other in cell for other in _MARKS if other != mark):
        named = f"a number with the decimal mark of the others, a {_MARKS[mark]}"
        raise InvalidInput(field, cell, named)
    try:
        if "_" in cell:  # which Python allows
            raise ValueError
        return float(cell.replace(",", "."))
    except ValueError:
        raise InvalidInput(field, cell, "a number") from None
