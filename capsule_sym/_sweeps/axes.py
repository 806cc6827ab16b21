"""Axes of a sweep: values of parameters and of the start."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import InvalidInput, check_one_of, counted
from capsule_sym._map.checks import check_count, is_real, real
from capsule_sym._map.result import brief
from capsule_sym._parameters import CAPSULE, Scene, SceneDevice
from capsule_sym._processes import sobol
from capsule_sym._sweeps.quantities import TAKEN

START = (*CAPSULE.facts.STATE, "phase")

_MOST_VALUES = 10**8  # of one axis, which is held in memory
_LONGEST_NAME = 100


@checked
@dataclass(frozen=True, eq=False)
class Axis:
    """One dimension of a sweep: values, shape (n, k), of k quantities that change together.

    The quantities are parameters, or `x_r`, `v_r`, `v_c` and `phase` of the start, all
    dimensionless. `device` has the SI values of an axis of a device. Raises InvalidInput for a name
    that no axis can have, and for values that are no numbers or of another shape; a `Sweep` checks
    that its scene has the quantities and allows the values.
    """

    name: str
    quantities: tuple[str, ...]
    values: NDArray[np.float64]
    device: tuple[NDArray[np.float64], str] | None = None
    """SI values, shape (n,), and unit of an axis of a device."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "quantities", tuple(self.quantities))
        check_name(self.name)
        values = _doubles(self.name, self.values)
        if not values.size:
            raise InvalidInput(self.name, [], "one value or more")
        if values.ndim != 2 or values.shape[1] != len(self.quantities):
            raise InvalidInput(self.name, values.shape, f"of shape (n, {len(self.quantities)})")
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    def check(self, scene: Scene) -> None:
        """Raise InvalidInput unless a scene has the quantities and allows the values.

        Also raised if the axis has the name of a quantity, and not that quantity alone.
        """
        known = named(scene)
        for quantity, column in zip(self.quantities, self.values.T, strict=True):
            check_one_of("axis", quantity, known, scene.told)
            least = 0.0 if quantity == "phase" else -1e20
            low, high = scene.facts.RANGES.get(quantity, (least, 1e20))
            bad = ~((column >= low) & (column <= high))  # nan fails the comparisons
            if bad.any():
                allowed = f"a number in [{low:.10g}, {high:.10g}] for a run"
                worst = column[bad][abs(column[bad]).argmax()]
                raise InvalidInput(quantity, float(worst), allowed)
        if self.name in known and self.quantities != (self.name,):
            raise InvalidInput("axis", self.name, f"a name that is not one of {', '.join(known)}")

    def part(self, where: slice) -> Axis:
        """Axis of a slice of the values."""
        device = self.device and (self.device[0][where], self.device[1])
        return replace(self, values=self.values[where], device=device)

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        (first, *_), (last, *_), unit = self._ends()
        ends = f"{first:.6g} to {last:.6g} {unit}".rstrip()
        return brief(self, f"{counted(len(self), 'value')}, {ends}", self.name)

    def _ends(self) -> tuple[list[float], list[float], str]:
        """First and last row of the values, and their unit: in SI units for an axis of a device."""
        values, unit = self.device or (self.values, "")
        return values[0].reshape(-1).tolist(), values[-1].reshape(-1).tolist(), unit

    @classmethod
    @checked
    def of(cls, name: str, values: ArrayLike) -> Self:
        """Axis of one quantity with given values, shape (n,), dimensionless.

        Raises InvalidInput for values that are no numbers, and for a name that no axis can have. A
        `Sweep` checks the ranges.
        """
        column = np.atleast_1d(_doubles(name, values))
        if column.ndim != 1:
            raise InvalidInput(name, column.shape, "of shape (n,)")
        return cls(name, (name,), column[:, None])

    @classmethod
    @checked
    def of_device(cls, device: SceneDevice, name: str, values: ArrayLike) -> Self:
        """Axis of a quantity of a device, such as P_d, with values (n,) in SI units.

        The runs use the dimensionless parameter proportional to it; results have both. Raises
        InvalidInput for another name, or for values that are no numbers. A `Sweep` checks the
        ranges.
        """
        tied, factor = device.tie(name)
        column = cls.of(name, values).values
        unit = device.scene.facts.DRIVEN[name][1]
        return cls(name, (tied,), column * factor, (column[:, 0], unit))

    @classmethod
    @checked
    def linear(cls, name: str, low: float, high: float, count: int) -> Self:
        """`count` evenly spaced values of one quantity, including both ends.

        A count is 1 to 10^8; a single value is `low`. Raises InvalidInput for ends or a count that
        are not allowed.
        """
        return cls.of(name, _spaced(np.linspace, name, low, high, count))

    @classmethod
    @checked
    def log(cls, name: str, low: float, high: float, count: int) -> Self:
        """`count` values of one quantity in geometric progression, including both ends (above 0).

        A count is 1 to 10^8; a single value is `low`. Raises InvalidInput for ends or a count that
        are not allowed.
        """
        if not (low > 0 and high > 0):
            raise InvalidInput(name, (low, high), "> 0 for a logarithmic axis")
        values = _spaced(np.geomspace, name, low, high, count)
        return cls.of(name, values.clip(min(low, high), max(low, high)))

    @classmethod
    @checked
    def sobol(cls, ranges: Mapping[str, Sequence[float]], count: int, seed: int) -> Self:
        """`count` points of a scrambled Sobol sequence in a box, one range for each quantity.

        The axis has the name "sample". The sequence is balanced if `count` is a power of two. A
        count is 1 to 10^8 over the number of ranges, a seed 0 to 10^12. Raises InvalidInput for
        another one, and for ranges that are not ascending. A `Sweep` checks quantities and values.
        """
        if not ranges:
            raise InvalidInput("sobol", ranges, "a table of ranges [low, high] by name")
        for name, ends in ranges.items():
            cls.of(name, ends)
            if len(ends) != 2 or not ends[0] < ends[1]:
                raise InvalidInput(name, ends, "a range [low, high] with low < high")
        check_count("count", count, most=_MOST_VALUES // len(ranges))
        check_count("seed", seed, 0)
        low, high = np.array([*ranges.values()], dtype=float).T
        with np.errstate(over="ignore"):
            values = low + (high - low) * sobol(len(ranges), count, seed)
        return cls("sample", tuple(ranges), values)

    def record(self) -> dict[str, Any]:
        """Identity of the axis in plain values, with a checksum of its dimensionless values."""
        first, last, unit = self._ends()
        return {
            "name": self.name,
            "quantities": list(self.quantities),
            "count": len(self),
            "first": first,
            "last": last,
            "unit": unit,
            "sha256": hashlib.sha256(np.ascontiguousarray(self.values).tobytes()).hexdigest(),
        }


def check_name(name: object) -> None:
    """Raises InvalidInput unless an axis can have this name.

    It is an identifier of at most 100 characters, and not the name of a result.
    """
    if not isinstance(name, str) or not name.isidentifier() or len(name) > _LONGEST_NAME:
        raise InvalidInput("axis", name, "a name of letters and digits")
    if name in TAKEN:
        raise InvalidInput("axis", name, "another name: this is the name of a result")


def _doubles(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Copy of values as doubles, in their shape; raises InvalidInput unless they are numbers."""
    try:
        given = np.asarray(values) if hasattr(values, "dtype") else np.array(values, dtype=object)
        real = given.dtype.kind in "iuf" or (
            given.dtype == object and all(map(is_real, given.ravel().tolist()))
        )
        with np.errstate(over="ignore"):
            if real:
                return given.astype(float)
    except (OverflowError, RecursionError, TypeError, ValueError):
        pass
    raise InvalidInput(name, values, "real numbers, as many in each row")


def named(scene: Scene) -> tuple[str, ...]:
    """Names that an axis of a scene can vary."""
    return (*scene.facts.PARAMETERS, *START)


def _spaced(space: Any, name: str, low: float, high: float, count: int) -> NDArray[np.float64]:
    """Values from `low` to `high`, spaced by a function of NumPy.

    Raises InvalidInput for ends that are not finite, and a count that is not allowed.
    """
    check_count("count", count, most=_MOST_VALUES)
    for end in (low, high):
        if not real(end):
            raise InvalidInput(name, end, "a finite number")
    with np.errstate(all="ignore"):
        return np.asarray(space(low, high, count))
