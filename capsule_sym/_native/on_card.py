"""Many runs on a graphics card: sorted, in chunks, and continued by the C core if handed back."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
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


class _Runs(NamedTuple):
    rows: Rows
    records: NDArray[Any]
    periods: int
    stops: NDArray[np.int8]
    strobe: Rows | None
    position: bool
    watch: Watch


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
        left: list[Future[None]] = []
        with ThreadPoolExecutor(1) as core:
            try:
                for part in self._chunks(runs):
                    self._run(runs, part)
                    undecided = part[stops[part] == self.binding.OPEN]
                    left.append(core.submit(self._continue, runs, undecided))
                    self.handed_back += len(undecided)
                for future in left:
                    future.result()
            except KeyboardInterrupt:  # another error ends no chunk beside this one
                runs.watch.stop()
                raise
        if np.any(stops == self.binding.REFUSED):
            raise ValueError("no runs from some of the states")
        return int(np.count_nonzero(stops == self.binding.OPEN))

    def order(self, rows: Rows, records: NDArray[Any]) -> NDArray[np.intp]:
        """Order in which neighbours run alike: by flow, then other parameters, then the start."""
        columns = [rows[:, i] for i in self.keys]
        columns += [records[name] for name in ("x_r", "v_r", "v_c", "angle")]
        varying = [column for column in columns if (column != column[:1]).any()]
        return np.lexsort(varying[::-1]) if varying else np.arange(len(rows))

    def _begins(self, rows: Rows) -> NDArray[np.bool_]:
        """True for rows whose flow is not that of the row before."""
        flows = rows[:, self.flow]
        return np.append(True, (flows[1:] != flows[:-1]).any(axis=1))

    def _chunks(self, runs: _Runs) -> Iterator[NDArray[np.intp]]:
        """Rows of each chunk, whose data fit the card, until the watch is over."""
        order, first = self.order(runs.rows, runs.records), 0
        each = runs.rows.itemsize * runs.rows.shape[1] + runs.records.itemsize + self.context + 8
        each += 0 if runs.strobe is None else 24 * (runs.periods + 1)
        sizes = np.full(len(order), each)
        sizes[self._begins(runs.rows[order])[: len(order)]] += self.tables
        ends, room = np.cumsum(sizes), self.card.free() - self.tables
        while first < len(order) and not runs.watch.over:
            before = ends[first] - sizes[first]
            last = max(first + 1, int(np.searchsorted(ends, before + room, "right")))
            yield order[first : min(last, first + _ROWS)]
            first = min(last, first + _ROWS)

    def _run(self, runs: _Runs, part: NDArray[np.intp]) -> None:
        """Run a chunk, launch by launch."""
        card, count, stopped = self.card, len(part), self.binding.STOPPED
        rows, states, stops = runs.rows[part], runs.records[part], runs.stops[part]
        begins = self._begins(rows)
        sets = rows[begins]
        tables, context = card.blank(len(sets) * self.tables), card.blank(count * self.context)
        card.launch(TABLES, len(sets), card.put(sets), tables, np.int64(len(sets)))
        flow = card.put(np.cumsum(begins, dtype=np.int32) - np.int32(1))
        marks = None if runs.strobe is None else runs.strobe[part]
        drawn = np.uintp(0) if marks is None else card.put(marks)
        at, ends = card.put(states), card.put(stops)
        fixed = card.put(rows), flow, tables, at, context, ends, drawn
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
        if not len(part):
            return
        states, stops = runs.records[part], runs.stops[part]
        marks = None if runs.strobe is None else runs.strobe[part]
        of = runs.rows[part], states, runs.periods, stops, marks, runs.position
        self.binding.run_many(*of, watch=runs.watch, lanes=1)
        runs.records[part], runs.stops[part] = states, stops
        if runs.strobe is not None:
            runs.strobe[part] = marks
