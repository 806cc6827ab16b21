"""Where an itinerary changes: the orbit with a segment of duration 0, and the event's name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.backend import backend as _backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.shooting.changes import around
from capsule_sym._orbits.shooting.equations import (
    ROUNDINGS,
    Matrix,
    SegmentFlow,
    ShootingSystem,
    Vector,
    shooting,
    solve,
)
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact, drift
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym.generated import formulas

_MOST_STEPS = 20
_LARGEST_RESIDUAL = 1024  # units of rounding
_RANK = 1e-9  # singular values below this share of the largest are taken for zero
_DIFFERENCE = 1e-6  # of the unknowns, for the gradient of a condition


class Vanishing(NamedTuple):
    """A quantity that is to vanish, the rounding in it, and its gradient where known.

    The gradient (n + 4 + free,) is by z and what varies.
    """

    value: float
    rounding: float
    gradient: Vector | None = None


#: What vanishes where no segment has the duration 0.
Condition = Callable[[Orbit], Vanishing]


class BorderCollision(NamedTuple):
    """An orbit on which certain segments have the duration 0, solved for, and how well.

    `values` are the seven parameters, of which as many as there are such segments were free. The
    `residual` is the largest entry of the equations'; `uncertainties` bound the errors of the free
    parameters to first order: the rounding of every equation carried through the inverse Jacobian.
    `iterations` counts the steps of Newton's method. In 50 digits the derivatives of `system` are
    those at the guess; `orbit` has its own.
    """

    itinerary: Itinerary
    segments: tuple[int, ...]
    z: Vector
    values: tuple[Number, ...]
    system: ShootingSystem
    residual: Number
    uncertainties: tuple[Number, ...]
    iterations: int

    def orbit(self, backend: str) -> Orbit:
        """The orbit, in the number system of a backend."""
        system = self.system
        if backend == "mpmath":
            with _backend(backend) as numbers:
                system = shooting(numbers, self.values, self.itinerary, self.z)
        return Orbit(self.values, self.itinerary, self.z, system, backend, self.iterations)


def solve_event(
    numbers: Backend,
    values: Sequence[Number],
    free: tuple[ParameterPath, ...],
    itinerary: Itinerary,
    z: Vector,
    segments: tuple[int, ...],
    conditions: Sequence[Condition] = (),
) -> BorderCollision | None:
    """The orbit on which each of `segments` has the duration 0, by Newton's method; None if none.

    Unknowns are the other entries of z and as many parameters as there are such segments and
    `conditions`, those that vary on the paths `free`; `z` and `values` hold the guess. Conditions,
    which vanish too, are for double precision; there may be one too many if it follows from others.
    In 50 digits the derivatives are computed at the guess alone: a step then leaves as much of the
    error as the guess was off, which is far less than a half.
    """
    gone = [4 + segment for segment in segments]
    rest = [i for i in range(len(z)) if i not in gone]
    given, z = list(values), np.array(list(z))
    z[gone] = numbers.number(0)
    # Near a segment of duration 0 the derivative has an error of some unit^(1/3), steps shrink by
    # that.
    small = numbers.sqrt(numbers.unit) * numbers.sqrt(numbers.sqrt(numbers.unit))
    kept, secant = None, _Secant()
    with np.errstate(all="ignore"):
        for iterations in range(1, _MOST_STEPS + 1):
            at = [path.value(given) for path in free]
            found = _system(numbers, given, free, itinerary, z, rest, conditions, kept, secant)
            residual, matrix = found.residual, found.matrix
            kept = kept or (found.orbit.system if numbers.name == "mpmath" else None)
            if not all(abs(value) < float("inf") for value in residual):
                return None
            try:
                step = _step(numbers, matrix, residual)
            except np.linalg.LinAlgError:
                return None
            secant.step = -step
            z[rest] = z[rest] - step[: len(rest)]
            for path, value, change in zip(free, at, step[len(rest) :], strict=True):
                given = path.placed(given, value - change)
            if max(abs(step)) <= small * (1 + max(abs(z))):
                secant = _Secant()
                found = _system(numbers, given, free, itinerary, z, rest, conditions, kept, secant)
                unknowns = np.array([*z[rest], *(path.value(given) for path in free)])
                solved = _solved(
                    numbers, found, unknowns, itinerary, z, segments, len(free), iterations
                )
                # Derivatives that are kept let the error fall by a factor, not by its square.
                if solved is not None or kept is None:
                    return solved
    return None


class _Secant:
    """Gradients of conditions that have no exact one: differences first, then Broyden's updates.

    An error of them costs steps of Newton's method only.
    """

    def __init__(self) -> None:
        self._rows: Matrix | None = None
        self._values = np.zeros(0)
        self.step = np.zeros(0)

    def rows(
        self,
        orbit_at: Callable[[Vector], Orbit],
        conditions: Sequence[Condition],
        values: Vector,
        size: int,
    ) -> Matrix:
        """The gradients (many, size) where the conditions have these values."""
        if self._rows is None:
            self._rows = np.zeros((len(conditions), size))
            for k, step in enumerate(_DIFFERENCE * np.eye(size)):
                ahead, behind = orbit_at(step), orbit_at(-step)
                ends = [(one(ahead).value, one(behind).value) for one in conditions]
                self._rows[:, k] = [(high - low) / (2 * _DIFFERENCE) for high, low in ends]
        else:
            missed = values - self._values - self._rows @ self.step
            self._rows = self._rows + np.outer(missed, self.step) / (self.step @ self.step)
        self._values = values
        return self._rows


class _System(NamedTuple):
    """The orbit at some unknowns, all equations there, roundings of conditions, derivatives."""

    orbit: Orbit
    residual: Vector
    roundings: list[float]
    matrix: Matrix


def _system(
    numbers: Backend,
    given: Sequence[Number],
    free: tuple[ParameterPath, ...],
    itinerary: Itinerary,
    z: Vector,
    rest: list[int],
    conditions: Sequence[Condition],
    kept: ShootingSystem | None,
    secant: _Secant,
) -> _System:
    def orbit_at(changed: Vector | None = None) -> Orbit:
        values, there = list(given), z
        if changed is not None:
            there = z.copy()
            there[rest] = there[rest] + changed[: len(rest)]
            for path, by in zip(free, changed[len(rest) :], strict=True):
                values = path.placed(values, path.value(given) + by)
        system = shooting(numbers, values, itinerary, there, kept)
        return Orbit(tuple(values), itinerary, there, system, numbers.name)

    orbit = orbit_at()
    matrix = _matrix(orbit.system, rest, free, [path.value(given) for path in free])
    if not conditions:
        return _System(orbit, orbit.system.residual, [], matrix)
    found = [condition(orbit) for condition in conditions]
    rows = np.zeros((len(conditions), matrix.shape[1]))
    unknown = [k for k, one in enumerate(found) if one.gradient is None]
    for row, one in zip(rows, found, strict=True):
        if one.gradient is not None:
            row[:] = [*one.gradient[rest], *one.gradient[len(z) :]]
    if unknown:
        others = [conditions[k] for k in unknown]
        values = np.array([found[k].value for k in unknown])
        rows[unknown] = secant.rows(orbit_at, others, values, matrix.shape[1])
    residual = np.append(orbit.system.residual, [one.value for one in found])
    roundings = [one.rounding for one in found]
    return _System(orbit, residual, roundings, np.vstack([matrix, rows]))


def _step(numbers: Backend, matrix: Matrix, residual: Vector) -> Vector:
    """The step of Newton's method; of more equations than unknowns some follow from the others."""
    if len(residual) == matrix.shape[1]:
        return solve(numbers, matrix, residual)
    step, _, rank, _ = np.linalg.lstsq(matrix, residual, rcond=_RANK)
    if rank < matrix.shape[1]:
        raise np.linalg.LinAlgError("dependent unknowns")
    return step


