"""Result of a comparison of switches: differences with their causes, and sizes of errors."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.result import brief, plain, record

if TYPE_CHECKING:
    from pandas import DataFrame


@dataclass(frozen=True)
class Entered:
    """A switch: its time, dimensionless, and the field entered."""

    time: float
    event: str


class Cause(StrEnum):
    """Reason why an integrator misses or invents a switch."""

    #: Its errors, as large as they were before, suffice: a smaller tolerance is needed.
    TOLERANCE = "tolerance"
    #: Its errors are far above its tolerance: it does not locate switches within a step, or has
    #: other parameters, units, equations or start.
    SETUP = "set-up"
    #: Its errors are too small to explain it: the event search passed over it.
    SEARCH = "search"
    #: An earlier difference changed the motion.
    EARLIER = "earlier difference"
    #: There is no switch before from which its errors could be known.
    UNKNOWN = "unknown"


@dataclass(frozen=True)
class Difference:
    """Switches in a row that one of two lists does not have."""

    missed: tuple[Entered, ...]
    invented: tuple[Entered, ...]
    cause: Cause
    gap: float | None
    """Least time between missed switches and their neighbours, which the search has to resolve."""
    needed: float | None
    """Error of a segment's state below which the missed switches are there."""

    @property
    def time(self) -> float:
        """Time of the first switch that is missed or invented."""
        return min(event.time for event in (*self.missed, *self.invented))


@dataclass(frozen=True, eq=False)
class SwitchCheck:
    """Switches of an integrator beside the exact ones; all dimensionless."""

    switches: DataFrame
    """Table of the switches up to the horizon, a row for each, in the order of time.

    `event`, times `exact`, by 50 digits, and `given`, nan where one has no such switch, and
    `growth`: largest shift of the exact one by errors of size 1, one a segment.
    """
    segment_error: float | None
    """Error that some segment's state has at least, by the switches before the first difference.

    None where there is no such switch.
    """
    horizon: float
    """Time up to which switches are compared; infinite if up to the end of the motion."""
    differences: tuple[Difference, ...]
    used: float | None
    """Tolerance that the integrator had, if it is known."""
    message: str
    """Verdict as a sentence."""

    @property
    def success(self) -> bool:
        """True if no switch up to the horizon is missing or invented."""
        return not self.differences

    @property
    def needed(self) -> float | None:
        """Error of a segment's state below which no switch is missed; None if it is not known."""
        return min((one.needed for one in self.differences if one.needed), default=None)

    @property
    def errors(self) -> NDArray[np.float64]:
        """Given time less exact time of each row, nan where one is missing; shape (rows,)."""
        return np.asarray(self.switches["given"] - self.switches["exact"])

    @property
    def tolerance(self) -> float | None:
        """Tolerance with which no switch would be missed; None if the one used is small enough.

        Also None if the one used or the one needed is unknown, or the set-up is wrong. The error of
        a segment is assumed to be proportional to the tolerance, and at least equal.
        """
        if not self.used or not self.needed or self.differences[0].cause is Cause.SETUP:
            return None
        found = self.needed / max((self.segment_error or 0.0) / self.used, 1.0)
        return found if found <= self.used else None

    def to_dict(self) -> dict[str, Any]:
        """Comparison by name, as JSON has it; `switches` has a row for each, with its `error`.

        None stands for a number that is unknown or not finite.
        """
        return {
            "success": self.success,
            **record(self, "message segment_error needed tolerance horizon differences"),
            "switches": plain(self.switches.assign(error=self.errors).to_dict("records")),
        }

    def __repr__(self) -> str:
        return brief(self, self.message)
