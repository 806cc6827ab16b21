"""Basins of attraction: which closed orbit each cell of a sweep over starts has come to."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.steady import shown_progression
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.stability import floquet_multipliers
from capsule_sym._parameters import SceneParameters
from capsule_sym._sweeps import itineraries
from capsule_sym._sweeps.axes import START
from capsule_sym._sweeps.execution import Summary, run_sweep
from capsule_sym._sweeps.itineraries import NotSolved, orbit_at_end
from capsule_sym._sweeps.layout import Added
from capsule_sym._sweeps.quantities import ATTRACTOR
from capsule_sym._sweeps.results import open_results
from capsule_sym._sweeps.sweep import Sweep, check_sweep

if TYPE_CHECKING:
    import xarray as xr

NONE = -1
"""Code of a cell that has come to no closed orbit."""

_QUANTITIES = ("itinerary", "progression", "final")
_SAME = 1e-9  # two closed orbits, each known to 1e-13, are one if their states are this near
_MOST_CELLS = 10**8  # whose ends are held in memory
_MOST_FAILURES = (
    20  # cells of one itinerary under which Newton's method fails, before it is given up
)


class Attractor(NamedTuple):
    """A stable periodic motion: its itinerary, and how much of the sweep leads to it.

    `states` are those at phase 0, shape (period_number, 3), of the closed orbit; `multiplier` is
    the largest modulus of its multipliers; `share` is the fraction of all cells.
    """

    itinerary: str
    period_number: int
    progression: float
    multiplier: float
    residual: float
    states: NDArray[np.float64]
    cells: int
    share: float

    def record(self) -> dict[str, Any]:
        """The attractor in plain values."""
        return {**self._asdict(), "states": self.states.tolist()}


class Basin(NamedTuple):
    """The attractors of a basin, the most frequent first, and the number of each cell's."""

    attractors: tuple[Attractor, ...]
    numbers: NDArray[np.int16]


def run_basin(sweep: Sweep, store: str | os.PathLike[str], **how: Any) -> tuple[Summary, Basin]:
    """Runs a basin and adds `attractor`, the number of each cell's, to the results of its store.

    `how` are the further arguments of `run`, which raises what this raises; besides InvalidInput
    for a sweep over anything but the start, or of more cells than memory is for.
    """
    check_sweep(sweep)
    for axis in sweep.axes:
        for quantity in axis.quantities:
            if quantity not in START:
                raise InvalidInput("axis", quantity, f"one of {', '.join(START)} for a basin")
    if sweep.size > _MOST_CELLS:
        raise InvalidInput("cells", sweep.size, f"at most {_MOST_CELLS} for a basin")
    given = {one.name: getattr(sweep, one.name) for one in fields(Sweep)}
    over = _OverStarts(**given | {"compute": _QUANTITIES})
    return run_sweep(over, store, **how), over.found


@dataclass(frozen=True, eq=False)
class _OverStarts(Sweep):
    """A sweep over starts, and in the end the basin that it has found."""

    kind = "basin"
    found: Basin = field(default=Basin((), np.empty(0, np.int16)), init=False)

    def further(self, store: Path) -> dict[str, Any]:
        """The number of each cell's attractor."""
        with open_results(store) as results:
            found = identify(self.parameters, results)
        object.__setattr__(self, "found", found)
        meaning = f"attractor of the cell, the most frequent first; {NONE} for none"
        records = [attractor.record() for attractor in found.attractors]
        return {ATTRACTOR: Added(found.numbers, {"long_name": meaning, "attractors": records})}


