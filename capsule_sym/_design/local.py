"""Local optimum from a start, by SciPy's SLSQP on motions of the map.

Metrics are continuous across changes of itinerary. Where their gradients jump the method stops
beside the border; `stationary` then solves the conditions of an optimum there.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.pieces import Piece
from capsule_sym._design.program import CLOSE, Place, Program
from capsule_sym._map.labelled import package
from capsule_sym._native import TimeUp, check_time

_EVALUATIONS = 100  # of one search, at most: beside a border a line search has no end
_PRECISE = 1e-11  # units of the objective: accuracy required of SLSQP
_LOST = 10.0  # units of the objective: above the start by more than all variation, without a motion
_STUCK = 8  # evaluations in a row at one place, as beside a border
_MAX_LOST = 25  # places without a motion: beside a bifurcation each line search meets some


class _Enough(Exception):
    """Raised if a search makes no further progress."""


class LocalSearch:
    """Search from a place, with the places it passed; no variable moves beyond `reach`.

    With several scenarios the last variable is a level to minimise, an upper bound of all
    objectives.
    """

    def __init__(self, model: Program | Piece, first: Place, reach: float = 1.0) -> None:
        self.model, self.first, self.evaluations = model, first, 1
        self.low, self.high = np.maximum(first.u - reach, 0.0), np.minimum(first.u + reach, 1.0)
        self.known = {first.u.tobytes(): first}
        self.lost = set[bytes]()
        """Variables at which a motion is lost."""
        self.levels = int(len(first.objective) > 1)

    def run(self) -> list[Place]:
        """Places passed, the best first; at the time limit those passed so far."""
        held: Any = {"type": "ineq", "fun": self.limits, "jac": self.limits_by}
        bounds: list[Any] = [*zip(self.low.tolist(), self.high.tolist(), strict=True)]
        with np.errstate(all="ignore"), suppress(_Enough, TimeUp):
            package("scipy.optimize").minimize(
                self.objective,
                np.append(self.first.u, [self.first.worst] * self.levels),
                jac=True,
                method="SLSQP",
                bounds=bounds + [(None, None)] * self.levels,
                constraints=[held] if len(self.first.slacks) or self.levels else (),
                options={"maxiter": _EVALUATIONS, "ftol": _PRECISE},
            )
        return sorted(self.known.values(), key=lambda place: place.rank)

    def objective(self, x: Vector) -> tuple[float, Vector]:
        """Objective, or level, and its derivatives."""
        if self.levels:
            return float(x[-1]), np.eye(len(x))[-1]
        found = self.place(x)
        if found is None:
            return self.first.worst + _LOST, np.zeros(len(x))
        return found.worst, self.model.by_u(found.objective_by)[0]

    def limits(self, x: Vector) -> Vector:
        """Slacks, and differences of the level and each objective."""
        found = self.place(x)
        if found is None:
            return np.full(len(self.limits_by(x)), -_LOST)
        return np.append(found.slacks, x[-1] - found.objective if self.levels else [])

    def limits_by(self, x: Vector) -> Matrix:
        """Derivatives of the slacks and differences."""
        found = self.place(x) or self.first
        rows = self.model.by_u(found.slacks_by)
        if self.levels:
            rows = np.vstack([rows, -self.model.by_u(found.objective_by)])
            rows = np.column_stack([rows, np.arange(len(rows)) >= len(found.slacks)])
        return rows

    def place(self, x: Vector) -> Place | None:
        """Place at variables, its motions continued from the nearest known place."""
        u = np.clip(x[: len(self.low)], self.low, self.high)
        if u.tobytes() in self.lost:
            return None
        if u.tobytes() not in self.known:
            check_time()
            recent = [*self.known.values()][-_STUCK:]
            stuck = len(recent) == _STUCK and all(abs(one.u - u).max() < CLOSE for one in recent)
            if stuck or self.evaluations == _EVALUATIONS or len(self.lost) == _MAX_LOST:
                raise _Enough
            self.evaluations += 1
            near = min(self.known.values(), key=lambda one: float(abs(one.u - u).max()))
            found = self.model.beside(near, u)
            if found is None:
                self.lost.add(u.tobytes())
                return None
            self.known[u.tobytes()] = found
        return self.known[u.tobytes()]
