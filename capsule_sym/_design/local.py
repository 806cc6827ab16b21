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

_EVALUATIONS = 100  # of one search, at most, as SciPy's iterations: beside a border it has no end
_PRECISE = 1e-11  # units of the objective: accuracy required of SLSQP
_LOST = 10.0  # units of the objective: above the start by more than all variation, without a motion
_STUCK = 8  # evaluations in a row at one place, as beside a border
_MAX_LOST = 25  # places without a motion: beside a bifurcation each line search meets some


class _Enough(Exception):
    """Raised if a search makes no further progress."""


class LocalSearch:
    """Search from a place, with the places it passed; no variable moves beyond `reach`."""

    def __init__(self, model: Program | Piece, first: Place, reach: float = 1.0) -> None:
        self.model, self.first, self.evaluations = model, first, 1
        self.low, self.high = np.maximum(first.u - reach, 0.0), np.minimum(first.u + reach, 1.0)
        self.known: dict[bytes, Place | None] = {first.u.tobytes(): first}
        """Places by their variables; None where the motion is lost."""

    @property
    def places(self) -> list[Place]:
        """Places passed, in their order."""
        return [one for one in self.known.values() if one is not None]

    def run(self) -> list[Place]:
        """Places passed, the best first; at the time limit those passed so far."""
        held: Any = {"type": "ineq", "fun": self.limits, "jac": self.limits_by}
        with np.errstate(all="ignore"), suppress(_Enough, TimeUp):
            package("scipy.optimize").minimize(
                self.objective,
                self.first.u,
                jac=True,
                method="SLSQP",
                bounds=[*zip(self.low.tolist(), self.high.tolist(), strict=True)],
                constraints=[held] if len(self.first.slacks) else (),
                options={"maxiter": _EVALUATIONS, "ftol": _PRECISE},
            )
        return sorted(self.places, key=lambda place: place.rank)

    def objective(self, x: Vector) -> tuple[float, Vector]:
        """Objective and its derivatives."""
        found = self.place(x)
        if found is None:
            return self.first.objective + _LOST, np.zeros(len(x))
        return found.objective, self.model.by_u(found.objective_by)

    def limits(self, x: Vector) -> Vector:
        """Slacks of the limits."""
        found = self.place(x)
        return np.full(len(self.first.slacks), -_LOST) if found is None else found.slacks

    def limits_by(self, x: Vector) -> Matrix:
        """Derivatives of the slacks."""
        return self.model.by_u((self.place(x) or self.first).slacks_by)

    def place(self, x: Vector) -> Place | None:
        """Place at variables, its motion continued from the nearest known place."""
        u = np.clip(x, self.low, self.high)
        if u.tobytes() not in self.known:
            check_time()
            recent = self.places[-_STUCK:]
            stuck = len(recent) == _STUCK and all(abs(one.u - u).max() < CLOSE for one in recent)
            lost = len(self.known) - len(self.places)
            if stuck or self.evaluations == _EVALUATIONS or lost == _MAX_LOST:
                raise _Enough
            self.evaluations += 1
            near = min(self.places, key=lambda one: float(abs(one.u - u).max()))
            self.known[u.tobytes()] = self.model.beside(near, u)
        return self.known[u.tobytes()]
