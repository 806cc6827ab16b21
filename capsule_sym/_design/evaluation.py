"""Steady motions and their metrics for the optimiser: from a start, next to another one, or many.

The C core closes a motion and differentiates its metrics. The orbit's equations serve on a piece,
also where the map leaves its itinerary. A motion that the core cannot decide is not found.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.neighbourhoods import MOST_OPEN, NEUTRAL
from capsule_sym._map.drift import drifts
from capsule_sym._map.itinerary import begun
from capsule_sym._map.many import simulate_many
from capsule_sym._map.steady import LONGEST
from capsule_sym._native import check_time, present
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.metrics.many import METRICS, MOST_SEGMENTS, Performances, performance_many
from capsule_sym._orbits.metrics.performance import performance
from capsule_sym._orbits.shooting.orbit import Orbit, solve_itinerary
from capsule_sym._orbits.shooting.search import orbit_at
from capsule_sym._orbits.shooting.stability import floquet_multipliers
from capsule_sym._parameters import Scene, SceneParameters
from capsule_sym._processes import processors

_OF_DRIFT = np.isin(METRICS, ("velocity", "progression"))


class Motion:
    """Steady motion and its dimensionless metrics, with derivatives by the parameters.

    It is given by `found`, the motion of the core over `period_number` excitation periods, or else
    by its `orbit`. `itinerary` has the names of the fields.
    """

    def __init__(
        self,
        parameters: SceneParameters,
        found: Performances | None,
        period_number: int = 1,
        orbit: Any = None,
    ) -> None:
        self.parameters, self.found, self.period_number = parameters, found, period_number
        self._orbit: Orbit | None = orbit
        self.fields = found.cycle(0) if found else begun(orbit.itinerary.fields, parameters.scene)
        self.itinerary = tuple(f"F{field}" for field in self.fields)

    @property
    def orbit(self) -> Orbit | None:
        """Orbit solved in its itinerary; None if that fails."""
        if self._orbit is None and self.found is not None:
            state = self.found.states[0].tolist()
            self._orbit = orbit_at(self.parameters, state, self.period_number)
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
        scene, row, fields = self.parameters.scene, _values(self.parameters), np.array(self.fields)
        if not drifting(scene, row[None], fields[None], values[None], self.multiplier)[0]:
            values[_OF_DRIFT], gradients[_OF_DRIFT] = 0.0, 0.0
        return dict(zip(METRICS, map(Slope, values.tolist(), gradients), strict=True))

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
    """Mask (n,) of motions that drift by more than rounding errors.

    By parameters (n, k), fields (n, m) padded with 0, METRICS (n, 7) and the largest modulus of the
    multipliers of each (n,), all dimensionless.
    """
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
        attracting=np.asarray(multipliers) < 1 - NEUTRAL,
        scene=scene,
    )


def _values(parameters: SceneParameters) -> Vector:
    return np.array(list(parameters.to_dict().values()))


def settle(
    parameters: SceneParameters, state: Sequence[float], phase: float = 0.0, brief: bool = False
) -> Motion | None:
    """Motion on which a start settles; None without one, or if the core cannot decide its run.

    A brief run has the stretches of a survey. Raises TimeUp after the time limit, and InvalidInput
    for parameters outside the ranges of a run.
    """
    row = _values(parameters)[None]
    scene, stretches = parameters.scene, BRIEF if brief else LONG
    found = settle_many(row, state, phase, stretches=stretches, gradients=True, scene=scene)
    check_time()
    number = int(found.period_numbers[0])
    return Motion(parameters, found.found, number) if number > 0 else None


def _start_of(orbit: Orbit, parameters: SceneParameters) -> tuple[list[float], float]:
    """State at an orbit's start, and its phase at other parameters."""
    *state, angle = (float(value) for value in orbit.z[:4])
    phase = (angle % math.tau) / parameters.omega
    return state, min(phase, math.nextafter(parameters.period, 0.0))


def same_itinerary_at(motion: Motion, parameters: SceneParameters) -> Motion | None:
    """Motion of the same itinerary at other parameters, admissible or not; None if none."""
    if (orbit := motion.orbit) is None:
        return None
    moved = _values(parameters) - _values(motion.parameters)
    with suppress(np.linalg.LinAlgError):
        for share in (1.0, 0.0):
            guess = np.array(orbit.z, dtype=float) + share * orbit.by_parameter @ moved
            solved = solve_itinerary(parameters, orbit.itinerary, guess.tolist())
            if solved.success:
                return Motion(parameters, None, orbit=solved)
    return None


def continue_motion(motion: Motion, parameters: SceneParameters) -> Motion | None:
    """The motion continued to other parameters, or the one on which it settles; None if lost.

    It is lost if it has not settled within the brief stretches. A motion given by its orbit is run
    from the orbit's start, in the long ones. Raises TimeUp and InvalidInput as `settle`.
    """
    if motion.found is None:
        assert motion.orbit is not None
        return settle(parameters, *_start_of(motion.orbit, parameters))
    row, number, scene = _values(parameters), motion.period_number, parameters.scene
    state, moved = motion.found.states[0], row - _values(motion.parameters)
    guess = state + motion.found.by_parameter[0] @ moved
    found = performance_many(row, guess, number, gradients=True, scene=scene)
    check_time()
    if attracting(found, gradients=True)[0]:
        return Motion(parameters, found, number)
    return settle(parameters, state.tolist(), brief=True)


