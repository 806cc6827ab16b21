"""Polish of a place near a local best to an optimum, over the pieces that meet there.

On one piece, the parameters on which an itinerary holds, the problem is smooth, with the piece's
borders as constraints. If a border is active, the pieces beyond it are examined. The search
continues in a better piece; if there is none, the place is an optimum at the border.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix, Vector
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.local import LocalSearch
from capsule_sym._design.pieces import Piece
from capsule_sym._design.program import CLOSE, Place, Program
from capsule_sym._design.stationary import SOLVED, Stationary, balanced, stationary
from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import backend
from capsule_sym._orbits.continuation.points import kinds
from capsule_sym._orbits.shooting.admissibility import DURATION
from capsule_sym._orbits.shooting.changes import insert_segment
from capsule_sym._orbits.shooting.equations import shooting
from capsule_sym._orbits.shooting.stability import floquet_multipliers

BASIN = "basin boundary"
"""Bound of a place beyond which the starts settle elsewhere."""
KINK = "kink"
"""Bound of a place with no better neighbour, without solved conditions."""
MARGIN = 1e-2
"""Distance of the largest multiplier from 1, if stability bounds the best and no margin is given:
a run needs a thousand periods there."""
REACH = 0.05
"""Largest way of a search on one piece, a share of each range: further away it rarely exists."""
_SEARCHES = 12  # of one piece, each from the end of the one before, at most: half of the bounds
_PIECES = 6  # passed on the way to an optimum, at most: each of six variables may cross a border
_INSIDE = 1e-12  # share of each range: a result is so far within its border, 5,000 roundings
_JUMP = 100  # times the change that the gradient explains: more is another motion, not a kink


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
class LocalOptimum:
    """Result of a polish: the conditions on the best piece, and the pieces beside it."""

    program: Program
    """The problem, with its margin of stability."""
    found: Stationary
    piece: Piece | None = None
    sides: tuple[Side, ...] = ()
    """Pieces beside the place, its own first; empty if no border holds the place."""
    kkt_satisfied: bool = False
    """True if the conditions hold, and no piece beyond a border is better."""
    bifurcation: str = ""
    """Bound of the best: loss of stability, or a border beyond which motions are lost."""
    limit: float = np.nan
    """Limit of the objective there."""

    @property
    def n_constraints(self) -> int:
        """Number of slacks that are limits; borders follow them."""
        return len(self.found.place.slacks) if self.piece is None else self.piece.n_constraints

    @property
    def active_borders(self) -> list[int]:
        """Slacks that are borders and hold the place, those of the largest multipliers first."""
        forces = self.found.multipliers
        some = range(self.n_constraints, len(forces))
        return sorted((i for i in some if forces[i] > SOLVED), key=lambda i: -forces[i])

    @property
    def critical(self) -> Motion:
        """Least stable motion."""
        return max(self.found.place.motions, key=lambda motion: motion.multiplier)

    @property
    def at_margin(self) -> bool:
        """True if the margin of stability is active."""
        each = len(self.program.texts)
        forces = self.found.multipliers[each - 1 : self.n_constraints : max(each, 1)]
        return self.program.margin is not None and bool(np.any(forces > SOLVED))

    def with_limit(self) -> LocalOptimum:
        """The same with the limit of the objective as the margin of stability goes to 0.

        Along the optima the objective is a smooth function of the margin, also at a fold.
        """
        if not self.at_margin or self.program.margin is None:
            return self
        margin = min(self.program.margin, MARGIN)
        margins, values, last = list[float](), list[float](), self
        for closer in (margin / 2, margin / 4, margin / 8):
            narrow = on_piece(replace(self.program, margin=closer), last.found.place)
            if narrow is None or not narrow.kkt_satisfied:
                break
            if not narrow.at_margin:  # the best is stable within the given margin
                return self
            margins.append(closer)
            values.append(narrow.found.place.worst)
            last = narrow
        limit = self.found.place.worst
        if values:
            limit = float(np.polynomial.Polynomial.fit(margins, values, len(values) - 1)(0.0))
        return replace(self, bifurcation=bifurcation_of(last.critical), limit=limit)


def polish(program: Program, place: Place) -> LocalOptimum | None:
    """Best place next to a given one; None if no piece has it."""
    found = _over_pieces(program, place)
    if found is None or program.margin is not None:
        return found
    near = 0.0 if found.kkt_satisfied else MARGIN
    if found.critical.multiplier <= 1 - near:
        return found
    return _over_pieces(replace(program, margin=MARGIN), place)


def bifurcation_of(motion: Motion) -> str:
    """The bifurcation that is near, by the largest multiplier."""
    assert motion.orbit is not None
    largest = complex(floquet_multipliers(motion.orbit)[0])
    if abs(largest.imag) > 1e-6 * abs(largest):  # rounding of a double real multiplier
        return kinds.NEIMARK_SACKER
    return kinds.FOLD if largest.real > 0 else kinds.PERIOD_DOUBLING


def _over_pieces(program: Program, place: Place) -> LocalOptimum | None:
    """Best place next to a place, over all pieces passed."""
    found = on_piece(program, place)
    for _ in range(_PIECES):
        if found is None or (found.kkt_satisfied and not found.active_borders):
            break
        around = [*_around(program, found)]
        better = _better(program, found, around)
        if better is None:
            return _with_sides(found, around) if found.kkt_satisfied else found
        found = better
    return found


def _better(
    program: Program, found: LocalOptimum, around: Sequence[tuple[Vector, Place | None]]
) -> LocalOptimum | None:
    """Better result on a piece beside a place; None if there is none."""
    here = found.found.place
    seen = {_itineraries(here)}
    for _, side in around:
        if side is None or _itineraries(side) in seen:
            continue
        seen.add(_itineraries(side))
        other = on_piece(program, side)
        if other is None or other.found.place.slacks.min(initial=0.0) < -SOLVED:
            continue
        gained = here.worst - other.found.place.worst
        if gained > SOLVED or (
            other.kkt_satisfied and not found.kkt_satisfied and gained > -SOLVED
        ):
            return other
    return None


def on_piece(program: Program, place: Place) -> LocalOptimum | None:
    """Best place on the piece of a place; None if its orbits have no equations."""
    found: LocalOptimum | None = None
    for _ in range(_SEARCHES):
        piece = Piece(program, place)
        first = piece.at(place.u)
        if first is None:
            return found
        best = LocalSearch(piece, first, REACH).run()[0]
        there = stationary(piece, best)
        if there is None or not _as_good(there, best):
            there = balanced(piece, best, CLOSE)
        found = LocalOptimum(program, there, piece, kkt_satisfied=there.minimal)
        moved = abs(there.place.u - place.u).max()
        if (there.minimal and moved < REACH) or moved < SOLVED:
            break
        place = there.place
    return found


def _as_good(found: Stationary, best: Place) -> bool:
    """True if an optimum is as good as a place that may exceed its limits a little, or fails."""
    gained = float(found.multipliers @ np.maximum(-best.slacks, 0.0))
    return best.beyond > 0 or found.place.worst <= best.worst + gained + SOLVED


def _with_sides(found: LocalOptimum, around: Sequence[tuple[Vector, Place | None]]) -> LocalOptimum:
    """Result at a border, with the pieces beside it; not an optimum if it is better beyond."""
    sides = dict[tuple[str, ...], Side]()
    for way, side in around:
        names = ("",) if side is None else _itineraries(side)
        sides.setdefault(names, Side(names, np.nan if side is None else _slope(found, side, way)))
    slopes = np.array([side.slope for side in sides.values()])
    best = not np.any(slopes < -SOLVED)
    whole = replace(_inset(found), sides=tuple(sides.values()), kkt_satisfied=best)
    if np.isnan(slopes).any():
        return replace(whole, bifurcation=_border(found), limit=found.found.place.worst)
    return whole


def _inset(found: LocalOptimum) -> LocalOptimum:
    """Result moved slightly within the borders of its piece, where rounding cannot change it."""
    assert found.piece is not None
    place, normals = found.found.place, _normals(found)
    way = np.linalg.lstsq(normals, np.ones(len(normals)), rcond=SOLVED)[0]
    way /= max(float(np.linalg.norm(way)), 1.0)
    inside = found.piece.at(np.clip(place.u + _INSIDE * way, 0.0, 1.0))
    return found if inside is None else replace(found, found=replace(found.found, place=inside))


def _normals(found: LocalOptimum) -> Matrix:
    """Slopes of at most three borders that hold a place, by the variables at no bound."""
    place = found.found.place
    normals: Matrix = found.program.by_u(place.slacks_by[found.active_borders[:3]])
    return normals * ((place.u > 0.0) & (place.u < 1.0))


def _slope(found: LocalOptimum, side: Place, way: Vector) -> float:
    """Objective's slope at a place on a side, less the gain that limits allow."""
    by = side.objective_by[int(np.argmax(side.objective))]
    by = by - found.found.multipliers[: found.n_constraints] @ side.slacks_by
    return float(found.program.by_u(by) @ way)


