"""Measured time series from files: their encoding, separator, decimal mark, header and units."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from unicodedata import normalize

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.measured import ALLOWED, OF_STATE, check_names, check_values
from capsule_sym._errors import InvalidInput
from capsule_sym._map import evaluation
from capsule_sym._map.labelled import package

_ENCODINGS = {b"\xff\xfe\0\0": "utf-32", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
_SEPARATORS = "\t;|,"
_COMMENT = re.compile(r"\s*(#|%|//|!|--)")
_HEAD = re.compile(
    rf"(t|time|{'|'.join(OF_STATE)})(?:[\s_]*(?:in\s|[\[(/,:]|(?=[\s_]))[\s_]*([^\])]*?)[\])]?)?",
    re.IGNORECASE,
)
_TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "μs": 1e-6, "min": 60.0}
_LENGTHS = {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "μm": 1e-6, "nm": 1e-9}
_SPEEDS = {f"{x}/{t}": a / b for x, a in _LENGTHS.items() for t, b in _TIMES.items()}
_GAPS = ("", "nan", "na", "n/a", "<na>", "null", "none", "-", "--", "#n/a")
_SPACES = str.maketrans({" ": "", "\xa0": "", "\u2009": "", "\u202f": "", "'": "", "−": "-"})
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?|[+-]?inf(inity)?", re.IGNORECASE)
_GROUPS = re.compile(r"[+-]?\d{1,3}([.,' \xa0\u2009\u202f]\d{3})+")


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
    ...     data = cs.read_measured(file)
    >>> print(data.message)
    read 3 rows: t in s, x_m in mm
    >>> print(data["x_m"])  # in metres
    [0.        nan 0.0025]
    """
    file = Path(path)
    heads, columns, rows = _parquet(file) if file.suffix == ".parquet" else _text(file)
    matches = {head: _HEAD.fullmatch(normalize("NFKC", head.strip())) for head, _ in heads}
    names = [(m[1].lower() if (m := matches[head]) else head.strip()) for head, _ in heads]
    names = ["t" if name == "time" else name for name in names]
    check_names(names)
    if "t" not in names or len(names) < 2:
        raise InvalidInput("columns", ", ".join(names) or "none", ALLOWED)
    found, units = Measurements(), dict[str, str]()
    for name, (head, below), values in zip(names, heads, columns, strict=True):
        match = matches[head]
        unit = ((match[2] if match else "") or below or "").strip("[]() \t")
        known = _TIMES if name == "t" else _LENGTHS if name[0] == "x" else _SPEEDS
        every = _TIMES | _LENGTHS | _SPEEDS
        plain = normalize("NFKC", unit).replace(" ", "").replace("µ", "μ")
        if plain in every and plain not in known:
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
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InvalidInput("file", str(file), f"readable ({error.strerror})") from error
    code = next((code for mark, code in _ENCODINGS.items() if data.startswith(mark)), "")
    if not code and b"\0" in data[:2]:
        code = "utf-16-be" if data[:1] == b"\0" else "utf-16-le"
    try:
        text = data.decode(code or "utf-8")
    except UnicodeDecodeError:
        text = data.decode("cp1252", "replace")
    text = text.lstrip("\ufeff")
    lines = [(k, line) for k, line in enumerate(re.split(r"\r\n|\r|\n", text), 1) if line.strip()]
    given = ""
    if lines and (hint := re.fullmatch(r"\s*sep=(.)\s*", lines[0][1])):
        given, lines = hint[1], lines[1:]
    notes = [(k, line) for k, line in lines if _COMMENT.match(line)]
    lines = [(k, line) for k, line in lines if not _COMMENT.match(line)]
    if lines and not re.search(r"[^\W\d_]", re.sub(r"(?i)e|nan|na|inf", "", lines[0][1])):
        # The header may be the last comment above the numbers, as NumPy writes it.
        above = [(k, _COMMENT.sub("", line)) for k, line in notes if k < lines[0][0]]
        lines = above[-1:] + lines
    if not lines:
        raise InvalidInput("columns", "none", ALLOWED)
    separator = given or _separator(lines[0][1])
    rows = list(_split(lines, separator))
    (_, head), *body = rows
    while head and not head[-1]:
        head.pop()
    if not any(_HEAD.fullmatch(normalize("NFKC", cell)) for cell in head):
        raise InvalidInput(f"header in row {lines[0][0]}", ",".join(head), ALLOWED)
    below = [""] * len(head)
    if body and all(not cell or not _is_number(cell) for cell in body[0][1]) and any(body[0][1]):
        units = [cell.strip("[]() ") for cell in body[0][1]]
        if all(_is_unit(one) for one in units[: len(head)]) and len(units) >= len(head):
            below, body = units[: len(head)], body[1:]
    for k, row in body:
        while len(row) > len(head) and not row[-1]:
            row.pop()
        if len(row) != len(head):
            told = f"{len(head)} values, as in the header"
            raise InvalidInput(f"row {k}", separator.join(row), told)
    mark = _decimal([(k, head[i], cell) for k, row in body for i, cell in enumerate(row)])
    columns = np.full((len(head), len(body)), np.nan)
    for j, (k, row) in enumerate(body):
        for i, cell in enumerate(row):
            if cell.lower() not in _GAPS:
                columns[i, j] = _value(f"{head[i]} in row {k}", cell, mark)
    return list(zip(head, below, strict=True)), list(columns), [k for k, _ in body]


