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
    """Gradient (n, ...) of a function of state and parameters; `by` (3, n, ...) is the state's.

    `gradient` has the derivatives by state, phase and parameters, as formulas give them; the last
    of the n are by the parameters. A function of the phase needs the gradient of the angle, (n,
    ...).
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
    """True unless a derivative is the integer 0 that formulas write for none."""
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
    """Gradient (n,) of a guard that is positive in the cell of the segment with constants `c`.

    `by` (3, n) are the derivatives of the state there; the last columns are by the parameters. If
    the drive reacts, cosine and sine of the forcing angle, `turned`, and its derivatives are
    needed. The other stop of two, `BACK`, needs the constants of contact with it, and has their
    sign.
    """
    if guard in (Guard.GAP, Guard.BACK):
        sign, row = 1 if c.contact else -1, c.gap_gradient()
    elif guard is Guard.DRIFT:
        sign, row = int(c.drift), c.speed_gradient()
    else:
        way = 1 if guard is Guard.UPPER else -1
        sign, row = -way, c.limit_gradient(way, gap, v_r, *turned)
    return sign * chained(row, by, angle_by)
