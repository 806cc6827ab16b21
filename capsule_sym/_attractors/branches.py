"""Results of attractors along a parameter: branches, births and deaths."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.attractor import closed_orbit, shown_itinerary
from capsule_sym._attractors.destinations import Cycle
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map.labelled import Labelled
from capsule_sym._map.result import Result, brief, by_fields, plain, record
from capsule_sym._map.steady import shown_progression
from capsule_sym._orbits.continuation.bifurcations import Bifurcation
from capsule_sym._orbits.continuation.parameter_paths import ParameterPath
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import SceneParameters


class Change(NamedTuple):
    """Birth or death of an attractor: its interval, and the bifurcation of its branch.

    All values are dimensionless, except a parameter in SI units to which others are tied. `message`
    has the itineraries before and after the bifurcation. If none was located, `value` is nan,
    `type` "not located" and `bifurcation` None, and `message` gives the reason.
    """

    value: float
    type: str
    interval: tuple[float, float]
    bifurcation: Bifurcation | None
    message: str

    def __repr__(self) -> str:
        return by_fields(self)

    def to_dict(self) -> dict[str, Any]:
        """Change by name, as numbers, texts and lists, without its `bifurcation`."""
        return record(self, "value type interval message")


@dataclass(frozen=True, eq=False)
class AttractorBranch:
    """One attractor along the parameter, at neighbouring values.

    Dimensionless, except values of the parameter if it is in SI units.

    `birth` is None if it exists at the first value, `death` if it exists at the last. Both are
    named tuples. `interval` has the values of the parameter between which it is. `bifurcation` is
    that of the branch, with its `value` and `type`; if none was located it is None, `type` "not
    located", `value` nan, and `message` gives the reason.
    """

    number: int
    path: ParameterPath
    base: SceneParameters
    values: Vector
    """Values of the parameter, shape (k,)."""
    counts: NDArray[np.int64]
    """Number of starts that lead to it, shape (k,)."""
    fractions: Vector
    """Fraction of starts that lead to it, shape (k,)."""
    intervals: Vector
    """95 % confidence intervals of the fractions, by Clopper and Pearson, shape (k, 2)."""
    cycles: tuple[Cycle, ...]
    """States at phase 0 and largest multiplier, for each value."""
    birth: Change | None
    death: Change | None

    def __repr__(self) -> str:
        ends = " to ".join(f"{value:.6g}" for value in self.values[[0, -1]])
        return brief(self, f"{self.path.name} from {ends}", str(self.number))

    def orbit(self, i: int) -> Orbit:
        """Periodic orbit at `values[i]`, solved again at each call.

        Raises InvalidInput if it is not found, and IndexError for an i outside the values.
        """
        found = closed_orbit(placed_at(self.path, self.base, self.values[i]), self.cycles[i])
        if found is None:
            raise InvalidInput("i", i, "a value at which the orbit's equations are solved")
        return found

    @cached_property
    def shown(self) -> list[tuple[str, float]]:
        """Itinerary and progression at each value; raises InvalidInput as `orbit` does."""
        orbits = [self.orbit(i) for i in range(len(self.values))]
        return [(shown_itinerary(one), shown_progression(one.motion)) for one in orbits]

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns, shape (k,), with a row for each value; raises InvalidInput as `orbit` does."""
        texts, paces = zip(*self.shown, strict=True)
        return {
            self.path.name: self.values,
            "attractor": np.full(len(self.values), self.number),
            "count": self.counts,
            "fraction": self.fractions,
            "fraction_low": self.intervals[:, 0],
            "fraction_high": self.intervals[:, 1],
            "period_number": np.array([len(cycle.states) for cycle in self.cycles]),
            "progression": np.array(paces),
            "largest_multiplier": np.array([cycle.multiplier for cycle in self.cycles]),
            "itinerary": np.array(texts, dtype=np.str_),
        }

    def to_dict(self) -> dict[str, Any]:
        """Columns as lists, birth and death as dicts or None; raises as `columns` does."""
        return {**plain(self.columns), **record(self, "birth death")}


@dataclass(frozen=True, eq=False, repr=False)
class ContinuedAttractors(Result, Labelled):
    """Attractors along a parameter, in the order of their first values.

    Dimensionless, except values of the parameter if it is in SI units.

    `unsettled` is for each value the number of starts that have not settled on a closed orbit.
    """

    name: str
    values: Vector
    """Values of the parameter, ascending, shape (m,)."""
    starts: int
    """Number of starts at each value."""
    branches: tuple[AttractorBranch, ...]
    unsettled: NDArray[np.int64]
    """Number of starts that have not settled, shape (m,)."""
    periods: int
    """Excitation periods after which a run counts as unsettled."""
    status: Status
    base: SceneParameters

    @property
    def changes(self) -> tuple[Change, ...]:
        """All births and deaths, attractor by attractor."""
        both = chain.from_iterable((one.birth, one.death) for one in self.branches)
        return tuple(one for one in both if one is not None)

    @property
    def message(self) -> str:
        """Number of attractors, births, deaths and unsettled runs, as a sentence."""
        found = counted(len(self.branches), "attractor")
        text = f"{found} at {counted(len(self.values), 'value')} of {self.name}"
        if self.changes:
            located = sum(one.bifurcation is not None for one in self.changes)
            text += f", {located} of {len(self.changes)} births and deaths at located bifurcations"
        if late := int(self.unsettled.sum()):
            text += f"; {late} of {counted(self.starts * len(self.values), 'run')} not settled"
        late_end = "; time limit reached, or interrupted, before the end"
        return text + late_end * (self.status is not Status.FINISHED)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns, shape (k,), with a row for each value of each attractor.

        There are none without attractors. Raises InvalidInput for an orbit that is not solved.
        """
        parts = [one.columns for one in self.branches]
        names = list(parts[0]) if parts else []
        return {name: np.concatenate([of[name] for of in parts]) for name in names}

    def to_dict(self) -> dict[str, Any]:
        """Result by name, as numbers, texts, lists and dicts; raises as `columns` does."""
        told = {"parameter": self.name, "parameters": self.base.to_dict()}
        found = record(self, "values starts periods unsettled")
        return super().to_dict() | told | found | {"attractors": plain(self.branches)}


def row_at(path: ParameterPath, base: SceneParameters, value: float) -> list[float]:
    """All parameters at a value of the varied one."""
    return [float(one) for one in path.placed([*base.to_dict().values()], float(value))]


def placed_at(path: ParameterPath, base: SceneParameters, value: float) -> SceneParameters:
    """Parameters at a value of the varied one."""
    return base.scene.Parameters(*row_at(path, base, value))
