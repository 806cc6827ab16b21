"""Bifurcations on branches, points of curves of them, and codimension-two points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from capsule_sym._errors import Ended, InvalidInput, Status
from capsule_sym._map.backend import backend
from capsule_sym._map.result import brief
from capsule_sym._orbits.continuation.conditions import EventSolution, ExtendedSystem, orbit_at
from capsule_sym._orbits.continuation.kinds import NormalForm, normal_form
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.shooting.admissibility import Inequality
from capsule_sym._orbits.shooting.changes import remove_segment, swap_segment, zero_segments
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import KEPT, halved_at, whole_orbit

_SAME = 1e-9  # parameters of a point found twice differ by less


def sorted_multipliers(orbit: Orbit) -> tuple[complex, ...]:
    """Floquet multipliers of an orbit as plain numbers, the largest modulus first."""
    return tuple(complex(value) for value in orbit.multipliers)


@dataclass(frozen=True, kw_only=True)
class SolvedPoint(Ended):
    """Orbit that fulfils conditions, with the accuracy of the solution.

    `residual` is the largest entry of all equations and conditions, `iterations` the number of
    Newton steps, `status` CONVERGED or NOT_CONVERGED.
    """

    orbit: Orbit
    residual: float
    iterations: int
    status: Status


@dataclass(frozen=True, kw_only=True)
class BifurcationPoint(SolvedPoint):
    """Point with its multipliers.

    `segment` is the index, from 0, of the orbit's segment of duration 0; None without one.
    """

    segment: int | None = None

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Floquet multipliers of the orbit, the largest modulus first.

        At a border collision they are those of the itinerary with the segment. Those of the other
        itinerary (`multipliers_without`) are the same, except at a grazing-sliding bifurcation and
        at an edge of the drive, and where there is no other itinerary.
        """
        return sorted_multipliers(self.orbit)

    @cached_property
    def multipliers_without(self) -> tuple[complex, ...]:
        """Multipliers of the itinerary without the segment; the same at a smooth bifurcation.

        Empty if the fields that are left form no itinerary. For an orbit that is its own mirror
        image also without the image of the segment. They do not depend on the order of two
        switches, unless one is an edge of the drive.
        """
        itinerary, z, pulsed = self.orbit.itinerary, self.orbit.z, self.orbit.scene.facts.PULSED
        if self.segment is None or (not pulsed and swap_segment(itinerary, z, self.segment)):
            return self.multipliers
        return () if self.orbit_without is None else sorted_multipliers(self.orbit_without)

    @cached_property
    def orbit_without(self) -> Orbit | None:
        """Orbit in the other itinerary; derivatives of both orbits are those of the two sides.

        Its segment of duration 0 is absent, or stands for the other order of two switches. None
        without a `segment`, and if the fields that are left form no itinerary.
        """
        if self.segment is None:
            return None
        orbit, half_segment = halved_at(self.orbit, self.segment) or (self.orbit, self.segment)
        segment = self.segment if half_segment is None else half_segment
        numbers, itinerary, z, system = orbit.numbers, orbit.itinerary, orbit.z, orbit.system
        try:
            change = swap_segment(itinerary, z, segment, system)
            if change is None:
                change, _ = remove_segment(numbers, itinerary, z, system, segment)
        except InvalidInput:
            return None
        return whole_orbit(orbit_at(numbers, orbit.values, change.itinerary, change.z))


