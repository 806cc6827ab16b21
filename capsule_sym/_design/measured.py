"""Measured time series for a fit."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
    names = tuple(name for name in OF_STATE if name in table)
    if "t" not in table or not names:
        raise InvalidInput("columns", ", ".join(table) or "none", ALLOWED)
    columns = {
        name: evaluation.real(name, values, "real numbers") for name, values in table.items()
    }
    times = columns.pop("t")
    if times.ndim != 1:
        raise InvalidInput("t", times.shape, "a column of times")
    for name, values in columns.items():
        if values.shape != times.shape:
            raise InvalidInput(name, values.shape, f"{len(times)} values, one for each time")
    check_values({"t": times, **columns}, range(1, len(times) + 1))
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
            raise InvalidInput("column", name, ALLOWED)
        if name in seen:
            raise InvalidInput("column", name, "there once")
        seen.add(name)


def check_values(columns: Mapping[str, NDArray[np.float64]], rows: Sequence[int]) -> None:
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
