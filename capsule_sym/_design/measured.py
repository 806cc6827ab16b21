"""Measured time series for a fit, from arrays or from a file."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map import evaluation
from capsule_sym._map.labelled import package

OF_STATE = {
    "x_r": (1.0, 0.0, 0.0, 0.0),
    "v_r": (0.0, 1.0, 0.0, 0.0),
    "v_c": (0.0, 0.0, 1.0, 0.0),
    "x_c": (0.0, 0.0, 0.0, 1.0),
    "x_m": (1.0, 0.0, 0.0, 1.0),
    "v_m": (0.0, 1.0, 1.0, 0.0),
}
"""Measurable quantities, as combinations of (x_r, v_r, v_c, x_c)."""
_ALLOWED = f"t and one or more of {', '.join(OF_STATE)}"


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
    missing, unknown, repeated, of other length, infinite or constant, and for times that are
    missing or not ascending.
    """
    check_names(table)
    names = tuple(name for name in OF_STATE if name in table)
    if "t" not in table or not names:
        raise InvalidInput("columns", ", ".join(table) or "none", _ALLOWED)
    columns = {
        name: evaluation.real(name, values, "real numbers") for name, values in table.items()
    }
    times = columns.pop("t")
    if times.ndim != 1:
        raise InvalidInput("t", times.shape, "a column of times")
    for name, values in columns.items():
        if values.shape != times.shape:
            raise InvalidInput(name, values.shape, f"{len(times)} values, one for each time")
    _check_values({"t": times, **columns}, range(1, len(times) + 1))
    parts = []
    for k, name in enumerate(names):
        values = columns[name]
        there = np.isfinite(values)
        if np.ptp(values[there]) == 0.0 if there.any() else True:
            raise InvalidInput(name, "constant" if there.any() else "empty", "a column that varies")
        parts.append((times[there], np.full(there.sum(), k), values[there]))
    t, column, values = (np.concatenate(one) for one in zip(*parts, strict=True))
    order = np.argsort(t, kind="stable")
    return Measured(names, t[order], column[order], values[order], float(times[0]))


def check_names(names: Iterable[object]) -> None:
    """Raises InvalidInput for a column that is unknown or repeated."""
    seen = set[object]()
    for name in names:
        if name != "t" and name not in OF_STATE:
            raise InvalidInput("column", name, _ALLOWED)
        if name in seen:
            raise InvalidInput("column", name, "there once")
        seen.add(name)


def _check_values(columns: Mapping[str, NDArray[np.float64]], rows: Sequence[int]) -> None:
    """Raises InvalidInput for the first invalid value of a column, with the number of its row."""
    bad = {name: (np.isinf(values), "finite, or nan for a gap") for name, values in columns.items()}
    if (times := columns.get("t")) is not None:
        bad["t"] = ~np.isfinite(times), "a finite number"
    for name, (wrong, allowed) in bad.items():
        if wrong.any():
            at = int(np.argmax(wrong))
            raise InvalidInput(f"{name} in row {rows[at]}", float(columns[name][at]), allowed)
    if times is not None and (falls := np.diff(times) <= 0).any():
        at = int(np.argmax(falls)) + 1
        allowed = f"after {float(times[at - 1])!r}"
        raise InvalidInput(f"t in row {rows[at]}", float(times[at]), allowed)


def read_measured(path: str | PathLike[str]) -> dict[str, NDArray[np.float64]]:
    """Columns (n,) of a CSV or Parquet file by name, in its own units, nan for a gap.

    Raises InvalidInput for a file that cannot be read or has no header, for a column that is
    unknown or repeated, and for a value that is not allowed, with its line in the file. Raises
    NotInstalled for Parquet without pyarrow.
    """
    file = Path(path)
    if file.suffix == ".parquet":
        parquet = package("pyarrow.parquet")
        try:
            table = parquet.ParquetFile(file).read()
        except (OSError, ValueError) as error:
            raise InvalidInput("file", str(path), f"a Parquet file ({error})") from error
        names = [name.strip() for name in table.column_names]
        check_names(names)
        return {
            name: evaluation.real(name, column.to_numpy(), "real numbers")
            for name, column in zip(names, table.columns, strict=True)
        }
    try:
        with file.open(encoding="utf-8-sig", newline="") as opened:
            reader = csv.reader(opened)
            lines = [(reader.line_num, row) for row in reader if row]
    except OSError as error:
        raise InvalidInput("file", str(path), f"readable ({error.strerror})") from error
    except (ValueError, csv.Error) as error:
        raise InvalidInput("file", str(path), f"a CSV file ({error})") from error
    names = [name.strip() for name in lines[0][1]] if lines else []
    check_names(names)
    columns = np.full((len(names), len(lines[1:])), np.nan)
    for i, (number, row) in enumerate(lines[1:]):
        if len(row) != len(names):
            told = f"{len(names)} values, as in the header"
            raise InvalidInput(f"row {number}", ",".join(row), told)
        for k, text in enumerate(row):
            try:
                columns[k, i] = float(text) if text.strip() else np.nan
            except ValueError:
                raise InvalidInput(f"{names[k]} in row {number}", text, "a number") from None
    found = dict(zip(names, columns, strict=True))
    _check_values(found, [number for number, _ in lines[1:]])
    return found
