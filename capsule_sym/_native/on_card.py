"""Many runs on a graphics card: sorted, in chunks, and continued by the C core if handed back."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from time import perf_counter
from types import ModuleType
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from capsule_sym._native.device import TABLES
from capsule_sym._native.watch import Watch
from capsule_sym._parameters import Scene

_LEAST, _MOST = 0.05, 0.2  # seconds of a launch: between launches a watch and Ctrl-C are seen
_FIRST = 64  # expansions of the first launch, of each run
_ROWS = 2**20  # most of a chunk

Rows = NDArray[np.float64]


class Card(Protocol):
    """Memory and kernels of a card, or of what stands in for one."""

    name: str
    """Name in records of results."""

    def free(self) -> int:
        """Bytes that a chunk may take."""

    def blank(self, size: int) -> Any:
        """Memory of so many bytes."""

    def put(self, values: NDArray[Any]) -> Any:
        """Copy of an array in the card's memory."""

    def take(self, held: Any, values: NDArray[Any]) -> None:
        """Copy memory of the card to an array."""

    def launch(self, kernel: str, count: int, *arguments: Any) -> None:
        """Run a kernel in at least `count` threads, until its end; memory, or NumPy's numbers."""


class OnCard:
    """Binding of a scene's core whose `start_many` and `run_many` compute on a card."""

    def __init__(self, binding: ModuleType, scene: Scene, card: Card) -> None:
        self.binding, self.card = binding, card
        self.handed_back = 0
        """Number of runs that the card could not decide so far."""
        names = scene.facts.PARAMETERS
        stops = (stiffness for _, stiffness in scene.facts.STOPS)
        flow = [names.index(name) for name in ("omega", "zeta", "gamma", *stops)]
        self.flow = flow
        """Indices of the parameters of a linear flow, then of the others."""
        self.keys = flow + [i for i in range(len(names)) if i not in flow]
        sizes = np.zeros(2, np.int64)
        held = card.put(sizes)
        card.launch("capsule_sizes", 1, held)
        card.take(held, sizes)
        self.context, self.tables = sizes.tolist()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.binding, name)

    def start_many(
        self, rows: Rows, states: Rows, phases: Rows, records: NDArray[Any], watch: Watch
    ) -> None:
        """Write the state records at the starts of runs, as the core's function does."""
        starts = np.column_stack((states, phases))
        each = rows[0].nbytes + starts[0].nbytes + records.itemsize if len(rows) else 1
        for part in _parts(len(rows), self._room(each)):
            if watch.over:  # then this marks the rest as not begun
                left = slice(part.start, None)
                of = rows[left], states[left], phases[left], records[left], watch
                self.binding.start_many(*of)
                return
            held = self.card.blank(records[part].nbytes)
            given = self.card.put(rows[part]), self.card.put(starts[part])
            count = part.stop - part.start
            self.card.launch("capsule_starts", count, *given, held, np.int64(count))
            self.card.take(held, records[part])

    def run_many(
        self,
        rows: Rows,
        records: NDArray[Any],
        periods: int,
        stops: NDArray[np.int8],
        strobe: Rows | None = None,
        position: bool = False,
        stride: int = 1,
        watch: Watch | None = None,
    ) -> int:
        """Run every row to the end of period `periods`, as the core's function does.

        Runs that the card cannot decide are continued by the core, in a thread beside its work.
        Returns the number of those that the core cannot decide either.
        """
        assert stride == 1
        watch = watch or Watch()
        stops[:] = self.binding.STOPPED
        order = self.order(rows, records)
        left: list[Future[None]] = []
        with ThreadPoolExecutor(1) as core:
            try:
                for part in self._chunks(rows, order, periods, strobe is not None):
                    self._run(rows, records, periods, stops, strobe, position, part, watch)
                    open_ = part[stops[part] == self.binding.OPEN]
                    if len(open_):
                        of = rows, records, periods, stops, strobe, position, open_, watch
                        left.append(core.submit(self._continue, *of))
                        self.handed_back += len(open_)
                    if watch.over:
                        break
                for future in left:
                    future.result()
            except BaseException:
                watch.stop()  # Ctrl-C comes here
                raise
        if np.any(stops == self.binding.REFUSED):
            raise ValueError("no runs from some of the states")
        return int(np.count_nonzero(stops == self.binding.OPEN))

    def order(self, rows: Rows, records: NDArray[Any]) -> NDArray[np.intp]:
        """Order in which neighbours run alike: by flow, then other parameters, then the start."""
        columns = [rows[:, i] for i in self.keys]
        columns += [records[name] for name in ("x_r", "v_r", "v_c", "angle")]
        varying = [column for column in columns if len(column) and (column != column[0]).any()]
        return np.lexsort(varying[::-1]) if varying else np.arange(len(rows))

    def _room(self, each: int) -> int:
        """Rows of a chunk, from the bytes of each; at least one block, or the card refuses."""
        return max(128, min(_ROWS, self.card.free() // each))

    def _chunks(
        self, rows: Rows, order: NDArray[np.intp], periods: int, strobed: bool
    ) -> Iterator[NDArray[np.intp]]:
        """Rows of each chunk, whose data fit the card."""
        if not len(order):
            return
        flows = rows[:, self.flow][order]
        share = (1 + np.count_nonzero((flows[1:] != flows[:-1]).any(axis=1))) / len(order)
        each = rows[0].nbytes + self.binding.STATE.itemsize + self.context + 8
        each += 24 * (periods + 1) * strobed + int(share * self.tables) + 1
        for part in _parts(len(order), self._room(each)):
            yield order[part]

    def _run(
        self,
        rows: Rows,
        records: NDArray[Any],
        periods: int,
        stops: NDArray[np.int8],
        strobe: Rows | None,
        position: bool,
        part: NDArray[np.intp],
        watch: Watch,
    ) -> None:
        """Run a chunk, launch by launch."""
        card, count = self.card, len(part)
        own, states, now = rows[part], records[part], stops[part]
        new = np.ones(count, bool)
        new[1:] = (own[1:, self.flow] != own[:-1, self.flow]).any(axis=1)
        sets = own[new]
        tables = card.blank(len(sets) * self.tables)
        card.launch(TABLES, len(sets), card.put(sets), tables, np.int64(len(sets)))
        flow, context = (
            card.put(np.cumsum(new, dtype=np.int32) - np.int32(1)),
            card.blank(count * self.context),
        )
        marks = None if strobe is None else strobe[part]
        held = card.put(states), context, card.put(now)
        drawn = np.uintp(0) if marks is None else card.put(marks)
        given = card.put(own), flow, tables, *held, drawn, np.int64(periods), np.int32(position)
        most, begins = _FIRST, 1
        while not watch.over:
            begun = perf_counter()
            ends = np.int32(begins), np.int64(most), np.int64(count)
            card.launch("capsule_runs", count, *given, *ends)
            card.take(held[2], now)
            begins, took = 0, perf_counter() - begun
            if not np.any(now == self.binding.STOPPED):
                break
            most = most * 2 if took < _LEAST else max(1, most // 2) if took > _MOST else most
        card.take(held[0], states)
        records[part], stops[part] = states, now
        if strobe is not None and marks is not None:
            card.take(drawn, marks)
            strobe[part] = marks

    def _continue(
        self,
        rows: Rows,
        records: NDArray[Any],
        periods: int,
        stops: NDArray[np.int8],
        strobe: Rows | None,
        position: bool,
        part: NDArray[np.intp],
        watch: Watch,
    ) -> None:
        """Run rows by the core, from the segments that the card could not decide."""
        states, now = records[part], stops[part]
        marks = None if strobe is None else strobe[part]
        self.binding.run_many(
            rows[part], states, periods, now, marks, position, watch=watch, lanes=1
        )  # alone: not even the last bits depend on the others
        records[part], stops[part] = states, now
        if strobe is not None:
            strobe[part] = marks


def _parts(count: int, room: int) -> Iterator[slice]:
    """Slices of so many rows at most."""
    return (slice(first, min(first + room, count)) for first in range(0, count, room))
