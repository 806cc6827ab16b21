"""Exceptions of the package, and statuses of runs and searches."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from enum import StrEnum


class CapsuleError(Exception):
    """Base of every exception that this package raises."""


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
    """Question after a text of which a word is nearly one of the names; empty for others."""
    words = re.findall(r"[A-Za-z_][\w.-]+", value) if isinstance(value, str) else []
    close = [one for word in words if word not in names for one in close_names(word, names)]
    return f"; did you mean {close[0]}?" if close else ""


def close_names(word: str, names: Iterable[str], count: int = 1, least: float = 0.6) -> list[str]:
    """Names that are much like a word, the nearest first."""
    from difflib import get_close_matches

    return get_close_matches(word, names, count, least)


_LONGEST = 300  # characters of a value in a message


def _shown(value: object) -> str:
    """A value in one line of a message, cut where it is long."""
    try:
        text = " ".join(line.strip() for line in repr(value).splitlines())
    except (RecursionError, ValueError):  # nested too deeply, or an integer of too many digits
        text = f"<{type(value).__name__}>"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def check_one_of(field: str, value: object, allowed: Collection[str], of: str = "") -> None:
    """Raise InvalidInput unless a value is one of the names that are allowed, `of` something."""
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
    "plot": ("matplotlib", "shapely", "textalloc"),
    "sweep": ("filelock", "google_crc32c", "xarray", "zarr"),
    "symbolic": ("flint", "sympy"),
}


class Status(StrEnum):
    """Status of a run or a search: finished, or the limit that stopped it."""

    #: All periods are over, or all starts are searched.
    FINISHED = "finished"
    #: The largest number of segments is reached.
    SEGMENT_LIMIT = "segment-limit"
    #: The time limit is reached.
    TIME_LIMIT = "time-limit"
    #: Kept data reach the memory limit.
    MEMORY_LIMIT = "memory-limit"
    #: Rounding lets no step advance in time.
    STALLED = "stalled"
    #: No switch is found or excluded, or no field is certain to be the successor.
    UNDECIDED = "undecided"


class Outcome(StrEnum):
    """Outcome of the search for the next switch of a segment."""

    #: One guard crosses zero, alone and with a slope that is certainly not zero.
    REGULAR = "regular"
    #: x_r touches delta within the error bound (line L9): no crossing, or a pair of them.
    GRAZE = "graze"
    #: Two guards vanish within the error bound of each other, on L5 to L8 or in O1, O2.
    CORNER = "corner"
    #: The force on a sticking capsule touches the friction bound (lines L1 to L4).
    SLIDING_TANGENCY = "sliding-tangency"
    #: No guard fires at any later time (proved).
    NEVER = "never"
    #: Rounding does not allow to decide if a guard fires.
    UNDECIDED = "undecided"
    #: Steps of the search, or segments of the run, do not advance in time.
    STALLED = "stalled"
    #: The run ended before the next switch.
    END = "end"
