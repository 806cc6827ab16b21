"""Residuals of a model at measured time series, and their exact Jacobian through every switch."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.measured import OF_STATE, Measured
from capsule_sym._design.quantities import System, dimensionless, real, varied
from capsule_sym._design.sensitivities import START, columns_of, sensitivities
from capsule_sym._errors import InvalidInput
from capsule_sym._map import Trajectory, simulate
from capsule_sym._native import check_time
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._parameters import SceneDevice, names_of

OF_START = (*START, "x_c")
_PHASE, _X_C = START.index("phase"), OF_START.index("x_c")
_BLOCK = 2**15  # times whose derivatives, all 48 of each, are in memory at once
_LOST = 1e3  # residual of a motion that does not reach the last of the times
Matrix = NDArray[np.float64]
Vector = NDArray[np.float64]


class _Run(NamedTuple):
    """A motion at values of the unknown, and its times (n,), in units of the model."""

    trajectory: Trajectory | None
    """None where it does not reach the last of the times."""
    times: Vector
    start: Vector
    """The values of OF_START."""
    units: Vector
    """Their units."""
    whole: float
    """The whole periods that the phase is reduced by, as a time over omega."""

    @property
    def itinerary(self) -> str:
        """The fields that were passed."""
        if self.trajectory is None:
            return "open"
        return " ".join(f"F{field}" for field in self.trajectory.records["field"].tolist())


@dataclass
class Problem:
    """Residuals and their Jacobian at values of the unknown."""

    data: Measured
    system: System
    unknown: tuple[str, ...]
    state: tuple[float, ...]
    phase: float
    progress: Callable[[str], object] | None = None
    doing: str = ""
    """What is done, in words."""

    def __post_init__(self) -> None:
        own = names_of(self.system)
        for name in self.unknown:
            if name not in own and name not in OF_START:
                raise InvalidInput("unknown", name, f"one of {', '.join((*own, *OF_START))}")
        if not self.unknown or len(set(self.unknown)) < len(self.unknown):
            raise InvalidInput("unknown", ", ".join(self.unknown), "one or more different names")
        if len(self.state) != 3 or not all(map(real, self.state)):
            raise InvalidInput("state", self.state, "three finite numbers")
        if not real(self.phase):
            raise InvalidInput("phase", self.phase, "a finite number")
        if len(self.unknown) >= len(self.data.values):
            raise InvalidInput("data", f"{len(self.data.values)} values", "more than are unknown")
        known = dict(zip(OF_START, (*self.state, self.phase, 0.0), strict=True))
        self.base = {name: getattr(self.system, name) for name in own} | known
        self.guess = np.array([float(self.base[name]) for name in self.unknown])
        data, column = self.data, self.data.column
        scales = [data.values[column == k].std() for k in range(len(data.names))]
        self.scales = np.array(scales)[column]
        self.rows = np.array([OF_STATE[name] for name in data.names])[column]
        self.speeds = np.array([name.startswith("v") for name in data.names])[column]
        self.different, self.which = np.unique(data.times - data.begin, return_inverse=True)
        self.evaluations = 0
        self._last: tuple[bytes, Vector, Matrix, str] | None = None

    def residuals(self, values: Vector) -> Vector:
        """Residuals (n,)."""
        return self.at(values)[0]

    def jacobian(self, values: Vector) -> Matrix:
        """Their Jacobian (n, k)."""
        return self.at(values)[1]

    def cost(self, values: Vector) -> float:
        """Half the sum of the residuals' squares."""
        return float(np.sum(self._at(values, slopes=False)[0] ** 2) / 2)

    def itinerary(self, values: Vector) -> str:
        """The run's itinerary."""
        return self._run(values).itinerary

    def at(self, values: Vector) -> tuple[Vector, Matrix, str]:
        """Residuals (n,), their Jacobian (n, k), and the run's itinerary."""
        key = values.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, *self._at(values))
        return self._last[1:]

    def now(self, values: Vector) -> dict[str, float]:
        """All values by name, with these of the unknown."""
        return self.base | dict(zip(self.unknown, values.tolist(), strict=True))

    def system_at(self, values: Vector) -> System:
        """The system with these values of the unknown."""
        now = self.now(values)
        return type(self.system)(**{name: now[name] for name in names_of(self.system)})

    def _run(self, values: Vector) -> _Run:
        """The motion at these values."""
        self.evaluations += 1
        if self.progress is not None:
            self.progress(f"{self.doing}, {self.evaluations} runs")
        now, system = self.now(values), self.system_at(values)
        p, units = dimensionless(system), np.ones(len(OF_START))
        if isinstance(system, SceneDevice):
            units = np.array([system.scale(name) for name in OF_START])
        start = np.array([now[name] for name in OF_START]) / units
        phase = float(start[_PHASE])
        reduced = phase % p.period
        reduced = 0.0 if reduced >= p.period else reduced
        times = reduced + self.different / units[_PHASE]
        periods = max(1, math.ceil(times[-1] / p.period + 1e-9))
        run = simulate(p, tuple(start[:_PHASE].tolist()), reduced, periods)
        lost = not run.success or times[-1] > run.span[1]
        return _Run(None if lost else run, times, start, units, (phase - reduced) / p.omega)

    def _at(self, values: Vector, slopes: bool = True) -> tuple[Vector, Matrix, str]:
        """The same as `at`, anew, block by block of the times; without slopes no Jacobian."""
        run, count = self._run(values), len(self.data.values)
        residuals, jacobian = np.full(count, _LOST), np.zeros((slopes * count, len(values)))
        for first in range(0, len(self.different) if run.trajectory else 0, _BLOCK):
            check_time()
            assert run.trajectory is not None
            rows = slice(*np.searchsorted(self.which, (first, first + _BLOCK)))
            which, times = self.which[rows] - first, run.times[first : first + _BLOCK]
            unit = np.where(self.speeds[rows], run.units[1], run.units[0])
            found = sensitivities(run.trajectory, times) if slopes else None
            states = run.trajectory(times, position=True) if found is None else found.states
            states = states + run.start[_X_C] * np.eye(4)[3]
            model = np.sum(self.rows[rows] * states[which], axis=1)
            residuals[rows] = (unit * model - self.data.values[rows]) / self.scales[rows]
            if found is None:
                continue
            chain, position, by_length, by_rate = self._chain(values, run)
            # After a tangential switch there are none.
            moved = np.where(np.isfinite(found.slopes), found.slopes, 0.0) @ chain
            elapsed = self.different[first : first + _BLOCK] / run.units[_PHASE]
            moved += found.rates[..., None] * (elapsed[:, None, None] * by_rate)
            moved[:, 3] += position
            by = np.einsum("nk,nkj->nj", self.rows[rows], moved[which])
            by += model[:, None] * (by_length + self.speeds[rows, None] * by_rate)
            jacobian[rows] = by * (unit / self.scales[rows])[:, None]
        return residuals, jacobian, run.itinerary

    def _chain(self, values: Vector, run: _Run) -> tuple[Matrix, Vector, Vector, Vector]:
        """Derivatives of start and parameters by the unknown (n, k), and of others, each (k,).

        Others are x_c at the start, and the logarithms of the units of length and of rate.
        """
        now = varied(self.system.scene, self.now(values), self.unknown)
        own, none = vars(now), np.zeros(len(values))
        columns = columns_of(self.system.scene)
        units = dict.fromkeys(OF_START, Slope(1.0, none))
        if isinstance(self.system, SceneDevice):
            own, units = own | now.ratios(), {name: now.scale(name) for name in OF_START}
        # The start is held in SI units: in those of the device it moves as they do.
        own |= {name: own[name] / unit for name, unit in units.items()}
        chain = np.array([getattr(own[name], "slope", none) for name in columns])
        # The phase was taken less whole periods, which depend on omega.
        chain[_PHASE] += run.whole * chain[columns.index("omega")]
        by_length, by_time = (units[name].slope / units[name].value for name in ("x_c", "phase"))
        return chain, own["x_c"].slope, by_length, -by_time
