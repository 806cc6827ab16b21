"""Linear stability: monodromy of a periodic orbit, Floquet multipliers, and Lyapunov exponents.

Between switches the flow's Jacobian propagates a deviation of the state (x_r, v_r, v_c); at a
switch the saltation matrix S = I + (f_after - f_before) n^T / (n^T f_before) does. The fields are
continuous on the impact surface and at the start of a slip, so that S differs from I only where the
capsule stops, n = (0, 0, 1). If it then sticks, S removes v_c, and the rank decreases.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import chain, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym._map import Segment, Trajectory
from capsule_sym._map.backend import Number, backend
from capsule_sym._map.expansion import Guard
from capsule_sym._native import check_time
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import Matrix, Vector
from capsule_sym._orbits.shooting.itinerary import drift

Constants = Any  # of a segment's closed form, by the kernels of a scene
OrbitLike = Any  # an Orbit, whose module imports this one


def field(c: Any, state: Sequence[Number] | Vector, cosine: Number) -> Vector:
    """Right side (x_r', v_r', v_c') of the segment with constants `c`, Eqs. (7)-(12)."""
    x_r, v_r, v_c = state
    place = x_r, x_r - c.own_stop(), v_r, cosine
    acceleration = c.v_rate(*place)
    if not c.drift:
        return np.array([v_r, acceleration, 0 * v_c])
    return np.array([v_r, acceleration, c.v_c_rate(c.margin_at(*place))])


def saltation_matrix(before: Constants, after: Constants, state: Vector, cosine: Number) -> Matrix:
    """Saltation matrix where the capsule stops and passes from one field to another.

    It carries a deviation of the state (x_r, v_r, v_c) across the switch. If the capsule then
    sticks, it removes the deviation of v_c.

    Parameters
    ----------
    before : constants of a segment
        Constants of the segment that ends, such as `orbit.system.flows[0].c`, dimensionless.
    after : constants of a segment
        Constants of the segment that follows, dimensionless.
    state : sequence of 3 floats
        State (x_r, v_r, v_c) at the switch, dimensionless.
    cosine : float
        Cosine of the forcing angle at the switch, dimensionless.

    Returns
    -------
    ndarray of shape (3, 3)
        Saltation matrix, dimensionless.

    Raises
    ------
    InvalidInput
        For a state that is not three numbers, or constants that are not those of a segment.

    See Also
    --------
    monodromy_matrix : the product over an orbit.

    Notes
    -----
    The matrix is S = I + (g - f) n^T/(n^T f), with n = (0, 0, 1). The field is f before the switch
    and g after it. At all other switches S = I: the fields are continuous, or the
    time is fixed, as at an edge of the drive.

    Examples
    --------
    >>> import math
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> landing, stick = orbit.system.flows[2:]  # the capsule stops at the end of F1
    >>> cosine = math.cos(landing.angle + 0.8 * landing.h)  # omega is 0.8
    >>> abs(cs.orbits.saltation_matrix(landing.c, stick.c, landing.end, cosine)).tolist()
    [[1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]]
    """
    if len(state) != 3:
        raise InvalidInput("state", state, "three numbers (x_r, v_r, v_c)")
    f, g = field(before, state, cosine), field(after, state, cosine)
    # v_r' and v_c' have opposite jumps. In stick v_c' = 0, even if a soft landing has no v_c' in
    # drift either.
    ratio = g[2] / f[2] if after.drift else 0 * f[2]
    matrix = np.zeros((3, 3)) * ratio + np.eye(3, dtype=int)
    matrix[1, 2] = 1 - ratio
    matrix[2, 2] = ratio
    return matrix  # type: ignore[no-any-return]


def monodromy_matrix(orbit: OrbitLike) -> Matrix:
    """Monodromy matrix of an orbit at the phase of its start.

    For the first half of a motion that is its own mirror image it is the matrix of half the period
    times the reflection. Its square is that of the motion.

    Parameters
    ----------
    orbit : Orbit
        A solved orbit, whose `success` is True.

    Returns
    -------
    ndarray of shape (3, 3)
        Derivative of the state (x_r, v_r, v_c) after the orbit's period by the state at its start.
        It is dimensionless, in the number system of the orbit.

    Raises
    ------
    InvalidInput
        For an orbit that was not found, a `NoOrbit`.

    See Also
    --------
    floquet_multipliers : its eigenvalues.
    jacobian : the same derivative of any run.

    Notes
    -----
    The matrix is the product of the segments' Jacobians and of the saltation matrices at switches
    where the capsule stops.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> for row in cs.orbits.monodromy_matrix(orbit):
    ...     print(" ".join(f"{value:9.6f}" for value in row))
    -0.569805 -0.228763  0.000000
     0.477978 -0.435885  0.000000
     0.000000  0.000000  0.000000
    """
    if orbit.system.monodromy is not None:
        return orbit.system.monodromy  # type: ignore[no-any-return]
    return _product(orbit, 0)


def floquet_multipliers(orbit: OrbitLike) -> NDArray[np.complex128]:
    """The three Floquet multipliers of an orbit, complex, the largest modulus first.

    One is exactly 0 if the capsule sticks on the orbit: stick ends with v_c = 0 for all deviations.
    For the first half of a symmetric orbit they are those of the whole orbit. They have double
    precision with every backend.

    Parameters
    ----------
    orbit : Orbit
        A solved orbit, whose `success` is True.

    Returns
    -------
    ndarray of complex, shape (3,)
        Floquet multipliers, dimensionless. The orbit is stable if all are below 1 in modulus.

    Raises
    ------
    InvalidInput
        For an orbit that was not found, a `NoOrbit`.

    See Also
    --------
    monodromy_matrix : the matrix of which they are eigenvalues.
    lyapunov_exponents : growth rates along any trajectory.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> abs(cs.orbits.floquet_multipliers(orbit)).round(6).tolist()
    [0.598091, 0.598091, 0.0]
    """
    flows = orbit.system.flows
    sticking = [i for i, flow in enumerate(flows) if not flow.c.drift]
    matrix = _product(orbit, sticking[0] if sticking else 0)
    size, values = 2 if sticking else 3, np.zeros(3, dtype=complex)
    values[:size] = np.linalg.eigvals(matrix[:size, :size].astype(float))
    if orbit.itinerary.mirrored:
        values = values**2
    return values[np.argsort(-abs(values), kind="stable")]


def _product(orbit: OrbitLike, first: int) -> Matrix:
    """Product of Jacobians and saltation matrices over the segments, in cyclic order from `first`.

    For the first half of a symmetric orbit it is multiplied by the reflection.
    """
    flows, itinerary = orbit.system.flows, orbit.itinerary
    n, numbers = len(flows), orbit.numbers
    forms = ClosedForms(numbers, orbit.values)
    sign = -1 if itinerary.mirrored else 1
    product: Matrix = np.zeros((3, 3)) * numbers.number(1) + sign * np.eye(3, dtype=int)
    # The reflection is -1 in the whole state, so that its place in the product does not matter.
    for k in (*range(first, n), *range(first)):
        flow = flows[k]
        product = flow.matrix[:3, :3] @ product
        if flow.segment.guard is Guard.DRIFT:
            cosine, _ = numbers.cos_sin(flow.angle + flow.c.omega * flow.h)
            after = forms.constants(itinerary.neighbour(k + 1))
            product = saltation_matrix(flow.c, after, flow.end, cosine) @ product
    return product


def jacobian(trajectory: Trajectory) -> NDArray[np.float64]:
    """Derivative of a run's final state with respect to its start state.

    It is the product of the segments' derivatives and the saltation matrices, in double precision
    with every backend.

    Parameters
    ----------
    trajectory : Trajectory
        A run with all its segments: `keep` is "segments", the default of `simulate`.

    Returns
    -------
    ndarray of shape (3, 3)
        Derivatives of (x_r, v_r, v_c) at the end by those at the start, dimensionless.

    Raises
    ------
    InvalidInput
        If the segments were not kept.

    See Also
    --------
    monodromy_matrix : the derivative over a periodic orbit.
    lyapunov_exponents : its growth rates, for long runs.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> run = cs.simulate(cs.Parameters(alpha=1.2), (0.1, 0.0, 0.5), periods=1)
    >>> for row in cs.orbits.jacobian(run):
    ...     print(" ".join(f"{value:9.6f}" for value in row))
     0.400054 -0.162556 -0.057553
     1.313807  0.220278  0.848364
    -0.099720 -0.041980 -0.092403
    """
    product = np.eye(3)
    for matrix in _matrices(trajectory):
        product = matrix @ product
    return product


@np.errstate(divide="ignore", under="ignore")
def lyapunov_exponents(trajectory: Trajectory, transient: int = 0) -> NDArray[np.float64]:
    """The three Lyapunov exponents along a trajectory, per unit of time.

    Only the part after `transient` excitation periods counts. An exponent is -inf once the capsule
    has stuck. They are computed in double precision with every backend.

    Parameters
    ----------
    trajectory : Trajectory
        A run with all its segments: `keep` is "segments", the default of `simulate`.
    transient : int, default 0, from 0 to below the periods of the run
        Length of the part that does not count, in excitation periods.

    Returns
    -------
    ndarray of shape (3,)
        Exponents, descending, dimensionless.

    Raises
    ------
    InvalidInput
        If no part is left after the transient, and if the segments were not kept.

    See Also
    --------
    floquet_multipliers : multipliers of a periodic orbit.

    Notes
    -----
    If the motion settles on an orbit of period T, the largest exponent tends to log(abs(m))/T for
    the largest Floquet multiplier m.

    Examples
    --------
    >>> import math
    >>> import capsule_sym as cs
    >>> parameters = cs.Parameters(alpha=0.9)
    >>> found = cs.orbits.lyapunov_exponents(cs.simulate(parameters, periods=50), transient=10)
    >>> found.round(3).tolist()
    [-0.065, -0.068, -inf]
    >>> largest = abs(cs.solve_orbit(parameters).multipliers[0])
    >>> print(f"{math.log(largest) / parameters.period:.3f}")
    -0.065
    """
    ends, omega = trajectory.final[0], trajectory.parameters.omega
    if not 0 <= transient < ends.period + (ends.phase > 0):
        raise InvalidInput("transient", transient, "from 0 to below the periods of the run")
    first = int(np.searchsorted(trajectory.records["start_period"], transient))
    # A tangent, the normal of a plane, and logarithms of the growth of both and of the volume.
    (tangent, _, normal), logs, time = np.eye(3), np.zeros(3), 0.0
    with backend("numpy", trajectory.parameters.scene) as numbers:
        forms = ClosedForms(numbers, list(trajectory.parameters.to_dict().values()))
        for segment, following in pairwise(
            chain(trajectory.segments[max(first - 1, 0) :], (None,))
        ):
            assert segment is not None
            left = (segment.end.period - transient) * math.tau / omega + float(segment.end.phase)
            lasting = min(float(segment.duration), left)
            if lasting <= 0:
                continue
            time += lasting
            sigma = forms.constants(segment.field).sigma
            sticks = not drift(segment.field, forms.scene)
            logs[2] += -math.inf if sticks else -2 * sigma * lasting
            for matrix, h in flows(forms, segment.field, lasting):
                tangent, grown = _carried(matrix, tangent)
                # The contraction of the plane, which no difference of products resolves, is known.
                cofactors = _cofactors(matrix)
                cofactors[2, 2] = math.exp(-2 * sigma * h)
                normal, turned = (normal, -2 * sigma * h) if sticks else _carried(cofactors, normal)
                logs[:2] += grown, turned
            if (switch := landing(forms, segment, following)) is not None:
                tangent, grown = _carried(switch, tangent)
                normal, turned = _carried(_cofactors(switch), normal)
                logs += grown, turned, np.log(abs(switch[2, 2]))
    return np.sort(np.diff(logs, prepend=0.0) / time)[::-1]


_MOST_DECAY = 3.0
"""Exponents of a piece of a segment by which its slowest free motion may decay."""


def _cofactors(matrix: Matrix) -> Matrix:
    return np.cross(matrix[[1, 2, 0]], matrix[[2, 0, 1]])


def _carried(matrix: Matrix, vector: Vector) -> tuple[Vector, float]:
    """Direction of a vector carried by a matrix, and the logarithm of its growth."""
    carried = matrix @ vector
    size = np.linalg.norm(carried)
    return carried / size, math.log(size)


def _matrices(trajectory: Trajectory) -> Iterator[Matrix]:
    """Jacobians and saltation matrices along a run."""
    with backend("numpy", trajectory.parameters.scene) as numbers:
        forms = ClosedForms(numbers, list(trajectory.parameters.to_dict().values()))
        for segment, following in pairwise(chain(trajectory.segments, (None,))):
            assert segment is not None
            for matrix, _ in flows(forms, segment.field, float(segment.duration)):
                yield matrix
            if (switch := landing(forms, segment, following)) is not None:
                yield switch


def flows(forms: ClosedForms, field: int, duration: float) -> Iterator[tuple[Matrix, float]]:
    """Jacobians (3, 3) over short pieces of a segment, and their durations."""
    c = forms.constants(field)
    decay = -c.slow if c.q < 0 else c.sigma
    pieces = math.ceil(duration * max(c.omega / math.tau, decay / _MOST_DECAY)) or 1
    # A segment's flow is affine in the state: its Jacobian does not depend on the start.
    start = forms.numbers.kernels.Start(0.0, -c.own_stop(), 0.0, 0.0, 0.0, 1.0, 0.0)
    matrix = forms.run(field, c, start, duration / pieces)[1][:3, :3]
    for _ in range(pieces):
        check_time()
        yield matrix, duration / pieces


def landing(forms: ClosedForms, segment: Segment, following: Segment | None) -> Matrix | None:
    """Saltation matrix (3, 3) at the end of a segment; None where it is the identity."""
    if following is None:
        return None
    if drift(segment.field, forms.scene) in (0, drift(following.field, forms.scene)):
        return None
    c, after = forms.constants(segment.field), forms.constants(following.field)
    state = np.array([float(value) for value in segment.end_state])
    return saltation_matrix(c, after, state, math.cos(float(segment.end.phase) * c.omega))
