"""A sweep as data: which cells are run, for how long, and what is computed of each."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym.errors import InvalidInput
from capsule_sym.map.simulate import RANGES, check_count, check_start
from capsule_sym.parameters import Parameters, read_toml

PARAMETERS = tuple(RANGES)
START = ("x_r", "v_r", "v_c", "phase")
QUANTITIES = ("word", "progression", "final", "multipliers", "energies", "lyapunov")
"""What can be computed of a cell. A word comes with its period multiple, energies with the
average velocity; multipliers and energies are those of the orbit that Newton closes."""

_MOST_CELLS = 10**10
_SPACINGS = ("linear", "log")
_PERIODS_PER_CHUNK = 2**21  # a second or two of the C core
_LEAST_CHUNKS = 16
_ORBIT = 20_000  # excitation periods of the C core in the time in which an orbit is closed


@dataclass(frozen=True, eq=False)
class Axis:
    """One dimension of a sweep: values, shape (n, k), of k quantities that change together.

    The quantities are parameters, or `x_r`, `v_r`, `v_c` and `phase` of the start. Raises
    InvalidInput for a name or a value that is not allowed.
    """

    name: str
    quantities: tuple[str, ...]
    values: NDArray[np.float64]

    def __post_init__(self) -> None:
        single = len(self.quantities) == 1
        if not self.name.isidentifier() or (self.name in PARAMETERS + START and not single):
            raise InvalidInput("axis", self.name, "a name of its own, of letters and digits")
        for quantity in self.quantities:
            if quantity not in (*PARAMETERS, *START):
                raise InvalidInput("axis", quantity, f"one of {', '.join(PARAMETERS + START)}")
        values = np.array(self.values, dtype=float)
        if values.ndim != 2 or values.shape[1] != len(self.quantities) or not values.size:
            raise InvalidInput(self.name, values.shape, f"of shape (n, {len(self.quantities)})")
        if not np.isfinite(values).all():
            raise InvalidInput(self.name, float(values[~np.isfinite(values)][0]), "finite")
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    def __len__(self) -> int:
        return len(self.values)

    @classmethod
    def of(cls, name: str, values: ArrayLike) -> Self:
        """The axis of one quantity with given values, shape (n,)."""
        return cls(name, (name,), np.atleast_1d(np.asarray(values, dtype=float))[:, None])

    @classmethod
    def linear(cls, name: str, low: float, high: float, count: int) -> Self:
        """`count` evenly spaced values of one quantity, both ends among them."""
        check_count("count", count)
        return cls.of(name, np.linspace(low, high, count))

    @classmethod
    def log(cls, name: str, low: float, high: float, count: int) -> Self:
        """`count` values of one quantity with even ratios, both ends among them."""
        check_count("count", count)
        if not (low > 0 and high > 0):
            raise InvalidInput(name, (low, high), "> 0 for a logarithmic axis")
        return cls.of(name, np.geomspace(low, high, count))

    @classmethod
    def sobol(cls, ranges: Mapping[str, Sequence[float]], count: int, seed: int) -> Self:
        """`count` points of a scrambled Sobol sequence in a box, one range for each quantity.

        The sequence is balanced where `count` is a power of two.
        """
        from scipy.stats import qmc

        check_count("count", count)
        if not ranges or any(not low < high for low, high in ranges.values()):
            raise InvalidInput("sobol", dict(ranges), "ranges [low, high] with low < high")
        low, high = np.array(list(ranges.values()), dtype=float).T
        design = qmc.Sobol(len(ranges), rng=np.random.default_rng(seed))
        whole = design.random_base2(max(count - 1, 0).bit_length())
        return cls("sample", tuple(ranges), low + (high - low) * whole[:count])

    def record(self) -> dict[str, Any]:
        """What identifies the axis, in plain values."""
        return {
            "name": self.name,
            "quantities": list(self.quantities),
            "count": len(self),
            "first": self.values[0].tolist(),
            "last": self.values[-1].tolist(),
            "sha256": hashlib.sha256(np.ascontiguousarray(self.values).tobytes()).hexdigest(),
        }


@dataclass(frozen=True, eq=False)
class Sweep:
    """Runs at every combination of the axes' values; what no axis changes stays as given.

    A motion is periodic if the stroboscopic states repeat within `tolerance` after `periods`
    excitation periods. Results are written in chunks of `chunk` cells along each axis, chosen so
    that a chunk takes a second or two if not given. All quantities are dimensionless. Raises
    InvalidInput for any value that is not allowed.
    """

    axes: tuple[Axis, ...]
    parameters: Parameters = field(default_factory=Parameters)
    state: tuple[float, float, float] = (0.0, 0.0, 0.0)
    phase: float = 0.0
    periods: int = 300
    tolerance: float = 1e-9
    compute: tuple[str, ...] = ("word",)
    chunk: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "axes", tuple(self.axes))
        set_(self, "state", check_start(self.parameters, self.state, 0.0, self.periods))
        for quantity in self.compute:
            if quantity not in QUANTITIES:
                raise InvalidInput("compute", quantity, f"some of {', '.join(QUANTITIES)}")
        set_(self, "compute", tuple(q for q in QUANTITIES if q in self.compute))
        if not self.axes:
            raise InvalidInput("axes", self.axes, "at least one axis")
        names = [axis.name for axis in self.axes]
        changed = [quantity for axis in self.axes for quantity in axis.quantities]
        for kind in (names, changed):
            twice = next((name for name in kind if kind.count(name) > 1), None)
            if twice:
                raise InvalidInput("axis", twice, "given once")
        if not self.compute:
            raise InvalidInput("compute", self.compute, f"some of {', '.join(QUANTITIES)}")
        if not 0.0 < self.tolerance < 1.0:
            raise InvalidInput("tolerance", self.tolerance, "in (0, 1)")
        self._check_values()
        if self.size > _MOST_CELLS:
            raise InvalidInput("cells", self.size, f"at most {_MOST_CELLS}")
        set_(self, "chunk", tuple(self.chunk) or self._chunk())
        if len(self.chunk) != len(self.axes) or not all(
            isinstance(n, int) and 1 <= n <= len(axis)
            for n, axis in zip(self.chunk, self.axes, strict=True)
        ):
            raise InvalidInput("chunk", self.chunk, f"whole numbers from 1 to {self.shape}")

    def _check_values(self) -> None:
        column = {q: a.values[:, i] for a in self.axes for i, q in enumerate(a.quantities)}
        for name, values in column.items():
            low, high = RANGES.get(name, (0.0 if name == "phase" else -1e20, 1e20))
            bad = ~((values >= low) & (values <= high))
            if bad.any():
                raise InvalidInput(name, float(values[bad][0]), f"in [{low:g}, {high:g}] for a run")
        fastest = float(np.max(column.get("omega", self.parameters.omega)))
        latest = float(np.max(column.get("phase", self.phase)))
        if not self.phase >= 0.0 or not 0.0 <= latest < 2 * math.pi / fastest:
            allowed = f"a time in [0, 2 pi/omega) = [0, {2 * math.pi / fastest:g})"
            raise InvalidInput("phase", latest if latest > 0 else self.phase, allowed)

    def _chunk(self) -> tuple[int, ...]:
        """Halves the longest side until a chunk takes a second or two."""
        orbits = {"multipliers", "energies", "lyapunov"} & set(self.compute)
        room = max(16, _PERIODS_PER_CHUNK // (self.periods + (_ORBIT if orbits else 0)))
        room = min(room, max(16, self.size // _LEAST_CHUNKS))
        sides = list(self.shape)
        while math.prod(sides) > room:
            longest = sides.index(max(sides))
            sides[longest] = -(-sides[longest] // 2)
        return tuple(sides)

    @cached_property
    def shape(self) -> tuple[int, ...]:
        """How many values each axis has."""
        return tuple(map(len, self.axes))

    @cached_property
    def size(self) -> int:
        """How many cells there are."""
        return math.prod(self.shape)

    @cached_property
    def chunks(self) -> tuple[int, ...]:
        """How many chunks there are along each axis."""
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunk, strict=True))

    def region(self, index: int) -> tuple[slice, ...]:
        """Where a chunk lies, counted along the last axis first."""
        place = np.unravel_index(index, self.chunks)
        return tuple(
            slice(int(i) * c, min((int(i) + 1) * c, n))
            for i, c, n in zip(place, self.chunk, self.shape, strict=True)
        )

    def cells_in(self, index: int) -> int:
        """How many cells a chunk has."""
        return math.prod(part.stop - part.start for part in self.region(index))

    def part(self, index: int) -> Sweep:
        """One chunk as a sweep of its own."""
        axes = tuple(
            Axis(axis.name, axis.quantities, axis.values[where])
            for axis, where in zip(self.axes, self.region(index), strict=True)
        )
        return replace(self, axes=axes, chunk=tuple(map(len, axes)))

    def columns(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Parameters (n, 7), states (n, 3) and phases (n,) of all cells, the last axis fastest."""
        fixed = [*self.parameters.to_dict().values(), *self.state, self.phase]
        table = np.tile(np.array(fixed), (*self.shape, 1))
        for number, axis in enumerate(self.axes):
            across = [1] * len(self.axes)
            across[number] = len(axis)
            for i, quantity in enumerate(axis.quantities):
                table[..., (*PARAMETERS, *START).index(quantity)] = axis.values[:, i].reshape(
                    across
                )
        flat = table.reshape(self.size, -1)
        return flat[:, :7].copy(), flat[:, 7:10].copy(), flat[:, 10].copy()

    def record(self) -> dict[str, Any]:
        """The sweep in plain values: two sweeps with one record give the same results."""
        return {
            "axes": [axis.record() for axis in self.axes],
            "parameters": self.parameters.to_dict(),
            "state": list(self.state),
            "phase": self.phase,
            "periods": self.periods,
            "tolerance": self.tolerance,
            "compute": list(self.compute),
            "chunk": list(self.chunk),
        }