_REPEATED = 1e-2  # change over its periods, over the motion's size, below which a run is closed
_REPEATS, _APART = 5e-2, 0.2  # the same of all states of its last period, and over their spread
_NEAR = 1e-2  # distance of the closed motion from its run, over the motion's size
LONG, BRIEF = (64, 1024, MOST_OPEN), (32, 256, 8)
"""Excitation periods of the first stretch of a run, and of the last; and switches that the core
cannot decide, at most, in a stretch. Within the long ones motions settle at a damping of 0.003. The
brief ones are for surveys, and for motions that searches continue: at a damping of 0.02 most
settle in the first; chaotic ones are lost."""
UNKNOWN = -1
"""Number of periods of a motion that no run could decide."""
_ARRIVED = 1e-7  # distance of a run that has arrived at its motion, over the motion's size


class Settled(NamedTuple):
    """Motions of n starts: closed ones, and the number of their excitation periods, (n,).

    The number is 0 if a start has not settled on a motion, and UNKNOWN if the core leaves its run
    open or there is no time for it.
    """

    found: Performances
    period_numbers: NDArray[np.int64]

    def put(self, some: NDArray[np.intp], found: Performances, period_numbers: Any) -> None:
        """Replace some of the motions."""
        self.found.records[some], self.found.fields[some] = found.records, found.fields
        self.period_numbers[some] = period_numbers

    def branch(self, i: int) -> tuple[int, ...]:
        """Period number and fields of one period of motion i; empty without one."""
        number = int(self.period_numbers[i])
        return (number, *self.found.cycle(i)) if number > 0 else ()


def settle_many(
    rows: Vector,
    states: ArrayLike,
    phases: ArrayLike = 0.0,
    *,
    stretches: tuple[int, int, int] = LONG,
    gradients: bool = False,
    scene: Scene,
) -> Settled:
    """Motions on which starts (n, 3) settle, at rows (n, k) of the parameters of a scene.

    Runs that have not settled after the first of the `stretches` continue for twice as long, and so
    on, up to the last. A run is unknown if the core cannot decide more switches of a stretch than
    it may, and after the time limit.
    """
    count = len(rows)
    whole = _nothing(count, scene)
    left, (length, most, most_open) = np.arange(count), stretches
    begin = np.broadcast_to(np.asarray(states, dtype=float), (count, 3))
    at = np.broadcast_to(np.asarray(phases, dtype=float), (count,))
    while len(left) and length <= most and not present().over:
        how: dict[str, Any] = {
            "max_seconds": present().left,
            "max_open": most_open,
            "threads": processors(),
        }
        starts = rows[left], begin, at
        run = simulate_many(*starts, length, keep="stroboscopic", scene=scene, **how)
        whole.period_numbers[left[~run.success]] = UNKNOWN
        left = left[run.success]
        seen = min(length, 2 * LONGEST + 1)
        marks = run.kept[run.offsets[1:][run.success, None] + np.arange(-seen, 0)]
        found, number = _arrived(rows[left], marks, gradients, scene)
        whole.put(left[number > 0], found.of(number > 0), number[number > 0])
        begin, at = marks[number == 0, -1], np.zeros(int((number == 0).sum()))
        left, length = left[number == 0], 2 * length
    if length <= most:
        whole.period_numbers[left] = UNKNOWN  # the time is over
    return whole


def _nothing(count: int, scene: Scene) -> Settled:
    """Result for so many starts, of which none has settled."""
    fields = np.zeros((count, MOST_SEGMENTS), np.uint8)
    records, stops = np.zeros(count, scene.records.ORBIT), np.zeros(count, np.int8)
    return Settled(Performances(records, stops, fields, scene), np.zeros(count, np.int64))


def _arrived(rows: Vector, marks: Vector, gradients: bool, scene: Scene) -> Settled:
    """Motions at the ends of n runs, from their last stroboscopic states (n, m, 3)."""
    count, last = len(rows), marks[:, -1]
    whole = _nothing(count, scene)
    numbers = whole.period_numbers
    size, least = 1 + abs(marks[:, -LONGEST:]).max(axis=(1, 2), initial=0.0), np.full(count, np.inf)
    most = min(LONGEST, (marks.shape[1] - 1) // 2)
    repeats = abs(marks[:, -2 : -2 - most : -1] - last[:, None]).max(axis=2)
    near = repeats <= _REPEATED * size[:, None]
    for number in (1 + np.flatnonzero(near.any(axis=0))).tolist():
        before, change = marks[:, -1 - number], repeats[:, number - 1]
        # This number of periods is skipped if another one repeats better.
        some = np.flatnonzero(near[:, number - 1] & (change < least) & (numbers == 0))
        # A chance return is not one of the whole period.
        changes = abs(marks[some, -number:] - marks[some, -2 * number : -number]).max(axis=(1, 2))
        spread = np.inf if number == 1 else abs(marks[some] - last[some, None]).max(axis=(1, 2))
        some = some[changes <= np.minimum(_REPEATS * size[some], _APART * spread)]
        if not len(some):
            continue
        least[some] = change[some]
        found = performance_many(
            rows[some], last[some], number, gradients=gradients, threads=processors(), scene=scene
        )
        good = attracting(found, gradients)
        far = abs(last[some] - found.states).max(axis=1)
        nearer = (far <= _NEAR * size[some]) & (far < abs(before[some] - found.states).max(axis=1))
        # The run is on the motion, or approaches it period by period.
        good &= (far <= _ARRIVED * size[some]) | nearer
        whole.put(some[good], found.of(good), number)
    return whole


def attracting(found: Performances, gradients: bool = False) -> NDArray[np.bool_]:
    """Mask (n,) of motions that are closed, stable, and have finite values.

    With `gradients` their derivatives are finite too.
    """
    with np.errstate(invalid="ignore"):
        good: NDArray[Any] = found.closed & (abs(found.multipliers[:, 0]) < 1)
    good &= np.isfinite(found.values).all(axis=1)
    return good & np.isfinite(found.gradients).all(axis=(1, 2)) if gradients else good
