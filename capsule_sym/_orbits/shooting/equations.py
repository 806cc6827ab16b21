"""The equations of a periodic orbit of a given itinerary, with their exact derivatives.

The unknowns are z = (x_r, v_r, v_c, theta, h_1, ..., h_n): state and forcing angle where the first
segment begins, and the duration of every segment. The n + 4 equations are: each segment's guard
vanishes at its end; state and forcing angle are those of the start again, the position x_c apart
(modulo drift). Of a motion that is its own mirror image only the first half is solved for: it ends
in the image of its start, so that what happens twice by symmetry happens once in the equations.

Where a guard vanishes at the segment's start already, that root is divided out: the equations then
stay regular as the segment shrinks to nothing, and go on beyond, to durations below zero. A motion
whose segment has the duration 0 is the bifurcation at which that segment is inserted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.expansion import Guard
from capsule_sym._native import check_time
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.itinerary import Itinerary, ItinerarySegment
from capsule_sym.generated import facts, formulas

_GUARD_BITS = 10  # in solving linear equations in 50 digits
_NODES = (-2, -1, 1, 2)
ROUNDINGS = 8  # of the terms of each equation, measured against 50 digits
PARAMETERS = facts.PARAMETERS
_OMEGA, _DELTA, _ZETA, _BETA, _GAMMA, _F_B = (
    PARAMETERS.index(name) for name in ("omega", "delta", "zeta", "beta", "gamma", "f_b")
)
Vector = NDArray[Any]  # of floats, or of mpmath numbers
Matrix = NDArray[Any]


@dataclass(frozen=True, eq=False)
class SegmentFlow:
    """A segment's flow: closed form, ends, and derivatives with respect to (z, parameters).

    States are (x_r, v_r, v_c); `angle` is the forcing angle at the start, not reduced; `moved` has
    the increments of x_r, v_c and x_c. `matrix` is the segment's own Jacobian, rows x_r, v_r, v_c
    and the advance of x_c, columns JACOBIAN_COLUMNS of the kernels; `start_by`, `end_by` (3, n +
    11) and `angle_by` (n + 11,) are total derivatives, in which the segment's duration is `column`.
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
        """Total derivatives (many, n + 11) of what has these derivatives within the segment.

        `rows` (many, 12) has the columns of the kernels' Jacobian: by start, duration, parameters.
        """
        return _total(rows, self.start_by, self.angle_by, self.column)


@dataclass(frozen=True, eq=False)
class ShootingSystem:
    """The equations of an orbit at some unknowns: residual, derivatives, and the segments.

    `residual` (n + 4,), `by_z` (n + 4, n + 4) and `by_p` (n + 4, 7); `advance` is the change of x_c
    over the orbit and `advance_by` (n + 11,) its gradient with respect to (z, parameters).
    """

    residual: Vector
    by_z: Matrix
    by_p: Matrix
    flows: tuple[SegmentFlow, ...]
    advance: Number
    advance_by: Vector

    def __repr__(self) -> str:
        largest = float(max(abs(self.residual)))
        return f"<ShootingSystem of {len(self.flows)} segments: largest residual {largest:.1e}>"


def shooting(
    numbers: Backend,
    values: Sequence[Number],
    itinerary: Itinerary,
    z: Vector,
    kept: ShootingSystem | None = None,
) -> ShootingSystem:
    """The equations of an itinerary at unknowns z, for values in the order of PARAMETERS.

    In 50 digits the segments' derivatives may be those `kept` from unknowns nearby.
    """
    check_time()
    n, zero = len(itinerary), numbers.number(0)
    forms, omega = ClosedForms(numbers, values), values[_OMEGA]
    chain = _chained(forms, itinerary, z) or _run_all(forms, itinerary, z, kept)
    residual, by = _zeros(numbers, n + 4), _zeros(numbers, n + 4, n + 11)
    for i, flow in enumerate(chain.flows):
        guard_by = None if kept is None else np.concatenate([kept.by_z[i], kept.by_p[i]])
        residual[i], by[i] = _guard(forms, flow, itinerary.zeros(i), 4 + i, guard_by)
    sign, turn = (-1, numbers.full_turn / 2) if itinerary.mirrored else (1, numbers.full_turn)
    for row in range(3):
        residual[n + row] = chain.end[row] - sign * z[row]
        by[n + row] = chain.end_by[row]
        by[n + row, row] = by[n + row, row] - sign
    _pin(itinerary, values, z, residual, by)
    elapsed = sum(z[4:].tolist(), zero)
    residual[n + 3] = omega * elapsed - itinerary.period_number * turn
    by[n + 3] = chain.angle_by
    by[n + 3, 3] = zero
    advance = sum((flow.moved[2] for flow in chain.flows), zero)
    by_z, by_p = by[:, : n + 4], by[:, n + 4 :]
    return ShootingSystem(residual, by_z, by_p, tuple(chain.flows), advance, chain.advance_by)


