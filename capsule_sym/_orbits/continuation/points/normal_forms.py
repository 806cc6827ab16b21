"""Normal forms of bifurcations: leading terms of the orbits beside them.

Beside a bifurcation the parameter is a function of one amplitude s: parameter - value = growth
s^order to leading order. At a border collision s is the duration of the inserted segment. At a
fold it is the length of the change of all durations, and at a period doubling that by which the
durations of a doubled orbit's half differ from those of the orbit that doubles.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Backend, backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.continuation.points import kinds
from capsule_sym._orbits.shooting.changes import (
    is_kink,
    remove_segment,
    swap_segment,
    zero_segments,
)
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import (
    STATES,
    Matrix,
    Vector,
    shooting,
    solve,
    touched,
)
from capsule_sym._orbits.shooting.itinerary import Itinerary, ItinerarySegment, drift
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import halved_at, whole_orbit
from capsule_sym._orbits.shooting.taylor import (
    carried,
    generator,
    quotient,
    residual_series,
)

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
_CANCELLED = 1e-9  # share of a coefficient below which a difference of two is rounding

_DIFFERENCE = 1e-3
_STATE = STATES
_LINEAR = _STATE + 3  # of the state, cos, sin and 1


class NormalForm(NamedTuple):
    """The leading terms of a bifurcation's normal form; dimensionless.

    Beside the bifurcation the parameter differs from its value by `growth * s**order`.
    `coefficient` is that of the Poincare map reduced to one variable: s -> s + coefficient s^2 at a
    fold, s -> -s + coefficient s^3 at a period doubling, supercritical where it is positive. At a
    border collision it is None, and `discontinuity` is what a segment of duration s does to (x_r,
    v_r, v_c), over `s**power`: the leading term of the difference between the maps of the two
    itineraries; at an edge of the drive `power` is 1 to 4, and a map that is piecewise linear has
    1. `scenario` is "supercritical" or "subcritical" at a period doubling, and where a symmetry
    breaks, which is one of the first half, closed by its mirror image; at a border
    collision "persistence" where each of the two itineraries has its orbit on a side of its own,
    "non-smooth fold" where both are on one; empty at a fold, and where the multipliers beyond would
    tell but the branch ends.
    """

    order: int
    growth: float
    coefficient: float | None
    discontinuity: tuple[float, float, float] | None
    power: int
    scenario: str

    @property
    def exponent(self) -> float:
        """The power of the leading term; at a border collision in the distance from the border."""
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
    """The normal form of a bifurcation of this type; None where it has none, or a degenerate one.

    `multipliers` are those on both sides, `mirrored` says that the orbit is its own mirror image.
    """
    if mirrored:
        orbit, segment = halved_at(orbit, segment) or (orbit, segment)
    with backend("numpy", orbit.scene) as numbers, np.errstate(all="ignore"):
        try:
            if kind == kinds.FOLD:
                form = _fold(numbers, orbit, path)
            elif kind in (kinds.PERIOD_DOUBLING, kinds.SYMMETRY_BREAKING):
                form = _period_doubling(numbers, orbit, path)
            elif kind in _POWERS and segment is not None:
                form = _collision(numbers, kind, orbit, segment, path, multipliers)
            else:
                return None
        except (np.linalg.LinAlgError, ArithmeticError, InvalidInput):
            return None
    terms = form.growth, form.coefficient or 0.0, *(form.discontinuity or ())
    return form if np.all(np.isfinite(terms)) else None


def _collision(
    numbers: Backend,
    kind: str,
    orbit: Orbit,
    segment: int,
    path: ParameterPath,
    multipliers: tuple[Sequence[complex], Sequence[complex]],
) -> NormalForm:
    order, power = 2 if kind in _TOUCHES else 1, _POWERS[kind]
    if Guard.DRIFT in _corner_guards(orbit.itinerary, segment):
        # What turns round where it lands does so the later, the longer the other spring acted.
        ends = (orbit.itinerary.neighbour(k) for k in (segment - 1, segment + 1))
        power = 3 if any(drift(field, orbit.scene) == 0 for field in ends) else 2
    if is_kink(orbit.itinerary, zero_segments(orbit.itinerary, orbit.z, segment)):
        raise ArithmeticError("a slip whose two segments begin without a rate")
    first, power, (x_r, v_r, v_c) = _discontinuity(
        numbers, whole_orbit(orbit), segment, kind, power
    )
    growth = _growth(numbers, orbit, first % len(orbit.itinerary), path, order)
    scenario = _scenario(*multipliers) if power == order else PERSISTENCE
    terms = float(x_r), float(v_r), float(v_c)
    return NormalForm(order, growth, None, terms, power, scenario)


def _corner_guards(itinerary: Itinerary, segment: int) -> set[Guard | None]:
    """The guards that vanish together at a corner, none elsewhere."""
    guards = {itinerary.guard_before(segment), itinerary.segments[segment].guard}
    return guards if guards & set(_STOPS) and len(guards) > 1 else set()


def _scenario(before: Sequence[complex], after: Sequence[complex]) -> str:
    """Of a map that is piecewise linear to leading order, by det(I - M) on both sides."""
    if not after:
        return ""
    signs = [np.prod([1 - value for value in side]).real for side in (before, after)]
    return PERSISTENCE if signs[0] * signs[1] > 0 else NON_SMOOTH_FOLD


def _along(z: Vector, *coefficients: Vector, many: int) -> Matrix:
    """A curve from z, of so many coefficients."""
    rows = [z, *coefficients]
    return np.array([*rows, *([0 * z] * (many - len(rows)))])


def _growth(numbers: Backend, orbit: Orbit, segment: int, path: ParameterPath, order: int) -> float:
    """(parameter - value) / duration^order of the segment that is inserted."""
    z, column = orbit.z, kinds.DURATIONS + segment
    rest = [i for i in range(len(z)) if i != column]
    matrix = np.column_stack([orbit.system.by_z[:, rest], path.by(orbit.system.by_p, orbit.values)])
    many = order + 1 + orbit.itinerary.zeros(segment)
    along = 0 * z
    along[column] = 1
    for power in range(1, order + 1):
        series = residual_series(numbers, orbit, _along(z, along, many=many))
        change = -solve(numbers, matrix, series[power])
        # At a touch the parameter stands still to first order.
        along[rest] = along[rest] + change[:-1]
    return float(change[-1])


def _null_vectors(matrix: Matrix, n: int) -> tuple[Vector, Vector]:
    """Left and right null vector of a singular matrix, the right one of length 1 in n durations."""
    left, _, right = np.linalg.svd(matrix)
    along = right[-1]
    return left[:, -1], along / np.linalg.norm(along[kinds.DURATIONS :][:n])


class _Singular(NamedTuple):
    """An orbit's equations near where they are singular: null vectors, and a leading term."""

    left: Vector
    along: Vector
    term: float
    by_multiplier: float


