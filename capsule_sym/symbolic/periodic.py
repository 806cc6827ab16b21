"""The attracting periodic motion at given parameters, with proof, found without following it.

Newton's method on the map of one period gives a state close to the periodic motion, from a few
periods of the motion from rest; that a box around it is mapped into itself and contracted is then
proved as in `attractors`. It is not proved that the motion from rest enters the box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from capsule_sym.symbolic.attractors import contraction, maps_of
from capsule_sym.symbolic.elimination import Undecided
from capsule_sym.symbolic.intervals import ZERO, Values, Vector, exact, middle, upper
from capsule_sym.symbolic.orbits import Passage, System
from capsule_sym.symbolic.switching import LocalMap

_SETTLING = 40  # periods from rest before Newton's method
_STEPS = 12
_RADII = [Fraction(1, 10**n) for n in (7, 9, 11, 13)]


@dataclass(frozen=True)
class Periodic:
    """A periodic motion of one excitation period that attracts all motions near it.

    `passage` encloses one period of every motion from a box of half sides `radius` around `state`
    (x_r, v_r, v_c) at cos(omega tau) = 1; the periodic motion is one of them.
    """

    passage: Passage
    state: tuple[Fraction, ...]
    radius: Fraction

    @property
    def maps(self) -> tuple[LocalMap, ...]:
        """The local maps of one period in order of time; none where there is no switch."""
        return maps_of(self.passage.legs)

    def speed(self, place: int) -> tuple[Fraction, Fraction]:
        """Bounds of v_r where a leg begins."""
        value = self.passage.marks[place][0][1]
        return -upper(-value), upper(value)


def _near(system: System, start: Vector) -> Vector:
    """A state near the periodic motion, by Newton's method."""
    state = start
    for _ in range(_STEPS):
        size = 2 if system.field_at(state).stick else 3
        units = [[exact(i == j) for j in range(3)] for i in range(size)]
        passed = system.passage(state, units)
        rows = [[float(middle(x)) for x in slope[:size]] for slope in passed.slopes]
        gap = [float(middle(x - y)) for x, y in zip(passed.end, state, strict=True)][:size]
        step = np.linalg.solve(np.eye(size) - np.array(rows).T, np.array(gap))
        moved = [middle(x) + Fraction(d) for x, d in zip(state, step.tolist(), strict=False)]
        state = [*map(exact, moved), *[ZERO] * (3 - size)]
        if max(map(abs, gap)) < 1e-25:
            break
    return state


def periodic(values: Values, hint: Sequence[Fraction] | None = None) -> Periodic:
    """The attracting periodic motion near a state, or near the motion from rest without one.

    Any hint that leads to a proof will do. Raises `Undecided` without one.
    """
    system = System(values)
    reached: Vector = [exact(x) for x in hint or (0, 0, 0)]
    for _ in range(0 if hint else _SETTLING):
        reached = [exact(middle(x)) for x in system.passage(reached).end]
    reached = _near(system, reached)
    for radius in _RADII:
        try:
            passage, state, _ = contraction(system, reached, radius)
        except Undecided:
            continue
        return Periodic(passage, state, radius)
    raise Undecided(f"no box is contracted at {values}")
