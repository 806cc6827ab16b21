"""Metrics, objective and limits of many motions at once, for surveys and their populations.

A place of the bounds has the motion on which the start settles, by the core. It is unknown if the
core leaves its run open, or if there is no time for it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.evaluation import BRIEF, UNKNOWN, drifting, settle_many
from capsule_sym._design.program import KEPT, Program
from capsule_sym._errors import counted
from capsule_sym._native import present
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.metrics.many import METRICS, Performances
from capsule_sym._orbits.quantities import with_units
from capsule_sym._parameters import Scene, SceneDevice
from capsule_sym._systems import System, dimensionless, values_of

BEYOND = 1e100
"""Merit of a place just beyond a limit: more than any objective."""
_BLOCK = 1024  # places between two looks at the time


class Grid:
    """Parameters of a system with n values (n, k) of some of them, and metrics of motions there."""

    def __init__(self, system: System, names: Sequence[str], values: Matrix) -> None:
        self.system = system
        self.scene: Scene = system.scene
        given: dict[str, Any] = values_of(system) | dict(zip(names, values.T, strict=True))
        self.own = self.scene.values(**{name: Slope(one, 0.0) for name, one in given.items()})
        with np.errstate(all="ignore"):
            device = isinstance(system, SceneDevice)
            ratios = self.own.ratios() if device else vars(self.own)
        plain = (
            getattr(ratios[name], "value", ratios[name]) for name in self.scene.facts.PARAMETERS
        )
        self.rows = np.array([np.broadcast_to(one, len(values)) for one in plain]).T.copy()
        """Dimensionless parameters, (n, p)."""

    @property
    def allowed(self) -> NDArray[np.bool_]:
        """Mask (n,) of points whose parameters the scene allows."""
        low, high = np.array([*self.scene.facts.RANGES.values()]).T
        found: NDArray[Any] = ((self.rows >= low) & (self.rows <= high)).all(axis=1)
        gaps = [self.scene.facts.PARAMETERS.index(name) for name, _ in self.scene.facts.STOPS]
        return found & (self.rows[:, gaps].sum(axis=1) > 0) if len(gaps) > 1 else found

    def metrics(self, found: Performances) -> dict[str, Slope]:
        """All metrics (n,) and parameters by name, without derivatives: their slopes are 0.

        In SI units if the system is a device.
        """
        values, moduli = found.values, abs(found.multipliers[:, 0])
        at_rest = ~drifting(self.scene, self.rows, found.fields, values, moduli)
        values[at_rest[:, None] & np.isin(METRICS, ("velocity", "progression"))] = 0.0
        given = {name: Slope(row, 0.0) for name, row in zip(METRICS, values.T, strict=True)}
        return with_units(given, self.own, self.system)


@dataclass(eq=False)
class Cells:
    """Values at n places: objective, slacks, and the period numbers of the motions.

    They are not divided by units. The objective is nan without a motion, and infinite if the
    function is not finite. A slack is infinite without a motion, and -infinite if its function is
    not finite.
    """

    u: Matrix
    objective: Vector
    slacks: Matrix
    """Slacks of the limits and of the margin of stability, (n, limits)."""
    numbers: NDArray[np.int64]
    """Excitation periods of the motions; 0 if not settled within 480, UNKNOWN if unknown."""

    def __len__(self) -> int:
        return len(self.u)

    def of(self, some: NDArray[Any]) -> Cells:
        """Some of the places, by indices or a mask."""
        return Cells(*(getattr(self, one.name)[some] for one in fields(self)))

    def beyond(self, program: Program) -> Vector:
        """Largest violation of a limit (n,), in units of the limits; 0 if all hold."""
        return np.asarray(np.maximum(0.0, -(self.slacks / program.sizes).min(1, initial=np.inf)))

    def merit(self, program: Program) -> Vector:
        """Objective over its unit (n,), BEYOND or more beyond limits.

        Infinite without a motion, and if the function is not finite.
        """
        beyond = self.beyond(program)
        merit = np.where(beyond > KEPT, BEYOND * (1 + beyond), self.objective / program.unit)
        return np.where(np.isfinite(self.objective), merit, np.inf)

    @property
    def unknown(self) -> int:
        """Number of places that are unknown."""
        return int((self.numbers == UNKNOWN).sum())


def together(parts: Sequence[Cells]) -> Cells:
    """Places of several parts as one."""
    return Cells(
        *(np.concatenate([getattr(part, one.name) for part in parts]) for one in fields(Cells))
    )


def evaluate(program: Program, u: Matrix) -> Cells:
    """Values at places u (n, k), by runs from the start; unknown after the time limit."""
    parts = [_unknown(program, u[:0])]
    for first in range(0, len(u), _BLOCK):
        if len(u) > _BLOCK:
            program.progress(f"survey, {first} of {counted(len(u), 'place')}")
        block = _unknown if present().over else _block
        parts.append(block(program, u[first : first + _BLOCK]))
    return together(parts)


def _unknown(program: Program, u: Matrix) -> Cells:
    """Places that are unknown."""
    slacks = np.full((len(u), len(program.sizes)), np.inf)
    return Cells(u, np.full(len(u), np.nan), slacks, np.full(len(u), UNKNOWN))


def _block(program: Program, u: Matrix) -> Cells:
    """Values at places, a few of them; no motion where the scene does not allow the parameters."""
    grid = Grid(program.system, program.names, program.values_at(u))
    own = [*dimensionless(program.system).to_dict().values()]
    rows = np.where(grid.allowed[:, None], grid.rows, own)
    found, numbers = settle_many(rows, program.start, stretches=BRIEF, scene=grid.scene)
    numbers[~grid.allowed] = 0
    moving = numbers > 0
    multiplier = Slope(abs(found.multipliers[:, 0]), 0.0)
    values = (one.value for one in program.rows(grid.metrics(found), multiplier))
    objective, *held = np.array([np.broadcast_to(one, len(u)) for one in values])
    slacks = np.array(held).reshape(-1, len(u)).T
    return Cells(
        u,
        np.where(moving, np.where(np.isfinite(objective), objective, np.inf), np.nan),
        np.where(moving[:, None], np.where(np.isfinite(slacks), slacks, -np.inf), np.inf),
        numbers,
    )
