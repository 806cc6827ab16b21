"""Many runs on a graphics card: sorted, in chunks, and continued by the C core if handed back."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from threading import BoundedSemaphore
from time import perf_counter
from types import ModuleType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from capsule_sym._native.device import TABLES
from capsule_sym._native.watch import Watch
from capsule_sym._parameters import Scene

_LEAST, _MOST = 0.05, 0.2  # seconds of a launch: between launches a watch and Ctrl-C are seen
_FIRST = 64  # expansions of the first launch, of each run
_ROWS = 2**20  # most of a chunk
_MOTIONS = 2**16  # the same of motions, whose work is not paused
_WORK = 2048  # most expansions of a motion
_TURNS = 3  # chunks on the card at a time, each with its share of the memory
_EVENTS, _SEGMENTS = 128, 64  # room of a motion: switches of two periods; segments

Rows = NDArray[np.float64]
Arrays = tuple[NDArray[Any], ...]


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


class _Runs(NamedTuple):
    rows: Rows
    records: NDArray[Any]
    periods: int
    stops: NDArray[np.int8]
    strobe: Rows | None
    position: bool
    watch: Watch


class OnCard:
    """Binding of a scene's core whose functions of many runs and motions compute on a card."""

    def __init__(self, binding: ModuleType, scene: Scene, card: Card) -> None:
        self.binding, self.card = binding, card
        self.handed_back, self.turns = 0, BoundedSemaphore(_TURNS)
        """Number of runs that the card could not decide so far."""
        names = scene.facts.PARAMETERS
        stops = (stiffness for _, stiffness in scene.facts.STOPS)
        of_drive = () if scene.facts.PULSED else ("omega",)
        flow = [names.index(name) for name in (*of_drive, "zeta", "gamma", *stops)]
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
        for first in range(0, len(rows), _ROWS):
            part, left = slice(first, first + _ROWS), slice(first, None)
            if watch.over:  # then this marks the rest as not begun
                of = rows[left], states[left], phases[left], records[left], watch
                self.binding.start_many(*of)
                return
            held, count = self.card.blank(records[part].nbytes), len(rows[part])
            given = self.card.put(rows[part]), self.card.put(starts[part])
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
        stops[:] = self.binding.STOPPED
        runs = _Runs(rows, records, periods, stops, strobe, position, watch or Watch())
        each = records.itemsize + self.context + 8
        each += 0 if strobe is None else 24 * (periods + 1)
        chunks = self._chunks(rows, self.order(rows, records), each, _ROWS, runs.watch)
        self._all(
            chunks, partial(self._run, runs), partial(self._continue, runs), stops, runs.watch
        )
        if np.any(stops == self.binding.REFUSED):
            raise ValueError("no runs from some of the states")
        return int(np.count_nonzero(stops == self.binding.OPEN))

    def steady_many(
        self,
        rows: Rows,
        records: NDArray[Any],
        strobe: Rows,
        tolerance: float,
        stops: NDArray[np.int8],
        motions: NDArray[Any],
        switches: NDArray[np.uint8],
        watch: Watch | None = None,
    ) -> None:
        """Find the periodic motions of finished runs, as the core's function does."""
        watch = watch or Watch()
        given, found = (rows, records, strobe), (stops, motions, switches)
        fixed = np.int64(strobe.shape[1] - 1), np.float64(tolerance)
        room = min(_EVENTS, switches.shape[1]), self.binding.EVENT.itemsize

        def core(given: Arrays, found: Arrays) -> None:
            self.binding.steady_many(*given, tolerance, *found, watch)

        self._motions("capsule_motions", given, fixed, room, found, core, watch)

    def orbit_many(
        self,
        rows: Rows,
        states: Rows,
        period_numbers: NDArray[np.int32],
        stops: NDArray[np.int8],
        orbits: NDArray[Any],
        fields: NDArray[np.uint8],
        energies: bool = False,
        forces: bool = False,
        gradients: bool = False,
        watch: Watch | None = None,
    ) -> None:
        """Solve for the periodic motions near states, as the core's function does."""
        watch = watch or Watch()
        given, found = (rows, states, period_numbers), (stops, orbits, fields)
        fixed = np.int8(energies), np.int8(forces)
        room = min(_SEGMENTS, fields.shape[1]), self.binding.SEGMENT.itemsize

        def core(given: Arrays, found: Arrays) -> None:
            self.binding.orbit_many(*given, *found, energies, forces, gradients, watch)

        if gradients:
            core(given, found)
        else:
            self._motions("capsule_orbits", given, fixed, room, found, core, watch)

    def _motions(
        self,
        kernel: str,
        given: Arrays,
        fixed: tuple[np.generic, ...],
        room: tuple[int, int],
        found: Arrays,
        core: Callable[[Arrays, Arrays], None],
        watch: Watch,
    ) -> None:
        """Results of motions whose stop, the first result, is DONE; undecided ones by the core.

        `room` is that of a motion's switches or segments, and the size of each. The last result has
        their fields.
        """
        (rows, states, _), (stops, records, fields) = given, found
        chosen = np.flatnonzero(stops == self.binding.DONE)
        stops[chosen] = self.binding.STOPPED
        narrow = stops, records, fields[:, : room[0]]
        each = math.prod(room) + sum(a[:1].nbytes for a in (*given[1:], *narrow))
        order = chosen[self.order(rows[chosen], states[chosen])]

        def run(part: NDArray[np.intp]) -> None:
            card, count = self.card, len(part)
            of = *self._flows(rows[part]), *(card.put(a[part]) for a in given[1:]), *fixed
            own = card.blank(count * math.prod(room)), np.int64(room[0]), np.int64(_WORK)
            made = [card.put(a[part]) for a in narrow]
            card.launch(kernel, count, *of, *own, *made, np.int64(count))
            pairs = [*zip(narrow, made, strict=True)]
            for array, held in reversed(pairs):  # the stop last, which vouches for the others
                values = array[part]
                card.take(held, values)
                array[part] = values
            stops[part[stops[part] != self.binding.DONE]] = self.binding.OPEN

        def again(part: NDArray[np.intp]) -> None:
            repeated = tuple(np.zeros_like(a[part]) for a in found)
            core(tuple(a[part] for a in given), repeated)
            for array, values in reversed([*zip(found, repeated, strict=True)]):
                array[part] = values

        self._all(self._chunks(rows, order, each, _MOTIONS, watch), run, again, stops, watch)

    def _all(
        self,
        chunks: Iterator[NDArray[np.intp]],
        run: Callable[[NDArray[np.intp]], None],
        rest: Callable[[NDArray[np.intp]], None],
        stops: NDArray[np.int8],
        watch: Watch,
    ) -> None:
        """Run each chunk on the card, and what it leaves by the core, in a thread beside it."""
        left: list[Future[None]] = []
        with ThreadPoolExecutor(1) as core:
            try:
                for part in chunks:
                    with self.turns:
                        run(part)
                    undecided = part[stops[part] == self.binding.OPEN]
                    if len(undecided):
                        left.append(core.submit(rest, undecided))
                        self.handed_back += len(undecided)
                for future in left:
                    future.result()
            except KeyboardInterrupt:  # another error ends no chunk beside this one
                watch.stop()
                raise

    def order(self, rows: Rows, states: NDArray[Any]) -> NDArray[np.intp]:
        """Order in which neighbours run alike: by flow, then other parameters, then the start."""
        columns = [rows[:, i] for i in self.keys]
        start = ("x_r", "v_r", "v_c", "angle")
        columns += [states[name] for name in start] if states.dtype.names else [*states.T]
        varying = [column for column in columns if (column != column[:1]).any()]
        return np.lexsort(varying[::-1]) if varying else np.arange(len(rows))

    def _begins(self, rows: Rows) -> NDArray[np.bool_]:
        """True for rows whose flow is not that of the row before."""
        flows = rows[:, self.flow]
        return np.append(True, (flows[1:] != flows[:-1]).any(axis=1))

    def _chunks(
        self, rows: Rows, order: NDArray[np.intp], each: int, most: int, watch: Watch
    ) -> Iterator[NDArray[np.intp]]:
        """Rows of each chunk, whose data fit the card, until the watch is over.

        A row has `each` bytes besides its parameters and their tables.
        """
        first, sizes = 0, np.full(len(order), each + rows[:1].nbytes)
        sizes[self._begins(rows[order])[: len(order)]] += self.tables
        ends, room = np.cumsum(sizes), self.card.free() - self.tables
        while first < len(order) and not watch.over:
            before = ends[first] - sizes[first]
            last = max(first + 1, int(np.searchsorted(ends, before + room, "right")))
            yield order[first : min(last, first + most)]
            first = min(last, first + most)

    def _flows(self, rows: Rows) -> tuple[Any, Any, Any]:
        """Rows on the card, the number of each one's flow, and the tables of the flows."""
        begins = self._begins(rows)
        sets = rows[begins]
        tables = self.card.blank(len(sets) * self.tables)
        self.card.launch(TABLES, len(sets), self.card.put(sets), tables, np.int64(len(sets)))
        flow = np.cumsum(begins, dtype=np.int32) - np.int32(1)
        return self.card.put(rows), self.card.put(flow), tables

    def _run(self, runs: _Runs, part: NDArray[np.intp]) -> None:
        """Run a chunk, launch by launch."""
        card, count, stopped = self.card, len(part), self.binding.STOPPED
        states, stops, context = runs.records[part], runs.stops[part], count * self.context
        marks = None if runs.strobe is None else runs.strobe[part]
        drawn = np.uintp(0) if marks is None else card.put(marks)
        at, ends = card.put(states), card.put(stops)
        fixed = *self._flows(runs.rows[part]), at, card.blank(context), ends, drawn
        lasting = np.int64(runs.periods), np.int32(runs.position)
        most, took, first = _FIRST, _LEAST, np.int32(1)
        while np.any(stops == stopped) and not runs.watch.over:
            most = most * 2 if took < _LEAST else max(1, most // 2) if took > _MOST else most
            begun = perf_counter()
            of = *fixed, *lasting, first, np.int64(most), np.int64(count)
            card.launch("capsule_runs", count, *of)
            card.take(ends, stops)
            first, took = np.int32(0), perf_counter() - begun
        card.take(at, states)
        runs.records[part], runs.stops[part] = states, stops
        if runs.strobe is not None and marks is not None:
            card.take(drawn, marks)
            runs.strobe[part] = marks

    def _continue(self, runs: _Runs, part: NDArray[np.intp]) -> None:
        """Run rows by the core, each alone, from the segments that the card could not decide."""
        states, stops = runs.records[part], runs.stops[part]
        marks = None if runs.strobe is None else runs.strobe[part]
        of = runs.rows[part], states, runs.periods, stops, marks, runs.position
        self.binding.run_many(*of, watch=runs.watch, lanes=1)
        runs.records[part], runs.stops[part] = states, stops
        if runs.strobe is not None:
            runs.strobe[part] = marks
