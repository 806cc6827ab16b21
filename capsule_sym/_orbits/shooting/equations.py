"""Equations of a periodic orbit of a given itinerary, with their exact derivatives.

The unknowns are z = (x_r, v_r, v_c, theta, h_1, ..., h_n): state and forcing angle at the start of
the first segment, and the duration of every segment. The n + 4 equations are: each segment's guard
vanishes at its end, or without switches theta is 0; the final state and forcing angle are those of
the start, while x_c may differ (modulo drift). If a motion is its own mirror image, only its first
half is solved for. It ends in the image of its start, so that an event that happens twice by
symmetry appears once.

If a guard vanishes at the segment's start too, that root is divided out. The equations then stay
regular as the segment shrinks to zero duration, and beyond, at negative durations. An orbit with a
segment of duration 0 is the bifurcation at which that segment is inserted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import counted
from capsule_sym._map.backend import Backend, Number, backend
from capsule_sym._map.expansion import Guard
from capsule_sym._map.result import brief
from capsule_sym._native import check_time
from capsule_sym._orbits.shooting.closed import ClosedForms, chained
from capsule_sym._orbits.shooting.itinerary import Itinerary, ItinerarySegment, contact, level
from capsule_sym._parameters import CAPSULE

_GUARD_BITS = 10  # in solving linear equations in 50 digits
_NODES = (-2, -1, 1, 2)
ROUNDINGS = 8  # of the terms of each equation, measured against 50 digits
PARAMETERS: tuple[str, ...] = CAPSULE.facts.PARAMETERS
"""Parameter names of the paper's scene; those of another scene are in its facts."""
STATES = 3  # x_r, v_r, v_c
BY_ANGLE, BY_TIME = STATES, STATES + 1  # columns of a row, after those by the start
Vector = NDArray[Any]  # of floats, or of mpmath numbers
Matrix = NDArray[Any]


@dataclass(frozen=True, eq=False)
class SegmentFlow:
    """Flow of a segment: closed form, ends, and derivatives with respect to (z, parameters).

    `c` are the constants of the segment's field, `closed` the kernels' `Start`, `h` is the
    duration. States are (x_r, v_r, v_c). `angle` is the forcing angle at the start, not reduced.
    `moved` has the increments of x_r, v_c and x_c. `matrix` has a row for x_r, v_r, v_c and the
    advance of x_c: derivatives within the segment, in the columns JACOBIAN_COLUMNS of the kernels.
    `start_by`, `end_by` (3, many) and `angle_by` (many,) are total derivatives by z and the
    parameters; the segment's duration is entry `column` of z.
    """

    segment: ItinerarySegment
    c: Any
    closed: Any
    angle: Number
    h: Number
    start: Vector
    end: Vector
    moved: Vector
    matrix: Matrix
    start_by: Matrix
    end_by: Matrix
    angle_by: Vector
    column: int

    def __repr__(self) -> str:
        return f"<SegmentFlow in F{self.segment.field} for {float(self.h):.6g}>"

    def total(self, rows: Matrix) -> Matrix:
        """Total derivatives (..., many) of quantities with rows (..., columns) in the segment."""
        return total(rows, self.start_by, self.angle_by, self.column)


@dataclass(frozen=True, eq=False)
class ShootingSystem:
    """Equations of an orbit at some unknowns: residual, derivatives, and segments.

    `residual` is (n + 4,), `by_z` (n + 4, n + 4), and `by_p` has a column for each parameter.
    `advance` is the change of x_c over the orbit and `advance_by` its gradient with respect to (z,
    parameters).
    """

    residual: Vector
    by_z: Matrix
    by_p: Matrix
    advance: Number
    advance_by: Vector
    made: Callable[[], tuple[SegmentFlow, ...]]
    """Makes `flows`, which few Newton steps need."""
    monodromy: Matrix | None = None
    """Monodromy matrix, if the C core evaluated the equations."""

    @cached_property
    def flows(self) -> tuple[SegmentFlow, ...]:
        """Flow of each segment."""
        return self.made()

    def __repr__(self) -> str:
        largest = float(max(abs(self.residual)))
        count = len(self.residual) - STATES - 1
        return brief(self, f"largest residual {largest:.1e}", f"of {counted(count, 'segment')}")


