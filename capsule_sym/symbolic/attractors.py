"""The periodic motion that the motion from rest tends to, with proof.

The state one excitation period later is a smooth function of the state as long as the order of
switches stays the same. Where it is proved to map a box into itself and to contract it, Banach's
theorem gives exactly one periodic motion through the box, of one period, to which every motion
that enters the box tends; the motion from rest is followed until it has entered. The sides of the
box are chosen along the eigenvectors of the derivative, in floating point: any choice that passes
the check is a proof.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import sympy as sp

from capsule_sym.symbolic.elimination import Undecided
from capsule_sym.symbolic.intervals import (
    ZERO,
    Interval,
    Values,
    Vector,
    dot,
    exact,
    hull,
    middle,
    rational,
    upper,
)
from capsule_sym.symbolic.orbits import Box, Leg, Passage, System
from capsule_sym.symbolic.switching import LocalMap

_RADII = [Fraction(1, 10**n) for n in (5, 7, 9)]  # of the boxes to try
_SETTLED = Fraction(1, 100)  # change in a period, in radii, at which a box is tried
_MOST_PERIODS = 250
_UNITS = [[exact(i == j) for j in range(3)] for i in range(3)]


@dataclass(frozen=True)
class Attractor:
    """A periodic motion of one excitation period to which the motion from (0, 0, 0) tends.

    Within `radius` of `state` (x_r, v_r, v_c) at cos(omega tau) = 1, along the sides of a box that
    the motion from rest has entered after `periods`. From then on its distance to the periodic
    motion shrinks in every period, at least by `factor`.
    """

    legs: tuple[Leg, ...]
    state: tuple[Fraction, ...]
    radius: Fraction
    factor: Fraction
    periods: int

    @property
    def maps(self) -> tuple[LocalMap, ...]:
        """The local maps of one period in order of time; none where there is no switch."""
        return maps_of(self.legs)


def maps_of(legs: Sequence[Leg]) -> tuple[LocalMap, ...]:
    """The local maps of a period that ends in the leg in which it begins."""
    begun = [(leg.field, leg.plane) for leg in legs if leg.plane]
    return tuple(
        LocalMap(target, field, source)
        for (field, source), (_, target) in zip(begun, [*begun[1:], *begun[:1]], strict=True)
    )


def _basis(slopes: Sequence[Vector], size: int) -> list[list[Fraction]]:
    """Real and imaginary parts of the eigenvectors of a derivative, as columns."""
    derivative = np.array([[float(middle(x)) for x in slope[:size]] for slope in slopes]).T
    values, vectors = np.linalg.eig(derivative)
    parts = np.where(values.imag >= 0, vectors.real, vectors.imag)
    return [[Fraction(x) for x in row] for row in parts.tolist()]


def _inverse(matrix: list[list[Fraction]]) -> list[list[Fraction]]:
    inverse = sp.Matrix(matrix).applyfunc(sp.Rational).inv()
    return [[rational(x) for x in row] for row in inverse.tolist()]


def contraction(
    system: System, reached: Vector, radius: Fraction
) -> tuple[Passage, tuple[Fraction, ...], Fraction]:
    """One period from a box about a state, the box's centre, and by how much it shrinks.

    Raises `Undecided` where it is not proved that the state is in the box, and that the box is
    mapped into itself and contracted.
    """
    size = 2 if system.field_at(reached).stick else 3
    rounded = tuple(map(middle, reached))
    state = [exact(x) for x in rounded]
    sides = _basis(system.passage(state, _UNITS[:size]).slopes, size)
    inverse = [[exact(x) for x in row] for row in _inverse(sides)]
    directions = [
        [*map(exact, column), *[ZERO] * (3 - size)] for column in zip(*sides, strict=True)
    ]
    centre = system.passage(state, directions)
    reach = exact(radius)
    box = Box(centre, hull(-reach, reach))
    around = [box.around(x, row) for x, *row in zip(state, *directions, strict=True)]
    passed = system.passage(around, directions, box)
    factors = [sum((abs(dot(row, slope)) for slope in passed.slopes), ZERO) for row in inverse]

    def inside(point: Vector, margins: Sequence[Interval]) -> bool:
        """Whether a point is in the box, from each side by more than a margin in radii."""
        shift = [x - y for x, y in zip(point, state, strict=True)]
        return all(
            abs(dot(row, shift)) < reach * (1 - margin)
            for row, margin in zip(inverse, margins, strict=True)
        )

    # The image of the box is within factors times radius of the image of its centre.
    proved = inside(reached, [ZERO] * size) and inside(centre.end, factors)
    if not proved or passed.legs[0].field != passed.legs[-1].field:
        raise Undecided(f"no box of radius {radius} is contracted")
    return passed, rounded, max(map(upper, factors))


def attractor(values: Values) -> Attractor:
    """The periodic motion to which that from (0, 0, 0) at tau = 0 tends, at rational parameters.

    Raises `Undecided` where that is not proved.
    """
    system = System(values)
    reached: Vector = [ZERO] * 3
    radii = list(_RADII)
    for periods in range(_MOST_PERIODS):
        after = system.passage(reached).end
        near = exact(radii[0] * _SETTLED)
        if all(abs(x - y) < near for x, y in zip(reached, after, strict=True)):
            try:
                passed, state, factor = contraction(system, reached, radii[0])
                return Attractor(passed.legs, state, radii[0], factor, periods)
            except Undecided:
                if not radii[1:]:
                    raise
                del radii[0]
        reached = after
    raise Undecided(f"not settled after {_MOST_PERIODS} periods")
