"""Performance of a periodic motion: progression, work, losses and peak forces, with gradients.

Work and damper loss are integrals of products of closed forms, which are entire functions of time
of known exponential type. Gauss-Legendre quadrature on panels that are short compared with that
type has no error above rounding, at resonance and for short segments too. As the fast mode of
strong damping decays, the panels become longer. Each integral is computed on its own, so that the
energy balance, work = damper loss + friction loss + lift, tests both. Friction loss, lift and
progression are closed forms.

A gradient is that along the branch of orbits, by the implicit function theorem.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._map.backend import Backend, Number, backend
from capsule_sym._map.result import brief
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._native import check_time
from capsule_sym._orbits.shooting.closed import ClosedForms, chained
from capsule_sym._orbits.shooting.equations import (
    BY_ANGLE,
    BY_TIME,
    STATES,
    Matrix,
    SegmentFlow,
    Vector,
)
from capsule_sym._orbits.shooting.extrema import extrema
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit
from capsule_sym._parameters import Scene
from capsule_sym.generated.interface import Quantity

# Relative error of n nodes on e^(lambda t) over a panel h: (lambda h)^(2n) (n!)^4/((2n + 1)
# (2n)!^3), about 1e-20 for 16 nodes if lambda h = 12, below 1e-65 for 48 nodes up to 30.
_NODES, _REACH = 16, 12
_MOST_EXPONENT = 700.0
_MPMATH_DEGREE, _MPMATH_REACH = 5, 30  # mpmath's rule of this degree has 48 nodes
METRICS = (
    "velocity",
    "progression",
    "work",
    "damper_loss",
    "friction_loss",
    "peak_force",
    "peak_contact",
)
"""Metrics in the order of the C core."""


def shown(scene: Scene) -> tuple[str, ...]:
    """Metrics that are shown in a scene; with lift if the scene has a constant force."""
    return (*METRICS[:5], "lift", *METRICS[5:]) if scene.facts.LIFTS else METRICS


_Energy = tuple[Number, Vector]  # of a segment, and its derivatives (columns,) within it


class Metric(NamedTuple):
    """A metric, and its derivative along the branch by each parameter's name; dimensionless."""

    value: Number
    gradient: dict[str, Number]

    def __repr__(self) -> str:
        return brief(self, f"{float(self.value):.6g}, gradient by {', '.join(self.gradient)}")


@dataclass(frozen=True)
class Performance:
    """Metrics of a periodic motion, dimensionless; energies are per excitation period.

    `velocity` is the average of v_c, `progression` the advance of x_c per excitation period.
    `work` is done by the drive, `damper_loss` is the integral of 2 zeta v_r^2. `friction_loss` is
    the integral of the friction times `|v_c|`, and `lift` the work against a constant force on the
    bodies over the progression: on a slope with bias s the friction is the bound less gamma s
    upward, plus gamma s downward, and the lift (1 + gamma) s times the progression. `imbalance`,
    the work less losses and lift, is zero but for rounding. `peak_force` is the largest `|P|` of
    spring, damper and stop between the bodies, `peak_contact` that of a stop's spring.
    """

    velocity: Metric
    progression: Metric
    work: Metric
    damper_loss: Metric
    friction_loss: Metric
    lift: Metric
    imbalance: Number
    peak_force: Metric
    peak_contact: Metric

    def __repr__(self) -> str:
        names = ("velocity", "progression", "work")
        return brief(self, ", ".join(f"{n} {float(getattr(self, n).value):.6g}" for n in names))


