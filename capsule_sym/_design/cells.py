"""Metrics, objective and limits of many motions at once: the one evaluation of searches.

A place of the bounds has the motion on which each scenario's start settles, by the core. It is
unknown if the core leaves its run open, or if there is no time for it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.evaluation import drifting
from capsule_sym._design.program import KEPT, STABLE, Program, Scenario
from capsule_sym._design.quantities import (
    Function,
    dimensionless,
    valued,
    values_of,
    with_derived,
)
from capsule_sym._design.settled import Settled, settle_many
from capsule_sym._errors import counted
from capsule_sym._native import core_of, present
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.metrics.many import METRICS, Performances
from capsule_sym._parameters import Scene, SceneDevice

BEYOND = 1e100
"""Merit of a place beyond a limit by nothing: more than any objective."""
_BLOCK = 1024  # places between two looks at the time
# Excitation periods: first stretch of a run, bounds of the last.
_FIRST, _LEAST, _MOST = 32, 64, 256
_FOLDINGS = 25.0  # e-foldings of a transient by damping alone: 1e-11 of it is left
_OPEN = 8  # switches in a stretch that the core cannot decide: with more of them a place is unknown
_DRAWN = 2  # random states at each place, where all stable motions count: bounds their time


class Grid:
    """Parameters of a scenario at points u (n, k) of a program, and values of motions there."""

    def __init__(self, program: Program, scenario: Scenario, u: Matrix) -> None:
        self.program, self.count = program, len(u)
        system = program.system
        self.scene: Scene = system.scene
        at = np.where(u == 1.0, program.high, program.low + u * (program.high - program.low))
        given: dict[str, Any] = dict(values_of(system)) | dict(
            zip(program.names, at.T, strict=True)
        )
        given |= {name: given[name] * by for name, by in scenario.factors.items()}
        self.own = self.scene.values(**{name: Slope(one, 0.0) for name, one in given.items()})
        self.device = isinstance(system, SceneDevice)
        with np.errstate(all="ignore"):
            ratios = self.own.ratios() if self.device else vars(self.own)
        plain = (
            getattr(ratios[name], "value", ratios[name]) for name in self.scene.facts.PARAMETERS
        )
        self.rows = np.array([np.broadcast_to(one, self.count) for one in plain]).T.copy()
        """Dimensionless parameters, (n, p)."""

    @property
    def allowed(self) -> NDArray[np.bool_]:
        """Mask (n,) of points whose parameters the scene allows."""
        low, high = np.array([*self.scene.facts.RANGES.values()]).T
        found: NDArray[Any] = ((self.rows >= low) & (self.rows <= high)).all(axis=1)
        gaps = [self.scene.facts.PARAMETERS.index(name) for name, _ in self.scene.facts.STOPS]
        return found & (self.rows[:, gaps].sum(axis=1) > 0) if len(gaps) > 1 else found

    def metrics(self, found: Performances) -> dict[str, Slope]:
        """All metrics and parameters by name, (n,), in SI units if the system is a device."""
        values, moduli = found.values, abs(found.multipliers[:, 0])
        at_rest = ~drifting(self.scene, self.rows, found.fields, values, moduli)
        values[at_rest[:, None] & np.isin(METRICS, ("velocity", "progression"))] = 0.0
        names = *self.scene.facts.PARAMETERS, *METRICS
        columns = np.column_stack([self.rows, values]).T
        own = {name: Slope(row, 0.0) for name, row in zip(names, columns, strict=True)}
        given = {name: own.pop(name) for name in METRICS}
        with np.errstate(all="ignore"):
            every = with_derived(given, own, self.scene.facts.BOUNDS)
            if self.device:
                every = {name: one * self.own.scale(name) for name, one in every.items()}
        found_: dict[str, Slope] = every | vars(self.own)
        return found_

    def valued(
        self, function: Function, every: Mapping[str, Slope], field: str = "metric", text: str = ""
    ) -> Vector:
        """Values (n,) of a function of the metrics."""
        with np.errstate(all="ignore"):
            try:
                found: Any = function(every)
                if np.iscomplexobj(found.value) or not isinstance(found, Slope):
                    raise TypeError
                return np.broadcast_to(np.asarray(found.value, float), self.count)
            except Exception:  # a function that does not accept arrays is evaluated one by one
                rows = {k: np.broadcast_to(v.value, self.count).tolist() for k, v in every.items()}
                each = (
                    {k: Slope(v[i], np.zeros(1)) for k, v in rows.items()}
                    for i in range(self.count)
                )
                return np.array([valued(field, function, one, text)[0] for one in each])


@dataclass(eq=False)
class Cells:
    """Values at n places: worst objective, least slacks and the motions of m scenarios.

    Nothing has a unit yet. The objective is nan without a motion, and infinite if the function is
    not finite.
    """

    u: Matrix
    objectives: Matrix
    """Objective of each scenario, (n, m)."""
    slacks: Matrix
    """Slacks of the limits and of the margin of stability, (n, limits)."""
    states: NDArray[np.float64]
    """States of the motions at forcing angle 0, (n, m, 3)."""
    numbers: NDArray[np.int64]
    """Excitation periods of the motions, (n, m); 0 without one, -1 if unknown."""
    peaks: Vector
    """Largest contact force."""

    def __len__(self) -> int:
        return len(self.u)

    @property
    def worst(self) -> Vector:
        """Objective of the worst scenario (n,)."""
        found: Vector = self.objectives.max(axis=1)
        return found

    def of(self, some: NDArray[Any]) -> Cells:
        """Some of the places, by indices or a mask."""
        return Cells(*(getattr(self, one.name)[some] for one in fields(self)))

    def beyond(self, program: Program) -> Vector:
        """Largest violation of a limit (n,), in units of the limits."""
        found: Vector = np.maximum(0.0, -(self.slacks / program.sizes).min(axis=1, initial=np.inf))
        return found

    def merit(self, program: Program) -> Vector:
        """Objective over its unit (n,), BEYOND or more beyond limits; infinite without a motion."""
        beyond = self.beyond(program)
        worst = np.where(beyond > KEPT, BEYOND * (1 + beyond), self.worst / program.unit)
        return np.where(np.isfinite(self.worst), worst, np.inf)

    @property
    def unknown(self) -> int:
        """Number of places that are unknown."""
        return int((self.numbers < 0).any(axis=1).sum())


def together(parts: Sequence[Cells]) -> Cells:
    """Places of several parts as one."""
    return Cells(
        *(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(Cells))
    )


def evaluate(program: Program, u: Matrix, states: Any = None, longer: int = 1) -> Cells:
    """Values at places u (n, k), by runs from the scenarios' starts.

    If all stable motions count, the best of those that the starts and random states lead to. With
    `states` (n, 3) runs of the first scenario begin there, and those of the others on the motion of
    the first. Runs are `longer` by a power of two.
    """
    if program.among == STABLE and states is None and len(u):
        every = together([_evaluate(program, u, one, longer) for one in _anywhere(program, u)])
        rank = every.merit(program).reshape(-1, len(u)).argmin(axis=0)
        return every.of(rank * len(u) + np.arange(len(u)))
    return _evaluate(program, u, states, longer)


def unknown(program: Program, u: Matrix) -> Cells:
    """Places that no run has reached."""
    n, m = len(u), len(program.scenarios)
    slacks, states = np.full((n, len(program.sizes)), np.inf), np.full((n, m, 3), np.nan)
    return Cells(u, np.full((n, m), np.nan), slacks, states, np.full((n, m), -1), np.zeros(n))


def _evaluate(program: Program, u: Matrix, states: Any, longer: int) -> Cells:
    parts = [unknown(program, u[:0])]
    for first in range(0, len(u), _BLOCK):
        block = slice(first, first + _BLOCK)
        if len(u) > _BLOCK:
            program.tell(f"survey, {first} of {counted(len(u), 'place')}")
        begin = None if states is None else states[block]
        over = present().over
        parts.append(
            unknown(program, u[block]) if over else _block(program, u[block], begin, longer)
        )
    return together(parts)


def _block(program: Program, u: Matrix, states: Any, longer: int) -> Cells:
    """Values at places, a few of them."""
    found = unknown(program, u)
    if core_of(program.system.scene) is None:
        _alone(program, found)
        return found
    for j, one in enumerate(program.scenarios):
        grid = Grid(program, one, u)
        begin = one.state if states is None else found.states[:, 0] if j else states
        begin = np.where(np.isfinite(begin), begin, one.state)
        motions = settled(grid, begin, _lasting(grid) * longer)
        moving = motions.period_numbers > 0
        every = grid.metrics(motions.found)
        objective = grid.valued(program.function, every) * program.sign
        objective = np.where(np.isfinite(objective), objective, np.inf)
        found.objectives[:, j] = np.where(moving, objective, np.nan)
        held: list[Any] = [
            (grid.valued(one.function, every, "subject_to", one.text) - one.value) * one.sign
            for one in program.limits
        ]
        if program.margin is not None:
            held.append(1 - program.margin - abs(motions.found.multipliers[:, 0]))
        for k, slack in enumerate(held):
            slack = np.where(np.isfinite(slack), slack, -np.inf)
            found.slacks[:, k] = np.minimum(found.slacks[:, k], np.where(moving, slack, np.inf))
        found.peaks = np.maximum(found.peaks, np.where(moving, motions.found["peak_contact"], 0.0))
        found.states[:, j], found.numbers[:, j] = motions.found.states, motions.period_numbers
    return found


def _alone(program: Program, cells: Cells) -> None:
    """Values at places, one by one in Python."""
    for i, u in enumerate(cells.u):
        if present().over:
            break
        motions, cells.numbers[i] = program.settled(u), 0
        with suppress(np.linalg.LinAlgError):  # at a fold
            if motions is not None:
                place = program.at(u, motions)
                values, slacks = place.objective * program.unit, place.slacks
                cells.objectives[i] = np.where(np.isfinite(values), values, np.inf)
                slacks = np.where(np.isfinite(slacks), slacks, -np.inf).reshape(len(motions), -1)
                cells.slacks[i] = slacks.min(axis=0, initial=np.inf) * program.sizes
                cells.numbers[i] = [motion.period_number for motion in motions]
                cells.peaks[i] = max(motion.metrics["peak_contact"].value for motion in motions)


def settled(grid: Grid, states: Any, most: Any) -> Settled:
    """Motions on which starts settle; none where parameters are not allowed."""
    own = [*dimensionless(grid.program.system).to_dict().values()]
    rows = np.where(grid.allowed[:, None], grid.rows, own)
    found = settle_many(rows, states, first=_FIRST, most=most, max_open=_OPEN, scene=grid.scene)
    found.period_numbers[~grid.allowed] = 0
    return found


def _lasting(grid: Grid) -> Any:
    """Excitation periods of the last stretch of runs (n,), by their damping."""
    if "zeta" not in (names := grid.scene.facts.PARAMETERS):
        return np.array(_MOST)
    omega, zeta = (grid.rows[:, names.index(name)] for name in ("omega", "zeta"))
    with np.errstate(divide="ignore"):
        needed = _FOLDINGS * omega / (math.tau * zeta) / _FIRST
    stretches = np.floor(np.log2(1 + np.minimum(needed, _MOST / _FIRST)))
    return np.maximum(_FIRST * 2 ** stretches.astype(int), _LEAST)


def _anywhere(program: Program, u: Matrix) -> list[Any]:
    """States from which stable motions are searched at places: the starts, and random ones."""
    draw, grid = np.random.default_rng(0), Grid(program, program.scenarios[0], u)
    p = dict(zip(grid.scene.facts.PARAMETERS, grid.rows.T, strict=True))
    far = 2 * (1 + p["alpha"] + p[grid.scene.facts.STOPS[0][0]])
    box = np.stack([far, far * p["omega"], far * p["omega"] / (1 + p["gamma"])], axis=1)
    given = [np.tile(state, (len(u), 1)) for state in program.seeds]
    return given + [box * draw.uniform(-1, 1, box.shape) for _ in range(_DRAWN)]