def identify(parameters: SceneParameters, results: xr.Dataset) -> Basin:
    """The attractors of a basin: orbits closed by Newton's method from the ends of runs.

    Of all ends of one itinerary and period number, that farthest from the orbits known so far is
    closed next. If it leads to the orbit nearest to it, so do the ends that are nearer to that
    orbit still; otherwise its orbit is a new one, and is asked the same. Two orbits are one if
    their states at phase 0 are, to 1e-9. Cells without a periodic motion, or from whose end no
    orbit of their itinerary closes, have the number NONE.
    """
    itinerary, period_number = (
        results["itinerary"].values.ravel(),
        results["period_number"].values.ravel(),
    )
    ends = results["final"].values.reshape(-1, 3)
    found = _Found(parameters)
    number = np.full(itinerary.shape, NONE, np.int16)
    for code, times in np.unique(
        np.stack([itinerary, period_number])[:, period_number > 0], axis=1
    ).T.tolist():
        left = np.flatnonzero((itinerary == code) & (period_number == times))
        own: list[int] = []  # orbits of this itinerary
        failures = 0
        while left.size and failures < _MOST_FAILURES:
            apart = np.array([found.distance(i, ends[left]) for i in own] or [np.zeros(left.size)])
            nearest = apart.argmin(axis=0)
            far = int(apart.min(axis=0).argmax())
            cell = int(left[far])
            try:
                place = found.index(tuple(ends[cell].tolist()), times, code)
            except NotSolved:
                failures, left = failures + 1, np.delete(left, far)
                continue
            number[cell] = place
            if own and own[nearest[far]] == place:
                number[left[nearest == nearest[far]]] = place
                left = left[nearest != nearest[far]]
            else:
                own += [] if place in own else [place]
                left = np.delete(left, far)
    counts = np.bincount(number[number >= 0], minlength=len(found.orbits))
    order = np.argsort(-counts, kind="stable")
    rank = np.append(np.argsort(order), NONE)  # NONE counts from the end, and stays what it is
    chosen = [(*found.orbits[i], int(counts[i])) for i in order.tolist()]
    table = tuple(_attractor(orbit, states, n, number.size) for orbit, states, n in chosen)
    return Basin(table, rank[number].astype(np.int16).reshape(results["outcome"].shape))


class _Found:
    """The orbits found so far, each with its states at phase 0, shape (period_number, 3)."""

    def __init__(self, parameters: SceneParameters) -> None:
        self.parameters = parameters
        self.orbits: list[tuple[Orbit, NDArray[np.float64]]] = []

    def distance(self, place: int, ends: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance of each end, shape (n, 3), from the nearest of an orbit's states."""
        apart = np.full(len(ends), np.inf)
        for state in self.orbits[place][1]:
            np.minimum(apart, np.abs(ends - state).max(axis=1), out=apart)
        return apart

    def index(self, end: tuple[float, float, float], period_number: int, itinerary: int) -> int:
        """The place of the orbit that Newton's method finds; raises NotSolved for none."""
        orbit = orbit_at_end(self.parameters, end, period_number, itinerary)
        states = _stroboscopic(orbit)
        for i, (_, known) in enumerate(self.orbits):
            if known.shape == states.shape and self.distance(i, states).max() <= _SAME:
                return i
        self.orbits.append((orbit, states))
        return len(self.orbits) - 1


def _stroboscopic(orbit: Orbit) -> NDArray[np.float64]:
    """States of an orbit at phase 0, shape (period_number, 3)."""
    trajectory = orbit.trajectory()
    period, (first, end) = orbit.parameters.period, trajectory.span
    times = np.arange(orbit.itinerary.period_number) * period + (period if first > 0 else 0.0)
    return trajectory(np.clip(times, first, end))


def _attractor(orbit: Orbit, states: NDArray[np.float64], cells: int, total: int) -> Attractor:
    return Attractor(
        itinerary=itineraries.text(orbit.itinerary.fields, orbit.parameters.scene),
        period_number=orbit.itinerary.period_number,
        progression=shown_progression(orbit.motion),
        multiplier=float(abs(floquet_multipliers(orbit)[0])),
        residual=float(orbit.residual),
        states=states,
        cells=cells,
        share=cells / total,
    )
