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
from capsule_sym._design.program import Place, Program
from capsule_sym._map.labelled import package
from capsule_sym._native import TimeUp, check_time

MOST = 100
"""Evaluations of a search, as SciPy's iterations: beside a border a line search has no end."""
_PRECISE = 1e-11  # units of the objective: accuracy required of SLSQP
_LOST = 10.0  # units of the objective: above the start by more than all variation, without a motion
_MAX_LOST = 25  # places without a motion: beside a bifurcation each line search meets some


class _Enough(Exception):
    """Raised if a search makes no further progress."""


class LocalSearch:
    """Search from a place, of a program or on a piece, with the places it passed."""

    def __init__(self, model: Program | Piece, first: Place, most: int = MOST) -> None:
        """It ends after `most` evaluations."""
        self.model, self.first, self.evaluations, self.most = model, first, 1, most
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
                bounds=[(0.0, 1.0)] * len(self.first.u),
                constraints=[held] if len(self.first.slacks) else (),
                options={"ftol": _PRECISE},
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
        u = np.clip(x, 0.0, 1.0)
        if u.tobytes() not in self.known:
            check_time()
            lost = len(self.known) - len(self.places)
            if self.evaluations == self.most or lost == _MAX_LOST:
                raise _Enough
            self.evaluations += 1
            near = min(self.places, key=lambda one: float(abs(one.u - u).max()))
            self.known[u.tobytes()] = self.model.beside(near, u)
        return self.known[u.tobytes()]