def load_sweep(path: str | PathLike[str]) -> Sweep:
    """The sweep in a TOML file.

    Tables `axes`, `parameters` and `start` (x_r, v_r, v_c, phase); keys `periods`, `tolerance`,
    `compute` and `chunk`. An axis is a list of values, a table with `from`, `to`, `count` and
    perhaps `spacing = "log"`, or a table with `sobol` (ranges by name), `count` and `seed`.
    Raises InvalidInput when the file cannot be read, is not TOML, or holds what is not allowed.
    """
    table = read_toml(path)
    keys = ("axes", "parameters", "start", "periods", "tolerance", "compute", "chunk")
    _check_keys("key", table, keys)
    start = table.pop("start", {})
    axes = table.pop("axes", {})
    for name, given in (("start", start), ("axes", axes)):
        if not isinstance(given, dict):
            raise InvalidInput(name, given, "a table")
    _check_keys("start", start, START)
    phase = start.pop("phase", 0.0)
    try:
        settings: dict[str, Any] = {
            "axes": tuple(_axis(name, given) for name, given in axes.items()),
            "parameters": Parameters().replace(**table.pop("parameters", {})),
            "state": tuple(start.get(name, 0.0) for name in START[:3]),
            "phase": phase,
            **{name: tuple(v) if isinstance(v, list) else v for name, v in table.items()},
        }
        return Sweep(**settings)
    except TypeError as error:
        raise InvalidInput("file", str(path), f"values of the right kinds ({error})") from error


def _axis(name: str, given: Any) -> Axis:
    if isinstance(given, list):
        return Axis.of(name, given)
    if not isinstance(given, dict):
        raise InvalidInput(name, given, "a list of values or a table")
    if "sobol" in given:
        _check_keys(name, given, ("sobol", "count", "seed"), needed=("count", "seed"))
        axis = Axis.sobol(given["sobol"], given["count"], given["seed"])
        return Axis(name, axis.quantities, axis.values)
    _check_keys(name, given, ("from", "to", "count", "spacing"), needed=("from", "to", "count"))
    spacing = given.get("spacing", "linear")
    if spacing not in _SPACINGS:
        raise InvalidInput("spacing", spacing, f"one of {', '.join(_SPACINGS)}")
    make = Axis.linear if spacing == "linear" else Axis.log
    return make(name, given["from"], given["to"], given["count"])


def _check_keys(
    field: str, given: Mapping[str, Any], allowed: Sequence[str], needed: Sequence[str] = ()
) -> None:
    for name in given:
        if name not in allowed:
            raise InvalidInput(field, name, f"one of {', '.join(allowed)}")
    for name in needed:
        if name not in given:
            raise InvalidInput(field, dict(given), f"a table with {', '.join(needed)}")
