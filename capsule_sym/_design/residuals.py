"""Model of a recorded run at its measured times, with its exact Jacobian through all switches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.measured import OF_STATE, Measured
from capsule_sym._design.quantities import System, dimensionless, real, varied
from capsule_sym._design.sensitivities import START, columns_of, sensitivities
from capsule_sym._errors import InvalidInput
from capsule_sym._map import Trajectory, simulate
from capsule_sym._native import check_time
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.shooting.itinerary import drift
from capsule_sym._parameters import SceneDevice, names_of

OF_START = (*START, "x_c")
STATE, PHASE = START[:-1], START[-1]
_X_C = OF_STATE["x_c"].index(1.0)
_BLOCK = 2**15  # times whose derivatives, 48 each, are in memory at once
_STILL = 1e-5  # velocity of a capsule that comes to rest within its square


class _Modelled(NamedTuple):
    """Motion at values of the unknowns, and its times (n,), in units of the model."""

    trajectory: Trajectory | None
    """None if the motion does not reach the last of the times."""
    times: Vector
    own: dict[str, Any]
    """Start, slip and parameters, with derivatives by the unknowns."""
    units: dict[str, Slope]
    """Units of the start, with derivatives."""
    whole: float
    """Whole periods by which the phase is reduced, as a time over omega."""


class Recorded:
    """Measured series of one run, and their model at values of the unknowns.

    A series is its scale times the model's quantity, plus an offset, plus a drift times the time
    since the first of the times. True time is 1 + slip times the measured time.
    """

    def __init__(
        self,
        data: Measured,
        system: System,
        unknown: tuple[str, ...],
        given: Mapping[str, float],
        name: str = "",
        sought: tuple[str, ...] = (),
    ) -> None:
        """`given` has known values and guesses that differ from those of `observed`.

        `sought` are the unknown phase and state components without a guess.
        """
        self.data, self.system, self.unknown, self.name = data, system, unknown, name
        self.sought = sought
        own = {one: getattr(system, one) for one in names_of(system)}
        self.base: dict[str, float] = own | observed(data.names) | dict(given)
        for one, value in self.base.items():
            if not real(value):
                raise InvalidInput(one, value, "a finite number")
        self.guess = np.array([float(self.base[one]) for one in unknown])
        column = data.column
        self.rows = np.array([OF_STATE[one] for one in data.names])[column]
        self.speeds = np.array([one.startswith("v") for one in data.names])[column]
        self.different, self.which = np.unique(data.times - data.begin, return_inverse=True)
        self.elapsed = self.different[self.which]
        least = {"slip": 1.0} | dict(zip(OF_START, units_of(system).tolist(), strict=True))
        for k, one in enumerate(data.names):
            spread = data.values[column == k].std()
            least |= {f"offset_{one}": spread, f"drift_{one}": spread / self.elapsed.max()}
        self.sizes = np.array([max(abs(self.base[one]), least.get(one, 0.0)) for one in unknown])
        """Reference sizes for relative changes of the unknowns; 0 if there is none."""

    @property
    def linear(self) -> tuple[bool, ...]:
        """True for each unknown in which the series are linear."""
        return tuple(of_series(one) for one in self.unknown)

    def scale_of(self, series: str) -> str:
        """Name of the scale of a series: its own if it has one."""
        own = f"scale_{series}"
        return own if own in self.base or own in self.unknown else "scale"

    def now(self, values: Vector) -> dict[str, float]:
        """All values by name, with these values of the unknowns."""
        return self.base | dict(zip(self.unknown, values.tolist(), strict=True))

    def system_at(self, values: Vector) -> System:
        """System with these values of the unknowns."""
        now = self.now(values)
        return type(self.system)(**{name: now[name] for name in names_of(self.system)})

    def itinerary(self, values: Vector) -> list[int]:
        """Fields passed by the run, in order; none if it does not reach the last of the times."""
        run = self._run(values).trajectory
        return [] if run is None else list(run.records["field"].tolist())

    def rests(self, values: Vector) -> bool:
        """True if the capsule rests at the first time, up to a velocity that vanishes at once."""
        still = values.copy()
        still[self.unknown.index("v_c")] = 0.0
        run = self._run(still).trajectory
        if run is None or abs(self._run(values).own["v_c"].value) > _STILL:
            return False
        return not drift(int(run.records["field"][0]), self.system.scene)

    def _run(self, values: Vector) -> _Modelled:
        """Motion at these values."""
        moving = {one: v for one, v in self.now(values).items() if not of_series(one)}
        now = varied(self.system.scene, moving, self.unknown)
        own, units = vars(now), dict.fromkeys(OF_START, Slope(1.0, np.zeros(len(values))))
        if isinstance(self.system, SceneDevice):
            own, units = own | now.ratios(), {name: now.scale(name) for name in OF_START}
        # The start is fixed in SI units, so that the dimensionless start varies with the units.
        own |= {name: own[name] / unit for name, unit in units.items()}
        p, phase = dimensionless(self.system_at(values)), own[PHASE].value
        reduced = phase % p.period
        reduced = 0.0 if reduced >= p.period else reduced
        times = reduced + self.different * ((1.0 + now.slip.value) / units[PHASE].value)
        periods = max(1, math.ceil(times[-1] / p.period + 1e-9))
        try:
            run = simulate(p, tuple(own[name].value for name in STATE), reduced, periods)
            lost = not run.success or times[-1] > run.span[1]
        except InvalidInput:  # of values that are out of range for a run
            if np.array_equal(values, self.guess):
                raise
            lost = True
        return _Modelled(None if lost else run, times, own, units, (phase - reduced) / p.omega)

    def at(self, values: Vector, slopes: bool = True) -> tuple[Vector, Matrix]:
        """Model (n,), and its Jacobian (n, k).

        Without slopes the Jacobian has the linear unknowns alone. The model is nan for a motion
        that does not reach the last of the times.
        """
        run, now, count = self._run(values), self.now(values), len(self.data.values)
        found, jacobian = np.full(count, np.nan), np.zeros((count, len(values)))
        if run.trajectory is None:
            return found, jacobian
        for first in range(0, len(self.different), _BLOCK):
            check_time()
            rows = slice(*np.searchsorted(self.which, (first, first + _BLOCK)))
            block = slice(first, first + _BLOCK)
            found[rows], jacobian[rows] = self._quantities(run, rows, block, slopes)
        for place, series in enumerate(self.data.names):
            of, scale = self.data.column == place, self.scale_of(series)
            jacobian[of] *= now[scale]
            terms = {scale: found[of], f"offset_{series}": 1.0, f"drift_{series}": self.elapsed[of]}
            found[of] = sum(now[name] * by for name, by in terms.items())
            for name in terms.keys() & self.unknown:
                jacobian[of, self.unknown.index(name)] = terms[name]
        return found, jacobian

    def _quantities(
        self, run: _Modelled, rows: slice, block: slice, slopes: bool
    ) -> tuple[Vector, Matrix | float]:
        """Quantities behind some rows of the series, in units of the system, and their Jacobian."""
        own, of, which = run.own, self.rows[rows], self.which[rows] - block.start
        speeds, rate = self.speeds[rows], 1.0 + own["slip"].value
        unit = np.where(speeds, run.units["v_r"].value * rate, run.units["x_c"].value)
        trajectory: Any = run.trajectory
        moved = sensitivities(trajectory, run.times[block]) if slopes else None
        states = trajectory(run.times[block], position=True) if moved is None else moved.states
        origin = own["x_c"].value * np.array(OF_STATE["x_c"])
        model = np.sum(of * (states + origin)[which], axis=1)
        if moved is None:
            return unit * model, 0.0
        columns, none = columns_of(self.system.scene), np.zeros(len(self.unknown))
        chain = np.array([getattr(own[name], "slope", none) for name in columns])
        # The phase was reduced by whole periods, which depend on omega.
        chain[columns.index(PHASE)] += run.whole * chain[columns.index("omega")]
        # Derivatives of the logarithms of the units of length and of rate.
        by_length, by_time = (
            run.units[name].slope / run.units[name].value for name in ("x_c", PHASE)
        )
        by_rate = own["slip"].slope / rate - by_time
        # Behind a tangential switch there are no derivatives.
        by = np.where(np.isfinite(moved.slopes), moved.slopes, 0.0) @ chain
        elapsed = self.different[block] * (rate / run.units[PHASE].value)
        by += moved.rates[..., None] * (elapsed[:, None, None] * by_rate)
        by[:, _X_C] += own["x_c"].slope
        each = np.einsum("nk,nkj->nj", of, by[which])
        each += model[:, None] * (by_length + speeds[:, None] * by_rate)
        return unit * model, unit[:, None] * each


def units_of(system: System) -> Vector:
    """Units of the start, in the order of OF_START."""
    if isinstance(system, SceneDevice):
        return np.array([system.scale(name) for name in OF_START])
    return np.ones(len(OF_START))


def period_of(system: System) -> float:
    """Excitation period, in the system's unit of time."""
    return float(dimensionless(system).period * units_of(system)[OF_START.index(PHASE)])


def observed(series: tuple[str, ...]) -> dict[str, float]:
    """Default values beside the parameters, by name."""
    added = {f"{kind}_{one}": 0.0 for kind in ("offset", "drift") for one in series}
    return dict.fromkeys(OF_START, 0.0) | {"slip": 0.0, "scale": 1.0} | added


def of_series(name: str) -> bool:
    """True for the name of an offset, a drift or a scale."""
    kind, _, series = name.partition("_")
    return kind == "scale" or (kind in ("offset", "drift") and series in OF_STATE)
