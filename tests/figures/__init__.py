"""Tests of the figures by what they draw; what curves should be comes from the DOP853 judge."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from capsule_sym import Parameters, PhysicalParameters
from capsule_sym._figures.catalogue import Study
from tests.judges.dop853 import derivative

SAFE = ("#0072B2", "#D55E00", "#CC79A7", "#009E73", "#000000", "#E69F00")
PAPER = ("blue", "red", "magenta", "green", "black", "orange")

DEVICE = PhysicalParameters(
    M_m=0.02, M_c=0.05, k1=40.0, k2=60.0, c=0.05, G=0.0004, P_d=0.12, Omega=36.0, mu=0.2
)
SYSTEMS = {
    "case study": {"system": Parameters()},
    "another": {
        "system": Parameters(alpha=0.9, delta=1.3, zeta=0.2, beta=4.0, gamma=5.0, f_b=1.2),
        "chosen": True,
    },
    "device": {"system": DEVICE.dimensionless(), "chosen": True, "device": DEVICE},
}


_OF_ANOTHER = ("fig2", "fig3", "fig4", "fig5", "motion", "margins")


def studies(names: Iterable[str], quick: Collection[tuple[str, float]]) -> list[Any]:
    """Figures by name, each in a column and over a page, of three systems."""
    return [
        pytest.param(
            *(name, width, of),
            marks=[] if (name, width) in quick and of == "case study" else [pytest.mark.long],
        )
        for name in names
        for width in (3.35, 7.0)
        for of in SYSTEMS
        if of != "another" or name in _OF_ANOTHER
    ]


def untracked(items: Iterable[Any], text: str, total: int | None) -> Iterable[Any]:
    return items


def study(width: float, of: str) -> Study:
    return Study(untracked, width=width, **SYSTEMS[of])


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
