"""Whether two orbits are one, or an orbit is a shorter one traversed again."""

from __future__ import annotations

from math import gcd

import numpy as np
from numpy.typing import NDArray

from capsule_sym._orbits.shooting.orbit import Orbit, close
from capsule_sym._orbits.shooting.word import Word

_SAME = 1e-7  # states of one orbit, found twice, differ by less


def same(orbit: Orbit, other: Orbit) -> bool:
    """Whether two orbits are one, begun at different switches perhaps."""
    if orbit.word.multiple != other.word.multiple or len(orbit.word) != len(other.word):
        return False
    return any(
        orbit.word.fields == other.word.rotated(i).fields and _alike(orbit, 0, other, i)
        for i in range(len(other.word))
    )


def primitive(orbit: Orbit) -> Orbit:
    """The orbit traversed once: that of the shortest itinerary which it repeats."""
    word, most = orbit.word, gcd(len(orbit.word), orbit.word.multiple)
    for times in range(most, 1, -1):
        count = len(word) // times
        if most % times or word.fields != word.fields[:count] * times:
            continue
        once = Word(word.legs[:count], word.multiple // times)
        found = close(orbit.values, once, list(orbit.z[: 4 + count]), backend=orbit.backend)
        if isinstance(found, Orbit) and all(
            _alike(orbit, i, found, i % count) for i in range(len(word))
        ):
            return found
    return orbit


def _alike(orbit: Orbit, leg: int, other: Orbit, its: int) -> bool:
    one, two = _place(orbit, leg), _place(other, its)
    return bool(abs(one - two).max() < _SAME * (1 + abs(one).max()))


def _place(orbit: Orbit, leg: int) -> NDArray[np.float64]:
    """State and forcing where a leg begins."""
    span = orbit.shot.spans[leg]
    angle = float(span.angle)
    return np.array([*span.start, np.cos(angle), np.sin(angle)], dtype=float)
