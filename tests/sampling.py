"""A part of many cases for the quick tests, and all of them for `make test-long`.

A test that tries only a part is marked `sampled`, so that the long ones run it again, whole.
"""

import os
from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
import pytest

_Case = TypeVar("_Case")

ALL = os.environ.get("CAPSULE_SYM_ALL") == "1"

sampled = pytest.mark.sampled


def many(count: int, quick: int) -> int:
    """Number of cases to try: a part of the count in quick tests."""
    return count if ALL else min(count, quick)


def some(cases: Iterable[_Case], quick: int) -> list[_Case]:
    """Cases spread evenly, so many of them in the quick tests."""
    held = list(cases)
    count = many(len(held), quick)
    return [held[i * len(held) // count] for i in range(count)]


def flows(kernels: Any, c: Any, start: Any, end: float, count: int) -> Any:
    """x_r - x_r(0), v_r and v_c - v_c(0) at equal steps up to `end`, shape (3, count + 1).

    The flow of one step is affine in the state and the angle's cosine and sine: its powers give all
    steps. v_c is right for drives that act on one body.
    """
    step, zero = end / count, np.zeros(5)

    def moved(change: Any) -> Any:
        x, v, w, cosine, sine = np.array([start.x_r, start.v_r, 0, 0, 0]) + change
        margin = start.margin + (1 + c.kappa) * change[0] + 2 * c.zeta * change[1]
        gap = start.gap + change[0]
        dx, v, *dw = kernels.flow(c, kernels.Start(x, gap, v, w, margin, cosine, sine), step)
        return np.array([change[0] + dx, v - start.v_r, w + (dw[0] if dw else 0.0)])

    one, angle = np.eye(6), getattr(c, "omega", 0.0) * step
    one[:3, 5] = moved(zero)
    one[:3, :5] = np.transpose([moved(e) - one[:3, 5] for e in np.eye(5)])
    one[3:5, 3:5] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    rows: Any = np.array([[0, 0, 0, start.cos_theta, start.sin_theta, 1]])
    while len(rows) <= count:
        rows, one = np.concatenate([rows, rows @ one.T]), one @ one
    return (rows[: count + 1, :3] + np.array([0, start.v_r, 0])).T
