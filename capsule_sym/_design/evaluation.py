"""Steady motions and their metrics for the optimiser: from a start, next to another one, or many.

The C core closes a motion and differentiates its metrics. The orbit's equations are used for a
motion that the core cannot decide, and beyond the place where the map leaves an itinerary. No other
module of the package names the source of the metrics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._design.settled import attracting, settle_many
from capsule_sym._map.drift import drifts
from capsule_sym._map.itinerary import begun
from capsule_sym._map.labelled import package
from capsule_sym._native import check_time
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.metrics.many import METRICS, Performances, performance_many
from capsule_sym._orbits.metrics.performance import performance
from capsule_sym._orbits.shooting.orbit import Orbit, solve_itinerary
from capsule_sym._orbits.shooting.search import orbit_at
from capsule_sym._orbits.shooting.stability import floquet_multipliers, monodromy_matrix
from capsule_sym._orbits.shooting.taylor import monodromy_derivative
from capsule_sym._parameters import Scene, SceneParameters

_NEUTRAL = 1e-9  # distance from 1 within which a multiplier is 1 up to rounding
_OF_DRIFT = np.isin(METRICS, ("velocity", "progression"))


class Motion:
    """Steady motion and its dimensionless metrics, with derivatives by the parameters.

    `state` is (x_r, v_r, v_c) at forcing angle 0; `itinerary` has the names of the fields.
    """

    def __init__(
        self,
        parameters: SceneParameters,
        found: Performances | None,
        period_number: int = 1,
        orbit: Orbit | None = None,
    ) -> None:
        self.parameters, self.found, self._orbit = parameters, found, orbit
        self.period_number = period_number
        if found is not None:
            self.state: Vector = found.states[0]
            self.itinerary: tuple[str, ...] = found.itinerary(0)
        elif orbit is not None:
            self.period_number = orbit.itinerary.period_number
            self.itinerary = tuple(
                f"F{field}" for field in begun(orbit.itinerary.fields, parameters.scene)
            )

    @property
    def orbit(self) -> Orbit | None:
        """Orbit solved in its itinerary; None if that fails."""
        if self._orbit is None:
            self._orbit = orbit_at(self.parameters, self.state.tolist(), self.period_number)
        return self._orbit

    @cached_property
    def metrics(self) -> dict[str, Slope]:
        """Metrics in the order of `METRICS`; raises numpy.linalg.LinAlgError at a fold."""
        if self.found is not None:
            values, gradients = self.found.values[0].copy(), self.found.gradients[0].copy()
        else:
            assert self._orbit is not None
            whole = performance(self._orbit)
            rows = [getattr(whole, name) for name in METRICS]
            values = np.array([float(one.value) for one in rows])
            gradients = np.array([[*map(float, one.gradient.values())] for one in rows])
        fields = np.array([[int(name[1:]) for name in self.itinerary]])
        row = _values(self.parameters)
        scene = self.parameters.scene
        if not drifting(scene, row[None], fields, values[None], self.multiplier)[0]:
            values[_OF_DRIFT], gradients[_OF_DRIFT] = 0.0, 0.0
        pairs = zip(METRICS, values.tolist(), gradients, strict=True)
        return {name: Slope(*one) for name, *one in pairs}

    @cached_property
    def multiplier(self) -> float:
        """Largest modulus of the Floquet multipliers."""
        if self.found is not None:
            return float(abs(self.found.multipliers[0, 0]))
        assert self._orbit is not None
        return float(abs(floquet_multipliers(self._orbit)[0]))


def drifting(
    scene: Scene, rows: Vector, fields: NDArray[Any], values: Vector, multipliers: ArrayLike
) -> NDArray[np.bool_]:
    """Mask of motions that drift, by parameters (n, k), fields (n, m), METRICS (n, 7)."""
    facts = scene.facts
    touching = [field for field, (contact, _) in facts.FIELDS.items() if contact]
    metrics = dict(zip(METRICS, values.T, strict=True))
    # The longest path with this loss is that against the least friction.
    p = SimpleNamespace(**dict(zip(facts.PARAMETERS, rows.T, strict=True)))
    bounds = [abs(scene.formulas.Formulas.loss_at(p, way)) for way in (1, -1)]
    return drifts(
        rows,
        contact=np.isin(fields, touching).any(axis=1),
        progression=metrics["progression"],
        way=metrics["friction_loss"] / np.min(bounds, axis=0, initial=np.inf),
        segments=np.count_nonzero(fields, axis=1),
        attracting=np.asarray(multipliers) < 1 - _NEUTRAL,
        scene=scene,
    )


def _values(parameters: SceneParameters) -> Vector:
    return np.array(list(parameters.to_dict().values()))


def settle(
    parameters: SceneParameters, state: Sequence[float], phase: float = 0.0
) -> Motion | None:
    """Motion on which a start settles; None if there is none."""
    row = _values(parameters)[None]
    found = settle_many(row, state, phase, gradients=True, scene=parameters.scene)
    check_time()
    number = int(found.period_numbers[0])
    return Motion(parameters, found.found, number) if number > 0 else None


def _start_of(orbit: Orbit, parameters: SceneParameters) -> tuple[list[float], float]:
    """State at an orbit's start, and its phase at other parameters."""
    *state, angle = (float(value) for value in orbit.z[:4])
    phase = (angle % math.tau) / parameters.omega
    return state, min(phase, math.nextafter(parameters.period, 0.0))


def same_itinerary_at(motion: Motion, parameters: SceneParameters) -> Motion | None:
    """Orbit of the same itinerary at other parameters, admissible or not; None if none."""
    orbit = motion.orbit
    moved = _values(parameters) - _values(motion.parameters)
    with suppress(np.linalg.LinAlgError):
        for share in (1.0, 0.0):
            if orbit is None:
                break
            guess = np.array(orbit.z, dtype=float) + share * orbit.by_parameter @ moved
            solved = solve_itinerary(parameters, orbit.itinerary, guess.tolist())
            if solved.success:
                return Motion(parameters, None, orbit=solved)
    return None


def continue_motion(motion: Motion, parameters: SceneParameters) -> Motion | None:
    """The motion continued to other parameters, or the one on which it settles; None if lost."""
    if motion.found is None:
        assert motion.orbit is not None
        return settle(parameters, *_start_of(motion.orbit, parameters))
    row, number, scene = _values(parameters), motion.period_number, parameters.scene
    state = motion.state + motion.found.by_parameter[0] @ (row - _values(motion.parameters))
    found = performance_many(row, state, number, gradients=True, scene=scene)
    check_time()
    if attracting(found, gradients=True)[0]:
        return Motion(parameters, found, number)
    return settle(parameters, motion.state.tolist())


def multiplier_by(motion: Motion) -> Vector:
    """Derivatives (7,) of the largest modulus of a multiplier along the branch; 0 without an orbit.

    A multiplier m with left and right eigenvectors w and v changes with the matrix M by
    `w dM v / (w v)`.
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
    found: Vector = by[-count:] + by[:-count] @ orbit.by_parameter.astype(float)
    return found
