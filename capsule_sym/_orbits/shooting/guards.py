"""Gradients of guards and forces, from those of the model's formulas."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from numpy.typing import NDArray

from capsule_sym._map.expansion import Guard

_STATE = 3


def chained(
    gradient: Sequence[Any], by: NDArray[Any], angle_by: NDArray[Any] | None = None
) -> NDArray[Any]:
    """Gradient (n, ...) of a function of state and parameters; `by` (3, n, ...) are the state's.

    `gradient` is that by state, phase and parameters, as formulas give it; the last of the n are by
    the parameters. A function that depends on the phase needs that of the angle, (n, ...).
    """
    rows = by[:_STATE] if angle_by is None else [*by[:_STATE], angle_by]
    by_state = gradient[: len(rows)]
    terms = [slope * row for slope, row in zip(by_state, rows, strict=True) if _varies(slope)]
    found: NDArray[Any] = sum(terms) if terms else 0 * by[0]
    by_parameters = gradient[_STATE + 1 :]
    for column, slope in enumerate(by_parameters, -len(by_parameters)):
        if _varies(slope):
            found[column] += slope
    return found


def _varies(slope: Any) -> bool:
    """Whether a derivative is other than the 0 that formulas write where there is none."""
    return type(slope) is not int or slope != 0


def guard_by(
    c: Any,
    guard: Guard,
    gap: Any,
    v_r: Any,
    by: NDArray[Any],
    turned: Sequence[Any] = (None, None),
    angle_by: NDArray[Any] | None = None,
) -> NDArray[Any]:
    """Gradient (n,) of a guard, positive in the cell of the segment with constants `c`.

    `by` (3, n) are the derivatives of the state there; the last columns are by the parameters. Of a
    drive that reacts the forcing angle counts: its cosine and sine, `turned`, and its derivatives.
    The other stop of two, `BACK`, has the constants of contact with it, and the sign of these.
    """
    if guard in (Guard.GAP, Guard.BACK):
        sign, row = 1 if c.contact else -1, c.gap_gradient()
    elif guard is Guard.DRIFT:
        sign, row = int(c.drift), c.speed_gradient()
    else:
        way = 1 if guard is Guard.UPPER else -1
        sign, row = -way, c.limit_gradient(way, gap, v_r, *turned)
    return sign * chained(row, by, angle_by)
