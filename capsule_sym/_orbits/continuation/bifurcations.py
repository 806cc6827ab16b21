"""Bifurcations of periodic orbits: what a record says, and where a smooth one is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Backend, backend
from capsule_sym._map.isolation import LEAST, brent
from capsule_sym._orbits.continuation.events import (
    ADDING,
    CORNER,
    CROSSING,
    FOLD,
    GRAZING,
    GRAZING_SLIDING,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    RESONANCE_1_1,
    RESONANCE_1_2,
    SWITCHING,
    BorderCollision,
    solve_event,
)
from capsule_sym._orbits.continuation.normal_forms import NormalForm, normal_form
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.shooting.changes import remove_segment, swap_segment
from capsule_sym._orbits.shooting.equations import Matrix, Vector, shooting
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.monodromy import monodromy_derivative
from capsule_sym._orbits.shooting.orbit import Orbit, OrbitStatus
from capsule_sym._orbits.shooting.stability import floquet_multipliers, monodromy_matrix
from capsule_sym._orbits.shooting.symmetry import KEPT, halved_at, whole_orbit

INITIALS = {
    FOLD: "FO",
    PERIOD_DOUBLING: "PD",
    NEIMARK_SACKER: "NS",
    GRAZING: "GR",
    ADDING: "AS",
    GRAZING_SLIDING: "GS",
    CROSSING: "CS",
    SWITCHING: "SS",
    CORNER: "BI",
}
SMOOTH = (FOLD, PERIOD_DOUBLING, NEIMARK_SACKER)

_UNIT = 2.0**-53
_ROUNDINGS = 64  # of a test function, in units of its largest terms
_STEP = 1e-4
_SHARE = 1e-14  # how near the root of a test function is taken


@dataclass(frozen=True)
class Bifurcation:
    """A bifurcation on a branch of periodic orbits, located exactly; dimensionless.

    `value` is that of the parameter `parameter` and `uncertainty` a bound on its rounding error.
    `residual` is the largest entry of the equations there, that of the bifurcation among them,
    `iterations` how many steps led to it, and `status` whether it is solved; where it is
    not, the uncertainty is all of the interval. `line` and
    `surfaces` are those that the orbit meets (empty for a smooth bifurcation), `segment` the
    segment of `orbit` that has the duration 0 (None for a smooth one), `interval` the values
    between which the branch stepped over it, `failed` the inequality that failed. Where `symmetry`
    is "kept" the orbits are their own mirror images, and it happens to the segment's image half a
    period later too; where it is "broken" those on one side are, those on the other touch the
    spring. The multipliers are those of orbits on the branch a little before and after.
    `itinerary_after` is None where the branch ends. `label`, such as "PD2", names it on its branch;
    `path` is what varies there.
    """

    type: str
    parameter: str
    value: float
    uncertainty: float
    residual: float
    iterations: int
    status: OrbitStatus
    line: str
    surfaces: tuple[str, ...]
    segment: int | None
    symmetry: str
    interval: tuple[float, float]
    failed: str
    itinerary_before: Itinerary
    itinerary_after: Itinerary | None
    multipliers_before: tuple[complex, ...]
    multipliers_after: tuple[complex, ...]
    orbit: Orbit
    label: str = ""
    path: ParameterPath | None = None

    @cached_property
    def multipliers(self) -> tuple[complex, ...]:
        """Multipliers of its orbit, at a border collision of the itinerary with the segment."""
        return sorted_multipliers(self.orbit)

    @cached_property
    def multipliers_without(self) -> tuple[complex, ...]:
        """Those of the itinerary without the segment, from the other side of a border collision.

        At a smooth bifurcation the same, and only at a grazing-sliding one others.
        """
        return multipliers_without(self.orbit, self.segment)

    @cached_property
    def normal_form(self) -> NormalForm | None:
        """What the bifurcation says of the orbits beside it; None where it has no normal form."""
        return normal_form(
            self.type,
            self.orbit,
            self.segment,
            self.path or ParameterPath(self.parameter),
            (self.multipliers_before, self.multipliers_after),
            mirrored=self.symmetry == KEPT,
        )


def refined(one: Bifurcation) -> BorderCollision:
    """A bifurcation at which a segment has duration 0, in 50 digits; the other parameters exact.

    Raises ValueError for a smooth bifurcation, and ArithmeticError where Newton's method fails.
    """
    if one.segment is None:
        raise ValueError(f"a {one.type} has no segment of duration 0")
    orbit = one.orbit
    with backend("mpmath") as numbers:
        values = [numbers.number(value) for value in orbit.values]
        z = np.array([numbers.number(value) for value in orbit.z])
        free = (one.path or ParameterPath(one.parameter),)
        found = solve_event(numbers, values, free, orbit.itinerary, z, (one.segment,))
    if found is None:
        raise ArithmeticError(f"no {one.type} in 50 digits near {one.parameter} = {one.value!r}")
    return found


def sorted_multipliers(orbit: Orbit) -> tuple[complex, ...]:
    """The multipliers of an orbit as plain numbers, the largest modulus first."""
    return tuple(complex(value) for value in floquet_multipliers(orbit))


def multipliers_without(orbit: Orbit, segment: int | None) -> tuple[complex, ...]:
    """The multipliers of an orbit without its segment of duration 0, sorted; empty if it needs it.

    Of an orbit that is its own mirror image also without the image of the segment.
    """
    if segment is None:
        return sorted_multipliers(orbit)
    half, its_segment = halved_at(orbit, segment) or (orbit, segment)
    orbit, segment = half, segment if its_segment is None else its_segment
    with backend("numpy") as numbers:
        itinerary, z = orbit.itinerary, orbit.z
        if swap_segment(itinerary, z, segment) is not None:
            return sorted_multipliers(whole_orbit(orbit))
        try:
            change, _ = remove_segment(numbers, itinerary, z, orbit.system, segment)
        except InvalidInput:
            return ()
        system = shooting(numbers, orbit.values, change.itinerary, change.z)
    short = Orbit(orbit.values, change.itinerary, change.z, system, orbit.backend)
    return sorted_multipliers(whole_orbit(short))


def evaluate_test_functions(orbit: Orbit) -> dict[str, float]:
    """The functions that vanish at a smooth bifurcation of an orbit."""
    return of_matrix(monodromy_matrix(orbit))


def of_matrix(matrix: Matrix) -> dict[str, float]:
    """The test functions of a monodromy matrix M.

    det(M - I) at a fold, det(M + I) at a period doubling, and the product of all 1 - mu_i mu_j,
    i < j, at a Neimark-Sacker bifurcation. At a 1:1 resonance a second multiplier is 1 at a fold,
    at a 1:2 resonance a second one -1 at a period doubling: there the derivative of the
    characteristic polynomial vanishes.
    """
    first, third = np.trace(matrix), np.linalg.det(matrix)
    second = (first * first - np.trace(matrix @ matrix)) / 2
    return {
        FOLD: float(third - second + first - 1),
        PERIOD_DOUBLING: float(1 + first + second + third),
        NEIMARK_SACKER: float(1 - second + first * third - third * third),
        RESONANCE_1_1: float(3 - 2 * first + second),
        RESONANCE_1_2: float(3 + 2 * first + second),
    }


def gradient_of_test_function(
    numbers: Backend, orbit: Orbit, name: str, directions: Matrix
) -> Vector:
    """Gradient (n + 4 + m,) of a test function by z and along m directions of the parameters."""
    matrix = monodromy_matrix(orbit)
    first, unit = np.trace(matrix), np.eye(3)
    third_by = np.cross(matrix[[1, 2, 0]], matrix[[2, 0, 1]])  # the cofactors
    second_by = first * unit - matrix.T
    of_first, of_second, of_third = {
        FOLD: (1, -1, 1),
        PERIOD_DOUBLING: (1, 1, 1),
        NEIMARK_SACKER: (np.linalg.det(matrix), -1, first - 2 * np.linalg.det(matrix)),
        RESONANCE_1_1: (-2, 1, 0),
        RESONANCE_1_2: (2, 1, 0),
    }[name]
    by = of_first * unit + of_second * second_by + of_third * third_by
    changes = monodromy_derivative(numbers, orbit, directions)
    return np.einsum("ij,kij->k", by, changes)  # type: ignore[no-any-return]


class SmoothEvent(NamedTuple):
    """Where a test function vanishes between two points of a path."""

    share: float
    orbit: Orbit
    doubt: float
    """Error of the share, estimated from the rounding of the test function and its slope."""
    residual: float
    iterations: int
    status: OrbitStatus
    uncertainties: tuple[float, ...] = ()
    """Bounds on the rounding of the free parameters, where all equations were solved at once."""


class _Lost(Exception):
    """The path between two points cannot be followed."""


def noise(orbit: Orbit) -> float:
    """Rounding of the test functions at an orbit."""
    return _ROUNDINGS * _UNIT * (1 + float(np.max(abs(monodromy_matrix(orbit))))) ** 3


def zero_of_test_function(
    name: str, between: Callable[[float], Orbit | None]
) -> SmoothEvent | None:
    """The orbit of a smooth bifurcation between two orbits where the test's signs differ.

    `between` gives the path's orbit at a share in [0, 1] of the way. Where the path or the root
    is lost on the way the result says so: its status is NOT_CONVERGED, its orbit the first one.
    None where the signs do not differ, and where the multipliers are not those of the bifurcation:
    a real pair mu, 1/mu for that of Neimark-Sacker.
    """

    def at(share: float) -> Orbit:
        orbit = between(share)
        if orbit is None:
            raise _Lost
        return orbit

    def test(share: float) -> float:
        return evaluate_test_functions(at(share))[name]

    try:
        first, last = at(0.0), at(1.0)
    except _Lost:
        return None
    ends = evaluate_test_functions(first)[name], evaluate_test_functions(last)[name]
    if not ends[0] * ends[1] < 0:
        return None
    known, iterations, residual = {0.0: ends[0], 1.0: ends[1]}, 0, abs(ends[0])

    def step(share: float) -> float:
        nonlocal iterations
        if share in known:
            return known[share]
        iterations += 1
        return test(share)

    try:
        share = brent(step, 0.0, 1.0, 5e-16, LEAST)
        orbit = at(share)
        residual = abs(evaluate_test_functions(orbit)[name])
        shares = max(share - _STEP, 0.0), min(share + _STEP, 1.0)
        slope = abs(test(shares[1]) - test(shares[0])) / (shares[1] - shares[0])
    except _Lost:
        if name == NEIMARK_SACKER and not (rotations(first) and rotations(last)):
            return None
        return SmoothEvent(0.0, first, 1.0, residual, iterations, OrbitStatus.NOT_CONVERGED)
    if name == NEIMARK_SACKER and not rotations(orbit):
        return None
    error = noise(orbit)
    solved = residual <= error + slope * _SHARE and orbit.status is OrbitStatus.CONVERGED
    status = OrbitStatus.CONVERGED if solved else OrbitStatus.NOT_CONVERGED
    doubt = error / slope if solved else 1.0
    return SmoothEvent(
        share, orbit, doubt, max(residual, float(orbit.residual)), iterations, status
    )


def rotations(orbit: Orbit) -> bool:
    """Whether an orbit has complex multipliers."""
    return any(abs(value.imag) > 1e-6 for value in sorted_multipliers(orbit))
