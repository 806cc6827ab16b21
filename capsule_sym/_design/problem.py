"""Residuals of recorded runs with shared unknowns, and their Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.residuals import OF_START, Recorded
from capsule_sym._errors import InvalidInput, counted
from capsule_sym._parameters import SceneDevice

_LOST = 1e3  # residual of a motion that does not reach the last of the times
_LARGEST = 1e20  # residual of the first guess; powers of much larger ones would overflow


def spread_of(values: Vector) -> float:
    """Standard deviation of values, also where their squares overflow or underflow."""
    largest = float(np.abs(values).max(initial=0.0)) or 1.0
    return largest * float((values / largest).std())


def about_trend(times: Vector, values: Vector) -> Vector:
    """Values without their linear trend in time."""
    along, size = times - times.mean(), float(np.abs(values).max()) or 1.0
    along, scaled = along / (np.abs(along).max() or 1.0), values / size
    slope = (along @ scaled) / ((along @ along) or 1.0)
    found: Vector = size * (scaled - scaled.mean() - slope * along)
    return found


class Misfit:
    """Residuals and their Jacobian at values of the unknowns.

    The unknowns are those that runs share, and those of each run, named "run.name" if it has one.
    """

    def __init__(
        self,
        recorded: Sequence[Recorded],
        shared: Sequence[str],
        progress: Callable[[str], object] | None = None,
    ) -> None:
        """`shared` are the unknowns with one value in all runs; each run has its own others.

        The guess of a shared one is that of the last run. Raises InvalidInput unless there are more
        values than unknowns.
        """
        self.recorded, self.shared, self.progress = tuple(recorded), tuple(shared), progress
        self.doing, self.evaluations = "", 0
        named = [
            [
                name if name in shared or not one.name else f"{one.name}.{name}"
                for name in one.unknown
            ]
            for one in self.recorded
        ]
        every = dict.fromkeys([*self.shared, *(name for names in named for name in names)])
        self.unknown = tuple(every)
        self.places = [np.array([self.unknown.index(name) for name in names]) for names in named]
        """Indices of each run's unknowns among all."""
        self.guess, self.linear = np.zeros(len(every)), np.zeros(len(every), bool)
        for run, places in zip(self.recorded, self.places, strict=True):
            self.guess[places], self.linear[places] = run.guess, run.linear
        ends = np.cumsum([0, *(len(one.data.values) for one in self.recorded)])
        self.rows = [slice(*pair) for pair in pairwise(ends.tolist())]
        self.values = np.concatenate([one.data.values for one in self.recorded])
        if len(self.unknown) >= len(self.values):
            raise InvalidInput(
                "data", counted(len(self.values), "value"), "more values than unknowns"
            )
        series = [(one, column) for one in self.recorded for column in range(len(one.data.names))]
        self.groups = np.concatenate(
            [one.data.column + series.index((one, 0)) for one in self.recorded]
        )
        """Series of each value, numbered over all runs, (n,)."""
        self.scales, self.stretch, self._begun = self._scales(series), 1.0, False
        self._last: tuple[bytes, Vector, Matrix] | None = None

    def _scales(self, series: Sequence[tuple[Recorded, int]]) -> Vector:
        """Units of the residuals (n,): standard deviations of series.

        In runs with names all series in the same unit share one: those of one camera have the same
        noise, even if a body hardly moves.
        """
        spread = np.array([spread_of(self.values[self.groups == k]) for k in range(len(series))])
        if self.recorded[0].name:
            names = [(one, one.data.names[column]) for one, column in series]
            kinds = np.array([f"{one.scale_of(name)} {name[0]}" for one, name in names])
            for kind in set(kinds.tolist()):
                largest = spread[kinds == kind].max()
                own = np.sqrt(np.mean((spread[kinds == kind] / largest) ** 2))
                spread[kinds == kind] = largest * own
        scales: Vector = spread[self.groups]
        return scales

    @property
    def partly(self) -> bool:
        """True if a part of a guess follows from the measurements."""
        return bool(self.linear.any()) or any(run.sought for run in self.recorded)

    def residuals(self, values: Vector) -> Vector:
        """Residuals (n,)."""
        return self.at(values)[0]

    def jacobian(self, values: Vector) -> Matrix:
        """Jacobian of the residuals (n, k)."""
        return self.at(values)[1]

    def cost(self, values: Vector) -> float:
        """Half the sum of the residuals' squares."""
        return float(np.sum(self.without_slopes(values)[0] ** 2) / 2)

    def at(self, values: Vector) -> tuple[Vector, Matrix]:
        """Residuals (n,) and their Jacobian (n, k)."""
        key = values.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, *self._at(values, True))
        return self._last[1:]

    def without_slopes(self, values: Vector) -> tuple[Vector, Matrix]:
        """Residuals (n,), and the Jacobian (n, k) by the linear unknowns alone."""
        return self._at(values, False)

    def complete(self, values: Vector) -> bool:
        """True if the motion of every run reaches the last of its times."""
        return bool(np.all(self.at(values)[0] != _LOST))

    def resting(self, values: Vector) -> NDArray[np.bool_]:
        """Mask of unknowns that are velocities of capsules at rest at the first time, (k,)."""
        found = np.zeros(len(values), bool)
        for run, places in zip(self.recorded, self.places, strict=True):
            if "v_c" in run.unknown:
                found[places[run.unknown.index("v_c")]] = run.rests(values[places])
        return found

    def itinerary(self, values: Vector, changed: int | None = None) -> tuple[str, ...]:
        """Itineraries of all runs, or only of those on which an unknown has an effect."""
        found = list[str]()
        for run, places in zip(self.recorded, self.places, strict=True):
            if changed is None or (changed in places and not self.linear[changed]):
                self._count()
                found.append(run.itinerary(values[places]))
        return tuple(found)

    def sizes(self, values: Vector) -> Vector:
        """Reference sizes for relative changes of the unknowns."""
        found = np.maximum(np.abs(values), np.abs(self.guess))
        found[found == 0.0] = 1.0
        for run, places in zip(self.recorded, self.places, strict=True):
            system, data = run.system_at(values[places]), run.data
            for k, name in zip(places.tolist(), run.unknown, strict=True):
                kind, _, series = name.partition("_")
                if name in OF_START:
                    unit = system.scale(name) if isinstance(system, SceneDevice) else 1.0
                    found[k] = max(unit, abs(values[k]))
                elif name == "slip":
                    found[k] = 1.0
                elif kind in ("offset", "drift") and series in data.names:
                    own = spread_of(data.values[data.column == data.names.index(series)])
                    found[k] = own / (1.0 if kind == "offset" else np.ptp(data.times))
        return found

    def _count(self) -> None:
        """Count a run, and report it."""
        self.evaluations += 1
        if self.progress is not None:
            self.progress(f"{self.doing}, {counted(self.evaluations, 'run')}")

    def _at(self, values: Vector, slopes: bool) -> tuple[Vector, Matrix]:
        """Residuals and Jacobian, computed; if the first are huge, all are divided by `stretch`."""
        residuals, jacobian = self._unstretched(values, slopes)
        if not self._begun:
            self._begun = True
            self.stretch = max(1.0, float(np.abs(residuals).max()) / _LARGEST)
            self.scales = self.scales * self.stretch
            residuals, jacobian = residuals / self.stretch, jacobian / self.stretch
        return residuals, jacobian

    def _unstretched(self, values: Vector, slopes: bool) -> tuple[Vector, Matrix]:
        """Residuals and Jacobian in units of the present scales."""
        residuals = np.empty(len(self.values))
        alone = len(self.recorded) == 1
        jacobian = np.zeros((0 if alone else len(self.values), len(self.unknown)))
        for run, places, rows in zip(self.recorded, self.places, self.rows, strict=True):
            self._count()
            model, by, itinerary = run.at(values[places], slopes)
            by /= self.scales[rows, None]
            residuals[rows] = model / self.scales[rows] - self.values[rows] / self.scales[rows]
            if itinerary == "open" or not np.isfinite(residuals[rows]).all():
                residuals[rows], by[:] = _LOST, 0.0
            if alone:  # its Jacobian may have a million rows
                return residuals, by
            jacobian[rows, places] = by
        return residuals, jacobian
