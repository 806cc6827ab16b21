"""Types of bifurcations, the place of a border collision in state space, and normal forms.

Beside a bifurcation the parameter is a function of one amplitude s: to leading order parameter -
value = growth s^order. At a border collision s is the duration of the inserted segment. At a fold
it is the norm of the change of the durations. At a period doubling it is the norm of the difference
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
from capsule_sym._orbits.shooting.changes import around, is_kink, zero_segments
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import (
    STATES,
    Matrix,
    SegmentFlow,
    Vector,
    shooting,
    solve,
    touched,
)
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact, drift, level
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import halved_at, whole_orbit
from capsule_sym._orbits.shooting.taylor import generator, residual_series
from capsule_sym._parameters import Scene

#: Index in z of the first segment's duration; state and forcing angle precede it.
DURATIONS = STATES + 1

GRAZING = "grazing"
ADDING = "adding-sliding"
GRAZING_SLIDING = "grazing-sliding"
CROSSING = "crossing-sliding"
SWITCHING = "switching-sliding"
CORNER = "boundary-intersection crossing"
EDGE = "edge"
FOLD = "fold"
PERIOD_DOUBLING = "period doubling"
NEIMARK_SACKER = "Neimark-Sacker"
SYMMETRY_BREAKING = "symmetry breaking"
RESONANCE_1_1, RESONANCE_1_2 = "1:1 resonance", "1:2 resonance"
CUSP = "cusp"
GENERALIZED_DOUBLING = "generalized period doubling"
DEGENERATE = "degenerate"

SMOOTH = (FOLD, PERIOD_DOUBLING, NEIMARK_SACKER)
#: Resonance on a Neimark-Sacker curve where both multipliers are those of this type.
RESONANCES = {FOLD: RESONANCE_1_1, PERIOD_DOUBLING: RESONANCE_1_2}


class EventType(NamedTuple):
    """Type of an event, and its line."""

    type: str
    line: str = ""


HIGHER = EventType("corner of higher codimension")
#: Initials of each type, for the labels on a branch.
INITIALS = {
    FOLD: "FO",
    PERIOD_DOUBLING: "PD",
    NEIMARK_SACKER: "NS",
    SYMMETRY_BREAKING: "SB",
    GRAZING: "GR",
    ADDING: "AS",
    GRAZING_SLIDING: "GS",
    CROSSING: "CS",
    SWITCHING: "SS",
    CORNER: "BI",
    EDGE: "ED",
    HIGHER.type: "HC",
}


def place(orbit: Orbit, segment: int) -> EventType:
    """Event at an orbit's segment of duration 0.

    Lines L1 to L4 have their part too, such as L3^(2); see Appendix B of the paper.
    """
    itinerary, flow = orbit.itinerary, orbit.system.flows[segment]
    scene = itinerary.scene
    fields = around(itinerary, segment)
    if len({level(field, scene) for field in fields}) > 1:
        # A switch that meets an edge of the drive, or a slip that begins at one.
        guards = {itinerary.guard_before(segment), itinerary.segments[segment].guard}
        met = sorted(
            _met(one, contact(fields[0], scene), scene) for one in guards - {Guard.EDGE, None}
        )
        line = f"at {' and '.join(met)}" if met else ""
        return EventType(EDGE, line)
    (before, during, after) = ((contact(field, scene), drift(field, scene)) for field in fields)
    if before[0] != after[0]:
        if before[1] == after[1]:
            return HIGHER
        guards = {itinerary.guard_before(segment), itinerary.segments[segment].guard}
        return EventType(CORNER, _corner(guards, flow))
    if during[0] != before[0]:
        if before != after:
            return HIGHER
        return EventType(GRAZING, "L9")
    kind = sliding(before[1], during[1], after[1])
    if kind is None:
        return HIGHER
    line = _edge(flow, during[0])
    return EventType(kind, f"{line}^({_part(flow, line)})")


def _met(guard: Guard | None, side: int, scene: Scene) -> str:
    """Label of the quantity of a guard, as in the declaration; `side` is the contact there."""
    facts = scene.facts
    if guard in (Guard.GAP, Guard.BACK):
        behind = (guard is Guard.BACK) != (side == 2)
        return str(facts.LABELS[facts.STOPS[behind][0]])
    if guard is Guard.DRIFT:
        return f"{facts.LABELS[facts.STATE[2]]} 0"
    way = 1 if guard is Guard.UPPER else -1
    alike = "" if len({*facts.BOUNDS.values()}) > 1 else (" forward" if way > 0 else " backward")
    return f"{facts.LABELS[facts.BOUNDS[way]]}{alike}"


def sliding(before: int, during: int, after: int) -> str | None:
    """Sliding bifurcation with these drifts before, in and after a segment of duration 0.

    None for other drifts.
    """
    if before == after:
        return GRAZING_SLIDING if before else ADDING
    if during == 0 and after == -before:
        return CROSSING
    return SWITCHING if during == -before and after == 0 else None


def _edge(flow: SegmentFlow, contact: int) -> str:
    """Edge of stick, L1 to L4, on which a segment begins."""
    force = flow.closed.margin + flow.c.friction
    return f"L{(1 if force > 0 else 2) + 2 * contact}"


def _part(flow: SegmentFlow, line: str) -> int:
    """Part number of L1 to L4, from the range of the force's rate under the forcing."""
    c, (_, v_r, _) = flow.c, flow.start
    side = 1 if line in ("L1", "L3") else -1
    turn, reach = -c.force_change(0, -c.friction_at(side)), c.force_change(0, c.alpha)
    speed = c.force_change(v_r, 0)
    return 1 if speed < turn - reach else 3 if speed > turn + reach else 2


