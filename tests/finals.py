"""Rows of parameters for runs side by side, and where they come to."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym import Parameters, results, simulate_many
from capsule_sym.generated.capsule.facts import PARAMETERS


def parameter_rows(base: Parameters, **columns: ArrayLike) -> NDArray[np.float64]:
    """Rows of parameters, shape (n, 7): the base with some of them replaced by arrays (n,)."""
    values = np.broadcast_arrays(*columns.values())
    rows = np.tile([*base.to_dict().values()], (max((v.size for v in values), default=1), 1))
    for name, column in zip(columns, values, strict=True):
        rows[:, PARAMETERS.index(name)] = column
    return rows


def final_states(rows: NDArray[np.float64], *start: Any, **more: Any) -> results.Trajectories:
    """The runs of rows of parameters, of which only the ends are kept."""
    return simulate_many(rows, *start, keep="final", **more)