def _around(program: Program, found: LocalOptimum) -> Iterator[tuple[Vector, Place | None]]:
    """Directions into the pieces that meet at a place, its own first, with places there.

    The place is None if the motions are lost.
    """
    place, k = found.found.place, len(found.found.place.u)
    ways = [*np.eye(k), *-np.eye(k)]
    if found.active_borders:
        normals = _normals(found)
        signs = product((1.0, -1.0), repeat=len(normals))
        ways = [np.linalg.lstsq(normals, np.array(one), rcond=SOLVED)[0] for one in signs]
    slope = 1 + abs(program.by_u(place.objective_by)).max()
    for way in ways:
        if np.any(way):
            way = way / np.linalg.norm(way)
            side = program.beside(place, np.clip(place.u + CLOSE * way, 0.0, 1.0))
            lost = side is None or abs(side.worst - place.worst) > _JUMP * CLOSE * slope
            yield way, None if lost else side


def _border(found: LocalOptimum) -> str:
    """Bifurcation at the border with the largest multiplier."""
    assert found.piece is not None
    orbit, inequality = found.piece.inequality(found.active_borders[0])
    try:
        if inequality.kind == DURATION:
            return kinds.place(orbit, inequality.segment).type
        with backend(orbit.backend, orbit.scene) as numbers:
            change, segment = insert_segment(
                numbers, orbit.itinerary, orbit.z, orbit.system, inequality
            )
            system = shooting(numbers, orbit.values, change.itinerary, change.z)
        longer = replace(orbit, itinerary=change.itinerary, z=change.z, system=system)
        return kinds.place(longer, segment).type
    except (InvalidInput, np.linalg.LinAlgError):
        return kinds.HIGHER.type


def _itineraries(place: Place) -> tuple[str, ...]:
    return tuple(" ".join(motion.itinerary) for motion in place.motions)
