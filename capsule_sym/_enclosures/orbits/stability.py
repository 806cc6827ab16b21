"""The derivative of one period of an orbit, and Jury's conditions on its multipliers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from capsule_sym._enclosures.numbers.balls import Ball, unit
from capsule_sym._enclosures.numbers.fields import C
from capsule_sym._enclosures.orbits.shooting import BoxValues
from capsule_sym._enclosures.passage.switches import saltation, three


@dataclass(frozen=True)
class Characteristic:
    """The polynomial m^3 - trace m^2 + minors m - determinant whose roots are the multipliers."""

    trace: Ball
    minors: Ball
    determinant: Ball

    @property
    def jury(self) -> tuple[Ball, ...]:
        """Jury's conditions: all positive exactly if all multipliers are inside the unit circle."""
        a, b, c = self.trace, self.minors, self.determinant
        return (
            1 - a + b - c,
            1 + a + b + c,
            1 - c,
            1 + c,
            1 - b + a * c - c * c,
        )


def monodromy(found: BoxValues) -> Any:
    """Monodromy matrix (3, 3) over all orbits of a box.

    The period begins with the first segment of stick, or else with the first segment.
    """
    segments = found.itinerary.segments
    n = len(segments)
    first = next((i for i, field in enumerate(found.fields) if field.stick), 0)
    product: Any = unit(3)
    if found.fields[first].stick:  # in stick v_c is not part of the state
        product[C, C] = 0
    for i in [*range(first, n), *range(first)]:
        after = (i + 1) % n
        product = three(found.flows[i]) * product
        jump = found.fields[i], found.fields[after], segments[i].guard, found.nodes[after].state
        product = saltation(*jump) * product
    return product


def characteristic(m: Any) -> Characteristic:
    """The characteristic polynomial, in balls, of a (3, 3) matrix of balls or of a form."""

    def minor(i: int, j: int, k: int, n: int) -> Any:
        return m[i, k] * m[j, n] - m[i, n] * m[j, k]

    trace = m[0, 0] + m[1, 1] + m[2, 2]
    minors = minor(0, 1, 0, 1) + minor(0, 2, 0, 2) + minor(1, 2, 1, 2)
    determinant = (
        m[0, 0] * minor(1, 2, 1, 2) - m[0, 1] * minor(1, 2, 0, 2) + m[0, 2] * minor(1, 2, 0, 1)
    )
    found = (trace, minors, determinant)
    return Characteristic(*(getattr(one, "hull", one) for one in found))