@np.errstate(under="ignore")
def performance(orbit: Orbit) -> Performance:
    """All metrics of an orbit with their gradients, in the number system of the orbit.

    A metric has a `value` and a `gradient`, the derivative by each parameter along the branch of
    orbits. All are dimensionless. Energies are per excitation period.

    Parameters
    ----------
    orbit : Orbit
        A solved orbit, whose `success` is True. The first half of a symmetric orbit gives the
        metrics of the whole one.

    Returns
    -------
    Performance
        Metrics by name: `velocity`, `progression`, `work`, `damper_loss`, `friction_loss`, `lift`,
        `peak_force` and `peak_contact`. The `imbalance` of the energies is a number: 0 but for
        rounding.

    Raises
    ------
    InvalidInput
        For an orbit that was not found, a `NoOrbit`.
    numpy.linalg.LinAlgError
        Where the orbit's equations are exactly singular, as at a fold, where the branch has no
        gradient. Next to it, within rounding, gradients are very large.

    See Also
    --------
    performance_many : metrics of many motions by the C core.

    Notes
    -----
    Work and damper loss are integrals of closed forms, by Gauss-Legendre quadrature to rounding.
    Gradients follow from the implicit function theorem.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> metrics = cs.performance(cs.solve_orbit(cs.Parameters(alpha=0.9)))
    >>> print(f"{metrics.velocity.value:.6f}, by alpha {metrics.velocity.gradient['alpha']:.4f}")
    0.102007, by alpha 0.2606
    >>> losses = metrics.damper_loss.value + metrics.friction_loss.value
    >>> print(f"{metrics.work.value:.6f} = {losses:.6f}")
    1.128979 = 1.128979
    """
    orbit = whole_orbit(orbit)
    with backend(orbit.backend, orbit.scene) as numbers:
        period_number, omega = orbit.itinerary.period_number, orbit.value("omega")
        per_turn = omega / numbers.full_turn
        progression = _along(orbit, orbit.progression, orbit.system.advance_by / period_number)
        slopes = {name: slope * per_turn for name, slope in progression.gradient.items()}
        slopes["omega"] += progression.value / numbers.full_turn
        forms = ClosedForms(numbers, orbit.values)
        segments = [_energies(forms, flow) for flow in orbit.system.flows]
        work, damper_loss, friction_loss = (
            _energy(orbit, [segment[i] for segment in segments]) for i in range(3)
        )
        lift = _lift(orbit, progression)
        return Performance(
            velocity=Metric(progression.value * per_turn, slopes),
            progression=progression,
            work=work,
            damper_loss=damper_loss,
            friction_loss=friction_loss,
            lift=lift,
            imbalance=work.value - damper_loss.value - friction_loss.value - lift.value,
            peak_force=_along(orbit, *_peak(forms, orbit, Quantity.FORCE)),
            peak_contact=_along(orbit, *_peak(forms, orbit, Quantity.GAP)),
        )


def _along(orbit: Orbit, value: Number, by: Vector) -> Metric:
    """Metric from its derivatives by z and parameters; the gradient is that along the branch."""
    unknowns = len(orbit.z)
    slopes = by[unknowns:] + by[:unknowns] @ orbit.by_parameter
    return Metric(value, dict(zip(orbit.scene.facts.PARAMETERS, slopes, strict=True)))


def _energy(orbit: Orbit, segments: Sequence[_Energy]) -> Metric:
    """Energy per excitation period, from those of the segments and their derivatives."""
    period_number = orbit.itinerary.period_number
    flows = orbit.system.flows
    by = sum(
        (flow.total(row) for flow, (_, row) in zip(flows, segments, strict=True)),
        0 * orbit.system.advance_by,
    )
    return _along(orbit, sum(value for value, _ in segments) / period_number, by / period_number)


def _lift(orbit: Orbit, progression: Metric) -> Metric:
    """Work of a period against the constant force on both bodies."""
    c, names = orbit.system.flows[0].c, orbit.scene.facts.PARAMETERS
    force, by = c.lift_force(), c.lift_force_gradient()[-len(names) :]
    slopes = {
        name: force * progression.gradient[name] + slope * progression.value
        for name, slope in zip(names, by, strict=True)
    }
    return Metric(force * progression.value, slopes)


def _energies(forms: ClosedForms, flow: SegmentFlow) -> tuple[_Energy, _Energy, _Energy]:
    """Drive's work, damper loss and friction loss of a segment, each with derivatives in it."""
    c, h = flow.c, flow.h
    check_time()
    fractions, weights = panels(forms.numbers, c, abs(float(h)))
    v_r, v_c, cosine, sine, by, angle_by = _sample(forms, flow, fractions)
    power_by = chained(c.drive_power_gradient(cosine, sine, v_r, v_c), by, angle_by)
    work = _integral(c.drive_power(cosine, v_r, v_c), power_by, weights, h)
    power_by = chained(c.damper_power_gradient(v_r), by)
    damper_loss = _integral(c.damper_power(v_r), power_by, weights, h)
    friction, advance = c.loss_at(c.drift), flow.moved[2]
    friction_by = chained(c.loss_gradient(c.drift), flow.matrix)
    friction_by = friction * flow.matrix[STATES] + advance * friction_by
    return work, damper_loss, (friction * advance, friction_by)


