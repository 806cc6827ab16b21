"""Two lists of switches matched: which are the same, which are missed, which are invented."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Pair(NamedTuple):
    """Places of a switch in the true list and in the given one; None where it is not there."""

    true: int | None
    given: int | None


def matched(
    true: tuple[NDArray[np.float64], Sequence[object]],
    given: tuple[NDArray[np.float64], Sequence[object]],
    slack: float,
    until: float = math.inf,
) -> list[Pair]:
    """Pairs of the switches of two lists, in the order of time.

    Each list has ascending times (n,) and what happens at each. Switches are the same if this is,
    and if their times differ by less than `slack`. The pairs have the least sum of differences of
    times, over `slack`, and of 1 for each switch that has no other. A switch of the true list after
    `until` that has no other is left out.
    """
    (times, events), (found, happened) = true, given
    rows, columns = len(times), len(found)
    numbers = {event: k for k, event in enumerate(dict.fromkeys([*events, *happened]))}
    kinds = np.array([numbers[event] for event in happened], dtype=int)
    cost, before = np.arange(columns + 1, dtype=float), np.arange(columns + 1)
    moves = np.zeros((rows + 1, columns + 1), np.int8)  # 0 given alone, 1 true alone, 2 both
    for i in range(rows):
        off = np.abs(found - times[i]) / slack
        same = (kinds == numbers[events[i]]) & (off < 1)
        both = np.concatenate([[np.inf], np.where(same, cost[:-1] + off, np.inf)])
        alone = cost + 1
        ahead = np.minimum(both, alone) - before
        least = np.minimum.accumulate(ahead)
        moves[i + 1] = np.where(both <= alone, 2, 1) * (ahead == least)
        cost = least + before

    i, j, pairs = rows, columns, list[Pair]()
    while i or j:  # the cheapest way through the table
        move = moves[i, j]
        pairs.append(Pair(i - 1 if move else None, None if move == 1 else j - 1))
        i, j = i - int(move > 0), j - int(move != 1)
    return [
        pair for pair in pairs[::-1] if pair.given is not None or times[pair.true or 0] <= until
    ]