class _Chain(NamedTuple):
    """Segments one after another; the state at the end, and total derivatives there."""

    flows: list[SegmentFlow]
    end: Vector
    end_by: Matrix
    angle_by: Vector
    advance_by: Vector


def _chained(forms: ClosedForms, itinerary: Itinerary, z: Vector) -> _Chain | None:
    """The segments by the C core; None without it."""
    chain = forms.chain(itinerary.fields, z)
    if chain is None:
        return None
    closed, matrices, angles, durations, states, moved, by, angles_by, advance_by = chain
    flows = [
        SegmentFlow(
            segment=segment,
            c=forms.constants(segment.field),
            closed=forms.numbers.kernels.Start(*start),
            angle=angle,
            h=h,
            start=states[i],
            end=states[i + 1],
            moved=moved[i],
            matrix=matrices[i],
            start_by=by[i],
            end_by=by[i + 1],
            angle_by=angles_by[i],
            column=4 + i,
        )
        for i, (segment, start, angle, h) in enumerate(
            zip(
                itinerary.segments,
                closed.tolist(),
                angles.tolist()[:-1],
                durations.tolist(),
                strict=True,
            )
        )
    ]
    return _Chain(flows, states[-1], by[-1], angles_by[-1], advance_by)


def _run_all(
    forms: ClosedForms, itinerary: Itinerary, z: Vector, kept: ShootingSystem | None
) -> _Chain:
    """The segments one by one, by the kernels of any number system."""
    numbers, n, size = forms.numbers, len(itinerary), len(itinerary) + 11
    zero, omega = numbers.number(0), forms.values[_OMEGA]
    # Plain numbers: NumPy's own make the scalar path several times slower.
    angle, *durations = z[3:].tolist()
    state, state_by, angle_by = z[:3], _zeros(numbers, 3, size), _zeros(numbers, size)
    for row in range(3):
        state_by[row, row] = zero + 1
    angle_by[3] = zero + 1
    advance_by, elapsed, flows = _zeros(numbers, size), zero, []
    for i, (segment, h) in enumerate(zip(itinerary.segments, durations, strict=True)):
        check_time()
        matrix = None if kept is None else kept.flows[i].matrix
        flow = _run(forms, segment, state, state_by, angle, angle_by, h, 4 + i, matrix)
        advance_by = advance_by + flow.total(flow.matrix[3:])[0]
        flows.append(flow)
        state, state_by, angle = flow.end, flow.end_by, angle + omega * h
        elapsed = elapsed + h
        angle_by = angle_by.copy()
        angle_by[4 + i] = angle_by[4 + i] + omega
        angle_by[n + 4 + _OMEGA] = elapsed
    return _Chain(flows, state, state_by, angle_by, advance_by)


def solve(numbers: Backend, matrix: Matrix, right: Matrix) -> Matrix:
    """The solution of a square system, for one right side or several as columns.

    Raises numpy.linalg.LinAlgError where the matrix is singular.
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


def _zeros(numbers: Backend, *shape: int) -> NDArray[Any]:
    return np.full(shape, numbers.number(0))


def _run(
    forms: ClosedForms,
    segment: ItinerarySegment,
    state: Vector,
    state_by: Matrix,
    angle: Number,
    angle_by: Vector,
    h: Number,
    column: int,
    kept: Matrix | None = None,
) -> SegmentFlow:
    """A segment of duration h from a start that is known with its derivatives."""
    numbers, c = forms.numbers, forms.constants(segment.field)
    x_r, v_r, v_c = state.tolist()
    gap = x_r - c.delta
    margin = formulas.margin_at(c, x_r, gap, v_r)
    closed = numbers.kernels.Start(x_r, gap, v_r, v_c, margin, *numbers.cos_sin(angle))
    # A duration of 0 would leave nothing to divide by; within rounding the limit is the same.
    duration = h if abs(h) > numbers.unit else numbers.unit
    (position, velocity, change, advance), matrix = forms.run(
        segment.field, c, closed, duration, kept
    )
    change = change if c.drift else -v_c
    end = np.array([x_r + position, velocity, v_c + change])
    moved = np.array([position, change, advance])
    end_by = _total(matrix[:3], state_by, angle_by, column)
    return SegmentFlow(
        segment=segment,
        c=c,
        closed=closed,
        angle=angle,
        h=duration,
        start=state,
        end=end,
        moved=moved,
        matrix=matrix,
        start_by=state_by,
        end_by=end_by,
        angle_by=angle_by,
        column=column,
    )


def _total(rows: Matrix, state_by: Matrix, angle_by: Vector, column: int) -> Matrix:
    """Total derivatives of what depends on a segment's start, duration and the parameters."""
    result = rows[:, :3] @ state_by + rows[:, 3:4] * angle_by
    result[:, column] = result[:, column] + rows[:, 4]
    result[:, -7:] = result[:, -7:] + rows[:, 5:]
    return result  # type: ignore[no-any-return]