def _separator(head: str) -> str:
    """Separator of the columns of a header; a blank stands for any blanks."""
    bare = re.sub(r"\[.*?\]|\(.*?\)", "", head)
    return next((one for one in _SEPARATORS if one in bare), " ")


def _split(lines: Sequence[tuple[int, str]], separator: str) -> Iterator[tuple[int, list[str]]]:
    """Cells of each line, with its row."""
    for k, line in lines:
        if separator == " ":
            line = re.sub(r"\s+(?=[\[(])", "", line.strip()) if k == lines[0][0] else line.strip()
            yield k, [cell.strip("\"'") for cell in line.split()]
        else:
            cells = next(csv.reader([line], delimiter=separator, skipinitialspace=True))
            yield k, [cell.strip() for cell in cells]


def _is_number(cell: str) -> bool:
    """True for a number with any marks, or a gap."""
    bare = cell.translate(_SPACES)
    return cell.lower() in _GAPS or bool(_NUMBER.fullmatch(re.sub("[.,]", "", bare)))


def _is_unit(text: str) -> bool:
    """True for what may stand in a row of units."""
    return len(text) <= 8 and not re.search(r"[=:;]", text)


def _decimal(cells: Sequence[tuple[int, str, str]]) -> str:
    """Decimal mark of the cells; raises InvalidInput if a comma may be either mark."""
    doubtful, commas = None, False
    for k, name, cell in cells:
        if "," not in cell:
            continue
        if "." in cell:
            return "," if cell.rindex(",") > cell.rindex(".") else "."
        if cell.count(",") > 1:
            return "."
        if _GROUPS.fullmatch(cell) and not re.match(r"[+-]?0", cell):
            doubtful = doubtful or (k, name, cell)
        else:
            commas = True
    if doubtful and not commas:
        k, name, cell = doubtful
        raise InvalidInput(f"{name} in row {k}", cell, "clear: a decimal comma, or thousands?")
    return "," if commas else "."


def _value(field: str, cell: str, mark: str) -> float:
    """Number in a cell with this decimal mark; raises InvalidInput."""
    whole, _, fraction = cell.partition(mark)
    if _GROUPS.fullmatch(whole):
        whole = re.sub(r"[.,]", "", whole)
    bare = (whole + "." * bool(fraction) + fraction).translate(_SPACES)
    if not _NUMBER.fullmatch(bare) or (
        " " in cell and not _GROUPS.fullmatch(cell.partition(mark)[0])
    ):
        raise InvalidInput(field, cell, "a number")
    return float(re.sub("[dD]", "e", bare))
