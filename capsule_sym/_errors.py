"""Exceptions of the package, and statuses of runs and searches."""

from __future__ import annotations

import os
import re
from collections.abc import Collection, Iterable
from enum import StrEnum
from typing import TYPE_CHECKING


class CapsuleError(Exception):
    """Base of the exceptions that functions raise, except `Rejected` and those of declarations."""


class InvalidInput(CapsuleError, ValueError):
    """Raised for a value that is not allowed; names the field, the value and the allowed range.

    `allowed` completes the sentence "must be ...", as in `finite and >= 0`.
    """

    def __init__(self, field: str, value: object, allowed: str) -> None:
        # All three go to the base class, so that the exception survives pickling.
        super().__init__(field, value, allowed)
        self.field = field
        self.value = value
        self.allowed = allowed

    def __str__(self) -> str:
        line = f"{self.field} = {_shown(self.value)}: must be {self.allowed}"
        names = re.split(r", (?:or )?| or | and |\bof ", self.allowed)
        return line + suggestion(self.value, [one for one in names if " " not in one])


def counted(count: int, name: str, names: str = "") -> str:
    """A number of things with their name, such as "1 period" and "2 periods"."""
    return f"{count:,} {name if count == 1 else names or f'{name}s'}"


def suggestion(value: object, names: Iterable[str]) -> str:
    """Question "; did you mean NAME?" if a word of a text is nearly a name; empty otherwise."""
    words = re.findall(r"[A-Za-z_][\w.-]+", value) if isinstance(value, str) else []
    close = [one for word in words if word not in names for one in close_names(word, names)]
    return f"; did you mean {close[0]}?" if close else ""


def close_names(word: str, names: Iterable[str], count: int = 1, least: float = 0.6) -> list[str]:
    """Names like a word, the nearest first: at most `count`, of similarity `least` or more."""
    from difflib import get_close_matches

    return get_close_matches(word, names, count, least)


_LONGEST = 300  # characters of a value in a message


def _shown(value: object) -> str:
    """A value in one line of a message, cut where it is long."""
    given = os.fspath(value) if isinstance(value, os.PathLike) else value
    try:
        text = " ".join(line.strip() for line in repr(given).splitlines())
    except (RecursionError, ValueError):  # nested too deeply, or an integer of too many digits
        text = f"<{type(value).__name__}>"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def check_one_of(field: str, value: object, allowed: Collection[str], of: str = "") -> None:
    """Raise InvalidInput unless a value is one of the names allowed; `of` ends the message."""
    if value not in allowed:
        raise InvalidInput(field, value, f"one of {', '.join(allowed)}{of}")


class NotInstalled(CapsuleError, ImportError):
    """Raised if an optional library is missing; the message gives the command to install it."""

    def __init__(self, missing: ModuleNotFoundError) -> None:
        name = str(missing.name).partition(".")[0]
        extra = next((extra for extra, some in _EXTRAS.items() if name in some), None)
        brought = f"'.[{extra}]' in the checkout" if extra else name
        super().__init__(f"{name} is missing: python -m pip install {brought}")


_EXTRAS = {
    "plot": ("matplotlib", "textalloc"),
    "sweep": ("filelock", "xarray", "zarr"),
    "symbolic": ("flint", "sympy"),
}