def _guard(
    forms: ClosedForms, flow: SegmentFlow, zeros: int, column: int, kept: Vector | None
) -> tuple[Number, Vector]:
    """A segment's guard at its end over its duration's power `zeros`, and the gradient."""
    if flow.segment.guard is None:
        return flow.angle, flow.angle_by
    if zeros == 0:
        return _value(flow)
    value = _increment(flow, zeros) / flow.h**zeros
    one = forms.numbers.number(1)
    least = min(forms.numbers.unit ** (one / (zeros + 4)), one / (10 * flow.c.rate))
    if abs(flow.h) >= least:
        return value, _divided_by(flow, zeros, column)
    if kept is not None:
        return value, kept
    # So near to the limit the differences in the gradient would cancel: it is interpolated, to an
    # error of `least` times the rate to the fourth, from durations to both sides where they do not.
    start = flow.start, flow.start_by, flow.angle, flow.angle_by
    gradient = 0 * flow.angle_by
    for node in _NODES:
        at = _run(forms, flow.segment, *start, node * least, column)
        weight = math.prod((flow.h / least - k) / (node - k) for k in _NODES if k != node)
        gradient = gradient + weight * _divided_by(at, zeros, column)
    return value, gradient


def _divided_by(flow: SegmentFlow, zeros: int, column: int) -> Vector:
    """Gradient of a guard's increment over the duration's power `zeros`."""
    power = flow.h**zeros
    by: Vector = _increment_by(flow, zeros, column) / power
    by[column] = by[column] - zeros * _increment(flow, zeros) / (power * flow.h)
    return by


def _increment(flow: SegmentFlow, zeros: int) -> Number:
    """What a guard gains over a segment at whose start it and `zeros` - 1 derivatives vanish."""
    if flow.segment.guard is Guard.GAP:
        return flow.moved[0]
    if zeros == 1:
        return flow.moved[1]
    return flow.moved[1] - flow.closed.margin * flow.h / flow.c.gamma


def _increment_by(flow: SegmentFlow, zeros: int, column: int) -> Vector:
    """Gradient of the increment."""
    row = 0 if flow.segment.guard is Guard.GAP else 2
    gradient = flow.end_by[row] - flow.start_by[row]
    if zeros == 1:
        return gradient  # type: ignore[no-any-return]
    c, h, margin = flow.c, flow.h, flow.closed.margin
    margin_by = force_by(c, flow.start[0], flow.start[1], flow.start_by)
    margin_by[-7 + _F_B] = margin_by[-7 + _F_B] - c.drift
    gradient = gradient - margin_by * (h / c.gamma)
    gradient[column] = gradient[column] - margin / c.gamma
    gradient[-7 + _GAMMA] = gradient[-7 + _GAMMA] + margin * h / (c.gamma * c.gamma)
    return gradient  # type: ignore[no-any-return]


def _value(flow: SegmentFlow) -> tuple[Number, Vector]:
    """A guard at the end of a segment, and its gradient."""
    c, (x_r, v_r, v_c), by = flow.c, flow.end, flow.end_by
    if flow.segment.guard is Guard.GAP:
        gradient = by[0].copy()
        gradient[-7 + _DELTA] = gradient[-7 + _DELTA] - 1
        return x_r - c.delta, gradient
    if flow.segment.guard is Guard.DRIFT:
        return v_c, by[2]
    side = 1 if flow.segment.guard is Guard.UPPER else -1
    gradient = force_by(c, x_r, v_r, by)
    gradient[-7 + _F_B] = gradient[-7 + _F_B] - side
    return formulas.force(c, x_r, x_r - c.delta, v_r) - formulas.friction_at(c, side), gradient


def force_by(c: Any, x_r: Number, v_r: Number, by: Matrix) -> Vector:
    """Gradient (n + 11,) of the interaction force P where x_r and v_r have the derivatives `by`."""
    gradient = formulas.force_change(c, by[0], by[1])
    slopes = formulas.force_slopes(c, x_r - c.delta, v_r)
    for parameter, slope in zip((_DELTA, _ZETA, _BETA), slopes, strict=True):
        gradient[-7 + parameter] = gradient[-7 + parameter] + slope
    return gradient  # type: ignore[no-any-return]


def _pin(
    itinerary: Itinerary, values: Sequence[Number], z: Vector, residual: Vector, by: Matrix
) -> None:
    """Hold the start to the last guard's surface, in place of that component's closure.

    The last segment's guard has its end there. Were the start not held, segments whose guards begin
    at 0 one after the other all round would fix their differences only.
    """
    n, guard = len(itinerary), itinerary.segments[-1].guard
    if guard is Guard.GAP:
        residual[n] = z[0] - values[_DELTA]
        by[n] = by[n] * 0
        by[n, 0], by[n, n + 4 + _DELTA] = by[n, 0] + 1, by[n, n + 4 + _DELTA] - 1
    elif guard is Guard.DRIFT:
        residual[n + 2] = z[2]
        by[n + 2] = by[n + 2] * 0
        by[n + 2, 2] = by[n + 2, 2] + 1
