"""Independent judges of the exact map: integrators based on the equations of motion only.

Each judge integrates Eqs. (7)-(12) numerically and shares no formula with the package. They
share with each other the numbering of the six fields, the switching rule of Sections 2 and 3 in
double precision, and the form of a result.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from capsule_sym import Parameters

CONTACT = {1: False, 2: False, 3: False, 4: True, 5: True, 6: True}
"""True if the second spring acts, by field index."""

DRIFT = {1: +1, 2: 0, 3: -1, 4: +1, 5: 0, 6: -1}
"""Direction of drift by field index: +1 forward, 0 stick, -1 backward."""

FIELD_OF = {(CONTACT[field], DRIFT[field]): field for field in DRIFT}
"""Field index by (contact, drift)."""


@dataclass(frozen=True)
class Segment:
    """One segment of a run: field index, start and end time, and the state at the end.

    Times are absolute and dimensionless; the state is (x_r, v_r, v_c, x_c). The numbers are of
    the judge's own kind (float, numpy.longdouble or mpmath.mpf).
    """

    field: int
    start: Any
    end: Any
    state: tuple[Any, ...]


@dataclass(frozen=True)
class Run:
    """Trajectory by a judge: its segments and the state (x_r, v_r, v_c, x_c) at its end."""

    segments: tuple[Segment, ...]

    @property
    def fields(self) -> str:
        """Field indices of the segments in order, such as `"252"`."""
        return "".join(str(segment.field) for segment in self.segments)

    @property
    def final(self) -> tuple[Any, ...]:
        """State (x_r, v_r, v_c, x_c) at the end of the last segment."""
        return self.segments[-1].state


def first_field(parameters: Parameters, state: Sequence[Any]) -> int:
    """Field that holds at the state (x_r, v_r, v_c), from the regions of Eqs. (7)-(12)."""
    x_r, v_r, v_c = state
    contact = bool(x_r >= parameters.delta)
    drift = _drift_at_rest(parameters, contact, x_r, v_r) if v_c == 0 else (1 if v_c > 0 else -1)
    return FIELD_OF[contact, drift]


def next_field(parameters: Parameters, field: int, guard: int, state: Sequence[Any]) -> int:
    """Field that follows `field` when one of its guards reaches zero at the state (x_r, v_r, ...).

    Guard 0 is x_r = delta. In drift guard 1 is v_c = 0; in stick guards 1 and 2 are the upper and
    the lower friction bound, P = f_b and P = -f_b.
    """
    contact, drift = CONTACT[field], DRIFT[field]
    if guard == 0:
        contact = not contact
    elif drift:
        drift = _drift_at_rest(parameters, contact, state[0], state[1])
    else:
        drift = 1 if guard == 1 else -1
    return FIELD_OF[contact, drift]


def _drift_at_rest(parameters: Parameters, contact: bool, x_r: Any, v_r: Any) -> int:
    """Direction in which a capsule with v_c = 0 moves on, by P3 or P4 against f_b: +1, 0, -1."""
    push = x_r + 2 * parameters.zeta * v_r
    if contact:
        push += parameters.beta * (x_r - parameters.delta)
    if abs(push) <= parameters.f_b:
        return 0
    return 1 if push > 0 else -1
