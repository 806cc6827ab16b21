"""Points of curves of bifurcations, and the points where a second condition holds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from capsule_sym._orbits.continuation.bifurcations import multipliers_without, sorted_multipliers
from capsule_sym._orbits.shooting.admissibility import Inequality
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit, OrbitStatus

_SAME = 1e-9  # parameters of one point, found twice, differ by less


@dataclass(frozen=True)
class CurvePoint:
    """A bifurcating orbit, the values of the two parameters, the line, the tightest inequality.

    `segment` is the segment of duration 0, None on the curve of a smooth bifurcation. `residual` is
    the largest entry of the equations, that of the bifurcation among them, `iterations` counts
    Newton's steps, and `status` says whether they are solved. All values are dimensionless.
    """

    values: tuple[float, float]
    line: str
    orbit: Orbit
    segment: int | None
    admissibility: Inequality
    residual: float
    iterations: int
    status: OrbitStatus

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of the orbit, the largest modulus first.

        At a border collision they are those of the itinerary with the segment: only at a
        grazing-sliding bifurcation has the other itinerary others, `multipliers_without` it.
        """
        return sorted_multipliers(self.orbit)

    @cached_property
    def multipliers_without(self) -> tuple[complex, ...]:
        """Multipliers of the itinerary without the segment; of a smooth bifurcation the same."""
        return multipliers_without(self.orbit, self.segment)


@dataclass(frozen=True)
class CodimensionTwoPoint:
    """A point of a curve where a second condition holds, located exactly; dimensionless.

    `types` and `lines` are those of the curve and of the second condition; `values` the two
    parameters with bounds on their rounding errors. `itinerary_after` is None where the curve ends.
    `segments` are those of `orbit` that have the duration 0, that of the curve first; of a motion
    that is its own mirror image those of its first half.
    """

    types: tuple[str, str]
    lines: tuple[str, str]
    values: tuple[float, float]
    uncertainties: tuple[float, float]
    residual: float
    iterations: int
    status: OrbitStatus
    failed: str
    itinerary_before: Itinerary
    itinerary_after: Itinerary | None
    orbit: Orbit
    segments: tuple[int, ...] = ()

    def at(self, values: tuple[float, float]) -> bool:
        """Whether these are the point's parameters, as far as those of a point found twice are."""
        return all(
            abs(one - other) <= _SAME for one, other in zip(self.values, values, strict=True)
        )
