"""Motions at and beside resonance, with little or no damping, in units of their conditioning."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
from numpy.typing import NDArray

from capsule_sym import Parameters, simulate, simulate_many
from tests.sampling import sampled, some

Values = NDArray[np.float64]
UNIT = 2.0**-53
MOST = 16.0
"""Units of the conditioning: those of each parameter's and the start's own rounding."""
SMALL = [10.0**-k for k in range(1, 17)]
KINDS = {
    "rest": (Parameters(0.05, delta=1e9, f_b=1e9), 1.0, (0.0, 0.0, 0.0)),
    "displaced": (Parameters(0.05, delta=1e9, f_b=1e9), 1.0, (0.3, -0.2, 0.0)),
    "slip": (Parameters(0.05, delta=1e9, gamma=1 / 3, f_b=1e-3), 4.0, (0.1, 0.0, 9.0)),
    "contact": (Parameters(0.05, delta=0.0, beta=3.0, f_b=1e9), 4.0, (0.2, 0.1, 0.0)),
}
"""Parameters, squared frequency of the flow that is driven near its resonance, and a start."""


def final(row: Values, periods: int, lanes: int) -> Values:
    if lanes:
        many = simulate_many(np.tile(row[:7], (lanes, 1)), row[7:], periods=periods)
        assert len({state.tobytes() for state in many.states}) == 1
        return many.states[0]
    return np.array(simulate(Parameters(*row[:7]), tuple(row[7:]), periods=periods).final[1])


def units(row: Values, periods: int) -> list[float]:
    """Errors of the final state, alone and in lanes, in units of the conditioning.

    A unit is what a rounding of each number given changes.
    """
    p, start = Parameters(*row[:7].tolist()), tuple(row[7:].tolist())
    exact = simulate(p, start, periods=periods, backend="mpmath").final[1]
    there = np.array(exact, dtype=float)
    allowed, share = abs(there), 2.0**-24
    for i in np.flatnonzero(row):
        moved = row * np.where(np.arange(row.size) == i, 1 + share, 1.0)
        allowed = allowed + abs(final(moved, periods, 0) - there) / share
    unit = UNIT * float(allowed.max())
    return [
        max(abs(float(a - b)) for a, b in zip(final(row, periods, n).tolist(), exact, strict=True))
        / unit
        for n in (0, 9)
    ]


CASES = [
    (kind, side * detuning, damping, periods)
    for kind, detuning, (side, periods), damping in product(
        KINDS, SMALL, ((1, 1), (-1, 4), (1, 300)), (0.0, *SMALL)
    )
    if periods < 300 or kind in ("rest", "displaced")  # others have hundreds of segments
][::11]


@sampled
def test_no_digits_are_lost_near_resonance() -> None:
    for kind, detuning, damping, periods in some(CASES, 9):
        p, K, start = KINDS[kind]
        p = p.replace(omega=math.sqrt(K) * (1 + detuning), zeta=damping)
        row = np.array([*p.to_dict().values(), *start])
        assert max(units(row, periods)) < MOST, (p, start, periods)
