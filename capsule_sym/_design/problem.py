"""Residuals of recorded runs with shared unknowns, and their Jacobian."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.residuals import Recorded
from capsule_sym._errors import InvalidInput, counted

_LOST = 1e3  # residual, in standard deviations of its series, of a motion that ends too early


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
        self.recorded, self.progress = tuple(recorded), progress
        self.doing, self.evaluations = "", 0
        named = [
            [
                name if name in shared or not run.name else f"{run.name}.{name}"
                for name in run.unknown
            ]
            for run in self.recorded
        ]
        self.unknown = tuple(dict.fromkeys([*shared, *(name for names in named for name in names)]))
        self.places = [np.array([self.unknown.index(name) for name in names]) for names in named]
        """Indices of each run's unknowns among all."""
        count = len(self.unknown)
        (self.guess, self.least), self.linear = np.zeros((2, count)), np.zeros(count, bool)
        for run, places in zip(self.recorded, self.places, strict=True):
            self.guess[places], self.least[places] = run.guess, run.sizes
            self.linear[places] = run.linear
        self.values = np.concatenate([run.data.values for run in self.recorded])
        if count >= len(self.values):
            told = counted(len(self.values), "value")
            raise InvalidInput("data", told, "more values than unknowns")
        ends = np.cumsum([0, *(len(run.data.values) for run in self.recorded)])
        self.rows = [slice(*pair) for pair in pairwise(ends.tolist())]
        firsts = np.cumsum([0, *(len(run.data.names) for run in self.recorded)])
        self.groups = np.concatenate(
            [run.data.column + first for run, first in zip(self.recorded, firsts, strict=False)]
        )
        """Series of each value, numbered over all runs, (n,)."""
        self.scales = self._scales()
        self._last: tuple[bytes, Vector, Matrix] | None = None

    def _scales(self) -> Vector:
        """Units of the residuals (n,): standard deviations of series.

        In runs with names all series in the same unit share one: those of one camera have the same
        noise, even if a body hardly moves.
        """
        kinds = [
            f"{run.scale_of(name)} {name[0]}" if run.name else name
            for run in self.recorded
            for name in run.data.names
        ]
        spread = np.array([self.values[self.groups == k].std() for k in range(len(kinds))])
        shared = {kind: np.equal(kinds, kind) for kind in kinds}
        sizes = np.array([np.sqrt(np.mean(spread[shared[kind]] ** 2)) for kind in kinds])
        return np.asarray(sizes[self.groups])

    def residuals(self, values: Vector) -> Vector:
        """Residuals (n,)."""
        return self.at(values)[0]

    def jacobian(self, values: Vector) -> Matrix:
        """Jacobian of the residuals (n, k)."""
        return self.at(values)[1]

    def at(self, values: Vector) -> tuple[Vector, Matrix]:
        """Residuals (n,) and their Jacobian (n, k), those of the last values without a run."""
        key = values.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = (key, *self.evaluated(values))
        return self._last[1:]

    def evaluated(self, values: Vector, slopes: bool = True) -> tuple[Vector, Matrix]:
        """Residuals (n,) and their Jacobian (n, k), without slopes by the linear unknowns alone."""
        residuals, jacobian = np.empty(len(self.values)), np.zeros((len(self.values), len(values)))
        for run, places, rows in zip(self.recorded, self.places, self.rows, strict=True):
            self._count()
            model, by = run.at(values[places], slopes)
            residuals[rows] = (model - self.values[rows]) / self.scales[rows]
            if np.isfinite(residuals[rows]).all():
                jacobian[rows, places] = by / self.scales[rows, None]
            else:
                residuals[rows] = _LOST
        return residuals, jacobian

    def complete(self, residuals: Vector) -> bool:
        """True if the motion of every run reaches the last of its times."""
        return bool(np.all(residuals != _LOST))

    def resting(self, values: Vector) -> NDArray[np.bool_]:
        """Mask of unknowns that are velocities of capsules at rest at the first time, (k,)."""
        found = np.zeros(len(values), bool)
        for run, places in zip(self.recorded, self.places, strict=True):
            if "v_c" in run.unknown:
                found[places[run.unknown.index("v_c")]] = run.rests(values[places])
        return found

    def itinerary(self, values: Vector, changed: int) -> list[list[int]]:
        """Itineraries of the runs on which an unknown has an effect."""
        pairs = zip(self.recorded, self.places, strict=True)
        runs = [(run, places) for run, places in pairs if changed in places]
        self._count(len(runs))
        return [run.itinerary(values[places]) for run, places in runs]

    def named(self, values: Vector) -> dict[str, float]:
        """Values by the names of the unknowns."""
        return dict(zip(self.unknown, values.tolist(), strict=True))

    def sizes(self, values: Vector) -> Vector:
        """Reference sizes for relative changes of the unknowns."""
        found = np.maximum(np.abs(values), self.least)
        return np.where(found == 0.0, 1.0, found)

    def _count(self, runs: int = 1) -> None:
        """Count runs, and report them."""
        self.evaluations += runs
        if self.progress is not None:
            self.progress(f"{self.doing}, {counted(self.evaluations, 'run')}")