def shooting(
    numbers: Backend,
    values: Sequence[Number],
    itinerary: Itinerary,
    z: Vector,
) -> ShootingSystem:
    """Equations of an itinerary at unknowns z, for values of the parameters in their order.

    In double precision they are evaluated by the C core if it exists, up to 4,096 segments.
    """
    check_time()
    forms = ClosedForms(numbers, values)
    found = forms.evaluated(itinerary, z)
    if found is None:
        return _by_kernels(forms, itinerary, z)
    return of_core(forms.values, itinerary, z, found)


def of_core(
    values: tuple[float, ...], itinerary: Itinerary, z: Vector, found: tuple[Any, ...]
) -> ShootingSystem:
    """Equations at z as evaluated by the C core."""
    records, states_by, residual, by, advance_by, advance, monodromy = found
    count = len(residual)
    made = partial(_flows_of_core, values, itinerary, z, records, states_by)
    return ShootingSystem(
        residual, by[:, :count], by[:, count:], advance, advance_by, made, monodromy
    )


def _flows_of_core(
    values: tuple[float, ...], itinerary: Itinerary, z: Vector, records: Any, states_by: Matrix
) -> tuple[SegmentFlow, ...]:
    flows = []
    with backend("numpy", itinerary.scene) as numbers:
        forms = ClosedForms(numbers, values)
    for i, (segment, record) in enumerate(zip(itinerary.segments, records, strict=True)):
        closed = forms.numbers.kernels.Start(*record["start"].tolist())
        flows.append(
            SegmentFlow(
                segment=segment,
                c=forms.constants(segment.field),
                closed=closed,
                angle=float(record["angle"]),
                h=float(record["duration"]),
                start=np.array([closed.x_r, closed.v_r, closed.v_c]),
                end=record["end"],
                moved=record["moved"],
                matrix=record["jacobian"].reshape(STATES + 1, -1),
                start_by=states_by[i],
                end_by=states_by[i + 1],
                angle_by=_angle_by(forms, z, i),
                column=STATES + 1 + i,
            )
        )
    return tuple(flows)


def _angle_by(forms: ClosedForms, z: Vector, segment: int) -> Vector:
    """Gradient of the forcing angle at a segment's start, by z and the parameters."""
    zero, first = forms.numbers.number(0), STATES + 1
    gradient = np.full(len(z) + len(forms.values), zero)
    gradient[BY_ANGLE] = zero + 1
    gradient[first : first + segment] = forms.value("omega")
    gradient[forms.column("omega")] = sum(z[first : first + segment].tolist(), zero)
    return gradient


def _by_kernels(forms: ClosedForms, itinerary: Itinerary, z: Vector) -> ShootingSystem:
    """Equations by the kernels of any number system, segment by segment."""
    numbers, n, size = forms.numbers, len(itinerary), len(z) + len(forms.values)
    zero, omega = numbers.number(0), forms.value("omega")
    # NumPy's scalars make the scalar path several times slower than plain numbers.
    angle, *durations = z[STATES:].tolist()
    state, state_by = z[:STATES], np.full((STATES, size), zero)
    for row in range(STATES):
        state_by[row, row] = zero + 1
    flows, advance_by = list[SegmentFlow](), np.full(size, zero)
    residual, by = np.full(len(z), zero), np.full((len(z), size), zero)
    for i, (segment, h) in enumerate(zip(itinerary.segments, durations, strict=True)):
        check_time()
        start_by = state_by, _angle_by(forms, z, i)
        flow = _flow(forms, segment, (state, angle), start_by, h, STATES + 1 + i)
        residual[i], by[i] = _guard(forms, flow, itinerary, i)
        flows.append(flow)
        state, state_by, angle = flow.end, flow.end_by, angle + omega * h
        advance_by = advance_by + flow.total(flow.matrix[STATES])
    sign, turn = (-1, numbers.full_turn / 2) if itinerary.mirrored else (1, numbers.full_turn)
    residual[n:-1], by[n:-1] = state - sign * z[:STATES], state_by
    for row in range(STATES):
        by[n + row, row] = by[n + row, row] - sign
    _pin(forms, itinerary, flows[0], residual, by)
    residual[-1] = omega * sum(durations, zero) - itinerary.period_number * turn
    by[-1] = _angle_by(forms, z, n)
    by[-1, BY_ANGLE] = zero
    advance = sum((flow.moved[2] for flow in flows), zero)
    by_z, by_p, made = by[:, : len(z)], by[:, len(z) :], partial(tuple, flows)
    return ShootingSystem(residual, by_z, by_p, advance, advance_by, made)


