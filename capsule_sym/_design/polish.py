"""Polish of a place near a local best to an optimum, over the pieces that meet there.

On one piece, the parameters on which an itinerary holds, the problem is smooth, with the piece's
borders as constraints. If a border is active, the pieces beyond it are examined. The search
continues in a better piece; if there is none, the place is an optimum at the border.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.local import LocalSearch
from capsule_sym._design.pieces import Piece
from capsule_sym._design.program import Budget, Exhausted, Place, Program
from capsule_sym._design.stationary import Stationary, rough, stationary
from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import backend
from capsule_sym._orbits.continuation.points.kinds import (
    FOLD,
    HIGHER,
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
)
from capsule_sym._orbits.continuation.points.kinds import place as event
from capsule_sym._orbits.shooting.admissibility import DURATION
from capsule_sym._orbits.shooting.changes import insert_segment
from capsule_sym._orbits.shooting.equations import shooting
from capsule_sym._orbits.shooting.stability import floquet_multipliers

BASIN = "basin boundary"
"""Bound of a place beyond which the starts settle elsewhere."""
KINK = "kink"
"""Bound of a place with no better neighbour, without solved conditions."""
MARGIN = 1e-2
"""Of the largest multiplier, if stability bounds the best and no margin is required."""
EFFORT = 300
"""Orbits that are solved for, for one optimum."""
_MARGINS = (0.5, 0.25, 0.125)  # of it, from which the limit is extrapolated
_REAL = 1e-6  # imaginary over absolute part
_REACH = 0.05  # of the bounds: largest way of a search on one piece
_ROUNDS = 12  # searches on one piece
_HOPS = 6  # from piece to piece
_BESIDE = 1e-6  # of the bounds: where the pieces beyond a border are looked at
_INSIDE = 1e-12  # of the bounds: where a result is, within a border that holds it
_JUMP = 100  # times what the gradient explains: another motion
_NEAR = 1e-6  # slacks below which constraints act where no equations are solved
_HELD = 1e-9  # least multiplier of a border that holds an optimum
_AT = 1e-9  # of the bounds: at a border
_MOST = 3  # largest number of borders for which all pieces are examined
_BETTER, _WORSE = 1e-11, 1e-9  # units of the objective: rounding of an optimum, and of other places

Beside = tuple[Vector, Place | None]
"""Direction from a place, and the place there."""


class Side(NamedTuple):
    """Piece at a border: the itineraries of its scenarios, and the slope into it.

    The slope is the objective's by the scaled variables, away from the borders, less the gain that
    active limits allow; nan if the motions are lost beyond.
    """

    itineraries: tuple[str, ...]
    slope: float

    @property
    def name(self) -> str:
        """Itineraries in a line."""
        return ", ".join(self.itineraries)


@dataclass(frozen=True, eq=False)
class Rest:
    """Result of a polish: the conditions on the best piece, and the pieces beside it."""

    program: Program
    """The problem, with its margin of stability."""
    found: Stationary
    piece: Piece | None = None
    sides: tuple[Side, ...] = ()
    """Pieces beside the place, its own first; empty if no border holds the place."""
    whole: bool = False
    """True if the conditions hold, and no piece beyond a border is better."""
    bifurcation: str = ""
    """Bound of the best: loss of stability, or a border beyond which motions are lost."""
    limit: float = np.nan
    """Limit of the objective there."""

    @property
    def asked(self) -> int:
        """Number of slacks that are limits; borders follow them."""
        return len(self.found.place.slacks) if self.piece is None else self.piece.asked

    @property
    def held(self) -> list[int]:
        """Active borders, by their slacks."""
        return [i for i in self._borders if self.found.multipliers[i] > _HELD]

    @property
    def near(self) -> list[int]:
        """Borders at the place, by their slacks."""
        return [i for i in self._borders if abs(self.found.place.slacks[i]) < _AT]

    @property
    def _borders(self) -> range:
        """Slacks that are borders."""
        return range(0) if self.piece is None else range(*self.piece.borders_at.indices(10**6))

    @property
    def critical(self) -> Motion:
        """Least stable motion."""
        return max(self.found.place.motions, key=lambda motion: motion.multiplier)

    @property
    def at_margin(self) -> bool:
        """True if the margin of stability is active."""
        if self.program.margin is None:
            return False
        each = len(self.program.texts)
        forces = self.found.multipliers[each - 1 : self.asked : each]
        return bool(np.any(forces > _HELD))


def polish(program: Program, place: Place, effort: int = EFFORT) -> Rest | None:
    """Best place next to a given one; None if no piece has it, or it takes too many orbits."""
    program = replace(program, budget=Budget(effort))
    with suppress(Exhausted):
        rest = _over_pieces(program, place)
        near = 0.0 if rest is not None and rest.whole else MARGIN
        if rest is not None and program.margin is None and rest.critical.multiplier > 1 - near:
            rest = _over_pieces(replace(program, margin=MARGIN), place)
        return rest
    return None


def with_limit(rest: Rest) -> Rest:
    """The same with the limit of the objective as the margin of stability goes to 0.

    Along the optima the objective is a smooth function of the margin, also at a fold.
    """
    if not rest.at_margin or rest.program.margin is None:
        return rest
    margins, values, last = list[float](), list[float](), rest
    with suppress(Exhausted):
        for share in _MARGINS:
            margin = min(rest.program.margin, MARGIN) * share
            program = replace(rest.program, margin=margin, budget=Budget(EFFORT))
            narrow = on_piece(program, last.found.place)
            if narrow is None or not narrow.whole:
                break
            if not narrow.at_margin:  # the best is stable within the given margin
                return rest
            margins.append(margin)
            values.append(narrow.found.place.worst)
            last = narrow
    if not values:
        kind = bifurcation_of(rest.critical)
        return replace(rest, bifurcation=kind, limit=rest.found.place.worst)
    fitted = np.polynomial.Polynomial.fit(margins, values, len(values) - 1)
    return replace(rest, bifurcation=bifurcation_of(last.critical), limit=float(fitted(0.0)))


def bifurcation_of(motion: Motion) -> str:
    """The bifurcation that is near, by the largest multiplier."""
    assert motion.orbit is not None
    largest = complex(floquet_multipliers(motion.orbit)[0])
    if abs(largest.imag) > _REAL * abs(largest):
        return NEIMARK_SACKER
    return FOLD if largest.real > 0 else PERIOD_DOUBLING


def _over_pieces(program: Program, place: Place) -> Rest | None:
    """Best place next to a place, over all pieces passed."""
    rest = on_piece(program, place)
    for _ in range(_HOPS):
        if rest is None or (rest.whole and not rest.held):
            break
        around = list(_around(program, rest))
        better = _better(program, rest, around)
        if better is None:
            return _with_sides(rest, around) if rest.whole else rest
        rest = better
    return rest


def _better(program: Program, rest: Rest, around: Sequence[Beside]) -> Rest | None:
    """Better result on a piece beside a place; None if there is none."""
    here = rest.found.place
    seen = {_itineraries(here)}
    for _, side in around:
        if side is None or _itineraries(side) in seen:
            continue
        seen.add(_itineraries(side))
        piece = Piece(program, side)
        there = piece.at(here.u)
        if rest.whole and there is not None and rough(piece, there, _NEAR).minimal:
            continue  # the conditions hold on this piece too
        other = on_piece(program, side)
        if other is None or other.found.place.slacks.min(initial=0.0) < -_WORSE:
            continue
        gained = here.worst - other.found.place.worst
        if gained > (_BETTER if other.whole else _WORSE) or (
            other.whole and not rest.whole and gained > -_WORSE
        ):
            return other
    return None


def on_piece(program: Program, place: Place) -> Rest | None:
    """Best place on the piece of a place; None if its orbits have no equations."""
    rest: Rest | None = None
    for _ in range(_ROUNDS):
        piece = Piece(program, place)
        first = piece.at(place.u)
        if first is None:
            return rest
        best = LocalSearch(piece, first, _REACH).run()[0]
        found = stationary(piece, best)
        good = found is not None and found.minimal and _as_good(found, best)
        if found is None or not good:
            found = rough(piece, best, _NEAR)
            good = found.minimal
        rest = Rest(program, found, piece, whole=good)
        moved = abs(found.place.u - place.u).max()
        if (good and moved < _REACH) or moved < _AT:
            break
        place = found.place
    return rest


def _as_good(found: Stationary, best: Place) -> bool:
    """True if an optimum is within its limits, and as good as a place that may exceed some."""
    gained = float(found.multipliers @ np.maximum(-best.slacks, 0.0))
    place = found.place
    return place.slacks.min(initial=0.0) > -_WORSE and (
        place.worst <= best.worst + gained + _WORSE or best.beyond > 0
    )


def _with_sides(rest: Rest, around: Sequence[Beside]) -> Rest:
    """Result at a border, with the pieces beside it; not an optimum if it is better beyond."""
    sides = dict[tuple[str, ...], Side]()
    for way, side in around:
        names = ("",) if side is None else _itineraries(side)
        slope = np.nan if side is None else _slope(rest, side, way)
        sides.setdefault(names, Side(names, slope))
    slopes = np.array([side.slope for side in sides.values()])
    lost, whole = bool(np.isnan(slopes).any()), not np.any(slopes < -_HELD)
    told = replace(_inside(rest), sides=tuple(sides.values()), whole=whole)
    if lost:
        told = replace(told, bifurcation=_border(rest), limit=rest.found.place.worst)
    return told


def _inside(rest: Rest) -> Rest:
    """Result moved slightly within the borders of its piece, where rounding cannot change it."""
    assert rest.piece is not None
    place, normals = rest.found.place, _normals(rest)
    way = np.linalg.lstsq(normals, np.ones(len(normals)), rcond=1e-6)[0]
    size = max(float(np.linalg.norm(way)), 1.0)
    inside = rest.piece.at(np.clip(place.u + _INSIDE * way / size, 0.0, 1.0))
    return rest if inside is None else replace(rest, found=replace(rest.found, place=inside))


def _normals(rest: Rest) -> Matrix:
    """Slopes of the borders at a place, by the variables at no bound."""
    place = rest.found.place
    free = (place.u > 0.0) & (place.u < 1.0)
    near = sorted({*rest.near, *rest.held}, key=lambda i: -rest.found.multipliers[i])[:_MOST]
    normals: Matrix = rest.program.by_u(place.slacks_by[near]) * free
    return normals


def _slope(rest: Rest, side: Place, way: Vector) -> float:
    """Objective's slope at a place on a side, less the gain that limits allow."""
    worst, asked = int(np.argmax(side.objective)), rest.asked
    by = side.objective_by[worst] - rest.found.multipliers[:asked] @ side.slacks_by
    return float(rest.program.by_u(by) @ way)


