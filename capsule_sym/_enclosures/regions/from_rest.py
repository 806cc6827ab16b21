"""Parts of alpha in [0.001, 2], and the attempt to prove where the motions from rest go."""

from __future__ import annotations

from collections.abc import Sequence
from time import process_time
from typing import NamedTuple

from capsule_sym._enclosures.case import ALPHA, EXACT, GAMMAS
from capsule_sym._enclosures.passage.segments import Interval
from capsule_sym._enclosures.regions.attraction import tendency
from capsule_sym._enclosures.regions.patches import Outcome
from capsule_sym._errors import CapsuleError

_OVERLAP = 1e-14


class AlphaPart(NamedTuple):
    """A part of alpha in [0.001, 2] at one of the mass ratios of Section 4.

    Places are counted from 2 downwards: there motions settle soonest, so that the share grows fast.
    """

    ratio: int
    level: int
    place: int

    @property
    def area(self) -> float:
        """The share of all alphas at both mass ratios."""
        return 2.0**-self.level / len(GAMMAS)

    @property
    def alphas(self) -> Interval:
        """Its values of alpha; neighbours overlap by more than the rounding of the middle."""
        first, last = ALPHA
        middle = last - (last - first) * (2 * self.place + 1) * 2.0 ** -(self.level + 1)
        return Interval(middle, (last - first) * 2.0 ** -(self.level + 1) + _OVERLAP)

    def halved(self, along: Sequence[int]) -> list[AlphaPart]:
        """Its halves."""
        ratio, level, place = self
        return [AlphaPart(ratio, level + 1, 2 * place + half) for half in (0, 1)]


def attempt(part: AlphaPart, state: tuple[float, ...] = ()) -> Outcome:
    """Try to prove what the motions from rest tend to, for all alpha of a part."""
    begin = process_time()
    try:
        found = tendency(EXACT | {"gamma": GAMMAS[part.ratio]}, part.alphas)
    except (CapsuleError, ArithmeticError, ValueError):
        return Outcome(None, (0,), (), process_time() - begin)
    fields = " ".join(f"F{field}" for field in _first_least(found.itinerary))
    return Outcome(f"{fields}, gamma = {GAMMAS[part.ratio]}", (), (), process_time() - begin)


def _first_least(fields: tuple[int, ...]) -> tuple[int, ...]:
    return min(fields[k:] + fields[:k] for k in range(len(fields)))
