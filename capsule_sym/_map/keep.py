"""Kept results of a run, in pieces: memory grows with them, not with the number of periods."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.segments import SEGMENT, Records, Segments, Tangencies
from capsule_sym._map.trajectory import Kept, Statistics
from capsule_sym._parameters import SceneParameters

CHOICES = ("segments", "final", "stroboscopic")
MOST_KEPT = 1_000_000
"""Default limit on the segments of a run that keeps them."""
MOST_BYTES = 2**32
"""Memory limit of the results of one call: 4 GiB."""
_PIECE = 512
"""Records written at a time, for every `keep`: a run that pauses resumes within a rounding."""
STROBE = 32  # bytes of a state at a period's end, with its number
_GROWTH = 65_536  # rows by which an array grows at most


def check_memory(field: str, value: object, size: int) -> None:
    """Raise InvalidInput if a call with this value would keep too many bytes."""
    if size > MOST_BYTES:
        gib = 2**30
        allowed = f"less: {size / gib:.3g} GiB would be kept, {MOST_BYTES / gib:.3g} GiB may be"
        raise InvalidInput(field, value, allowed)


class Growing:
    """Array that grows at its end; rows stay in place as far as possible."""

    def __init__(self, dtype: Any, shape: tuple[int, ...] = ()) -> None:
        self._rows, self.count = np.empty((_PIECE, *shape), dtype), 0

    def tail(self, count: int) -> NDArray[Any]:
        """Free rows at the end, valid until the next call."""
        room = len(self._rows)
        if self.count + count > room:
            self._resize(room + max(count, min(room, _GROWTH)))
        return self._rows[self.count : self.count + count]

    def append(self, rows: NDArray[Any]) -> None:
        """Append rows."""
        self.tail(len(rows))[...] = rows
        self.count += len(rows)

    def done(self) -> NDArray[Any]:
        """All rows, read-only, in no more memory than they need."""
        self._resize(self.count)
        self._rows.flags.writeable = False
        return self._rows

    def _resize(self, room: int) -> None:
        # Views of the rows are not used any more: see `tail`.
        self._rows.resize((room, *self._rows.shape[1:]), refcheck=False)


class Keeper:
    """Collects the records of a run piece by piece, and keeps what `keep` names.

    The run ends at `most` records, or when the memory limit of a call is reached (`full`).
    """

    def __init__(self, parameters: SceneParameters, keep: str) -> None:
        self.parameters, self.what = parameters, keep
        self._rows = Growing(SEGMENT) if keep == "segments" else None
        self._strobes, self._strobe_periods = Growing(float, (3,)), Growing(np.int64)
        self.count = self.evaluations = self.escalations = 0
        self.most = max(1, MOST_BYTES // SEGMENT.itemsize) if self._rows else 10**12
        self._piece = np.empty(_PIECE, SEGMENT)
        self._tangencies: dict[int, Any] = {}

    def strobe(self, states: NDArray[np.float64], periods: NDArray[np.int64]) -> None:
        """Add states at the ends of these periods."""
        if self.what != "final":
            self._strobes.append(states)
            self._strobe_periods.append(periods)

    @property
    def full(self) -> bool:
        """True if kept data reach the memory limit, or the records `most`."""
        held = self._strobes.count * STROBE
        held += self.count * SEGMENT.itemsize if self._rows else 0
        return held >= MOST_BYTES or self.count >= self.most

    def room(self, most: int) -> Records:
        """Buffer for the core, of `most` records, at most one piece."""
        count = min(most, _PIECE)
        return self._rows.tail(count) if self._rows else self._piece[:count]

    def wrote(self, count: int) -> None:
        """Register records that were written into the last buffer."""
        records = self.room(count)
        if self._rows:
            self._rows.count += count
        self._take(records)

    def append(self, records: Records, tangencies: Tangencies) -> None:
        """Add records made elsewhere, with the tangencies of some of them, by index."""
        if self._rows:
            self._tangencies |= {self.count + i: found for i, found in tangencies.items() if found}
            self._rows.append(records)
        self._take(records)

    def _take(self, records: Records) -> None:
        self.count += len(records)
        self.evaluations += int(records["evaluations"].sum())
        self.escalations += int(records["wide"].sum())

    def kept(self) -> Kept:
        """All kept results of a run."""
        p = self.parameters
        if self.what == "final":
            return Kept("final")
        segments = None
        if self._rows:
            segments = Segments(self._rows.done(), p.omega, self._tangencies, scene=p.scene)
        return Kept(self.what, segments, self._strobes.done(), self._strobe_periods.done())

    @property
    def statistics(self) -> Statistics:
        """Statistics of the run so far."""
        return Statistics(self.count, self.evaluations, self.escalations)


def most_segments(keep: str, given: int | None, backend: str) -> int:
    """Limit of a run's segments: the given one, else one that limits kept segments.

    The core keeps only what `keep` names; the other backends keep all segments meanwhile.
    """
    if given is not None:
        return given
    return MOST_KEPT if backend != "c" or keep == "segments" else 10**12