@dataclass(frozen=True, kw_only=True)
class Bifurcation(BifurcationPoint):
    """Bifurcation on a branch of periodic orbits, located exactly.

    Dimensionless, except a parameter in SI units.

    `value` is that of the parameter `parameter`, and `uncertainty` a bound on its rounding error;
    if the equations are not solved it is the width of the gap in which the bifurcation lies. `line`
    is the one that the orbit meets, or at an edge of the drive what is there: such as "at gap". It
    is empty at smooth bifurcations and at corners of higher codimension. `segment` is the index,
    from 0, of the segment of `orbit` with duration 0, None at a smooth or an unsolved one; `failed`
    names the inequality that failed, and is empty at a smooth one.

    `interval` has the values at both ends of the step within which it was found. At a located
    border collision the second one is that of the itinerary before, continued beyond the border; it
    is no point of the branch. `value` may lie outside the interval if the parameter turns back
    between, as at a fold.

    If `symmetry` is "kept", the orbit is its own mirror image, and the event also happens to
    the segment's image half a period later. If it is "broken", the orbits on one side are their own
    images, and those on the other touch the spring.
    The multipliers before and after are those of orbits on the branch next to it. If the branch
    ends, `itinerary_after` is None, and `multipliers_after` is empty. `label`, such as "PD2", is
    its name on the branch, `path` the varied parameters.
    """

    type: str
    parameter: str
    value: float
    uncertainty: float
    line: str = ""
    symmetry: str = ""
    interval: tuple[float, float]
    failed: str = ""
    itinerary_before: Itinerary
    itinerary_after: Itinerary | None
    multipliers_before: tuple[complex, ...]
    multipliers_after: tuple[complex, ...]
    label: str = ""
    path: ParameterPath | None = None

    def __repr__(self) -> str:
        place = f"{self.parameter} = {self.value:.9g}"
        after = "the end" if self.itinerary_after is None else self.itinerary_after
        return brief(self, f"{place}, {self.itinerary_before} to {after}", self.label or self.type)

    @cached_property
    def normal_form(self) -> NormalForm | None:
        """Leading terms of the orbits beside the bifurcation.

        None at a Neimark-Sacker bifurcation, at a corner of higher codimension, where the equations
        are not solved, and where the terms are not defined or not finite.
        """
        if not self.success:
            return None
        return normal_form(
            self.type,
            self.orbit,
            self.segment,
            self.path or ParameterPath(self.parameter, scene=self.orbit.scene),
            (self.multipliers_before, self.multipliers_after),
            mirrored=self.symmetry == KEPT,
        )


@dataclass(frozen=True, kw_only=True)
class CurvePoint(BifurcationPoint):
    """Orbit at a bifurcation, values of the two parameters, and the line that it meets.

    `values` are in the order of the curve's `parameters`. `segment` is the index, from 0, of the
    segment of duration 0, None on the curve of a smooth bifurcation, where `line` is empty.
    `admissibility` is the inequality of the itinerary with the least value. All values are
    dimensionless.
    """

    values: tuple[float, float]
    line: str
    admissibility: Inequality

    def __repr__(self) -> str:
        return brief(self, self.orbit.summary, "at {:.6g}, {:.6g}".format(*self.values))


@dataclass(frozen=True, kw_only=True)
class CodimensionTwoPoint(SolvedPoint):
    """Point of a curve where a second condition holds, located exactly; dimensionless.

    `types` and `lines` are those of the curve and of the second condition, `values` the two
    parameters, `uncertainties` bounds on their rounding errors, or widths of the gap if the
    equations are not solved. The itineraries before and after are those on the way outwards from
    the bifurcation at which the curve started; `itinerary_after` is None if the curve ends, but for
    Neimark-Sacker curves that end in a resonance. `segments` are the indices, from 0, of the
    segments of `orbit` with duration 0, that of the curve first; if the motion is its own mirror
    image they are those of its first half.
    """

    types: tuple[str, str]
    lines: tuple[str, str]
    values: tuple[float, float]
    uncertainties: tuple[float, float]
    failed: str = ""
    itinerary_before: Itinerary
    itinerary_after: Itinerary | None
    segments: tuple[int, ...] = ()

    def __repr__(self) -> str:
        return brief(self, " and ".join(self.types), "at {:.6g}, {:.6g}".format(*self.values))

    def at(self, values: tuple[float, float]) -> bool:
        """True if these are the point's values, each within the absolute tolerance 1e-9.

        They are in the order of the curve's `parameters`.
        """
        return all(
            abs(one - other) <= _SAME for one, other in zip(self.values, values, strict=True)
        )


def solution_fields(found: EventSolution, solved: bool = True) -> dict[str, Any]:
    """Fields of a SolvedPoint, for the whole orbit."""
    orbit = found.orbit
    return {
        "orbit": whole_orbit(orbit),
        "residual": float(found.residual),
        "iterations": orbit.iterations,
        "status": orbit.status if solved else Status.NOT_CONVERGED,
    }


def refined(one: Bifurcation) -> EventSolution:
    """Border collision in 50 digits; the doubles of parameters not on its path count as exact.

    Raises ValueError for a smooth bifurcation, and ArithmeticError if Newton's method fails.
    """
    if one.segment is None:
        raise ValueError(f"a {one.type} has no segment of duration 0")
    orbit = one.orbit
    with backend("mpmath", orbit.scene) as numbers:
        values = [numbers.number(value) for value in orbit.values]
        z = np.array([numbers.number(value) for value in orbit.z])
        free = (one.path or ParameterPath(one.parameter, scene=orbit.scene),)
        segments = zero_segments(orbit.itinerary, orbit.z, one.segment)
        found = ExtendedSystem(numbers, values, free, orbit.itinerary, segments).solve(z)
    if found is None:
        raise ArithmeticError(f"no {one.type} in 50 digits near {one.parameter} = {one.value!r}")
    return found
