"""Measured time series from files: their encoding, separator, decimal mark, header and units."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from unicodedata import normalize

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.measured import ALLOWED, OF_STATE, check_names, check_values
from capsule_sym._errors import InvalidInput
from capsule_sym._map import evaluation
from capsule_sym._map.labelled import package

_SEPARATORS = "\t;|,"
# A line "sep=;" is for spreadsheets alone.
_COMMENT = re.compile(r"\s*(#|%|//|!|--|sep=.\s*$)")
_HEAD = re.compile(
    rf"(t|time|{'|'.join(OF_STATE)})(?:[\s_]*(?:in\s|[\[(/,:]|(?=[\s_]))[\s_]*([^\])]*?)[\])]?)?",
    re.IGNORECASE,
)
_TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "μs": 1e-6, "min": 60.0}
_LENGTHS = {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "μm": 1e-6, "nm": 1e-9}
_SPEEDS = {f"{x}/{t}": a / b for x, a in _LENGTHS.items() for t, b in _TIMES.items()}
_GAPS = ("", "nan", "na", "n/a", "<na>", "null", "none", "-", "--", "#n/a")
_GROUPS = re.compile(r"[+-]?[1-9]\d{0,2}([.,' \xa0\u2009\u202f]\d{3})+")
_WORD = re.compile(r"[^\d=:;]{1,8}")
"""A cell in a row of units: short, and not a number."""


class Measurements(dict[str, NDArray[np.float64]]):
    """Columns (n,) by name, nan for a gap; in SI units where the file names a multiple of them."""

    units: Mapping[str, str]
    """Units that the file names, by column."""

    @property
    def message(self) -> str:
        """Number of rows, and the columns with their units, as a sentence."""
        named = [f"{name} in {self.units[name]}" if self.units[name] else name for name in self]
        count = len(next(iter(self.values()), ()))
        return f"read {count:,} row{'s' * (count != 1)}: {', '.join(named)}"


def read_measured(path: str | PathLike[str]) -> Measurements:
    r"""Columns (n,) of a text or Parquet file by name, nan for a gap, and a `message` on them.

    Separator, decimal comma, thousands separators, encoding and comments are detected. The columns
    are `t`, or `time`, and one or more of x_r, v_r, v_c, x_c, x_m, v_m, in any order.

    A header may name units, as in "x_m [mm]", or a row below it. Multiples of s, m and m/s become
    SI units; others are kept. In a Parquet file they stand in the names of the columns.

    Parameters
    ----------
    path : str or path
        The file; one that ends with .parquet is read as Parquet.

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
        and for a comma that may separate decimals or thousands.
    NotInstalled
        For Parquet without pyarrow.

    See Also
    --------
    fit : fit to these columns.
    read_rig : several files, with the unknowns of a rig.

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
    read 3 rows: t in s, x_m in mm
    >>> print(data["x_m"])  # in metres
    [0.        nan 0.0025]
    """
    file = Path(path)
    heads, columns, rows = _parquet(file) if file.suffix == ".parquet" else _text(file)
    matches = [_HEAD.fullmatch(normalize("NFKC", head)) for head, _ in heads]
    names = [m[1].lower() if m else head for m, (head, _) in zip(matches, heads, strict=True)]
    names = ["t" if name == "time" else name for name in names]
    check_names(names)
    found, units = Measurements(), dict[str, str]()
    for name, match, (_, below), values in zip(names, matches, heads, columns, strict=True):
        unit = ((match[2] if match else "") or below).strip("[]() \t")
        known = _TIMES if name == "t" else _LENGTHS if name[0] == "x" else _SPEEDS
        plain = normalize("NFKC", unit).replace(" ", "")
        if plain in _TIMES | _LENGTHS | _SPEEDS and plain not in known:
            raise InvalidInput(f"unit of {name}", unit, f"one of {', '.join(known)}")
        found[name], units[name] = values * known.get(plain, 1.0), unit
    check_values(found, rows)
    found.units = units
    return found


_Table = tuple[list[tuple[str, str]], Sequence[NDArray[np.float64]], Sequence[int]]
"""Header and unit of each column, its values, and the row of each value in the file."""


def _parquet(file: Path) -> _Table:
    """Table of a Parquet file."""
    parquet = package("pyarrow.parquet")
    try:
        table = parquet.ParquetFile(file).read()
    except (OSError, ValueError) as error:
        raise InvalidInput("file", str(file), f"a Parquet file ({error})") from error
    names = [name.strip() for name in table.column_names]
    pairs = zip(names, table.columns, strict=True)
    columns = [evaluation.real(name, one.to_numpy(), "real numbers") for name, one in pairs]
    return [(name, "") for name in names], columns, range(1, table.num_rows + 1)


def _text(file: Path) -> _Table:
    """Table of a text file."""
    (first, head), *body = _rows(file)
    while head and not head[-1]:
        head.pop()
    if not any(_HEAD.fullmatch(normalize("NFKC", cell)) for cell in head):
        raise InvalidInput(f"header in row {first}", ",".join(head), ALLOWED)
    for k, row in body:
        while len(row) > len(head) and not row[-1]:
            row.pop()
        if len(row) != len(head):
            told = f"{len(head)} values, as in the header"
            raise InvalidInput(f"row {k}", " ".join(row), told)
    units = [""] * len(head)
    words = [cell for cell in body[0][1] if cell] if body else []
    if words and all(_WORD.fullmatch(one) and one.lower() not in _GAPS for one in words):
        units, body = body[0][1], body[1:]
    cells = [[(f"{name} in row {k}", row[i]) for k, row in body] for i, name in enumerate(head)]
    mark = _decimal([one for column in cells for one in column])
    columns = [np.array([_value(*one, mark) for one in column]) for column in cells]
    return list(zip(head, units, strict=True)), columns, [k for k, _ in body]


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
    every = [(k, line) for k, line in enumerate(re.split(r"\r\n|\r|\n", text), 1) if line.strip()]
    lines = [(k, line.strip(" ")) for k, line in every if not _COMMENT.match(line)]
    if lines and not re.search(r"[^\W\d_]", re.sub(r"(?i)e|nan|na|inf", "", lines[0][1])):
        # The header may be the last comment above the numbers, as NumPy writes it.
        above = [(k, _COMMENT.sub("", line).strip()) for k, line in every if k < lines[0][0]]
        lines = above[-1:] + lines
    if not lines:
        raise InvalidInput("columns", "none", ALLOWED)
    first, head = lines[0]
    bare = re.sub(r"\[.*?\]|\(.*?\)", "", head)
    separator = next((one for one in _SEPARATORS if one in bare), " ")
    lines[0] = first, re.sub(r"\s+(?=[\[(])", "", head)
    split = [csv.reader([line], delimiter=separator, skipinitialspace=True) for _, line in lines]
    cells = [[cell.strip() for cell in next(row)] for row in split]
    return [(k, row) for (k, _), row in zip(lines, cells, strict=True)]


def _decimal(cells: Sequence[tuple[str, str]]) -> str:
    """Decimal mark of named cells; raises InvalidInput if a comma may be either mark."""
    commas = [(field, cell) for field, cell in cells if "," in cell]
    for _, cell in commas:
        if "." in cell or cell.count(",") > 1:
            return "," if cell.rfind(",") > cell.rfind(".") >= 0 else "."
    if commas and all(_GROUPS.fullmatch(cell) for _, cell in commas):
        raise InvalidInput(*commas[0], "clear: a decimal comma, or thousands?")
    return "," if commas else "."


def _value(field: str, cell: str, mark: str) -> float:
    """Number in a cell with this decimal mark, nan for a gap; raises InvalidInput."""
    if cell.lower() in _GAPS:
        return math.nan
    whole, _, fraction = cell.replace("\N{MINUS SIGN}", "-").partition(mark)
    if _GROUPS.fullmatch(whole):
        whole = re.sub(r"[^\d+-]", "", whole)
    try:
        if "_" in cell:  # which Python allows
            raise ValueError
        return float(re.sub("[dD]", "e", f"{whole}.{fraction}" if fraction else whole))
    except ValueError:
        raise InvalidInput(field, cell, "a number") from None
