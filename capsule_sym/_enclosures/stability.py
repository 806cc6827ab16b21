"""The derivative of one period of an orbit in balls, and Jury's conditions on its multipliers."""

from __future__ import annotations

from dataclasses import dataclass

from capsule_sym._enclosures.balls import Ball, Matrix, Unproved, arb, matrix
from capsule_sym._enclosures.fields import C, V
from capsule_sym._enclosures.krawczyk import Tube
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.itinerary import drift


@dataclass(frozen=True)
class Characteristic:
    """The polynomial m^3 - trace m^2 + minors m - determinant whose roots are the multipliers."""

    trace: Ball
    minors: Ball
    determinant: Ball

    @property
    def jury(self) -> tuple[Ball, ...]:
        """What is positive exactly if all multipliers are inside the unit circle (Jury)."""
        a, b, c = self.trace, self.minors, self.determinant
        return (
            1 - a + b - c,
            1 + a + b + c,
            1 - c,
            1 + c,
            1 - b + a * c - c * c,
        )


def monodromy(tube: Tube) -> Matrix:
    """The derivative (3, 3) of one period from a segment's start, over all orbits of a tube."""
    itinerary = tube.shooting.itinerary
    n = len(itinerary)
    first = next((i for i in range(n) if drift(itinerary.fields[i]) == 0), 0)
    size = 3 if drift(itinerary.fields[first]) else 2  # v_c is no state of stick
    product = matrix(3, 3, ((i, i, 1) for i in range(size)))
    for step in range(n):
        i = (first + step) % n
        flow = tube.wide.flows[i]
        product = matrix(3, 3, ((r, s, flow[r, s]) for r in range(3) for s in range(3))) * product
        if itinerary.segments[i].guard is Guard.DRIFT:
            product = _jump(tube, i, (i + 1) % n) * product
    return product


def _jump(tube: Tube, segment: int, following: int) -> Matrix:
    """The saltation matrix where a drift ends.

    The inner mass does not feel friction: v_r + v_c has the same rate before and after.
    """
    found = matrix(3, 3, ((i, i, 1) for i in range(3)))
    lost = arb(1)  # of v_c, where stick follows
    if drift(tube.shooting.itinerary.fields[following]):
        state = tube.wide.nodes[following].state
        before = (tube.wide.fields[segment].A * state)[C, 0]
        lost = 1 - (tube.wide.fields[following].A * state)[C, 0] / before
    found[V, C], found[C, C] = lost, 1 - lost
    return found


def characteristic(found: Matrix) -> Characteristic:
    """The characteristic polynomial of a (3, 3) matrix."""
    m = found.tolist()
    minors = sum(
        (m[i][i] * m[j][j] - m[i][j] * m[j][i] for i, j in ((0, 1), (0, 2), (1, 2))), arb(0)
    )
    return Characteristic(m[0][0] + m[1][1] + m[2][2], minors, found.det())


def prove_stable(tube: Tube) -> Characteristic:
    """Prove that every orbit of a tube attracts its neighbours, or raise Unproved."""
    found = characteristic(monodromy(tube))
    for number, value in enumerate(found.jury, 1):
        if not value > 0:
            raise Unproved("stability", f"Jury's condition {number} is not proved: {value.str(3)}")
    return found
