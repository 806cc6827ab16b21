"""Quantities of a cell, and their types, dimensions and meanings in a store."""

from __future__ import annotations

from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple


class CellOutcome(IntEnum):
    """Outcome of the run of a cell."""

    #: Not computed yet.
    PENDING = 0
    #: The motion is periodic, or approaches a stable periodic orbit.
    CONVERGED = 1
    #: The motion is periodic; doubles did not decide some switch or field, and more digits were
    #: tried.
    ESCALATED = 2
    #: The motion has not settled within the sweep's periods: chaos, a period number above 16, or a
    #: slow approach from afar.
    NOT_SETTLED = 3
    #: It is proved that no further switch occurs.
    NEVER_SWITCHES = 4
    #: The requested quantities could not be computed; the chunk's record holds the reason.
    FAILED = 5


class Variable(NamedTuple):
    """A result of each cell, dimensionless: type, meaning, and its own dimension if it has one."""

    dtype: str
    meaning: str
    dimension: tuple[str, int] | None = None


OUTCOME = {"outcome": Variable("i1", "outcome of the run of the cell")}
VARIABLES = {
    "itinerary": {
        "itinerary": Variable("i8", "fields of one period of the motion, as a 48-bit code"),
        "period_number": Variable("i2", "excitation periods of the motion, 0 if none"),
    },
    "progression": {"progression": Variable("f8", "advance of x_c per excitation period")},
    "final": {
        "final": Variable(
            "f8",
            "x_r, v_r and v_c at the end of the run, or on the orbit that it approaches",
            ("component", 3),
        ),
    },
    "multipliers": {
        "multipliers": Variable(
            "c16", "multipliers of the closed orbit, largest first", ("multiplier", 3)
        ),
    },
    "energies": {
        "velocity": Variable("f8", "average velocity of the capsule"),
        "work": Variable("f8", "work of the drive per excitation period"),
        "damper_loss": Variable("f8", "energy lost in the damper per excitation period"),
        "friction_loss": Variable("f8", "energy lost by friction per excitation period"),
    },
    "forces": {
        "peak_force": Variable("f8", "largest force between the bodies"),
        "peak_contact": Variable("f8", "largest force of the second spring"),
    },
    "lyapunov": {"lyapunov": Variable("f8", "largest Lyapunov exponent, per unit of time")},
}
QUANTITIES = tuple(VARIABLES)
"""Quantities of a cell. An itinerary comes with its period number, energies with the average
velocity. Multipliers, energies and forces are those of the orbit solved by Newton's method."""
OF_ORBIT = frozenset(("multipliers", "energies", "forces", "lyapunov"))
"""Quantities of that orbit; `lyapunov` without a periodic motion is that of a further run."""

ATTRACTOR = "attractor"
"""Name of the further result of a basin."""


def variables(compute: Iterable[str] = QUANTITIES) -> dict[str, Variable]:
    """Results of each cell by name, for these quantities."""
    asked = {name: v for quantity in compute for name, v in VARIABLES[quantity].items()}
    return {**OUTCOME, **asked}


_OWN = [v.dimension[0] for v in variables().values() if v.dimension]
TAKEN = frozenset([*variables(), *_OWN, ATTRACTOR])
"""Names of results and of their own dimensions, which no axis can have."""
