"""Optimisation problem: objective, limits and stability as functions of scaled variables.

The variables u are parameters of a system, each scaled by its bounds to [0, 1].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.evaluation import Motion, continue_motion, settle
from capsule_sym._design.functions import Function, Limit, named, valued
from capsule_sym._errors import InvalidInput
from capsule_sym._map.checks import check_scales
from capsule_sym._map.labelled import package
from capsule_sym._native.watch import silent
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.quantities import dimensionless_slopes, of
from capsule_sym._orbits.shooting.stability import monodromy_matrix
from capsule_sym._orbits.shooting.taylor import monodromy_derivative
from capsule_sym._parameters import SceneParameters, names_of
from capsule_sym._systems import System, dimensionless

KEPT = 1e-7
"""Violation of a limit that counts as none, and difference of objectives that are the same, in
their units: a run that has settled is as close to its motion."""
CLOSE = 1e-6
"""Distance of places that count as one, a share of each range: rounding is far below, and changes
of an itinerary rarely are within it."""


@dataclass(frozen=True, eq=False)
class Place:
    """Objective and slacks at some variables, with derivatives by all parameters of the system.

    The objective is to be minimised, over its unit; a slack is the distance to its limit, over its
    unit. `slacks` (n,) are those of the limits, then of the stability. On a piece that of the
    stability is squared, and those of its borders follow.
    """

    u: Vector
    motion: Motion
    objective: float
    objective_by: Vector
    slacks: Vector
    slacks_by: Matrix

    @property
    def finite(self) -> bool:
        """True if all values are finite."""
        rows = self.objective, self.objective_by, self.slacks, self.slacks_by
        return all(bool(np.all(np.isfinite(row))) for row in rows)

    @property
    def beyond(self) -> float:
        """Largest violation of a limit, less KEPT; 0 if all hold."""
        return max(0.0, -float(self.slacks.min(initial=0.0)) - KEPT)

    @property
    def rank(self) -> tuple[float, float]:
        """Order of places, the least is the best: violation of limits, then objective."""
        return self.beyond, self.objective


@dataclass(frozen=True)
class Program:
    """Minimise `sign` times a function of the metrics over variables between bounds."""

    system: System
    names: tuple[str, ...]
    low: Vector
    high: Vector
    function: Function
    sign: int
    limits: tuple[Limit, ...]
    margin: float | None
    start: tuple[float, float, float]
    """State (x_r, v_r, v_c) at phase 0 that leads to the motion."""
    unit: float = 1.0
    """Divisor of the objective: its variation."""
    limit_units: tuple[float, ...] = ()
    """Divisors of the limits' slacks; by default the size of the limit, or 1 if that is 0."""
    progress: Callable[[str], object] = silent
    """Called with messages of progress."""

    @property
    def name(self) -> str:
        """Name of the metric."""
        return named(self.function)

    def values_at(self, u: Matrix) -> Matrix:
        """Variables (..., k) of scaled ones."""
        return np.where(u == 1.0, self.high, self.low + u * (self.high - self.low))

    def system_at(self, u: Vector) -> System:
        """System at the scaled variables u; raises InvalidInput if it is not allowed."""
        values = self.values_at(u).tolist()
        return self.system.replace(**dict(zip(self.names, values, strict=True)))

    def parameters_at(self, u: Vector) -> SceneParameters | None:
        """Dimensionless parameters at scaled variables; None where no run is possible."""
        with suppress(InvalidInput):
            check_scales(found := dimensionless(self.system_at(u)))
            return found
        return None

    def by_u(self, rows: Matrix) -> Matrix:
        """Derivatives by the scaled variables, from those by all parameters, (..., k)."""
        columns = [names_of(self.system).index(name) for name in self.names]
        return np.asarray(rows[..., columns] * (self.high - self.low))

    def by_all(self, u: Vector, by: Vector) -> Vector:
        """Derivatives by all parameters of the system, from those by its dimensionless ones."""
        return np.asarray(by @ dimensionless_slopes(self.system_at(u)))

    def begin(self, u: Vector) -> Place | None:
        """Place with the motion on which the start settles; None if there is none.

        Raises TimeUp and InvalidInput as `settle`.
        """
        parameters = self.parameters_at(u)
        return self.place(u, settle(parameters, self.start) if parameters else None)

    def beside(self, near: Place, u: Vector) -> Place | None:
        """Place at other variables, its motion continued from a known one; None if it is lost.

        Raises TimeUp and InvalidInput as `settle`.
        """
        parameters = self.parameters_at(u)
        found = continue_motion(near.motion, parameters) if parameters else None
        return self.place(u, found)

    def place(self, u: Vector, motion: Motion | None) -> Place | None:
        """Place with a motion; None without one, at a fold, or if a value is not finite."""
        with suppress(np.linalg.LinAlgError):  # at a fold
            if motion is not None and (found := self.at(u, motion)).finite:
                return found
        return None

    def at(self, u: Vector, motion: Motion) -> Place:
        """Objective and slacks of a motion at u; raises LinAlgError at a fold."""
        stability = Slope(0.0, 0.0)
        if self.margin is not None:
            stability = Slope(motion.multiplier, self.by_all(u, multiplier_by(motion)))
        rows = self.rows(of(motion.metrics, self.system_at(u)), stability)
        units = np.append(self.unit, self.sizes)
        values = np.array([one.value for one in rows]) / units
        by = np.array([one.slope for one in rows]) / units[:, None]
        return Place(u, motion, float(values[0]), by[0], values[1:], by[1:])

    def rows(self, every: Mapping[str, Slope], multiplier: Slope) -> list[Slope]:
        """Objective and slacks of one motion or of n, by all of their metrics, without units."""
        found = [valued("metric", self.function, every) * self.sign]
        found += [limit.slack(every) for limit in self.limits]
        if self.margin is not None:
            found.append(1 - self.margin - multiplier)
        return found

    @property
    def sizes(self) -> Vector:
        """Unit of each slack, of the stability last."""
        units = [abs(limit.value) or 1.0 for limit in self.limits]
        return np.array([*(self.limit_units or units), *([1.0] * (self.margin is not None))])

    @property
    def texts(self) -> tuple[str, ...]:
        """Texts of the limits, of the stability last."""
        found = [limit.text for limit in self.limits]
        if self.margin is not None:
            found.append(f"largest multiplier <= {1 - self.margin:g}")
        return tuple(found)


def multiplier_by(motion: Motion) -> Vector:
    """Derivatives (p,) of the largest modulus of a multiplier along the branch; 0 without an orbit.

    They are by the dimensionless parameters. A multiplier m with left and right eigenvectors w and
    v changes with the matrix M by `w dM v / (w v)`.
    """
    orbit, count = motion.orbit, len(motion.parameters.scene.facts.PARAMETERS)
    if orbit is None:
        return np.zeros(count)
    matrix = monodromy_matrix(orbit).astype(float)
    values, left, right = package("scipy.linalg").eig(matrix, left=True, right=True)
    largest = int(np.argmax(abs(values)))
    w, v, modulus = left[:, largest].conj(), right[:, largest], abs(values[largest])
    by = np.einsum("i,kij,j->k", w, monodromy_derivative(orbit, np.eye(count)), v) / (w @ v)
    by = (by * values[largest].conj()).real / (modulus or 1.0)
    if orbit.itinerary.mirrored:  # the matrix is that of half the motion
        by = 2 * modulus * by
    return np.asarray(by[-count:] + by[:-count] @ orbit.by_parameter.astype(float))
