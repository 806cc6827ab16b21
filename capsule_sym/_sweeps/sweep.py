"""A sweep as data: its cells, the length of the runs, and the quantities to compute."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import InvalidInput, counted
from capsule_sym._map.checks import check_count, check_start, is_real
from capsule_sym._map.result import brief
from capsule_sym._parameters import Parameters, SceneDevice, SceneParameters
from capsule_sym._sweeps.axes import START, Axis, named
from capsule_sym._sweeps.quantities import OF_ORBIT, QUANTITIES

MOST_CELLS = 10**10
_MOST_IN_CHUNK = 2**20  # one to two gigabytes of a worker's memory
_PERIODS_PER_CHUNK = 2**21  # one to two seconds of the C core
_LEAST_CHUNKS = 16
# Cost of an orbit, and of a Lyapunov exponent without one, in excitation periods of the core.
_ORBIT, _EXPONENT = 100, 20_000


@checked
@dataclass(frozen=True, eq=False)
class Sweep:
    """Runs at every combination of the axes' values; all other values are fixed.

    Runs start in `state`, (x_r, v_r, v_c), at `phase`, a time from 0 to below the shortest
    excitation period. A motion is periodic if at the end of `periods` excitation periods, 1 to
    10^12, its states repeat after at most 16 of them within `tolerance`, between 0 and 1, or if it
    approaches a stable orbit that does. `compute` has some of itinerary, progression, final,
    multipliers, energies, forces and lyapunov.

    A sweep has at most 10^10 cells. Results are written in chunks of `chunk` cells along each axis,
    at most 2^20 in all. By default a chunk takes at most about two seconds in the C core, or has at
    most 16 cells; small sweeps are cut finer. All quantities are dimensionless. With a `device` no
    `parameters` are given: they are those of the device. Axes may then be `Axis.of_device` of this
    device, and results have `si_scale` and `si_units` to convert them to SI units. Raises
    InvalidInput for a value that is not allowed.
    """

    kind: ClassVar[str] = "sweep"
    """Kind of its store."""

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
        if not self.axes:
            raise InvalidInput("axes", self.axes, "at least one axis")
        for axis in self.axes:
            if axis.device and self.device is None:
                raise InvalidInput("device", None, f"given for the axis {axis.name} in SI units")
        if self.device is not None:
            default = type(self.parameters)()
            if self.parameters not in (Parameters(), default, self.device.dimensionless()):
                raise InvalidInput("parameters", self.parameters, "absent if a device is given")
            set_(self, "parameters", self.device.dimensionless())
        set_(self, "state", check_start(self.parameters, self.state, 0.0, self.periods))
        scene = self.parameters.scene
        set_(self, "axes", tuple(self.axes))
        for axis in self.axes:
            axis.check(scene)
            if self.device and axis.device:
                values = axis.device[0] * self.device.tie(axis.name)[1]
                if not np.array_equal(axis.values[:, 0], values):
                    raise InvalidInput("device", self.device, f"that of the axis {axis.name}")
        changed = [quantity for axis in self.axes for quantity in axis.quantities]
        for kind in ([axis.name for axis in self.axes], changed):
            if twice := [name for name in kind if kind.count(name) > 1]:
                raise InvalidInput("axis", twice[0], "given once")
        if wrong := [one for one in self.compute or ("",) if one not in QUANTITIES]:
            raise InvalidInput(
                "compute", wrong[0] or self.compute, f"some of {', '.join(QUANTITIES)}"
            )
        set_(self, "compute", tuple(one for one in QUANTITIES if one in self.compute))
        if not is_real(self.tolerance) or not 0.0 < self.tolerance < 1.0:
            raise InvalidInput("tolerance", self.tolerance, "a number in (0, 1)")
        column = {q: a.values[:, i] for a in self.axes for i, q in enumerate(a.quantities)}
        end = 2 * math.pi / float(np.max(column.get("omega", self.parameters.omega)))
        for phase in (self.phase, float(np.max(column.get("phase", 0.0)))):
            if not is_real(phase) or not 0.0 <= phase < end:
                raise InvalidInput("phase", phase, f"a time in [0, 2 pi/omega) = [0, {end:g})")
        for name, plain in (("periods", int), ("phase", float), ("tolerance", float)):
            set_(self, name, plain(getattr(self, name)))
        if self.size > MOST_CELLS:
            raise InvalidInput("cells", self.size, f"at most {MOST_CELLS}")
        self._check_chunk()
        set_(self, "chunk", tuple(self.chunk) or self._chunk())

    def __repr__(self) -> str:
        axes = ", ".join(f"{axis.name} ({len(axis)})" for axis in self.axes)
        cells, periods = counted(self.size, "cell"), counted(self.periods, "period")
        return brief(self, f"{cells} of {periods}, {', '.join(self.compute)}", f"over {axes}")

    def _check_chunk(self) -> None:
        given, sides = self.chunk, self.shape
        right = isinstance(given, list | tuple) and all(type(n) is int for n in given)
        if not right or (given and len(given) != len(sides)):
            raise InvalidInput("chunk", given, "a whole number for each axis")
        inside = all(1 <= n <= most for n, most in zip(given, sides, strict=False))
        if not inside or math.prod(given) > _MOST_IN_CHUNK:
            allowed = f"from 1 to {sides}, and in all at most {_MOST_IN_CHUNK} cells"
            raise InvalidInput("chunk", given, allowed)

    def _chunk(self) -> tuple[int, ...]:
        """Sides of a chunk by default: the longest is halved until the chunk is small enough."""
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
        """Number of values of each axis."""
        return tuple(map(len, self.axes))

    @cached_property
    def size(self) -> int:
        """Number of cells."""
        return math.prod(self.shape)

    @cached_property
    def chunks(self) -> tuple[int, ...]:
        """Number of chunks along each axis."""
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunk, strict=True))

    def region(self, index: int) -> tuple[slice, ...]:
        """Slices of a chunk; chunks are counted from 0 along the last axis first.

        Raises InvalidInput for another number.
        """
        check_count("index", index, 0, math.prod(self.chunks) - 1)
        place = np.unravel_index(index, self.chunks)
        return tuple(
            slice(int(i) * c, min((int(i) + 1) * c, n))
            for i, c, n in zip(place, self.chunk, self.shape, strict=True)
        )

    def cells_in(self, index: int) -> int:
        """Number of cells in a chunk."""
        return math.prod(part.stop - part.start for part in self.region(index))

    def part(self, index: int) -> Sweep:
        """Chunk of this number, from 0 on, as a sweep of its own; `region` has its cells.

        Raises InvalidInput for another number.
        """
        parts = zip(self.axes, self.region(index), strict=True)
        axes = tuple(axis.part(where) for axis, where in parts)
        return replace(self, axes=axes, chunk=tuple(map(len, axes)))

    def columns(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Parameters (n, k), states (n, 3) and phases (n,) of all cells, the last axis fastest.

        Parameters are in the order of the scene. All values are dimensionless, also of a device.
        """
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
        """Further results by name, each `Added`, from the cells in a finished store; none here."""
        return {}

    def record(self) -> dict[str, Any]:
        """Sweep in plain values; two sweeps with equal records give the same results."""
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
