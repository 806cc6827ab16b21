"""Charts of motion types at full sharpness for the price of their boundaries."""

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
from capsule_sym._sweeps.quantities import COMPUTED
from capsule_sym._sweeps.results import Held, damaged_in_chart, open_results
from capsule_sym._sweeps.store import write_chart
from capsule_sym._sweeps.sweep import Sweep, check_sweep

_UNKNOWN = -1
_LONGEST_STRIDE = 2**20
_MOST_CELLS = 10**8  # which are held in memory
_LABEL = ("outcome", "itinerary", "period_number")

Numbers = NDArray[np.int32]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Chart(Ended):
    """A refined chart: the share of its points that were computed, and what each round did.

    `damaged` is the number of damaged parts that were found and made again, `outcomes` has numbers
    of computed points by the outcome's name; `finished` tells that no round ran out of time.
    """

    fraction: float
    rounds: tuple[Summary, ...]
    damaged: int
    outcomes: dict[str, int]
    finished: bool

    @property
    def statistics(self) -> dict[str, Any]:
        """Points computed, passes over the chart, damaged parts, seconds, and points by outcome."""
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
    """The chart of itineraries over two axes, computed only where neighbours differ.

    A lattice of every `stride`-th point is computed first. Then, stride by stride halved, the
    squares whose corners differ in outcome, itinerary or period_number, and the squares beside
    them, are computed at their midpoints; a point of any other square has the label of its corners.
    What is smaller than a stride and lies wholly within a square is not seen. The points of each
    round are a sweep of their own in the store, which is resumed as one is; `how` are the further
    arguments of `run_sweep`. `open_results` gives `outcome`, `itinerary`, `period_number` and
    `computed`; the chart is written when all rounds are finished.

    Raises InvalidInput for anything but two axes of one quantity each, and what `run_sweep` raises.
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
    """Computes round by round until every point has a label."""
    sweep = points.sweep
    lattice = [np.unique(np.append(np.arange(0, n, stride), n - 1)) for n in sweep.shape]
    points.compute(_where(sweep.shape, lattice))
    while True:
        # What is computed may differ from its neighbours, and then these are looked at too.
        while points.compute(_corners(points, lattice)):
            pass
        finer = [_halved(lines) for lines in lattice]
        if all(len(new) == len(old) for new, old in zip(finer, lattice, strict=True)):
            break
        points.fill(lattice, finer)
        lattice = finer


class _Points:
    """Labels of all points of the chart, as numbers, and which of them were computed."""

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
        """Computes the points that were not yet; returns whether there were any."""
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
        """Gives the points of a finer lattice that are not computed the label of a corner."""
        nearest = [
            old[np.searchsorted(old, new, side="right") - 1]
            for old, new in zip(lattice, finer, strict=True)
        ]
        at = np.ix_(*finer)
        unknown = self.number[at] == _UNKNOWN
        self.number[at] = np.where(unknown, self.number[np.ix_(*nearest)], self.number[at])

    def chart(self) -> Chart:
        """What was computed so far."""
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
        """Writes the labels of all points to the store."""
        table = np.array(list(self.labels), dtype=np.int64)
        dims = [axis.name for axis in self.sweep.axes]
        kinds = {"outcome": np.int8, "itinerary": np.int64, "period_number": np.int16}
        columns: dict[str, Any] = {
            name: (dims, table[self.number, i].astype(kinds[name])) for i, name in enumerate(_LABEL)
        }
        columns[COMPUTED] = (dims, self.computed)
        about = {"fraction_computed": float(self.computed.mean())}
        write_chart(self.store, self.sweep, columns, self.texts, sorted(self.cores), about)


def _where(shape: tuple[int, ...], lattice: list[NDArray[np.intp]], chosen: Any = True) -> Mask:
    """The points of a lattice that are chosen, all of them if not told otherwise."""
    mask = np.zeros(shape, bool)
    mask[np.ix_(*lattice)] = chosen
    return mask


def _corners(points: _Points, lattice: list[NDArray[np.intp]]) -> Mask:
    """The corners of all squares of a lattice that are mixed, or beside one that is."""
    number = points.number[np.ix_(*lattice)]
    # Along an axis of one value the squares are lines, with each end twice.
    squares = windows(np.pad(number, [(0, n == 1) for n in number.shape], mode="edge"), (2, 2))
    mixed = squares.min(axis=(2, 3)) != squares.max(axis=(2, 3))
    beside = windows(np.pad(mixed, 1), (3, 3)).max(axis=(2, 3))
    chosen = windows(np.pad(beside, 1), (2, 2)).max(axis=(2, 3))
    chosen = chosen[: number.shape[0], : number.shape[1]]
    return _where(points.number.shape, lattice, chosen)


def _halved(lines: NDArray[np.intp]) -> NDArray[np.intp]:
    return np.unique(np.append(lines, (lines[:-1] + lines[1:]) // 2))