def _around(program: Program, rest: Rest) -> Iterator[Beside]:
    """Directions into the pieces that meet at a place, its own first, with places there.

    The place is None if the motions are lost.
    """
    place, k = rest.found.place, len(rest.found.place.u)
    ways = [*np.eye(k), *-np.eye(k)]
    if rest.held:
        normals = _normals(rest)
        signs = product((1.0, -1.0), repeat=len(normals))
        ways = [np.linalg.lstsq(normals, np.array(one), rcond=1e-6)[0] for one in signs]
    slope = 1 + abs(program.by_u(place.objective_by)).max()
    for way in ways:
        if np.any(way):
            way = way / np.linalg.norm(way)
            side = program.beside(place, np.clip(place.u + _BESIDE * way, 0.0, 1.0))
            lost = side is None or abs(side.worst - place.worst) > _JUMP * _BESIDE * slope
            yield way, None if lost else side


def _border(rest: Rest) -> str:
    """Bifurcation at the border with the largest multiplier."""
    assert rest.piece is not None
    forces = rest.found.multipliers
    which, inequality = rest.piece.inequality(max(rest.held, key=lambda i: forces[i]))
    orbit = rest.found.place.motions[which].orbit
    assert orbit is not None
    try:
        if inequality.kind == DURATION:
            return event(orbit, inequality.segment).type
        with backend(orbit.backend, orbit.scene) as numbers:
            change, segment = insert_segment(
                numbers, orbit.itinerary, orbit.z, orbit.system, inequality
            )
            system = shooting(numbers, orbit.values, change.itinerary, change.z)
        longer = replace(orbit, itinerary=change.itinerary, z=change.z, system=system)
        return event(longer, segment).type
    except (InvalidInput, np.linalg.LinAlgError):
        return HIGHER.type


def _itineraries(place: Place) -> tuple[str, ...]:
    return tuple(" ".join(motion.itinerary) for motion in place.motions)