class Status(StrEnum):
    """Status of a result: success, or the reason why it is partial or missing.

    Runs, searches and sweeps are finished or complete, orbits and fits converged, branches and
    curves reached their target; an optimum is optimal, a shock or a pulse found.
    """

    #: All periods, starts or samples are done.
    FINISHED = "finished"
    #: Every cell of a sweep is computed, periodic or not.
    COMPLETE = "complete"
    #: The requested quantities of some cells of a sweep could not be computed.
    FAILED = "failed"
    #: The largest number of segments is reached.
    SEGMENT_LIMIT = "segment-limit"
    #: The time limit is reached: the result is the best so far, if there is one.
    TIME_LIMIT = "time-limit"
    #: Kept data reach the memory limit.
    MEMORY_LIMIT = "memory-limit"
    #: Rounding lets no step advance in time.
    STALLED = "stalled"
    #: No switch is found or excluded, or no field is certain to be the successor.
    UNDECIDED = "undecided"

    #: The equations are solved to rounding, or the least squares converged to a minimum.
    CONVERGED = "converged"
    #: Newton's method, the least squares or an optimisation did not converge; on a branch not even
    #: at the shortest step.
    NOT_CONVERGED = "not-converged"
    #: The Jacobian of the equations is singular, as at a fold or at undamped resonance, or too
    #: ill-conditioned for double precision.
    SINGULAR = "singular"
    #: The equations have no finite value at the guess.
    NOT_FINITE = "not-finite"
    #: The equations are solved, but the map has another itinerary from there.
    NOT_ADMISSIBLE = "not-admissible"
    #: The simulated motion did not settle on a periodic one.
    NOT_PERIODIC = "not-periodic"

    #: The parameter has reached the target value, or the border of its range.
    REACHED = "reached"
    #: The path returned to its start.
    RETURNED = "returned"
    #: The parameter returned to its start value, on another orbit.
    TURNED_BACK = "turned-back"
    #: The two halves of a period-doubled orbit became equal: a branch of half the period.
    PERIOD_HALVED = "period-halved"
    #: The orbit became its own mirror image: a branch of symmetric orbits.
    SYMMETRIC = "symmetric"
    #: An inequality of the itinerary fails, and no admissible orbit continues the branch.
    NO_ADMISSIBLE_ORBIT = "no-admissible-orbit"
    #: The mean force of drive and load reaches friction: beyond, no motion is periodic.
    DRAGGED = "dragged"
    #: The curve ends in a codimension-two point; the last of its list, if that is located.
    CODIMENSION_TWO = "codimension-two"
    #: The largest number of points was reached.
    TOO_MANY_POINTS = "too-many-points"

    #: The conditions of an optimum hold, in the interior or with active bounds and limits.
    OPTIMAL = "optimal"
    #: The best is at a border beyond which the objective is worse or the motion is lost: another
    #: itinerary, stability, or basin; see `bifurcation` and `limit`.
    OPTIMAL_AT_BORDER = "optimal-at-border"
    #: No place was found within the bounds that satisfies all constraints.
    INFEASIBLE = "infeasible"
    #: The start leads to no periodic motion at any place that was tried.
    NO_MOTION = "no-motion"
    #: The metric is constant, such as a speed if the mass does not reach the spring.
    FLAT = "flat"
    #: The noise of a column is half its spread or more: the fit does not explain it.
    UNEXPLAINED = "unexplained"
    #: An unknown of a fit is at one of its bounds.
    AT_BOUND = "at-bound"
    #: The measurements do not determine some combination of the unknowns.
    NOT_IDENTIFIABLE = "not-identifiable"

    #: A pulse leads from one attractor to the other; or a knock loses the motion, and no smaller
    #: one that was tried does.
    FOUND = "found"
    #: No knock up to the largest loses the motion.
    NOT_LOST = "not-lost"
    #: No pulse within the bounds and the number of periods leads there.
    NO_PULSE = "no-pulse"

    @property
    def success(self) -> bool:
        """True for a complete result.

        The `success` of a curve is its own: also True for RETURNED and CODIMENSION_TWO.
        """
        return self in _COMPLETE


_COMPLETE = {
    *(Status.FINISHED, Status.COMPLETE, Status.CONVERGED, Status.REACHED, Status.OPTIMAL),
    *(Status.OPTIMAL_AT_BORDER, Status.FOUND, Status.NOT_LOST),
}


class Ended:
    """A result with a status."""

    __slots__ = ()
    if TYPE_CHECKING:  # a field or a property of each result

        @property
        def status(self) -> Status: ...

    @property
    def success(self) -> bool:
        """True if the result is complete; otherwise `status` gives the reason."""
        return self.status.success


class Outcome(StrEnum):
    """Outcome of the search for the next switch of a segment."""

    #: One guard crosses zero, alone and with a slope that is certainly not zero.
    REGULAR = "regular"
    #: x_r touches a stop within the error bound (line L9): no crossing, or a pair of them.
    GRAZE = "graze"
    #: Two guards vanish within the error bound of each other, on L5 to L8 or in O1, O2.
    CORNER = "corner"
    #: The force on a capsule at rest touches a friction bound, or the velocity of a drifting one
    #: touches 0 (lines L1 to L4), within the error bound.
    SLIDING_TANGENCY = "sliding-tangency"
    #: No guard fires at any later time (proved).
    NEVER = "never"
    #: The search for a guard was given up: after 200,000 evaluations, or at a time limit.
    UNDECIDED = "undecided"
    #: Steps of the search, or segments of the run, do not advance in time.
    STALLED = "stalled"
    #: The run ended before the next switch.
    END = "end"