def _corner(guards: set[Guard | None], flow: SegmentFlow) -> str:
    """Line or corner point on P1 = 0, P2 = delta where a segment between two guards begins."""
    if Guard.UPPER in guards:
        return "O1"
    if Guard.LOWER in guards:
        return "O2"
    c, (x_r, v_r, _) = flow.c, flow.start
    force = c.force(x_r, 0, v_r)
    if all(c.friction_guard(sign, force) > 0 for sign in (1, -1)):
        return "L6" if v_r > 0 else "L7"
    if v_r > 0:
        return "L5"
    return "L8" if force < 0 else "L10"


SUPERCRITICAL, SUBCRITICAL = "supercritical", "subcritical"
PERSISTENCE, NON_SMOOTH_FOLD = "persistence", "non-smooth fold"
_TOUCHES = (GRAZING, ADDING, GRAZING_SLIDING)
_COLLISIONS = (*_TOUCHES, CROSSING, SWITCHING, CORNER, EDGE)
_LINEAR = (GRAZING_SLIDING, EDGE)
"""Types with a map that may be piecewise linear to leading order."""
_STOPS = (Guard.GAP, Guard.BACK)

_DIFFERENCE = 1e-3


class NormalForm(NamedTuple):
    """Leading terms of a bifurcation's normal form.

    Dimensionless, except `growth` of a parameter in SI units.

    Beside the bifurcation the parameter differs from its value by `growth * s**order`, to leading
    order, with `order` 1 or 2. At a border collision s is the duration of the segment that is
    inserted, or of the one between two switches. At a fold it is the norm of the change of the
    durations, of the first half if the orbit is its own mirror image. At a period doubling it is
    half the norm of the difference of the halves' durations.

    `coefficient` is that of the Poincare map reduced to one variable: s -> s + coefficient s^2 at a
    fold, s -> -s + coefficient s^3 at a period doubling, which is supercritical if it is positive.
    It is None at a border collision.

    `scenario` is "supercritical" or "subcritical" at a period doubling, and at a symmetry breaking,
    which is a period doubling of the first half. At a border collision it is "persistence" if the
    two itineraries have their orbits on different sides, and "non-smooth fold" if both are on one
    side. It is empty at a fold, and at a grazing-sliding bifurcation or an edge where the branch
    ends, so that the multipliers beyond are unknown.
    """

    order: int
    growth: float
    coefficient: float | None
    scenario: str

    def __repr__(self) -> str:
        return by_fields(self)


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
            if kind == FOLD:
                form = _fold(orbit, path)
            elif kind in (PERIOD_DOUBLING, SYMMETRY_BREAKING):
                form = _period_doubling(orbit, path)
            elif kind in _COLLISIONS and segment is not None:
                form = _collision(kind, orbit, segment, path, multipliers)
            else:
                return None
        except (np.linalg.LinAlgError, ArithmeticError, InvalidInput):
            return None
    terms = form.growth, form.coefficient or 0.0
    return form if np.all(np.isfinite(terms)) else None


