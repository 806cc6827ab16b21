"""States at any times of a run, from its records: in one pass of the core, or by NumPy."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import backend
from capsule_sym._map.segments import Records
from capsule_sym._native import core_of
from capsule_sym._parameters import Scene, SceneParameters


@cache
def _maps(scene: Scene) -> tuple[list[Any], Callable[[SceneParameters], tuple[float, ...]]]:
    """Free maps of a scene, and the function that gives the numbers from which one is made."""
    return [], attrgetter(*scene.facts.PARAMETERS)


def borrowed(parameters: SceneParameters) -> Any:
    """Map of the core at these parameters, from those kept for their scene.

    Return it with `give_back`. Until then no other thread or signal handler uses it. As many are
    kept as were ever used at the same time.
    """
    kept, numbers = _maps(parameters.scene)
    try:
        native = kept.pop()
    except IndexError:
        return core_of(parameters.scene).map(numbers(parameters))
    native.remake(*numbers(parameters))
    return native


def give_back(parameters: SceneParameters, native: Any) -> None:
    """Keep a map for its next use."""
    _maps(parameters.scene)[0].append(native)


def check(times: NDArray[np.float64], first: float, last: float) -> None:
    """Raise InvalidInput for a time that is not in [first, last]."""
    if times.size and not (first <= times.min() and times.max() <= last):
        outside = ~((times >= first) & (times <= last))
        raise InvalidInput("t", float(times[outside].flat[0]), f"a time in [{first!r}, {last!r}]")


def real(name: str, value: ArrayLike, allowed: str) -> NDArray[np.float64]:
    """Array of real numbers, nan for masked entries and pandas' NA.

    Raises InvalidInput for other values.
    """
    try:
        given = np.asarray(value)
        if given.size and given.dtype.kind not in "iufO":
            raise TypeError
        missing: Any = getattr(value, "isna", None)
        lost = missing() if missing and given.dtype.kind == "O" else np.ma.getmask(value)
        if np.any(lost):
            given = np.where(lost, np.nan, given)
        return given.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInput(name, value, allowed) from None


def by_core(
    parameters: SceneParameters, records: Records, times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """States (x_r, v_r, v_c, x_c) at times of a run, shape times.shape + (4,), by the core."""
    flat, states = np.ascontiguousarray(times).ravel(), np.empty((times.size, 4))
    native = borrowed(parameters)
    if np.all(flat[1:] >= flat[:-1]):
        native.evaluate(records, flat, states)
    else:
        order, found = np.argsort(flat, kind="stable"), np.empty_like(states)
        native.evaluate(records, flat[order], found)
        states[order] = found
    give_back(parameters, native)
    return states.reshape(*times.shape, 4)


def by_numpy(
    parameters: SceneParameters, records: Records, times: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The states of `by_core` by the kernels in doubles, time by time."""
    starts = records["start_period"] * parameters.period + records["start_angle"] / parameters.omega
    index = np.searchsorted(starts, times.ravel(), side="right") - 1
    rows = records[np.maximum(index, 0)]
    h = np.clip(times.ravel() - starts[np.maximum(index, 0)], 0.0, rows["duration"])
    out = np.empty((times.size, 4))
    with backend("numpy", parameters.scene) as numbers:
        constants = {n: numbers.constants(n, parameters) for n in set(rows["field"].tolist())}
        for i, (row, duration) in enumerate(zip(rows, h.tolist(), strict=True)):
            c, (x_r, v_r, v_c) = constants[row["field"].item()], row["start"].tolist()
            angle = (row[name].item() for name in ("margin", "cosine", "sine"))
            closed = numbers.kernels.Start(x_r, row["gap"].item(), v_r, v_c, *angle)
            change, v_r, *drift = numbers.kernels.flow(c, closed, duration, True)
            gained, advance = drift if c.drift else (-v_c, 0.0)
            out[i] = x_r + change, v_r, v_c + gained, row["position"] + advance
    return out.reshape(*times.shape, 4)
