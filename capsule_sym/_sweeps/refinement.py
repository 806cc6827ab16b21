"""Charts of itineraries refined along the boundaries of their regions."""

from __future__ import annotations

import math
import os
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view as windows
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map.checks import checked_seconds
from capsule_sym._native import TimeUp, Watch
from capsule_sym._sweeps import itineraries
from capsule_sym._sweeps.axes import Axis
from capsule_sym._sweeps.execution import Ended, Summary, run_sweep
from capsule_sym._sweeps.results import Held, damaged_in_chart, open_results
from capsule_sym._sweeps.store import write_chart
from capsule_sym._sweeps.sweep import Sweep, check_sweep

_UNKNOWN = -1
_LONGEST_STRIDE = 2**20
_MOST_CELLS = 10**8  # held in memory
_LABEL = ("outcome", "itinerary", "period_number")

Numbers = NDArray[np.int32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Chart(Ended):
    """Refined chart: share of its points that were computed, and the summary of each round.

    `damaged` is the number of damaged parts that were found and written again. `outcomes` has the
    number of computed points by outcome. `finished` is False if a round ran out of time.
    """

    fraction: float
    rounds: tuple[Summary, ...]
    damaged: int
    outcomes: dict[str, int]
    finished: bool

    @property
    def statistics(self) -> dict[str, Any]:
        """Computed points, rounds, damaged parts, seconds, and points by outcome."""
        return {
            "computed": sum(one.computed for one in self.rounds),
            "passes": len(self.rounds),
            "damaged": self.damaged,
            "seconds": sum(one.seconds for one in self.rounds),
            "outcomes": self.outcomes,
        }


def refine_sweep(
    sweep: Sweep,
    store: str | os.PathLike[str],
    *,
    stride: int = 16,
    max_seconds: float = math.inf,
    **how: Any,
) -> Chart:
    """Chart of itineraries over two axes, computed only where neighbours differ.

    A lattice of every `stride`-th point is computed first. Then the stride is halved repeatedly. In
    each round the squares whose corners differ in outcome, itinerary or period_number, and the
    squares beside them, are computed at their midpoints; a point of any other square gets the label
    of its corners. A region smaller than the stride that lies within one square is missed. The
    points of each round are a sweep of their own in the store, and resume as one; `how` has the
    further arguments of `run_sweep`. The chart is written after all rounds; `open_results` reads
    `outcome`, `itinerary`, `period_number` and `computed`.

    Raises InvalidInput unless there are two axes of one quantity each; else as `run_sweep`.
    """
    check_sweep(sweep)
    if len(sweep.axes) != 2 or any(len(axis.quantities) != 1 for axis in sweep.axes):
        raise InvalidInput("axes", [a.name for a in sweep.axes], "two, of one quantity each")
    if (
        isinstance(stride, bool)
        or not isinstance(stride, int)
        or stride < 1
        or stride & (stride - 1)
        or stride > _LONGEST_STRIDE
    ):
        raise InvalidInput("stride", stride, f"a power of two, at most {_LONGEST_STRIDE}")
    if sweep.size > _MOST_CELLS:
        raise InvalidInput("cells", sweep.size, f"at most {_MOST_CELLS} for a refined chart")
    sweep = replace(sweep, compute=("itinerary",), chunk=())
    limit = Watch(checked_seconds(max_seconds))
    points = _Points(sweep, Path(store), limit, how)
    with suppress(TimeUp):
        _refine(points, stride)
    found = points.chart()
    if found.finished:
        points.write()
    return found


def _refine(points: _Points, stride: int) -> None:
    """Compute round by round until every point has a label."""
    sweep = points.sweep
    lattice = [np.unique(np.append(np.arange(0, n, stride), n - 1)) for n in sweep.shape]
    points.compute(_where(sweep.shape, lattice))
    while True:
        # A computed point may differ from its neighbours, which are then checked too.
        while points.compute(_corners(points, lattice)):
            pass
        middles = [(lines[:-1] + lines[1:]) // 2 for lines in lattice]
        finer = [np.union1d(*pair) for pair in zip(lattice, middles, strict=True)]
        if all(len(new) == len(old) for new, old in zip(finer, lattice, strict=True)):
            break
        points.fill(lattice, finer)
        lattice = finer


class _Points:
    """Labels of all points of the chart, as numbers, with a mask of those computed."""

    def __init__(self, sweep: Sweep, store: Path, limit: Watch, how: dict[str, Any]) -> None:
        self.sweep, self.store, self.limit, self.how = sweep, store, limit, how
        self.number: Numbers = np.full(sweep.shape, _UNKNOWN, np.int32)
        self.computed: Mask = np.zeros(sweep.shape, bool)
        self.labels: dict[tuple[int, int, int], int] = {}
        self.texts: dict[int, str] = {}
        self.cores: set[str] = set()
        self.summaries: list[Summary] = []
        self.rounds: Iterator[int] = count()

    def compute(self, wanted: Mask) -> bool:
        """Compute the points that are not computed yet; returns False if there are none."""
        rows, columns = np.nonzero(wanted & ~self.computed)
        if not rows.size:
            return False
        first, second = self.sweep.axes
        values = np.column_stack([first.values[rows, 0], second.values[columns, 0]])
        axis = Axis("point", first.quantities + second.quantities, values)
        part = replace(self.sweep, axes=(axis,), chunk=())
        place = self.store / f"round-{next(self.rounds):03d}"
        self.summaries.append(run_sweep(part, place, max_seconds=self.limit.left, **self.how))
        if not self.summaries[-1].finished:
            raise TimeUp(self.limit)
        self.cores.update(Held(place).tally().cores)
        with open_results(place) as results:
            self.texts.update(itineraries.texts(results))
            label = np.column_stack([results[name].values for name in _LABEL])
        kinds, inverse = np.unique(label, axis=0, return_inverse=True)
        numbers = [self.labels.setdefault(tuple(k), len(self.labels)) for k in kinds.tolist()]
        self.number[rows, columns] = np.array(numbers, np.int32)[inverse.ravel()]
        self.computed[rows, columns] = True
        return True

    def fill(self, lattice: list[NDArray[np.intp]], finer: list[NDArray[np.intp]]) -> None:
        """Label each point of a finer lattice that is not computed as one of its corners."""
        nearest = [
            old[np.searchsorted(old, new, side="right") - 1]
            for old, new in zip(lattice, finer, strict=True)
        ]
        at = np.ix_(*finer)
        unknown = self.number[at] == _UNKNOWN
        self.number[at] = np.where(unknown, self.number[np.ix_(*nearest)], self.number[at])

    def chart(self) -> Chart:
        """Chart of the points computed so far."""
        damaged = sum(s.damaged for s in self.summaries) + len(damaged_in_chart(self.store))
        outcomes = Counter[str]()
        for one in self.summaries:
            outcomes.update(one.outcomes)
        return Chart(
            fraction=outcomes.total() / self.sweep.size,
            rounds=tuple(self.summaries),
            damaged=damaged,
            outcomes=dict(outcomes),
            finished=all(one.finished for one in self.summaries),
        )

    def write(self) -> None:
        """Write the labels of all points to the store."""
        table = np.array(list(self.labels), dtype=np.int64)
        columns: dict[str, Any] = {name: table[self.number, i] for i, name in enumerate(_LABEL)}
        cores = sorted(self.cores)
        write_chart(self.store, self.sweep, columns, self.computed, self.texts, cores)


def _where(shape: tuple[int, ...], lattice: list[NDArray[np.intp]], chosen: Any = True) -> Mask:
    """Mask of the chosen points of a lattice, by default all of them."""
    mask = np.zeros(shape, bool)
    mask[np.ix_(*lattice)] = chosen
    return mask


def _corners(points: _Points, lattice: list[NDArray[np.intp]]) -> Mask:
    """Corners of all squares of a lattice that are mixed, or beside a mixed one."""
    number = points.number[np.ix_(*lattice)]
    # An axis of one value is padded: its squares have each point twice.
    squares = windows(np.pad(number, [(0, n == 1) for n in number.shape], mode="edge"), (2, 2))
    mixed = squares.min(axis=(2, 3)) != squares.max(axis=(2, 3))
    beside = windows(np.pad(mixed, 1), (3, 3)).max(axis=(2, 3))
    chosen = windows(np.pad(beside, 1), (2, 2)).max(axis=(2, 3))
    chosen = chosen[: number.shape[0], : number.shape[1]]
    return _where(points.number.shape, lattice, chosen)
