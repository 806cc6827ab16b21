"""Measured time series for a fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

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
    missing, unknown, repeated, of other length, infinite or constant, and for times that are
    missing or not ascending.
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
    """Raises InvalidInput for the first invalid value of a column, with the number of its row."""
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
