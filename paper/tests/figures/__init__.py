from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest

from capsule_sym import Parameters
from paper.study.motions import Study
from tests.figures import DEVICE, untracked

SYSTEMS = {
    "case study": {"system": Parameters()},
    "another": {
        "system": Parameters(alpha=0.9, delta=1.3, zeta=0.2, beta=4.0, gamma=5.0, f_b=1.2),
        "chosen": True,
    },
    "device": {"system": DEVICE.dimensionless(), "chosen": True, "device": DEVICE},
}


_OF_ANOTHER = ("fig2", "fig3", "fig4", "fig5", "motion")


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


def study(width: float, of: str) -> Study:
    return Study(untracked, width=width, **SYSTEMS[of])
