"""The nearest optimum from a start: SciPy's SLSQP on the motion as the map has it.

Metrics are continuous across changes of itinerary; where their gradients jump the method comes to
rest beside the border, and the conditions of an optimum there are for `stationary` to settle.
"""

from __future__ import annotations

from contextlib import suppress
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from capsule_sym._design.program import KEPT, Place, Program
from capsule_sym._map.labelled import package

Vector = NDArray[np.float64]
_MOST = 80  # steps of SLSQP
_EVALUATIONS = 100
_PRECISE = 1e-11
_LOST = 10.0  # units of the objective above the start, where there is no motion
_CLOSE = 1e-6  # of the bounds
_STUCK = 8  # evaluations in a row that come no further, as beside a border


class _Enough(Exception):
    """The search comes no further."""


class Search:
    """Optima of a program next to starts, and the places that were passed on the way."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.places: list[Place] = []
        self.evaluations = 0

    def begin(self, u: Vector) -> Place | None:
        """The place that the scenarios' own starts lead to."""
        motions = self.program.settled(u)
        self.evaluations += 1
        return None if motions is None else self._at(u, motions)

    def go(self, u: Vector, reach: float = 1.0) -> list[Place]:
        """The places passed from u on, the best of them first; none where there is no motion.

        No variable is moved farther than `reach`.
        """
        first = self.begin(u)
        if first is None:
            return []
        known = {u.tobytes(): first}
        k, many = len(u), len(first.objective) > 1
        low, high = np.maximum(u - reach, 0.0), np.minimum(u + reach, 1.0)

        def place(x: Vector) -> Place | None:
            here = np.clip(x[:k], low, high)
            if here.tobytes() not in known:
                # Those that find no motion count as well.
                if self.evaluations == _EVALUATIONS or self.program.watch.over:
                    raise _Enough
                self.evaluations += 1
                recent = [*known.values()][-_STUCK:]
                if len(recent) == _STUCK and all(
                    abs(one.u - here).max() < _CLOSE for one in recent
                ):
                    raise _Enough
                near = min(known.values(), key=lambda one: float(abs(one.u - here).max()))
                motions = self.program.followed(near.motions, here)
                if motions is None:
                    return None
                found = self._at(here, motions)
                if found is None:
                    return None
                known[here.tobytes()] = found
            return known[here.tobytes()]

        def objective(x: Vector) -> tuple[float, Vector]:
            slope = np.zeros(len(x))
            if many:
                slope[-1] = 1.0
                return float(x[-1]), slope
            found = place(x)
            if found is None:
                return float(first.objective[0]) + _LOST, slope
            slope[:] = self.by_u(found.objective_by)[0]
            return float(found.objective[0]), slope

        def limits(x: Vector) -> Vector:
            found = place(x)
            if found is None:
                return np.full(len(first.slacks) + many * len(first.objective), -_LOST)
            rest = x[-1] - found.objective if many else np.zeros(0)
            return np.concatenate([found.slacks, rest])

        def limits_by(x: Vector) -> Vector:
            found = place(x) or first
            rows = self.by_u(found.slacks_by)
            if many:
                rows = np.vstack([rows, -self.by_u(found.objective_by)])
                rows = np.column_stack(
                    [rows, np.append(np.zeros(len(found.slacks)), np.ones(len(found.objective)))]
                )
            return rows

        begin: Any = np.append(u, first.objective.max()) if many else u
        bounded: list[Any] = [*zip(low.tolist(), high.tolist(), strict=True)] + [
            (None, None)
        ] * many
        held: Any = [{"type": "ineq", "fun": limits, "jac": limits_by}]
        with np.errstate(all="ignore"), suppress(_Enough):
            package("scipy.optimize", "design").minimize(
                cast(Any, objective),
                begin,
                jac=True,
                method="SLSQP",
                bounds=bounded,
                constraints=held if len(first.slacks) or many else (),
                options={"maxiter": _MOST, "ftol": _PRECISE},
            )
        return sorted(known.values(), key=self.rank)

    def by_u(self, rows: Vector) -> Vector:
        """Derivatives by the scaled variables, from those by all parameters."""
        found: Vector = rows[:, self.program.columns] * (self.program.high - self.program.low)
        return found

    @staticmethod
    def rank(place: Place) -> tuple[float, float]:
        """How far beyond its limits a place is, and its objective."""
        beyond = max(0.0, -float(place.slacks.min(initial=0.0)) - KEPT)
        return beyond, float(place.objective.max())

    def _at(self, u: Vector, motions: Any) -> Place | None:
        try:
            found = self.program.at(u, motions)
        except np.linalg.LinAlgError:
            return None
        return found if found.finite else None
