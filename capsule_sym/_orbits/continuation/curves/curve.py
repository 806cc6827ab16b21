"""Curves of bifurcations in two parameters, as results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.labelled import Labelled
from capsule_sym._orbits.continuation.families.states import Ending
from capsule_sym._orbits.continuation.points.bifurcation import CodimensionTwoPoint, CurvePoint
from capsule_sym._orbits.shooting.orbit import columns_of

_FINE = (Ending.REACHED, Ending.RETURNED, Ending.CODIMENSION_TWO)


@dataclass(frozen=True)
class Curve(Labelled):
    """A curve of bifurcations in two parameters: points in order, and why each of its ends is.

    `origin` says from which point of codimension two the curve is followed, as "cusp" or such, and
    is empty for one from a bifurcation on a branch. All values are dimensionless.
    """

    type: str
    parameters: tuple[str, str]
    points: tuple[CurvePoint, ...]
    codimension_two: tuple[CodimensionTwoPoint, ...]
    endings: tuple[tuple[Ending, str], tuple[Ending, str]]
    origin: str = ""
    dimension = "point"

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The points as columns, arrays of shape (n,).

        The two parameters have their own names; of each point there are the line, and its orbit's
        itinerary, period number, progression and start.
        """
        values = np.array([point.values for point in self.points], dtype=float).reshape(-1, 2)
        return {
            self.parameters[0]: values[:, 0],
            self.parameters[1]: values[:, 1],
            "line": np.array([point.line for point in self.points], dtype=np.str_),
            **columns_of([point.orbit for point in self.points]),
            "residual": np.array([float(point.residual) for point in self.points]),
            "status": np.array([str(point.status) for point in self.points], dtype=np.str_),
        }

    @property
    def success(self) -> bool:
        """Whether both ends are where a curve ends: at the ranges, where it began, in a point."""
        return all(end in _FINE for end, _ in self.endings)

    @property
    def status(self) -> Ending:
        """Why the curve ends: of the two ends the first that is not where it was to be."""
        return self._worst[0]

    @property
    def message(self) -> str:
        """The status in words."""
        return self._worst[1]

    @property
    def statistics(self) -> dict[str, Any]:
        """How many points there are, and Newton's steps to all of them."""
        steps = sum(point.iterations for point in self.points)
        return {"points": len(self.points), "iterations": steps}

    @property
    def _worst(self) -> tuple[Ending, str]:
        return min(self.endings, key=lambda end: end[0] in _FINE)

    def attributes(self) -> dict[str, Any]:
        """The type of the bifurcations, and why the curve ends."""
        return {"type": self.type, "endings": [str(ending) for ending, _ in self.endings]}

    def __repr__(self) -> str:
        counts = f"{len(self.points)} points, {len(self.codimension_two)} of codimension two"
        ends = " and ".join(ending for ending, _ in self.endings)
        return f"<Curve of {self.type} in {', '.join(self.parameters)}: {counts}, ending {ends}>"
