"""A sweep as data: which cells are run, for how long, and what is computed of each."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.checks import check_start, is_real
from capsule_sym._parameters import Parameters, SceneDevice, SceneParameters
from capsule_sym._sweeps.axes import START, Axis, named
from capsule_sym._sweeps.quantities import OF_ORBIT, QUANTITIES

_MOST_CELLS = 10**10
_MOST_IN_CHUNK = 2**20  # a gigabyte or two of a worker's memory
_PERIODS_PER_CHUNK = 2**21  # a second or two of the C core
_LEAST_CHUNKS = 16
# Excitation periods of the C core in the time in which an orbit is closed, or an exponent computed
# of a motion that is none.
_ORBIT, _EXPONENT = 100, 20_000


def check_sweep(sweep: object) -> None:
    """Raises InvalidInput for anything but a sweep."""
    if not isinstance(sweep, Sweep):
        raise InvalidInput("sweep", sweep, "a Sweep")


@dataclass(frozen=True, eq=False)
class Sweep:
    """Runs at every combination of the axes' values; what no axis changes stays as given.

    A motion is periodic if the stroboscopic states repeat within `tolerance` after `periods`
    excitation periods. Results are written in chunks of `chunk` cells along each axis, chosen so
    that a chunk takes a second or two if not given. All quantities are dimensionless; where a
    `device` is given its parameters are the runs', its axes may be `Axis.of_device`, and results
    say in `si_scale` and `si_units` what they are multiplied with for SI units. Raises InvalidInput
    for any value that is not allowed.
    """

    kind: ClassVar[str] = "sweep"
    """What its store is."""

    axes: tuple[Axis, ...]
    parameters: SceneParameters = field(default_factory=Parameters)
    state: tuple[float, float, float] = (0.0, 0.0, 0.0)
    phase: float = 0.0
    periods: int = 300
    tolerance: float = 1e-9
    compute: tuple[str, ...] = ("itinerary",)
    chunk: tuple[int, ...] = ()
    device: SceneDevice | None = None

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        if not isinstance(self.axes, list | tuple) or not self.axes:
            raise InvalidInput("axes", self.axes, "at least one axis")
        for axis in self.axes:
            if not isinstance(axis, Axis):
                raise InvalidInput("axes", axis, "an Axis")
            if axis.device and self.device is None:
                raise InvalidInput("device", None, f"given for the axis {axis.name} in SI units")
        if self.device is not None:
            default = type(self.parameters)()
            if self.parameters not in (Parameters(), default, self.device.dimensionless()):
                raise InvalidInput("parameters", self.parameters, "absent where a device is given")
            set_(self, "parameters", self.device.dimensionless())
        set_(self, "state", check_start(self.parameters, self.state, 0.0, self.periods))
        scene = self.parameters.scene
        set_(self, "axes", tuple(axis.within(scene) for axis in self.axes))
        names = [axis.name for axis in self.axes]
        changed = [quantity for axis in self.axes for quantity in axis.quantities]
        for kind in (names, changed):
            twice = next((name for name in kind if kind.count(name) > 1), None)
            if twice:
                raise InvalidInput("axis", twice, "given once")
        asked = self.compute if isinstance(self.compute, list | tuple) else [self.compute]
        wrong = [quantity for quantity in asked if quantity not in QUANTITIES]
        if wrong or not asked:
            value = wrong[0] if wrong else self.compute
            raise InvalidInput("compute", value, f"some of {', '.join(QUANTITIES)}")
        set_(self, "compute", tuple(q for q in QUANTITIES if q in asked))
        if not is_real(self.tolerance) or not 0.0 < self.tolerance < 1.0:
            raise InvalidInput("tolerance", self.tolerance, "a number in (0, 1)")
        self._check_phases()
        if self.size > _MOST_CELLS:
            raise InvalidInput("cells", self.size, f"at most {_MOST_CELLS}")
        self._check_chunk()
        set_(self, "chunk", tuple(self.chunk) or self._chunk())

    def _check_phases(self) -> None:
        column = {q: a.values[:, i] for a in self.axes for i, q in enumerate(a.quantities)}
        end = 2 * math.pi / float(np.max(column.get("omega", self.parameters.omega)))
        for phase in (self.phase, float(np.max(column.get("phase", 0.0)))):
            if not is_real(phase) or not 0.0 <= phase < end:
                raise InvalidInput("phase", phase, f"a time in [0, 2 pi/omega) = [0, {end:g})")

    def _check_chunk(self) -> None:
        given = self.chunk
        if not isinstance(given, list | tuple) or len(given) not in (0, len(self.axes)):
            raise InvalidInput("chunk", given, "a whole number for each axis")
        for n, most in zip(given, self.shape, strict=False):
            if isinstance(n, bool) or not isinstance(n, int) or not 1 <= n <= most:
                raise InvalidInput("chunk", given, f"whole numbers from 1 to {self.shape}")
        if math.prod(given) > _MOST_IN_CHUNK:
            raise InvalidInput("chunk", given, f"at most {_MOST_IN_CHUNK} cells")

    def _chunk(self) -> tuple[int, ...]:
        """Halves the longest side until a chunk takes a second or two."""
        more = _ORBIT if OF_ORBIT & set(self.compute) else 0
        more += _EXPONENT if "lyapunov" in self.compute else 0
        room = max(16, _PERIODS_PER_CHUNK // (self.periods + more))
        room = min(room, max(16, self.size // _LEAST_CHUNKS), _MOST_IN_CHUNK)
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
            replace(axis, values=axis.values[where])
            for axis, where in zip(self.axes, self.region(index), strict=True)
        )
        return replace(self, axes=axes, chunk=tuple(map(len, axes)))

    def columns(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Parameters (n, k), states (n, 3) and phases (n,) of all cells, the last axis fastest."""
        names = named(self.parameters.scene)
        fixed = [*self.parameters.to_dict().values(), *self.state, self.phase]
        table = np.tile(np.array(fixed), (*self.shape, 1))
        for number, axis in enumerate(self.axes):
            across = [1] * len(self.axes)
            across[number] = len(axis)
            for i, quantity in enumerate(axis.quantities):
                table[..., names.index(quantity)] = axis.values[:, i].reshape(across)
        ends = len(names) - len(START), len(names) - 1
        rows, states, phases = np.split(table.reshape(self.size, -1), ends, axis=1)
        return rows.copy(), states.copy(), phases[:, 0].copy()

    def further(self, store: Path) -> dict[str, Any]:
        """Results of all cells, each `Added`, that are computed from the others in the end."""
        return {}

    def record(self) -> dict[str, Any]:
        """The sweep in plain values: two sweeps with one record give the same results."""
        return {
            "scene": self.parameters.scene.source,
            "axes": [axis.record() for axis in self.axes],
            "parameters": self.parameters.to_dict(),
            "state": list(self.state),
            "phase": self.phase,
            "periods": self.periods,
            "tolerance": self.tolerance,
            "compute": list(self.compute),
            "chunk": list(self.chunk),
            **({} if self.device is None else {"device": self.device.to_dict()}),
        }