def _integral(values: Vector, by: Matrix, weights: Vector, h: Number) -> _Energy:
    """Integral over a segment and its derivatives, from values at fractions of the duration."""
    mean = values @ weights
    row = h * (by @ weights)
    row[BY_TIME] += mean
    return h * mean, row


def _sample(
    forms: ClosedForms, flow: SegmentFlow, fractions: Vector
) -> tuple[Vector, Vector, Vector, Vector, Matrix, Matrix]:
    """v_r, v_c, cosine and sine of the forcing angle, and derivatives of state and angle.

    The derivatives are (3, columns, many) and (columns, many), those by the duration at a fixed
    fraction of it.
    """
    c, times = flow.c, fractions * flow.h
    runs = [forms.run(flow.segment.field, c, flow.closed, time) for time in times]
    v_r = np.array([values[1] for values, _ in runs])
    v_c = flow.closed.v_c + np.array([values[2] for values, _ in runs]) if c.drift else 0 * v_r
    rows = np.stack([matrix[:STATES] for _, matrix in runs], axis=-1)
    rows[:, BY_TIME] = rows[:, BY_TIME] * fractions
    angle_by = 0 * rows[0]
    angle_by[BY_ANGLE] += 1
    angle_by[BY_TIME] += c.omega * fractions
    angle_by[forms.column("omega")] += times
    turned = [forms.numbers.cos_sin(flow.angle + c.omega * time) for time in times]
    cosine, sine = (np.array(column) for column in zip(*turned, strict=True))
    return v_r, v_c, cosine, sine, rows, angle_by


def panels(numbers: Backend, c: Any, h: float) -> tuple[Vector, Vector]:
    """Nodes and weights on (0, 1), for products of two functions of a segment of duration h."""
    mpmath = numbers.name == "mpmath"
    (nodes, weights), longest = (_mpmath_nodes(), _MPMATH_REACH) if mpmath else (_nodes(), _REACH)
    if c.q < 0:
        ends = _graded(c, h, longest, 2 * len(nodes) + 1)
    else:
        count = max(1, math.ceil(2 * float(c.rate) * h / longest))
        ends = [i / count for i in range(count + 1)]
    bounds = np.array([numbers.number(end) for end in ends])
    widths = np.diff(bounds)[:, None]
    fractions = bounds[:-1, None] + widths * ((1 + nodes) / 2)
    return fractions.ravel(), (widths * (weights / 2)).ravel()


def _graded(c: Any, h: float, longest: float, order: int) -> list[float]:
    """Ends of an overdamped segment's panels, which grow as its fast mode decays.

    Half of the decay is reserved for the powers of time in the derivatives.
    """
    fast, slow = c.fast * h, max(c.omega, -c.slow) * h
    ends = [0.0]
    while ends[-1] < 1:
        left = math.exp(-min(fast * ends[-1] / (2 * order), _MOST_EXPONENT))
        ends.append(min(1.0, ends[-1] + longest / (2 * max(slow, fast * left))))
    return ends


@lru_cache(maxsize=1)
def _nodes() -> tuple[Vector, Vector]:
    return np.polynomial.legendre.leggauss(_NODES)


@lru_cache(maxsize=1)
def _mpmath_nodes() -> tuple[Vector, Vector]:
    from mpmath.calculus.quadrature import GaussLegendre

    from capsule_sym._map.precision import mpf, workspace

    mp = workspace()
    rule = GaussLegendre(mp).calc_nodes(_MPMATH_DEGREE, mp.prec)
    nodes, weights = np.array([[mpf(value) for value in row] for row in rule]).T
    return nodes, weights


