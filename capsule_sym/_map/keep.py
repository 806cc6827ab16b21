"""Kept results of a run, in pieces: memory grows with them, not with the number of periods."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map import evaluation
from capsule_sym._map.segments import SEGMENT, SWITCH, Records, Segments, Tangencies, switches_of
from capsule_sym._map.trajectory import Kept, Statistics, Trajectory
from capsule_sym._parameters import SceneParameters

CHOICES = ("segments", "final", "stroboscopic", "switches")
MOST_KEPT = 1_000_000
"""Default limit on the segments of a run that keeps data of each segment."""
MOST_BYTES = 2**32
"""Memory limit of the results of one call: 4 GiB."""
_PIECE = 512
"""Records written at a time, for every `keep`: a run that pauses resumes within a rounding."""
STATE = STROBE = 32  # bytes of (x_r, v_r, v_c, x_c); of a state at a period's end, with its number
_GROWTH = 65_536  # rows by which an array grows at most


def checked(keep: str | ArrayLike, first: float, last: float) -> str | NDArray[np.float64]:
    """Value of `keep`: one of CHOICES, or times in [first, last]. Raises InvalidInput otherwise."""
    allowed = f"one of {', '.join(CHOICES)}, or an array of times"
    if isinstance(keep, str):
        if keep not in CHOICES:
            raise InvalidInput("keep", keep, allowed)
        return keep
    times = evaluation.real("keep", keep, allowed).copy()
    evaluation.check(times, first, last, "keep")
    return times


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

    It may use one part in `share` of the memory limit of a call. The run ends at `most` records, or
    when this memory is `full`.
    """

    def __init__(
        self, parameters: SceneParameters, keep: str | NDArray[np.float64], share: int = 1
    ) -> None:
        self.parameters = parameters
        self.what = keep if isinstance(keep, str) else "times"
        strobed = self.what in ("segments", "stroboscopic")
        self._strobes = Growing(float, (3,)) if strobed else None
        self._strobe_periods = Growing(np.int64) if strobed else None
        self.count = self.evaluations = self.escalations = 0
        self._rows = Growing(SEGMENT) if self.what == "segments" else None
        self._events = Growing(SWITCH) if self.what == "switches" else None
        sizes = {"segments": SEGMENT.itemsize, "switches": SWITCH.itemsize}
        self._room, self._size = MOST_BYTES // share, sizes.get(self.what, 0)
        self.most = max(1, self._room // self._size) if self._size else 10**12
        self._piece = np.empty(0 if self._rows else _PIECE, SEGMENT)
        self._tangencies: dict[int, Any] = {}
        self._last: Records | None = None
        if not isinstance(keep, str):
            self._times = keep
            flat = keep.ravel()
            self._order = evaluation.in_order(flat)
            self._sorted = flat if self._order is None else flat[self._order]
            self._states, self._at = np.full((keep.size, 4), np.nan), 0

    def strobe(self, states: NDArray[np.float64], periods: NDArray[np.int64]) -> None:
        """Add states at the ends of these periods."""
        if self._strobes and self._strobe_periods:
            self._strobes.append(states)
            self._strobe_periods.append(periods)

    @property
    def full(self) -> bool:
        """True if no memory is left."""
        strobes = self._strobes.count if self._strobes else 0
        held = self.count * self._size + strobes * STROBE
        return held >= self._room or self.count >= self.most

    def room(self, most: int) -> Records:
        """Buffer for the core, of at most so many records."""
        count = min(most, _PIECE)
        return self._rows.tail(count) if self._rows else self._piece[:count]

    def wrote(self, native: Any, count: int) -> None:
        """Register records that were written into the last buffer."""
        if self._rows:
            records = self._rows.tail(count)
            self._rows.count += count
        else:
            records = self._piece[:count]
        self._take(native, records)

    def append(self, native: Any, records: Records, tangencies: Tangencies) -> None:
        """Add records made elsewhere, with the tangencies of some of them, by index."""
        if self._rows:
            self._tangencies |= {self.count + i: found for i, found in tangencies.items() if found}
            self._rows.append(records)
        self._take(native, records)

    def _take(self, native: Any, records: Records) -> None:
        self.count += len(records)
        self.evaluations += int(records["evaluations"].sum())
        self.escalations += int(records["wide"].sum())
        if self._events:
            self._events.append(switches_of(records))
        if self.what == "times" and len(records):
            self._at += native.evaluate(
                records, self._sorted[self._at :], self._states[self._at :], more=True
            )
            self._last = records[-1:].copy()

    def kept(self, native: Any, end: float) -> Kept:
        """All kept results of a run until a time, given the map on which it ran."""
        if self.what == "times":
            left = self._sorted[self._at :]
            left = left[left <= end]
            if self._last is not None:
                native.evaluate(self._last, left, self._states[self._at : self._at + len(left)])
            states = np.empty_like(self._states)
            states[slice(None) if self._order is None else self._order] = self._states
            shape = (*self._times.shape, 4)
            return Kept("times", times=self._times, states=states.reshape(shape))
        p, segments = self.parameters, None
        if self._rows:
            segments = Segments(self._rows.done(), p.omega, self._tangencies, scene=p.scene)
        return Kept(
            self.what,
            segments=segments,
            stroboscopic=self._strobes.done() if self._strobes else None,
            stroboscopic_periods=self._strobe_periods.done() if self._strobe_periods else None,
            switches=self._events.done() if self._events else None,
        )

    @property
    def statistics(self) -> Statistics:
        """Statistics of the run so far."""
        return Statistics(self.count, self.evaluations, self.escalations)


def reduced(run: Trajectory, keep: str | NDArray[np.float64]) -> Kept:
    """Results of `keep` from a run that has all its segments."""
    if not isinstance(keep, str):
        last = run.span[1]
        states = np.full((*keep.shape, 4), np.nan)
        states[keep <= last] = run(keep[keep <= last], position=True)
        return Kept("times", times=keep, states=states)
    if keep == "stroboscopic":
        periods = run.stroboscopic_periods
        return Kept(keep, stroboscopic=run.stroboscopic, stroboscopic_periods=periods)
    return Kept(keep, switches=run.switches) if keep == "switches" else Kept(keep)


def most_segments(keep: str | NDArray[np.float64], given: int | None, backend: str) -> int:
    """Limit of a run's segments: the given one, else one that limits kept segments.

    The core keeps only what `keep` names; the other backends keep all segments meanwhile.
    """
    if given is not None:
        return given
    bounded = backend != "c" or (isinstance(keep, str) and keep in ("segments", "switches"))
    return MOST_KEPT if bounded else 10**12
