"""Steady motions of many starts, closed in batches by the core."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._map.many import simulate_many
from capsule_sym._map.steady import LONGEST
from capsule_sym._native import present
from capsule_sym._orbits.metrics.many import MOST_SEGMENTS, Performances, performance_many
from capsule_sym._parameters import Scene
from capsule_sym._processes import processors

_REPEATED = 1e-2  # change over its periods, over the motion's size, below which a run is closed
_REPEATS, _APART = 5e-2, 0.2  # the same of all states of its last period, and over their spread
_NEAR = 1e-2  # distance of the closed motion from its run
FIRST, _MOST = 64, 1024
"""Excitation periods of the first stretch of a run and of the last: within these a motion settles
at a damping of 0.003."""
_MOST_OPEN = 100  # segments of a run that the core may fail to decide, before it counts as unknown
UNKNOWN = -1
_ARRIVED = 1e-7  # distance at which a run has arrived at its motion


class Settled(NamedTuple):
    """Motions of n starts: closed ones, and the number of their excitation periods, (n,).

    The number is 0 if a start has not settled on a motion, and UNKNOWN if the core leaves its run
    open or there is no time for it.
    """

    found: Performances
    period_numbers: NDArray[np.int64]

    def put(self, some: NDArray[np.intp], found: Performances, period_numbers: Any) -> None:
        """Replace some of the motions."""
        self.found.records[some], self.found.fields[some] = found.records, found.fields
        self.period_numbers[some] = period_numbers

    def branch(self, i: int) -> tuple[int, ...]:
        """Period number and fields of one period of motion i; empty without one."""
        number = int(self.period_numbers[i])
        return (number, *self.found.cycle(i)) if number > 0 else ()


def settle_many(
    rows: Vector,
    states: ArrayLike,
    phases: ArrayLike = 0.0,
    *,
    first: int = FIRST,
    most: int = _MOST,
    gradients: bool = False,
    max_open: int = _MOST_OPEN,
    scene: Scene,
) -> Settled:
    """Motions on which starts (n, 3) settle, at rows (n, k) of the parameters of a scene.

    Each run is looked at after `first` excitation periods; others continue for twice
    as long, and so on for stretches of at most `most`.
    """
    count = len(rows)
    whole = _nothing(count, scene)
    left, length = np.arange(count), first
    begin = np.broadcast_to(np.asarray(states, dtype=float), (count, 3))
    at = np.broadcast_to(np.asarray(phases, dtype=float), (count,))
    while len(left) and length <= most and not present().over:
        run = simulate_many(
            rows[left],
            begin,
            at,
            length,
            keep="stroboscopic",
            max_seconds=present().left,
            max_open=max_open,
            threads=processors(),
            scene=scene,
        )
        whole.period_numbers[left[~run.success]] = UNKNOWN
        left = left[run.success]
        seen = min(length, 2 * LONGEST + 1)
        marks = run.kept[run.offsets[1:][run.success, None] + np.arange(-seen, 0)]
        found, number = _arrived(rows[left], marks, gradients, scene)
        whole.put(left[number > 0], found.of(number > 0), number[number > 0])
        begin, at = marks[number == 0, -1], np.zeros(int((number == 0).sum()))
        left, length = left[number == 0], 2 * length
    if length <= most:
        whole.period_numbers[left] = UNKNOWN  # the time is over
    return whole


def _nothing(count: int, scene: Scene) -> Settled:
    """Room for the motions of so many starts."""
    fields = np.zeros((count, MOST_SEGMENTS), np.uint8)
    records, stops = np.zeros(count, scene.records.ORBIT), np.zeros(count, np.int8)
    return Settled(Performances(records, stops, fields, scene), np.zeros(count, np.int64))


def _arrived(rows: Vector, marks: Vector, gradients: bool, scene: Scene) -> Settled:
    """Motions at the ends of n runs, from their last stroboscopic states (n, m, 3)."""
    count, last = len(rows), marks[:, -1]
    whole = _nothing(count, scene)
    numbers = whole.period_numbers
    size, least = 1 + abs(marks[:, -LONGEST:]).max(axis=(1, 2), initial=0.0), np.full(count, np.inf)
    for number in range(1, min(LONGEST, (marks.shape[1] - 1) // 2) + 1):
        before = marks[:, -1 - number]
        change = abs(last - before).max(axis=1)
        # This number of periods is skipped if another one repeats better.
        some = np.flatnonzero((change <= _REPEATED * size) & (change < least) & (numbers == 0))
        # A chance return is not one of the whole period.
        changes = abs(marks[some, -number:] - marks[some, -2 * number : -number]).max(axis=(1, 2))
        spread = np.inf if number == 1 else abs(marks[some] - last[some, None]).max(axis=(1, 2))
        some = some[changes <= np.minimum(_REPEATS * size[some], _APART * spread)]
        if not len(some):
            continue
        least[some] = change[some]
        found = performance_many(
            rows[some], last[some], number, gradients=gradients, threads=processors(), scene=scene
        )
        good = attracting(found, gradients)
        far = abs(last[some] - found.states).max(axis=1)
        nearer = (far <= _NEAR * size[some]) & (far < abs(before[some] - found.states).max(axis=1))
        # The run is on the motion, or approaches it period by period.
        good &= (far <= _ARRIVED * size[some]) | nearer
        whole.put(some[good], found.of(good), number)
    return whole


def attracting(found: Performances, gradients: bool = False) -> NDArray[np.bool_]:
    """Mask (n,) of motions that are closed, stable, and have finite values."""
    with np.errstate(invalid="ignore"):
        good: NDArray[Any] = found.closed & (abs(found.multipliers[:, 0]) < 1)
    good &= np.isfinite(found.values).all(axis=1)
    return good & np.isfinite(found.gradients).all(axis=(1, 2)) if gradients else good
