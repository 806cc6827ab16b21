"""Tests of the figures by what they draw; what curves should be comes from the DOP853 judge."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from capsule_sym import Parameters, PhysicalParameters
from tests.judges.dop853 import derivative

SAFE = ("#0072B2", "#D55E00", "#CC79A7", "#009E73", "#000000", "#E69F00")

DEVICE = PhysicalParameters(
    M_m=0.02, M_c=0.05, k1=40.0, k2=60.0, c=0.05, G=0.0004, P_d=0.12, Omega=36.0, mu=0.2
)


def untracked(items: Iterable[Any], text: str, total: int | None) -> Iterable[Any]:
    return items


def integrated(
    parameters: Parameters, field: int, times: NDArray[np.float64], state: Sequence[float]
) -> NDArray[np.float64]:
    """States (x_r, v_r, v_c, x_c) at times, shape (4, n), from the one at the first of them."""
    solution = solve_ivp(
        partial(derivative, parameters, field),
        (times[0], times[-1]),
        state,
        method="DOP853",
        t_eval=times,
        rtol=1e-11,
        atol=1e-12,
    )
    return np.asarray(solution.y)