def _peak(forms: ClosedForms, orbit: Orbit, quantity: Quantity) -> tuple[Number, Vector]:
    """Largest |P| on an orbit, or force of a stop's spring; derivatives by z and parameters."""
    _, flow, time = max(
        _places(forms, orbit, quantity), key=lambda one: one[0], default=3 * (None,)
    )
    if flow is None:  # no segment is in contact
        return forms.numbers.number(0), 0 * orbit.system.advance_by
    c, x_r, v_r, by = flow.c, flow.end[0], flow.end[1], flow.end_by
    if time is not None:
        (position, v_r, *_), matrix = forms.run(flow.segment.field, c, flow.closed, time)
        rows = matrix[:STATES].copy()
        rows[:, BY_TIME] = 0 * rows[:, BY_TIME]  # the force is stationary in the time
        x_r, by = flow.closed.x_r + position, flow.total(rows)
    gap = x_r - c.own_stop()
    if quantity is Quantity.FORCE:
        force, row = c.force(x_r, gap, v_r), c.force_gradient(gap, v_r)
        side = 1 if force > 0 else -1
    else:
        force, row = c.force(0, gap, 0), c.contact_gradient(gap)
        side = 1 if gap > 0 else -1
    return side * force, side * chained(row, by)


def _places(
    forms: ClosedForms, orbit: Orbit, quantity: Quantity
) -> Iterator[tuple[tuple[Number, Number], SegmentFlow, Number | None]]:
    """Ends, at the time None, and extrema of all segments, with the sizes that order them.

    Of the gap only those of segments in contact; without stiffness the deepest contact counts.
    """
    for flow in orbit.system.flows:
        c, (x_r, v_r, _) = flow.c, flow.end
        gap = x_r - c.own_stop()
        end = c.force(x_r, gap, v_r) if quantity is Quantity.FORCE else gap
        if quantity is Quantity.FORCE or c.contact:
            found = extrema(forms.numbers, flow, quantity, {})
            for time, value in ((None, end), *((one.time, one.value) for one in found)):
                force = value if quantity is Quantity.FORCE else c.force(0, value, 0)
                yield (abs(force), abs(value)), flow, time


def drive_work(run: Trajectory) -> float:
    """Work of the drive over a run, dimensionless, by quadrature."""
    omega, origin = run.parameters.omega, run.span[0]
    records, parts = run.records, list[tuple[Vector, Vector]]()
    with backend("numpy", run.scene) as numbers:
        forms = ClosedForms(numbers, [*run.parameters.to_dict().values()])
        constants = [forms.constants(field) for field in records["field"].tolist()]
        for c, h in zip(constants, records["duration"].tolist(), strict=True):
            fractions, weights = panels(numbers, c, h)
            parts.append((fractions * h, weights * h))
        counts = [len(times) for times, _ in parts]
        begins = np.append(0.0, np.cumsum(records["duration"]))[:-1]
        after = np.concatenate([times for times, _ in parts])
        times = np.minimum(origin + np.repeat(begins, counts) + after, run.span[1])
        _, v_r, v_c = run(times).T
        cosine = np.cos(np.repeat(records["start_angle"], counts) + omega * after)
        power, ends = np.empty_like(times), np.cumsum(counts)
        for c, first, last in zip(constants, ends - counts, ends, strict=True):
            power[first:last] = c.drive_power(cosine[first:last], v_r[first:last], v_c[first:last])
    return float(power @ np.concatenate([weights for _, weights in parts]))


def drive_force(run: Trajectory, times: Vector) -> Vector:
    """Force of the drive on the mass at times of a run, (n,), dimensionless.

    Where a pulse rises or falls it is that before or after the edge, by rounding of the time.
    """
    omega, records = run.parameters.omega, run.records
    begins = run.span[0] + np.append(0.0, np.cumsum(records["duration"]))[:-1]
    index = np.maximum(np.searchsorted(begins, times, side="right") - 1, 0)
    fields, found = records["field"][index], np.empty_like(times)
    with backend("numpy", run.scene) as numbers:
        forms = ClosedForms(numbers, [*run.parameters.to_dict().values()])
        for field in np.unique(fields).tolist():
            these = fields == field
            # Equal to the power at velocity 1 of the mass.
            found[these] = forms.constants(field).drive_power(
                np.cos(omega * times[these]), 1.0, 0.0
            )
    return found