def quadratic(numbers: Backend, orbit: Orbit, like: Vector | None = None) -> _Singular:
    """The second derivative of an orbit's equations along their null vector; at a fold.

    The null vector points where `like`, a change of z, does.
    """
    n, z = len(orbit.itinerary), orbit.z
    left, along = _null_vectors(orbit.system.by_z, n)
    if like is not None and like @ along < 0:
        along = -along
    second = left @ residual_series(numbers, orbit, _along(z, along, many=3))[2]
    # Closed with a multiplier 1 + m in place of 1 the equations are singular for m = 2 b s.
    return _Singular(left, along, float(second), float(left[n:] @ along[: kinds.DURATIONS]))


def cubic(numbers: Backend, orbit: Orbit) -> _Singular:
    """The third derivative of a doubled orbit's equations along their null vector.

    Of the orbit that doubles; reduced by what the second derivative bends.
    """
    n, whole = len(orbit.itinerary), doubled(numbers, orbit)
    left, along = _null_vectors(whole.system.by_z, n)
    second = residual_series(numbers, whole, _along(whole.z, along, many=3))[2]
    bordered = np.block([[whole.system.by_z, left[:, None]], [along, np.zeros(1)]])
    bent = -np.linalg.solve(bordered, np.append(second, 0.0))[:-1]
    third = left @ residual_series(numbers, whole, _along(whole.z, along, bent, many=4))[3]
    # Closed with a multiplier 1 + 2 m in place of 1 the equations are singular for m = b s^2.
    return _Singular(
        left, along, -float(third), 2 * float(left[2 * n :] @ along[: kinds.DURATIONS])
    )


def doubled(numbers: Backend, orbit: Orbit) -> Orbit:
    """The orbit twice over; of a motion that is its own mirror image, by its half, all of it."""
    once = orbit.itinerary
    if once.mirrored:
        return whole_orbit(orbit)
    twice = Itinerary(2 * once.segments, 2 * once.period_number, scene=once.scene)
    z = np.array([*orbit.z, *orbit.durations])
    return Orbit(orbit.values, twice, z, shooting(numbers, orbit.values, twice, z), numbers.name)


