"""Normal forms of bifurcations: leading terms of the orbits beside them.

Beside a bifurcation the parameter is a function of one amplitude s: to leading order parameter -
value = growth s^order. At a border collision s is the duration of the inserted segment. At a fold
it is the norm of the change of all durations. At a period doubling it is the norm of the difference
between the durations of one half of the doubled orbit and those of the orbit that doubles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.expansion import Guard
from capsule_sym._map.result import by_fields
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.continuation.points import kinds
from capsule_sym._orbits.shooting.changes import (
    is_kink,
    remove_segment,
    swap_segment,
    zero_segments,
)
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import STATES, Matrix, Vector, shooting, solve, touched
from capsule_sym._orbits.shooting.itinerary import Itinerary, ItinerarySegment, drift
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import halved_at, whole_orbit
from capsule_sym._orbits.shooting.taylor import carried, generator, quotient, residual_series

SUPERCRITICAL, SUBCRITICAL = "supercritical", "subcritical"
PERSISTENCE, NON_SMOOTH_FOLD = "persistence", "non-smooth fold"
_TOUCHES = (kinds.GRAZING, kinds.ADDING, kinds.GRAZING_SLIDING)
_POWERS = {
    kinds.GRAZING: 3,
    kinds.ADDING: 4,
    kinds.GRAZING_SLIDING: 2,
    kinds.CROSSING: 2,
    kinds.SWITCHING: 3,
    kinds.CORNER: 2,
    kinds.EDGE: 4,
}
_STOPS = (Guard.GAP, Guard.BACK)
_CANCELLED = 1e-9  # share of a coefficient below which a difference of two counts as rounding

_DIFFERENCE = 1e-3
_STATE = STATES
_LINEAR = _STATE + 3  # of the state, cos, sin and 1


class NormalForm(NamedTuple):
    """Leading terms of a bifurcation's normal form; dimensionless.

    Beside the bifurcation the parameter differs from its value by `growth * s**order`.

    `coefficient` is that of the Poincare map reduced to one variable: s -> s + coefficient s^2 at a
    fold, s -> -s + coefficient s^3 at a period doubling, which is supercritical if it is positive.
    It is None at a border collision.

    `discontinuity` is the leading term of the difference between the maps of the two itineraries at
    a border collision: the change of (x_r, v_r, v_c) by a segment of duration s, over `s**power`.
    At an edge of the drive `power` is 1 to 3; a piecewise-linear map has 1.

    `scenario` is "supercritical" or "subcritical" at a period doubling, and at a symmetry breaking,
    which is a period doubling of the first half. At a border collision it is "persistence" if the
    two itineraries have their orbits on different sides, and "non-smooth fold" if both are on one
    side. It is empty at a fold, and where the branch ends and the multipliers beyond are unknown.
    """

    order: int
    growth: float
    coefficient: float | None
    discontinuity: tuple[float, float, float] | None
    power: int
    scenario: str

    def __repr__(self) -> str:
        return by_fields(self)

    @property
    def exponent(self) -> float:
        """Power of the leading term; at a border collision as a function of the parameter."""
        return self.power if self.discontinuity is None else self.power / self.order


def normal_form(
    kind: str,
    orbit: Orbit,
    segment: int | None,
    path: ParameterPath,
    multipliers: tuple[Sequence[complex], Sequence[complex]],
    *,
    mirrored: bool,
) -> NormalForm | None:
    """Normal form of a bifurcation of this type; None if it has none, or a degenerate one.

    `multipliers` are those on both sides; `mirrored` is True if the orbit is its own mirror image.
    """
    if mirrored:
        orbit, segment = halved_at(orbit, segment) or (orbit, segment)
    with np.errstate(all="ignore"):
        try:
            if kind == kinds.FOLD:
                form = _fold(orbit, path)
            elif kind in (kinds.PERIOD_DOUBLING, kinds.SYMMETRY_BREAKING):
                form = _period_doubling(orbit, path)
            elif kind in _POWERS and segment is not None:
                form = _collision(kind, orbit, segment, path, multipliers)
            else:
                return None
        except (np.linalg.LinAlgError, ArithmeticError, InvalidInput):
            return None
    terms = form.growth, form.coefficient or 0.0, *(form.discontinuity or ())
    return form if np.all(np.isfinite(terms)) else None


def _collision(
    kind: str,
    orbit: Orbit,
    segment: int,
    path: ParameterPath,
    multipliers: tuple[Sequence[complex], Sequence[complex]],
) -> NormalForm:
    order, power = 2 if kind in _TOUCHES else 1, _POWERS[kind]
    if Guard.DRIFT in _corner_guards(orbit.itinerary, segment):
        # A drift that reverses where it lands does so later by the time of contact.
        ends = (orbit.itinerary.neighbour(k) for k in (segment - 1, segment + 1))
        power = 3 if any(drift(field, orbit.scene) == 0 for field in ends) else 2
    if is_kink(orbit.itinerary, zero_segments(orbit.itinerary, orbit.z, segment)):
        raise ArithmeticError("a slip whose two segments begin without a rate")
    first, power, (x_r, v_r, v_c) = _discontinuity(whole_orbit(orbit), segment, kind, power)
    growth = _growth(orbit, first % len(orbit.itinerary), path, order)
    scenario = _scenario(*multipliers) if power == order else PERSISTENCE
    terms = float(x_r), float(v_r), float(v_c)
    return NormalForm(order, growth, None, terms, power, scenario)


def _corner_guards(itinerary: Itinerary, segment: int) -> set[Guard | None]:
    """Guards that vanish together at a corner; empty elsewhere."""
    guards = {itinerary.guard_before(segment), itinerary.segments[segment].guard}
    return guards if guards & set(_STOPS) and len(guards) > 1 else set()


def _scenario(before: Sequence[complex], after: Sequence[complex]) -> str:
    """Scenario of a map that is piecewise linear to leading order, from det(I - M) of both."""
    if not after:
        return ""
    signs = [np.prod([1 - value for value in side]).real for side in (before, after)]
    return PERSISTENCE if signs[0] * signs[1] > 0 else NON_SMOOTH_FOLD


def _along(z: Vector, *coefficients: Vector, many: int) -> Matrix:
    """Curve from z, with so many coefficients."""
    rows = [z, *coefficients]
    return np.array([*rows, *([0 * z] * (many - len(rows)))])


def _growth(orbit: Orbit, segment: int, path: ParameterPath, order: int) -> float:
    """(parameter - value) / duration^order of the inserted segment."""
    z, column = orbit.z, kinds.DURATIONS + segment
    rest = [i for i in range(len(z)) if i != column]
    matrix = np.column_stack([orbit.system.by_z[:, rest], path.by(orbit.system.by_p, orbit.values)])
    many = order + 1 + orbit.itinerary.zeros(segment)
    along = 0 * z
    along[column] = 1
    for power in range(1, order + 1):
        series = residual_series(orbit, _along(z, along, many=many))
        change = -solve(orbit.numbers, matrix, series[power])
        # At a touch the parameter is constant to first order.
        along[rest] = along[rest] + change[:-1]
    return float(change[-1])


def _null_vectors(matrix: Matrix, n: int) -> tuple[Vector, Vector]:
    """Left and right null vector of a singular matrix, the right one of norm 1 in n durations."""
    left, _, right = np.linalg.svd(matrix)
    along = right[-1]
    return left[:, -1], along / np.linalg.norm(along[kinds.DURATIONS :][:n])


class _Singular(NamedTuple):
    """Equations of an orbit near a singularity: null vectors, and a leading term."""

    left: Vector
    along: Vector
    term: float
    by_multiplier: float


def quadratic(orbit: Orbit, like: Vector | None = None) -> _Singular:
    """Second derivative of an orbit's equations along their null vector, at a fold.

    The null vector points in the direction of `like`, a change of z.
    """
    n, z = len(orbit.itinerary), orbit.z
    left, along = _null_vectors(orbit.system.by_z, n)
    if like is not None and like @ along < 0:
        along = -along
    second = left @ residual_series(orbit, _along(z, along, many=3))[2]
    # With a multiplier 1 + m in place of 1 the equations are singular for m = 2 b s.
    return _Singular(left, along, float(second), float(left[n:] @ along[: kinds.DURATIONS]))


def cubic(orbit: Orbit) -> _Singular:
    """Third derivative of a doubled orbit's equations along their null vector.

    `orbit` is the orbit that doubles. The effect of the second derivative is eliminated.
    """
    n, whole = len(orbit.itinerary), doubled(orbit)
    left, along = _null_vectors(whole.system.by_z, n)
    second = residual_series(whole, _along(whole.z, along, many=3))[2]
    bordered = np.block([[whole.system.by_z, left[:, None]], [along, np.zeros(1)]])
    bent = -np.linalg.solve(bordered, np.append(second, 0.0))[:-1]
    third = left @ residual_series(whole, _along(whole.z, along, bent, many=4))[3]
    # With a multiplier 1 + 2 m in place of 1 the equations are singular for m = b s^2.
    return _Singular(
        left, along, -float(third), 2 * float(left[2 * n :] @ along[: kinds.DURATIONS])
    )


def doubled(orbit: Orbit) -> Orbit:
    """The orbit traversed twice; for half a mirrored orbit the whole orbit."""
    once = orbit.itinerary
    if once.mirrored:
        return whole_orbit(orbit)
    twice = Itinerary(2 * once.segments, 2 * once.period_number, scene=once.scene)
    z = np.array([*orbit.z, *orbit.durations])
    system = shooting(orbit.numbers, orbit.values, twice, z)
    return replace(orbit, itinerary=twice, z=z, system=system, iterations=0)


def _fold(orbit: Orbit, path: ParameterPath) -> NormalForm:
    left, _, term, by_multiplier = quadratic(orbit)
    growth = -term / (left @ path.by(orbit.system.by_p, orbit.values))
    return NormalForm(2, float(growth), float(abs(term / by_multiplier)), None, 2, "")


def _period_doubling(orbit: Orbit, path: ParameterPath) -> NormalForm:
    left, along, term, by_multiplier = cubic(orbit)
    coefficient = term / by_multiplier
    # Change of the multiplier along the branch, by five-point differences of exact derivatives.
    value = path.value(orbit.values)
    moved = -np.linalg.solve(orbit.system.by_z, path.by(orbit.system.by_p, orbit.values))
    step = _DIFFERENCE / max(1.0, abs(moved).max())

    def closed(k: int) -> float:
        z, values = orbit.z + k * step * moved, tuple(path.placed(orbit.values, value + k * step))
        at = doubled(replace(orbit, values=values, z=z))
        return float(left @ at.system.by_z @ along)

    slope = (8 * (closed(1) - closed(-1)) - (closed(2) - closed(-2))) / (12 * step * by_multiplier)
    scenario = SUPERCRITICAL if coefficient > 0 else SUBCRITICAL
    return NormalForm(2, float(coefficient / slope), float(coefficient), None, 3, scenario)


def degeneracy(orbit: Orbit, segment: int) -> float:
    """Next derivative of the guard, which is 0 at a degenerate border collision.

    It is the guard at the end of the segment of duration 0, divided by the vanishing power of its
    duration.
    """
    numbers, omega, itinerary = orbit.numbers, orbit.value("omega"), orbit.itinerary
    forms = ClosedForms(numbers, orbit.values)
    flow, field, end = orbit.system.flows[segment], itinerary.fields[segment], segment
    zeros = itinerary.zeros(segment)
    if itinerary.segments[segment].guard is Guard.EDGE:  # ends at its time: the one before
        field, end, zeros = itinerary.neighbour(segment - 1), segment - 1, 0
    y = np.array([*flow.start, *numbers.cos_sin(flow.angle), 1.0])
    for _ in range(zeros + 1):
        y = generator(forms.constants(field), omega) @ y
    return float(_row(forms, itinerary, end, itinerary.segments[end].guard, field) @ y)


def _sides(
    orbit: Orbit, segment: int, kind: str
) -> tuple[int, Sequence[ItinerarySegment], Sequence[ItinerarySegment]]:
    """First segment of duration 0, the segments after it, and those of the other itinerary.

    The latter begin with the segment before; they are empty if the change is at the start.
    """
    itinerary, z, n = orbit.itinerary, orbit.z, len(orbit.itinerary)
    change, begin = swap_segment(itinerary, z, segment, orbit.system), segment - 1
    if change is None and kind != kinds.EDGE:
        return segment, (), ()
    if change is None:
        change, begin = remove_segment(orbit.numbers, itinerary, z, orbit.system, segment)[0], 0
    gone = [k for k, kept in enumerate(change.kept) if kept is None] or [segment]
    first = next(k for k in gone if (k - 1) % n not in gone)
    count = len(change.itinerary) - n + len(gone) + 1
    inside = itinerary.rotated(first).segments[1 : len(gone)]
    return first, inside, change.itinerary.rotated(begin).segments[:count]


def _discontinuity(orbit: Orbit, segment: int, kind: str, power: int) -> tuple[int, int, Vector]:
    """Change of the state at equal times by a segment of duration s, over s^power.

    Also the index of that segment (the first of two), and the power, which is computed at an edge.
    The change is the difference of two local motions from the same start, as power series. One goes
    through the segment, the other follows the itinerary without it. The start is on the guard
    before the segment, such that the segment has the duration s.
    """
    itinerary, omega = orbit.itinerary, orbit.value("omega")
    segment, inside, outside = _sides(orbit, segment, kind)
    numbers, flow = orbit.numbers, orbit.system.flows[segment]
    forms = ClosedForms(numbers, orbit.values)
    before, field = itinerary.neighbour(segment - 1), itinerary.fields[segment]
    during = generator(forms.constants(field), omega)
    after = generator(forms.constants(itinerary.neighbour(segment + len(inside) + 1)), omega)
    many, zeros = power + 2, itinerary.zeros(segment)
    enters = itinerary.guard_before(segment)
    leaves = itinerary.segments[segment].guard
    place = segment if leaves in _STOPS else segment - 1
    start, s = np.zeros((many, _LINEAR)), np.eye(many)[1]
    start[0] = [*flow.start, *numbers.cos_sin(flow.angle), 1.0]
    if leaves is not Guard.EDGE:
        # Guard after a duration s, over s^zeros, as a functional of the segment's start.
        rows = [_row(forms, itinerary, place, leaves, field)]
        for order in range(1, many + zeros):
            rows.append(rows[-1] @ during / order)
        rows, fixed = rows[zeros:], []
        if enters is not Guard.EDGE:
            fixed.append(_row(forms, itinerary, place, enters, before)[:_STATE])
        if enters is Guard.DRIFT or drift(before, orbit.scene) == 0:
            fixed.append(_row(forms, itinerary, place, Guard.DRIFT, field)[:_STATE])
        direction = rows[0][:_STATE].copy()
        for normal in np.linalg.qr(np.array(fixed).T)[0].T if fixed else ():
            direction -= (direction @ normal) * normal
        off = np.array([row @ start[0] for row in rows])
        off[0] = 0.0
        along = np.array([row[:_STATE] @ direction for row in rows])
        start[:, :_STATE] -= np.outer(quotient(off, along), direction)
    later = 0 * s if leaves is Guard.EDGE else s  # time between the edge and the end

    def passed(y: Matrix, left: Vector, way: Sequence[ItinerarySegment]) -> tuple[Matrix, Vector]:
        for one in way:
            matrix = generator(forms.constants(one.field), omega)
            time = left - later
            if one.guard is not Guard.EDGE:
                time = _time(y, matrix, _row(forms, itinerary, place, one.guard, one.field))
            y, left = carried(y, time, matrix), left - time
        return y, left

    long, beyond = passed(carried(start, s, during), 0 * s, inside)
    later = later - beyond
    other = carried(*passed(start, s - beyond, outside), after)
    if kind == kinds.EDGE:
        sizes = np.maximum(abs(long), abs(other)).max(axis=1)
        differs = abs(long - other)[:, :_STATE].max(axis=1) > _CANCELLED * sizes
        power = next((k for k in range(1, many) if differs[k]), power)
    return segment, power, (long - other)[power, :_STATE]


def _row(
    forms: ClosedForms, itinerary: Itinerary, place: int, guard: Guard | None, field: int
) -> Vector:
    """Guard as a linear function of (state, cos, sin, 1), from its gradient and its value at 0.

    A stop is the one at the end of the segment `place`.
    """
    cosine, c = 0.0, forms.constants(field)
    if guard is Guard.DRIFT:
        by, constant = c.speed_gradient(), 0.0
    elif guard in _STOPS:
        c = touched(forms, itinerary, place)
        by, constant = c.gap_gradient(), -c.own_stop()
    else:
        way = 1 if guard is Guard.UPPER else -1
        by = c.limit_gradient(way, 0.0, 0.0, 0.0, 0.0)
        constant = c.pull(0, -c.own_stop(), 0, 0) - c.friction_at(way)
        cosine = c.pull(0, 0, 0, 1) - c.pull(0, 0, 0, 0)
    return np.array([*by[:_STATE], cosine, 0.0, constant])


def _time(y: Matrix, matrix: Matrix, row: Vector) -> Vector:
    """Series of the time of a guard's zero, if the guard vanishes to first order at time 0."""
    time = np.zeros(len(y))
    for _ in range(len(y)):
        there = carried(y, time, matrix)
        off, rate = there @ row, there @ matrix.T @ row
        off[0] = 0.0
        time = time - quotient(off, rate)
    return time