def solve(numbers: Backend, matrix: Matrix, right: Matrix) -> Matrix:
    """Solution of a square system, for one right side or several as columns.

    Raises numpy.linalg.LinAlgError if the matrix is singular.
    """
    if numbers.name != "mpmath":
        return np.linalg.solve(matrix, right)
    from capsule_sym._map.precision import workspace

    mp, number = workspace(), numbers.number
    columns = right.reshape(len(right), -1)
    mp.prec += _GUARD_BITS
    try:
        both, order = mp.LU_decomp(mp.matrix(matrix.tolist()))
    except ZeroDivisionError as error:
        raise np.linalg.LinAlgError("singular matrix") from error
    solved = [mp.U_solve(both, mp.L_solve(both, mp.matrix(list(b)), order)) for b in columns.T]
    rows = [[number(value) for value in x] for x in solved]
    return np.array(rows, dtype=object).T.reshape(right.shape)


def _flow(
    forms: ClosedForms,
    segment: ItinerarySegment,
    begin: tuple[Vector, Number],
    begin_by: tuple[Matrix, Vector],
    h: Number,
    column: int,
) -> SegmentFlow:
    """Segment of duration h from a state and a forcing angle with known derivatives."""
    numbers, c, (state, angle) = forms.numbers, forms.constants(segment.field), begin
    x_r, v_r, v_c = state.tolist()
    gap, turned = x_r - c.own_stop(), numbers.cos_sin(angle)
    margin = c.margin_at(x_r, gap, v_r, turned[0])
    closed = numbers.kernels.Start(x_r, gap, v_r, v_c, margin, *turned)
    # A duration of 0 cannot divide; the unit of rounding gives the same limit.
    duration = h if abs(h) > numbers.unit else numbers.unit
    (position, velocity, change, advance), matrix = forms.run(segment.field, c, closed, duration)
    change = change if c.drift else -v_c
    return SegmentFlow(
        segment=segment,
        c=c,
        closed=closed,
        angle=angle,
        h=duration,
        start=state,
        end=np.array([x_r + position, velocity, v_c + change]),
        moved=np.array([position, change, advance]),
        matrix=matrix,
        start_by=begin_by[0],
        end_by=total(matrix[:STATES], *begin_by, column),
        angle_by=begin_by[1],
        column=column,
    )


def total(rows: Matrix, state_by: Matrix, angle_by: Vector, column: int) -> Matrix:
    """Total derivatives of a function of a segment's start, its duration and the parameters."""
    result = rows[..., :STATES] @ state_by + rows[..., BY_ANGLE, None] * angle_by
    result[..., column] = result[..., column] + rows[..., BY_TIME]
    first = BY_TIME + 1 - rows.shape[-1]
    result[..., first:] = result[..., first:] + rows[..., first:]
    return result  # type: ignore[no-any-return]


def angle_row(forms: ClosedForms, h: Number, like: Vector) -> Vector:
    """Derivatives of the forcing angle a time after a segment's start, as the row `like`."""
    row = 0 * like
    row[BY_ANGLE] = row[BY_ANGLE] + 1
    row[BY_TIME] = row[BY_TIME] + forms.value("omega")
    row[forms.column("omega")] = h
    return row


def _guard(
    forms: ClosedForms, flow: SegmentFlow, itinerary: Itinerary, i: int
) -> tuple[Number, Vector]:
    """Guard of a segment at its end, over a power of its duration, and the gradient."""
    if flow.segment.guard is None:
        return flow.angle, flow.angle_by
    zeros = itinerary.zeros(i)
    if zeros == 0:
        value, row = _value(forms, flow, itinerary, i)
        return value, flow.total(row)
    value, row = _divided(flow, zeros)
    one = forms.numbers.number(1)
    least = min(forms.numbers.unit ** (one / (zeros + 4)), one / (10 * flow.c.rate))
    if abs(flow.h) >= least:
        return value, flow.total(row)
    # So near to the limit the differences in the row cancel. It is interpolated between durations
    # on both sides, with an error of (`least` times the rate)^4.
    begin = (flow.start, flow.angle), (flow.start_by, flow.angle_by)
    row = 0 * row
    for node in _NODES:
        at = _flow(forms, flow.segment, *begin, node * least, flow.column)
        weight = math.prod((flow.h / least - k) / (node - k) for k in _NODES if k != node)
        row = row + weight * _divided(at, zeros)[1]
    return value, flow.total(row)