def _matrix(
    system: ShootingSystem, rest: list[int], free: tuple[ParameterPath, ...], at: Sequence[Number]
) -> Matrix:
    """The derivative of the equations by some entries of z and by what varies."""
    by = [path.along(system.by_p, value) for path, value in zip(free, at, strict=True)]
    return np.column_stack([system.by_z[:, rest], *by])


def _solved(
    numbers: Backend,
    found: _System,
    unknowns: Vector,
    itinerary: Itinerary,
    z: Vector,
    segments: tuple[int, ...],
    free: int,
    iterations: int,
) -> BorderCollision | None:
    orbit, residual, roundings, matrix = found
    closed, off = orbit.system.residual, residual[len(orbit.system.residual) :]
    if not max(abs(closed)) <= _LARGEST_RESIDUAL * numbers.unit * (1 + max(abs(unknowns))):
        return None
    if not all(abs(value) <= limit for value, limit in zip(off, roundings, strict=True)):
        return None
    rounding = ROUNDINGS * numbers.unit * (abs(matrix) @ abs(unknowns))
    if roundings:
        rounding[len(closed) :] = roundings
    if len(residual) > len(unknowns):
        rows = np.linalg.pinv(matrix)[-free:]
    else:
        # Columns: the rows of the inverse that give the parameters.
        last = np.full((len(unknowns), free), numbers.number(0))
        for k in range(free):
            at = len(unknowns) - free + k
            last[at, k] = last[at, k] + 1
        rows = solve(numbers, matrix.T, last).T
    uncertainties = tuple((abs(rows) @ (rounding + abs(residual))).tolist())
    return BorderCollision(
        itinerary,
        segments,
        z,
        orbit.values,
        orbit.system,
        max(abs(residual)),
        uncertainties,
        iterations,
    )


