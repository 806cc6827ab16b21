"""Two lists of switches matched: which are the same, which are missed, which are invented."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_SAME_AGAIN = 3
"""Number of equal switches in a row after which two lists agree again."""


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
    times, over `slack`, and of 1 for each switch that has no other. A few coincidences between
    differences are none: fewer than three in a row, unless the lists end with them.
    A switch of the true list after `until` that has no other is left out.
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

    def counts(pair: Pair) -> bool:
        return pair.given is not None or times[pair.true or 0] <= until

    return list(filter(counts, _settled(list(filter(counts, _traced(moves))))))


def _traced(moves: NDArray[np.int8]) -> list[Pair]:
    """The pairs of the cheapest way through the table of moves."""
    i, j, pairs = moves.shape[0] - 1, moves.shape[1] - 1, list[Pair]()
    while i or j:
        move = moves[i, j]
        pairs.append(Pair(i - 1 if move else None, None if move == 1 else j - 1))
        i, j = i - int(move > 0), j - int(move != 1)
    return pairs[::-1]


def _settled(pairs: list[Pair]) -> list[Pair]:
    """The pairs, of which coincidences between differences are taken apart."""
    groups = [list(group) for _, group in groupby(pairs, key=lambda pair: None in pair)]
    found: list[Pair] = []
    for place, group in enumerate(groups):
        between = 0 < place < len(groups) - 1
        if between and None not in group[0] and len(group) < _SAME_AGAIN:
            found += [Pair(pair.true, None) for pair in group]
            found += [Pair(None, pair.given) for pair in group]
        else:
            found += group
    return found