def _collision(
    kind: str,
    orbit: Orbit,
    segment: int,
    path: ParameterPath,
    multipliers: tuple[Sequence[complex], Sequence[complex]],
) -> NormalForm:
    vanishing = zero_segments(orbit.itinerary, orbit.z, segment)
    if is_kink(orbit.itinerary, vanishing):
        raise ArithmeticError("a slip whose two segments begin without a rate")
    order = 2 if kind in _TOUCHES else 1
    growth = _growth(orbit, vanishing[0], path, order)
    scenario = _scenario(*multipliers) if kind in _LINEAR else PERSISTENCE
    return NormalForm(order, growth, None, scenario)


def _scenario(before: Sequence[complex], after: Sequence[complex]) -> str:
    """Scenario of a map that is piecewise linear to leading order, from det(I - M) of both."""
    if not after:
        return ""
    signs = [np.prod([1 - value for value in side]).real for side in (before, after)]
    return PERSISTENCE if signs[0] * signs[1] > 0 else NON_SMOOTH_FOLD


def _along(z: Vector, *coefficients: Vector, many: int) -> Matrix:
    """Coefficients of a curve from z, zeros to the length `many`."""
    rows = [z, *coefficients]
    return np.array([*rows, *([0 * z] * (many - len(rows)))])


def _growth(orbit: Orbit, segment: int, path: ParameterPath, order: int) -> float:
    """(parameter - value) / duration^order of the inserted segment."""
    z, column = orbit.z, DURATIONS + segment
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
    """Left and right null vector of a matrix, the right one of norm 1 in the first n durations."""
    left, _, right = np.linalg.svd(matrix)
    along = right[-1]
    return left[:, -1], along / np.linalg.norm(along[DURATIONS:][:n])


class _Singular(NamedTuple):
    """Equations of an orbit near a singularity: null vectors, and a leading term."""

    left: Vector
    along: Vector
    term: float
    by_multiplier: float


def quadratic(orbit: Orbit, like: Vector | None = None) -> _Singular:
    """Quadratic coefficient of an orbit's equations along their null vector, at a fold.

    The null vector points in the direction of `like`, a change of z.
    """
    n, z = len(orbit.itinerary), orbit.z
    left, along = _null_vectors(orbit.system.by_z, n)
    if like is not None and like @ along < 0:
        along = -along
    second = left @ residual_series(orbit, _along(z, along, many=3))[2]
    # With a multiplier 1 + m in place of 1 the equations are singular for m = 2 b s.
    return _Singular(left, along, float(second), float(left[n:] @ along[:DURATIONS]))


def cubic(orbit: Orbit) -> _Singular:
    """Cubic coefficient of a doubled orbit's equations along their null vector.

    `orbit` is the orbit that doubles. The quadratic coefficient is eliminated.
    """
    n, whole = len(orbit.itinerary), doubled(orbit)
    left, along = _null_vectors(whole.system.by_z, n)
    second = residual_series(whole, _along(whole.z, along, many=3))[2]
    bordered = np.block([[whole.system.by_z, left[:, None]], [along, np.zeros(1)]])
    bent = -np.linalg.solve(bordered, np.append(second, 0.0))[:-1]
    third = left @ residual_series(whole, _along(whole.z, along, bent, many=4))[3]
    # With a multiplier 1 + 2 m in place of 1 the equations are singular for m = b s^2.
    return _Singular(left, along, -float(third), 2 * float(left[2 * n :] @ along[:DURATIONS]))


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
    return NormalForm(2, float(growth), float(abs(term / by_multiplier)), "")


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
    return NormalForm(2, float(coefficient / slope), float(coefficient), scenario)


def degeneracy(orbit: Orbit, segment: int) -> float:
    """Lowest derivative of a guard that need not be 0 at a segment of duration 0.

    It is 0 at a degenerate border collision. The guard is that of the segment, and if this is an
    edge of the drive, that of the segment before.
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
    return np.array([*by[:STATES], cosine, 0.0, constant])
