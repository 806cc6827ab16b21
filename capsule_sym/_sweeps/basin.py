"""Basins of attraction: which closed orbit each cell of a sweep over starts has come to."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._attractors.attractors import Attractor, closed_orbit, listed, ranked
from capsule_sym._attractors.neighbourhoods import NONE
from capsule_sym._attractors.settling import Settling
from capsule_sym._errors import InvalidInput
from capsule_sym._parameters import SceneParameters
from capsule_sym._sweeps.axes import START
from capsule_sym._sweeps.execution import Summary, run_sweep
from capsule_sym._sweeps.layout import Added
from capsule_sym._sweeps.quantities import ATTRACTOR
from capsule_sym._sweeps.results import open_results
from capsule_sym._sweeps.sweep import Sweep, check_sweep

if TYPE_CHECKING:
    import xarray as xr

_QUANTITIES = ("itinerary", "progression", "final")
_MOST_CELLS = 10**8  # whose ends are held in memory


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
        records = [attractor.to_dict() for attractor in found.attractors]
        return {ATTRACTOR: Added(found.numbers, {"long_name": meaning, "attractors": records})}


def identify(parameters: SceneParameters, results: xr.Dataset) -> Basin:
    """The attractors of a basin, of which orbits close from the ends of runs.

    Cells without a periodic motion, or from whose end no stable orbit closes, have the number NONE.
    """
    periods = results["period_number"].values.ravel()
    ends = results["final"].values.reshape(-1, 3)
    row = np.array([[*parameters.to_dict().values()]])
    settling = Settling(row, parameters.scene)
    found = settling.identify(np.zeros(len(ends), np.intp), ends, periods)
    orbits = [closed_orbit(parameters, cycle) for cycle in settling.cycles[0]]
    numbers, order = ranked(found, [orbit is not None for orbit in orbits])
    chosen = [orbit for i in order if (orbit := orbits[i]) is not None]
    counts = np.bincount(numbers[numbers >= 0], minlength=len(chosen))
    table = listed(chosen, counts, numbers.size)
    return Basin(table, numbers.reshape(results["outcome"].shape))
