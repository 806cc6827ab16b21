"""Result of a comparison of switches: differences with their causes, and sizes of errors."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._check.matching import Pair
from capsule_sym._map.result import brief


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

    exact: tuple[Entered, ...]
    """The exact switches, by 50 digits, up to where a double can follow the motion."""
    given: tuple[Entered, ...]
    """The switches given up to there."""
    pairs: tuple[Pair, ...]
    """Places in both lists, in the order of time; None where a list has no such switch."""
    errors: NDArray[np.float64]
    """Given time less exact time of each pair, nan where one is missing; shape (pairs,)."""
    growth: NDArray[np.float64]
    """Largest shift of each exact switch by errors of size 1, one a segment; shape (exact,)."""
    segment_error: float | None
    """Error that some segment's state has at least, by the switches before the first difference.

    None where there is no such switch.
    """
    horizon: float
    """Time up to which switches are compared; infinite if a double can follow the whole motion."""
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
    def latest(self) -> tuple[float, Entered, float] | None:
        """Largest error of a time before the first difference, its exact switch, and the growth."""
        first = next((k for k, one in enumerate(self.pairs) if None in one), len(self.pairs))
        if not first:
            return None
        k = int(np.argmax(np.abs(self.errors[:first])))
        place = self.pairs[k].true or 0
        return float(self.errors[k]), self.exact[place], float(self.growth[place])

    @property
    def tolerance(self) -> float | None:
        """Tolerance with which no switch would be missed; None if the one used is small enough.

        The error of a segment is assumed to be proportional to the tolerance, and at least equal.
        """
        if not self.used or not self.needed or self.differences[0].cause is Cause.SETUP:
            return None
        found = self.needed / max((self.segment_error or 0.0) / self.used, 1.0)
        return found if found <= self.used else None

    def record(self) -> dict[str, Any]:
        """The comparison as a plain record."""
        switches = []
        for (a, b), error in zip(self.pairs, self.errors.tolist(), strict=True):
            true = None if a is None else self.exact[a]
            given = None if b is None else self.given[b]
            switches.append(
                {
                    "event": getattr(true or given, "event", None),
                    "exact": true and true.time,
                    "given": given and given.time,
                    "error": error if true and given else None,
                    "growth": None if a is None else float(self.growth[a]),
                }
            )
        names = ("message", "segment_error", "needed", "tolerance")
        return {
            "right": self.success,
            **{name: getattr(self, name) for name in names},
            "horizon": None if self.horizon == math.inf else self.horizon,
            "differences": [asdict(one) for one in self.differences],
            "switches": switches,
        }

    def __repr__(self) -> str:
        return brief(self, self.message)
