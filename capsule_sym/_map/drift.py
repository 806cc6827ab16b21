"""Whether a steady motion drifts, or only seems to by its rounding."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

UNIT = 2.0**-53
"""Of rounding in double precision."""
_ROUNDED = 8.0  # such units by which the advance of one segment may be off, of its largest term


def drifts(
    parameters: ArrayLike,
    contact: ArrayLike,
    progression: ArrayLike,
    way: ArrayLike,
    segments: ArrayLike,
    unit: float = UNIT,
) -> NDArray[np.bool_]:
    """Whether n steady motions drift, of parameters (n, 7), or one of parameters (7,).

    Each (n,), or one: `contact` is whether it comes into contact; `progression` is its advance and
    `way` the length of the capsule's way, both per excitation period; `segments` is their number.

    Without contact, or on a stop of no stiffness, all forces are monotone and two motions never
    move apart. With damping, zeta > 0, two periodic ones then have the same v_r, since the damper
    would bring them together else, and drift alike. The mirror image of a motion, half a period
    later, is a motion too and drifts the other way: so none drifts. Without damping their
    difference may also be a free oscillation for ever. There, and in contact, a drift counts that
    is above its rounding: the advance of a segment is a sum of terms of the size of the capsule's
    way, and of f_b h^2 and alpha/omega^2 over 1 + gamma.
    """
    alpha, omega, _, zeta, beta, gamma, f_b = np.asarray(parameters, dtype=float).T
    terms = way + (f_b * (math.tau / omega) ** 2 + alpha / omega**2) / (1 + gamma)
    above: Any = np.abs(progression) > _ROUNDED * unit * np.asarray(segments) * terms
    free = (zeta > 0) & (~np.asarray(contact, dtype=bool) | (beta == 0))
    found: NDArray[np.bool_] = above & ~free
    return found