def _fold(numbers: Backend, orbit: Orbit, path: ParameterPath) -> NormalForm:
    left, _, term, by_multiplier = quadratic(numbers, orbit)
    growth = -term / (left @ path.by(orbit.system.by_p, orbit.values))
    return NormalForm(2, float(growth), float(abs(term / by_multiplier)), None, 2, "")


def _period_doubling(numbers: Backend, orbit: Orbit, path: ParameterPath) -> NormalForm:
    left, along, term, by_multiplier = cubic(numbers, orbit)
    coefficient = term / by_multiplier
    # The multiplier's change along the branch, by five-point differences of exact derivatives.
    value = path.value(orbit.values)
    moved = -np.linalg.solve(orbit.system.by_z, path.by(orbit.system.by_p, orbit.values))
    step = _DIFFERENCE / max(1.0, abs(moved).max())

    def closed(k: int) -> float:
        z, values = orbit.z + k * step * moved, tuple(path.placed(orbit.values, value + k * step))
        at = doubled(numbers, Orbit(values, orbit.itinerary, z, orbit.system, numbers.name))
        return float(left @ at.system.by_z @ along)

    slope = (8 * (closed(1) - closed(-1)) - (closed(2) - closed(-2))) / (12 * step * by_multiplier)
    scenario = SUPERCRITICAL if coefficient > 0 else SUBCRITICAL
    return NormalForm(2, float(coefficient / slope), float(coefficient), None, 3, scenario)


def degeneracy(numbers: Backend, orbit: Orbit, segment: int) -> float:
    """The next derivative of its guard, which is 0 at a degenerate border collision.

    Of the guard that ends the segment of duration 0, over its duration's power that vanishes.
    """
    forms = ClosedForms(numbers, orbit.values)
    omega, itinerary = orbit.value("omega"), orbit.itinerary
    flow, field, end = orbit.system.flows[segment], itinerary.fields[segment], segment
    zeros = itinerary.zeros(segment)
    if itinerary.segments[segment].guard is Guard.EDGE:  # which comes at its time: the one before
        field, end, zeros = itinerary.neighbour(segment - 1), segment - 1, 0
    y = np.array([*flow.start, *numbers.cos_sin(flow.angle), 1.0])
    for _ in range(zeros + 1):
        y = generator(forms.constants(field), omega) @ y
    return float(_row(forms, itinerary, end, itinerary.segments[end].guard, field) @ y)


def _sides(
    numbers: Backend, orbit: Orbit, segment: int, kind: str
) -> tuple[int, Sequence[ItinerarySegment], Sequence[ItinerarySegment]]:
    """The first segment of duration 0, those that follow it, and what the other itinerary has.

    That begins with the segment before, and is empty where the change is at the start already.
    """
    itinerary, z, n = orbit.itinerary, orbit.z, len(orbit.itinerary)
    change, begin = swap_segment(itinerary, z, segment, orbit.system), segment - 1
    if change is None and kind != kinds.EDGE:
        return segment, (), ()
    if change is None:
        change, begin = remove_segment(numbers, itinerary, z, orbit.system, segment)[0], 0
    gone = [k for k, kept in enumerate(change.kept) if kept is None] or [segment]
    first = next(k for k in gone if (k - 1) % n not in gone)
    count = len(change.itinerary) - n + len(gone) + 1
    inside = itinerary.rotated(first).segments[1 : len(gone)]
    return first, inside, change.itinerary.rotated(begin).segments[:count]


def _discontinuity(
    numbers: Backend, orbit: Orbit, segment: int, kind: str, power: int
) -> tuple[int, int, Vector]:
    """The change of the state at equal times by a segment of duration s, over s^power.

    With the index of that segment, the first one of two, and the power, which at an edge is found.
    The series of two local motions from the same start on the guard before the segment, which is
    chosen such that the segment has the duration s: through the segment, and as the itinerary
    without it has it, continued to where that does not hold.
    """
    itinerary, omega = orbit.itinerary, orbit.value("omega")
    segment, inside, outside = _sides(numbers, orbit, segment, kind)
    forms, flow = ClosedForms(numbers, orbit.values), orbit.system.flows[segment]
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
        # The guard after a duration s, over s^zeros, as a functional of where the segment starts.
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
    """A guard as a linear function of (state, cos, sin, 1), by its gradient and its value at 0.

    A stop is the one that the itinerary meets at the end of the segment `place`.
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
    """The series of the time after which a guard that is 0 at first order is 0."""
    time = np.zeros(len(y))
    for _ in range(len(y)):
        there = carried(y, time, matrix)
        off, rate = there @ row, there @ matrix.T @ row
        off[0] = 0.0
        time = time - quotient(off, rate)
    return time
