"""Linear stability: monodromy of a periodic orbit, its multipliers, and Lyapunov exponents.

Between switches a deviation of the state (x_r, v_r, v_c) is carried by the flow's Jacobian, across
a switch by the saltation matrix S = I + (f_after - f_before) n^T / (n^T f_before). The fields are
continuous on the impact surface and where a slip begins, so that S differs from I only where the
capsule comes to rest, n = (0, 0, 1). If it then sticks, S projects out v_c, and the rank falls.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput, Status
from capsule_sym._map import Segment, Trajectory
from capsule_sym._map.backend import Backend, Number, backend
from capsule_sym._map.checks import checked_seconds
from capsule_sym._map.expansion import Guard
from capsule_sym._native import Watch, check_time
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import Matrix, ShootingSystem, Vector
from capsule_sym._orbits.shooting.itinerary import Itinerary, drift


class Orbit(Protocol):
    """What is read of an orbit that was found."""

    @property
    def itinerary(self) -> Itinerary: ...
    @property
    def values(self) -> tuple[Number, ...]: ...
    @property
    def system(self) -> ShootingSystem: ...
    @property
    def backend(self) -> str: ...


def field(c: Any, state: Vector, cosine: Number) -> Vector:
    """Right side (x_r', v_r', v_c') of the segment with constants `c`, Eqs. (7)-(12)."""
    x_r, v_r, v_c = state
    place = x_r, x_r - c.own_stop(), v_r, cosine
    acceleration = c.v_rate(*place)
    if not c.drift:
        return np.array([v_r, acceleration, 0 * v_c])
    return np.array([v_r, acceleration, c.v_c_rate(c.margin_at(*place))])


def saltation_matrix(before: Any, after: Any, state: Vector, cosine: Number) -> Matrix:
    """Saltation matrix (3, 3) where the capsule comes to rest in passing from one field to another.

    `before` and `after` are the constants of the two segments, `state` and the cosine of the
    forcing angle those of the switch; all dimensionless.
    """
    f, g = field(before, state, cosine), field(after, state, cosine)
    # v_r' jumps by as much as v_c' does, the other way. What sticks has no v_c', even where the
    # landing is so soft that the drift has none either.
    ratio = g[2] / f[2] if after.drift else 0 * f[2]
    matrix = np.zeros((3, 3)) * ratio + np.eye(3, dtype=int)
    matrix[1, 2] = 1 - ratio
    matrix[2, 2] = ratio
    return matrix  # type: ignore[no-any-return]


def monodromy_matrix(orbit: Orbit) -> Matrix:
    """Monodromy matrix (3, 3), dimensionless, over the orbit, at the phase where it begins.

    Of the first half of a motion that is its own mirror image it is the matrix of half the period
    and the reflection: its square is that of the motion.
    """
    if orbit.system.monodromy is not None:
        return orbit.system.monodromy
    with backend(orbit.backend, orbit.itinerary.scene) as numbers:
        return _product(numbers, orbit, 0)


def floquet_multipliers(orbit: Orbit) -> NDArray[np.complex128]:
    """The three multipliers, complex, shape (3,), dimensionless, the largest modulus first.

    One is 0 exactly where the capsule sticks somewhere along the orbit: only deviations with
    v_c = 0 leave the stick.
    """
    flows = orbit.system.flows
    sticking = [i for i, flow in enumerate(flows) if not flow.c.drift]
    with backend(orbit.backend, orbit.itinerary.scene) as numbers:
        matrix = _product(numbers, orbit, sticking[0] if sticking else 0)
        size = 2 if sticking else 3
        values = np.zeros(3, dtype=complex)
        values[:size] = np.linalg.eigvals(matrix[:size, :size].astype(float))
    if orbit.itinerary.mirrored:
        values = values**2
    return values[np.argsort(-abs(values), kind="stable")]


def _product(numbers: Backend, orbit: Orbit, first: int) -> Matrix:
    """Product of Jacobians and saltation matrices over the segments from `first` on."""
    flows, itinerary = orbit.system.flows, orbit.itinerary
    n, forms = len(flows), ClosedForms(numbers, orbit.values)
    sign = -1 if itinerary.mirrored else 1
    product: Matrix = np.zeros((3, 3)) * numbers.number(1) + sign * np.eye(3, dtype=int)
    # The reflection is -1 in all of the state, so that it does not matter where it is taken.
    for k in (*range(first, n), *range(first)):
        flow = flows[k]
        product = flow.matrix[:3, :3] @ product
        if flow.segment.guard is Guard.DRIFT:
            cosine, _ = numbers.cos_sin(flow.angle + flow.c.omega * flow.h)
            after = forms.constants(itinerary.neighbour(k + 1))
            product = saltation_matrix(flow.c, after, flow.end, cosine) @ product
    return product


def jacobian(trajectory: Trajectory, *, max_seconds: float = math.inf) -> NDArray[np.float64]:
    """Derivative (3, 3) of a run's final state with respect to the state at its start.

    Dimensionless, the product of the segments' derivatives and of saltation matrices, in double
    precision whatever the trajectory's backend. After `max_seconds` of the clock it is nan.
    """
    product, done = np.eye(3), False
    with Watch(checked_seconds(max_seconds)):
        for matrix, _ in _matrices(trajectory, trajectory.segments):
            product = matrix @ product
        done = True
    return product if done else np.full((3, 3), np.nan)


@dataclass(frozen=True, eq=False)
class LyapunovExponents:
    """The three Lyapunov exponents along a trajectory, per unit of time, dimensionless."""

    values: NDArray[np.float64]
    """The exponents, shape (3,), descending; nan where no time was passed."""
    time: float
    """How long the part of the trajectory lasts that they are of."""
    status: Status
    """Finished, or time-limit."""

    @property
    def success(self) -> bool:
        """Whether they are of the whole trajectory but its transient."""
        return self.status is Status.FINISHED

    @property
    def message(self) -> str:
        """The status as a sentence."""
        whole = "of the whole trajectory" if self.success else "of what was passed in the time"
        return f"the exponents are {whole}"


def lyapunov_exponents(
    trajectory: Trajectory, transient: int = 0, *, max_seconds: float = math.inf
) -> LyapunovExponents:
    """The three Lyapunov exponents per unit of time along a trajectory, its segments in order.

    Only segments that begin after `transient` excitation periods count. An exponent is -inf once
    the capsule has stuck. In double precision whatever the trajectory's backend. After
    `max_seconds` of the clock they are those of the part that was passed. Raises InvalidInput where
    no segment is left.
    """
    first = int(np.searchsorted(trajectory.records["start_period"], transient))
    segments = trajectory.segments[first:]
    if not segments:
        raise InvalidInput("transient", transient, "less than the periods of the run")
    frame, sums, time, status = np.eye(3), np.zeros(3), 0.0, Status.TIME_LIMIT
    with Watch(checked_seconds(max_seconds)):
        for matrix, lasting in _matrices(trajectory, segments):
            frame, grown = _orthonormal(matrix @ frame)
            sums[: len(grown)] += grown
            sums[len(grown) :] = -math.inf
            time += lasting
        status = Status.FINISHED
    values = np.sort(sums / time)[::-1] if time else np.full(3, np.nan)
    return LyapunovExponents(values, time, status)


def _matrices(
    trajectory: Trajectory, segments: Sequence[Segment]
) -> Iterator[tuple[NDArray[np.float64], float]]:
    """What carries a deviation along, Jacobians and saltation matrices, and how long each lasts."""
    with backend("numpy", trajectory.parameters.scene) as numbers:
        forms = ClosedForms(numbers, list(trajectory.parameters.to_dict().values()))
        for segment, following in pairwise(chain(segments, (None,))):
            assert segment is not None
            yield from flows(forms, segment)
            if (matrix := landing(forms, segment, following)) is not None:
                yield matrix, 0.0


def flows(forms: ClosedForms, segment: Segment) -> Iterator[tuple[NDArray[np.float64], float]]:
    """Jacobians (3, 3) over pieces of a segment no longer than a period, and their durations."""
    c, duration = forms.constants(segment.field), float(segment.duration)
    pieces = math.ceil(duration * c.omega / forms.numbers.full_turn) or 1
    # A segment's flow is affine in the state: its Jacobian is the same from every start.
    start = forms.numbers.kernels.Start(0.0, -c.own_stop(), 0.0, 0.0, 0.0, 1.0, 0.0)
    matrix = forms.run(segment.field, c, start, duration / pieces)[1][:3, :3]
    for _ in range(pieces):
        check_time()
        yield matrix, duration / pieces


def landing(
    forms: ClosedForms, segment: Segment, following: Segment | None
) -> NDArray[np.float64] | None:
    """Saltation matrix (3, 3) at the end of a segment; None where it is the identity."""
    if following is None or not _lands(forms, segment.field, following.field):
        return None
    c, after = forms.constants(segment.field), forms.constants(following.field)
    state = np.array([float(value) for value in segment.end_state])
    return saltation_matrix(c, after, state, math.cos(float(segment.end.phase) * c.omega))


def _lands(forms: ClosedForms, field: int, following: int) -> bool:
    return drift(field, forms.scene) not in (0, drift(following, forms.scene))


def _orthonormal(frame: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """An orthonormal basis of the frame's span, and the logarithms of its growth.

    Where the last row vanishes the capsule sticks, and a third vector has nowhere to point.
    """
    if not np.any(frame[2]):
        basis, triangle = np.linalg.qr(frame[:2, :2])
        basis = np.vstack([basis, np.zeros((1, 2))])
    else:
        basis, triangle = np.linalg.qr(frame)
    return basis, np.log(abs(np.diag(triangle)))
