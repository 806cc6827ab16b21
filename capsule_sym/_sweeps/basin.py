"""Basins of attraction: the attractor that each cell of a sweep over starts reaches."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arguments import checked
from capsule_sym._attractors.attractor import Attractor, closed_orbit, collected
from capsule_sym._attractors.destinations import KnownOrbits
from capsule_sym._attractors.neighbourhoods import NONE
from capsule_sym._errors import InvalidInput
from capsule_sym._parameters import SceneParameters
from capsule_sym._sweeps.axes import START
from capsule_sym._sweeps.execution import Summary, run_sweep
from capsule_sym._sweeps.layout import Added
from capsule_sym._sweeps.quantities import ATTRACTOR
from capsule_sym._sweeps.results import open_results
from capsule_sym._sweeps.sweep import Sweep

if TYPE_CHECKING:
    import xarray as xr

_QUANTITIES = ("itinerary", "progression", "final")
_MOST_CELLS = 10**8  # their final states are held in memory


class Basins(NamedTuple):
    """Attractors of a basin, the most frequent first, and the number of each cell's; -1 is none."""

    attractors: tuple[Attractor, ...]
    numbers: NDArray[np.int16]


def run_basin(sweep: Sweep, store: str | os.PathLike[str], **how: Any) -> tuple[Summary, Basins]:
    """Run of a basin, with the attractor number of each cell.

    At the end of the run the variable `attractor` is added to the results of the store. Attractors
    are stable orbits that Newton's method finds from the ends of the runs. A cell has the number -1
    if its motion is not periodic, or if no stable orbit is found from its final state. The cells
    compute their itinerary, progression and final state, and nothing else, whatever the sweep's
    `compute` has. The extra `sweep` is needed.

    Parameters
    ----------
    sweep : Sweep
        Sweep whose axes are coordinates of the start: x_r, v_r, v_c or phase. It has at most 10^8
        cells.
    store : str or path
        Directory that receives the results.
    **how : optional
        Further arguments of `run_sweep`, such as `workers`, `resume` and `max_seconds`.

    Returns
    -------
    Summary
        Summary of the run, as from `run_sweep`.
    Basins
        Named tuple: `attractors`, the most frequent first, and `numbers`, the attractor number of
        each cell, in the shape of the sweep. Both are empty if the run did not finish.

    Raises
    ------
    InvalidInput
        For an axis that is not of the start, for more than 10^8 cells, and as `run_sweep`.
    CapsuleError, KeyboardInterrupt
        As `run_sweep` raises them.

    See Also
    --------
    plot_basin : figure of the results.
    attractors : attractors without a grid of starts.

    Examples
    --------
    >>> import tempfile
    >>> import capsule_sym as cs
    >>> from capsule_sym.inputs import Axis, Sweep
    >>> axes = Axis.linear("x_r", -2.0, 2.0, 6), Axis.linear("v_r", -2.0, 2.0, 4)
    >>> system = cs.Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     summary, basin = cs.run_basin(Sweep(axes, system), f"{folder}/basin")
    >>> print([(one.count, round(one.progression, 4)) for one in basin.attractors])
    [(16, 4.2081), (8, -0.3257)]
    >>> print(basin.numbers[0])
    [0 0 1 1]
    """
    for axis in sweep.axes:
        for quantity in axis.quantities:
            if quantity not in START:
                raise InvalidInput("axis", quantity, f"one of {', '.join(START)} for a basin")
    if sweep.size > _MOST_CELLS:
        raise InvalidInput("cells", sweep.size, f"at most {_MOST_CELLS} for a basin")
    given = {one.name: getattr(sweep, one.name) for one in fields(Sweep)}
    over = _OverStarts(**given | {"compute": _QUANTITIES})
    return checked(run_sweep)(over, store, **how), over.found


@dataclass(frozen=True, eq=False)
class _OverStarts(Sweep):
    """Sweep over starts; `found` is its basin after the run."""

    kind = "basin"
    found: Basins = field(default=Basins((), np.empty(0, np.int16)), init=False)

    def further(self, store: Path) -> dict[str, Any]:
        """Attractor number of each cell, as the result "attractor"; sets `found`."""
        with open_results(store) as results:
            found = identify(self.parameters, results)
        object.__setattr__(self, "found", found)
        meaning = f"attractor of the cell, the most frequent first; {NONE} for none"
        records = [attractor.to_dict() for attractor in found.attractors]
        return {ATTRACTOR: Added(found.numbers, {"long_name": meaning, "attractors": records})}


def identify(parameters: SceneParameters, results: xr.Dataset) -> Basins:
    """Attractors of a basin: stable orbits that Newton's method finds from the ends of runs.

    The number is NONE for a cell without a periodic motion, or if no stable orbit is found from its
    final state.
    """
    periods = results["period_number"].values.ravel()
    ends = results["final"].values.reshape(-1, 3)
    row = np.array([[*parameters.to_dict().values()]])
    known, settled = KnownOrbits(row, parameters.scene), np.ones(len(ends), bool)
    found = known.identify(np.zeros(len(ends), np.intp), ends, periods, settled)
    orbits = [closed_orbit(parameters, cycle) for cycle in known.cycles[0]]
    table, numbers = collected(found, orbits)
    return Basins(table, numbers.reshape(results["outcome"].shape))
