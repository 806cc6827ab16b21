"""Gradients of the guards that end a segment, from the model's formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.expansion import Guard
from capsule_sym.generated import facts, formulas

_STATE, _PARAMETERS = len(facts.STATE), len(facts.PARAMETERS)


def guard_by(c: Any, guard: Guard, gap: Any, v_r: Any, by: NDArray[Any]) -> NDArray[Any]:
    """Gradient (n,) of a guard, positive in the cell of the segment with constants `c`.

    `by` (3, n) are the derivatives of the state there; the last columns are by the parameters.
    """
    if guard is Guard.GAP:
        sign, row = 1 if c.contact else -1, formulas.gap_gradient(c)
    elif guard is Guard.DRIFT:
        sign, row = int(c.drift), formulas.speed_gradient(c)
    else:
        way = 1 if guard is Guard.UPPER else -1
        sign, row = -way, formulas.limit_gradient(c, way, gap, v_r)
    gradient = np.array(row)
    found: NDArray[Any] = gradient[:_STATE] @ by[:_STATE]
    found[-_PARAMETERS:] += gradient[-_PARAMETERS:]
    return sign * found