class Place(NamedTuple):
    """The type of an event, the line on which it happens, and the surfaces that meet there."""

    type: str
    line: str
    surfaces: tuple[str, ...]


GRAZING = "grazing"
ADDING = "adding-sliding"
GRAZING_SLIDING = "grazing-sliding"
CROSSING = "crossing-sliding"
SWITCHING = "switching-sliding"
CORNER = "boundary-intersection crossing"
FOLD = "fold"
PERIOD_DOUBLING = "period doubling"
NEIMARK_SACKER = "Neimark-Sacker"
RESONANCE_1_1, RESONANCE_1_2 = "1:1 resonance", "1:2 resonance"
CUSP = "cusp"
GENERALIZED_DOUBLING = "generalized period doubling"
DEGENERATE = "degenerate"

_SURFACES = {
    "L1": ("S1", "S2"),
    "L2": ("S2", "S3"),
    "L3": ("S4", "S5"),
    "L4": ("S5", "S6"),
    "L5": ("S1", "S4", "S7", "S9"),
    "L6": ("S2", "S5", "S7", "S9"),
    "L7": ("S2", "S5", "S8", "S10"),
    "L8": ("S3", "S6", "S8", "S10"),
    "L10": ("S1", "S4", "S8", "S10"),
    "O1": ("S1", "S2", "S4", "S5", "S7", "S9"),
    "O2": ("S2", "S3", "S5", "S6", "S8", "S10"),
}


def place(itinerary: Itinerary, system: ShootingSystem, segment: int) -> Place | None:
    """What happens where a segment has the duration 0; None for what has no name.

    Of the lines L1 to L4 the part is given too, such as L3^(2), see `symbolic.appendices`.
    """
    before, during, after = around(itinerary, segment)
    flow = system.flows[segment]
    if contact(before) != contact(after):
        if drift(before) == drift(after):
            return None
        guards = {itinerary.guard_before(segment), itinerary.segments[segment].guard}
        line = _corner(guards, flow)
        return Place(CORNER, line, _SURFACES[line])
    if contact(during) != contact(before):
        if before != after:
            return None
        sign = drift(before)
        surfaces = ("S2", "S5") if sign == 0 else ("S7", "S8") if sign > 0 else ("S9", "S10")
        return Place(GRAZING, "L9", surfaces)
    kind = _sliding(drift(before), drift(during), drift(after))
    if kind is None:
        return None
    line = _edge(flow)
    return Place(kind, f"{line}^({_part(flow, line)})", _SURFACES[line])


def _sliding(before: int, during: int, after: int) -> str | None:
    if before == after:
        return GRAZING_SLIDING if before else ADDING
    if during == 0 and after == -before:
        return CROSSING
    return SWITCHING if during == -before and after == 0 else None


def _edge(flow: SegmentFlow) -> str:
    """The edge of stick, L1 to L4, on which a segment begins."""
    force = flow.closed.margin + flow.c.friction
    return f"L{(1 if force > 0 else 2) + 2 * contact(flow.segment.field)}"


def _part(flow: SegmentFlow, line: str) -> int:
    """Number of the part of L1 to L4: by the range that the forcing leaves to the force's rate."""
    c, (_, v_r, _) = flow.c, flow.start
    side = 1 if line in ("L1", "L3") else -1
    turn, reach = -formulas.force_change(c, 0, -side * c.f_b), formulas.force_change(c, 0, c.alpha)
    speed = formulas.force_change(c, v_r, 0)
    return 1 if speed < turn - reach else 3 if speed > turn + reach else 2


def _corner(guards: set[Guard | None], flow: SegmentFlow) -> str:
    """The line or corner point on P1 = 0, P2 = delta where a segment between two guards begins."""
    if Guard.UPPER in guards:
        return "O1"
    if Guard.LOWER in guards:
        return "O2"
    c, (x_r, v_r, _) = flow.c, flow.start
    force = formulas.force(c, x_r, 0, v_r)
    if abs(force) < c.f_b:
        return "L6" if v_r > 0 else "L7"
    if v_r > 0:
        return "L5"
    return "L8" if force < 0 else "L10"
