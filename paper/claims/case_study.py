"""The motions of Section 4, proved in ball arithmetic, at the printed mass ratio and at 3.0.

`steady_orbit` is the stable orbit at an amplitude, `from_rest` the one to which the motion from
(0, 0, 0) tends; `BRACKETS` encloses each bifurcation by two amplitudes with different motions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import TypeVar

import sympy as sp

from capsule_sym._enclosures.interface import Unproved
from capsule_sym._symbolic.theory import PARAMETERS, SEGMENTS, Undecided
from paper.derived.local_maps import LocalMap
from paper.derived.reachability import ENTRY_PLANE
from paper.printed import Paper
from paper.proofs import steady
from paper.proofs.attraction import tendency
from paper.proofs.steady import SteadyOrbit

OTHER = "3.0"
"""Mass ratio that gives the printed order of the bifurcations."""

Itinerary = tuple[int, ...]
"""Fields of one period in order of time."""
Maps = tuple[LocalMap, ...]
T = TypeVar("T")


@dataclass(frozen=True)
class Point:
    """Parameters of the case study, by name as decimal numbers."""

    numbers: tuple[tuple[str, str], ...]

    def __str__(self) -> str:
        return f"γ = {self['gamma']}, α = {self['alpha']}"

    def __getitem__(self, name: str) -> str:
        return dict(self.numbers)[name]

    @property
    def values(self) -> dict[sp.Symbol, sp.Rational]:
        """All parameters as exact numbers."""
        return {symbol: sp.Rational(self[str(symbol)]) for symbol in PARAMETERS}


def point(paper: Paper, alpha: str, gamma: str = "") -> Point:
    """Printed parameters at an amplitude, with another mass ratio if one is given."""
    entry = paper["section.4.parameters"]
    numbers = {str(symbol): entry.printed.get(str(symbol), alpha) for symbol in PARAMETERS}
    return Point(tuple((numbers | {"gamma": gamma or entry["gamma"], "alpha": alpha}).items()))


def _decided(found: Callable[[Mapping[str, str]], T], at: Point) -> T:
    try:
        return found(dict(at.numbers))
    except Unproved as error:
        raise Undecided(f"{at}: {error}") from error


@cache
def steady_orbit(at: Point) -> SteadyOrbit:
    """Stable orbit near which the motion from rest settles."""
    return _decided(steady.steady_orbit, at)


@cache
def from_rest(at: Point) -> Itinerary:
    """Fields of the orbit to which the motion from rest is proved to tend."""
    return _decided(lambda values: tendency(values).itinerary, at)


@cache
def first_fields(at: Point) -> Itinerary:
    """Fields of the motion from rest within one period."""
    return _decided(steady.first_fields, at)


def maps(itinerary: Itinerary) -> Maps:
    """Local maps of a periodic sequence of fields; none for a single field."""

    def plane(before: int, after: int) -> str:
        old, new = SEGMENTS[before - 1], SEGMENTS[after - 1]
        impact = old.drift == new.drift != 0
        return ENTRY_PLANE[after] if impact else f"Σ{after}"

    if len(itinerary) == 1:
        return ()
    begins = [plane(itinerary[i - 1], itinerary[i]) for i in range(len(itinerary))]
    return tuple(map(LocalMap, [*begins[1:], begins[0]], itinerary, begins))


def global_map(local_maps: Maps) -> str:
    """A global map in the paper's notation, composed from right to left."""
    return " ∘ ".join(map(str, reversed(local_maps))) or "Id_{Σ2,F2,Σ2}"


def cycle(local_maps: Maps) -> Maps:
    """The same cycle, starting with its least map."""
    start = local_maps.index(min(local_maps)) if local_maps else 0
    return (*local_maps[start:], *local_maps[:start])


@dataclass(frozen=True)
class Bracket:
    """Two amplitudes with different motions that enclose a bifurcation."""

    below: str
    first: Itinerary
    above: str
    second: Itinerary


_EARLY = (
    Bracket("0.00737", (2,), "0.00738", (2, 5)),
    Bracket("0.36877", (5, 2), "0.36879", (5, 4, 5, 2)),
)
BRACKETS: dict[str, tuple[Bracket, ...]] = {
    "3.3": (
        *_EARLY,
        Bracket("0.52459", (5, 4, 5, 2), "0.5246", (5, 4, 1, 2)),
        Bracket("0.9409", (5, 4, 1, 2), "0.9411", (5, 4, 1, 2, 3, 2)),
        Bracket("1.4268", (5, 4, 1, 2, 3, 2), "1.4269", (5, 4, 1, 2, 3, 6)),
        Bracket("1.5885", (5, 4, 1, 3, 6), "1.5887", (4, 1, 3, 6)),
        Bracket("1.5217", (5, 4, 1, 2, 3, 6), "1.5219", (5, 4, 1, 3, 2, 3, 6)),
        Bracket("1.5513", (5, 4, 1, 3, 2, 3, 6), "1.5515", (5, 4, 1, 3, 6)),
    ),
    OTHER: (
        *_EARLY,
        Bracket("0.524", (5, 4, 5, 2), "0.5242", (5, 4, 1, 2)),
        Bracket("0.9388", (5, 4, 1, 2), "0.9389", (5, 4, 1, 2, 3, 2)),
        Bracket("1.4412", (5, 4, 1, 2, 3, 2), "1.4413", (5, 4, 1, 2, 3, 6)),
        Bracket("1.6152", (5, 4, 1, 2, 3, 6), "1.6153", (4, 1, 2, 3, 6)),
        Bracket("1.6621", (4, 1, 2, 3, 6), "1.6623", (4, 1, 3, 2, 3, 6)),
        Bracket("1.7016", (4, 1, 3, 2, 3, 6), "1.7018", (4, 1, 3, 6)),
    ),
}
"""The eight bifurcations in the order in which Section 4 names them, at each mass ratio."""