def _divided(flow: SegmentFlow, zeros: int) -> tuple[Number, Vector]:
    """Gain of a guard over the duration's power `zeros`, and its row.

    At the segment's start the guard and `zeros` - 1 of its derivatives vanish.
    """
    h, c = flow.h, flow.c
    which, gained = (2, flow.moved[1]) if flow.segment.guard is Guard.DRIFT else (0, flow.moved[0])
    row = flow.matrix[which].copy()
    row[which] = row[which] - 1
    if zeros == 2:
        # Rate at the start, which is 0 where all equations hold, by the guard before.
        x_r, gap, v_r, *_ = flow.closed
        rate, unit = c.v_c_rate(flow.closed.margin), 0 * flow.matrix[: STATES + 1]
        for k in range(STATES + 1):
            unit[k, k] = unit[k, k] + 1
        turned = flow.closed.cos_theta, flow.closed.sin_theta
        rate_row = chained(c.slip_gradient(c.drift, x_r, gap, v_r, *turned), unit, unit[BY_ANGLE])
        gained, row = gained - rate * h, row - h * rate_row
        row[BY_TIME] = row[BY_TIME] - rate
    power = h**zeros
    row = row / power
    row[BY_TIME] = row[BY_TIME] - zeros * gained / (power * h)
    return gained / power, row


def _value(
    forms: ClosedForms, flow: SegmentFlow, itinerary: Itinerary, i: int
) -> tuple[Number, Vector]:
    """Guard at the end of a segment, and its row."""
    c, (x_r, v_r, v_c), rows, guard = flow.c, flow.end, flow.matrix, flow.segment.guard
    if guard in (Guard.GAP, Guard.BACK):
        at = touched(forms, itinerary, i)
        return x_r - at.own_stop(), chained(at.gap_gradient(), rows)
    if guard is Guard.DRIFT:
        return v_c, chained(c.speed_gradient(), rows)
    angle_by = angle_row(forms, flow.h, rows[0])
    end_angle = flow.angle + c.omega * flow.h
    if guard is Guard.EDGE:
        edge, slope = edge_of(forms, itinerary, i)
        return end_angle - edge, angle_by - slope
    way, gap = 1 if guard is Guard.UPPER else -1, x_r - c.own_stop()
    turned = forms.numbers.cos_sin(end_angle)
    beyond = c.pull(x_r, gap, v_r, turned[0]) - c.friction_at(way)
    return beyond, chained(c.limit_gradient(way, gap, v_r, *turned), rows, angle_by)


def touched(forms: ClosedForms, itinerary: Itinerary, i: int) -> Any:
    """Constants of the field in contact with the stop at the end of segment i."""
    fields = itinerary.neighbour(i), itinerary.neighbour(i + 1)
    return forms.constants(max(fields, key=lambda field: contact(field, itinerary.scene)))


def edge_of(forms: ClosedForms, itinerary: Itinerary, i: int) -> tuple[Number, Vector]:
    """Angle of the drive's edge at the end of segment i, and its row within the segment.

    The itinerary begins in the first turn.
    """
    scene, turn = itinerary.scene, forms.numbers.full_turn
    turns = itinerary.turns(i)
    row = np.full(BY_TIME + 1 + len(forms.values), 0 * turn)
    if level(itinerary.fields[i], scene):
        return (turns + 1) * turn, row
    c = forms.constants(itinerary.fields[i])
    row = row + turn * chained(c.high_share_gradient(), row[None, :] + np.zeros((STATES, 1)))
    return (turns + c.high_share()) * turn, row


def _pin(
    forms: ClosedForms, itinerary: Itinerary, start: SegmentFlow, residual: Vector, by: Matrix
) -> None:
    """Fix the start on the last guard's surface, in place of that component's closure.

    The end is there by the last segment's guard. Without this equation, segments whose guards all
    begin at 0 would determine only the differences of that component.
    """
    n, guard = len(itinerary), itinerary.segments[-1].guard
    if guard in (Guard.GAP, Guard.BACK):
        at = touched(forms, itinerary, -1)
        residual[n] = start.start[0] - at.own_stop()
        by[n] = chained(at.gap_gradient(), start.start_by)
    elif guard is Guard.DRIFT:
        residual[n + 2] = start.closed.v_c
        by[n + 2] = chained(start.c.speed_gradient(), start.start_by)
