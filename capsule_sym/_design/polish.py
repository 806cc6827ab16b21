"""Polish of a place near a local best to an optimum, over the pieces that meet there.

On one piece, the parameters on which an itinerary holds, the problem is smooth, with the piece's
borders as constraints. If borders are active, the pieces beyond three of them are examined. The
search continues in a better piece; if there is none, the place is the best at the border.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from capsule_sym._arrays import Matrix
from capsule_sym._design.evaluation import Motion
from capsule_sym._design.pieces import Piece
from capsule_sym._design.program import CLOSE, Place, Program
from capsule_sym._design.stationary import SOLVED, LocalOptimum, balanced, local_search, stationary
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.shooting.stability import floquet_multipliers

BASIN = "basin boundary"
"""Bound of a place beyond which the start settles elsewhere."""
KINK = "kink"
"""Bound of a place without solved conditions, if it is no other bound."""
LOST = "border collision"
"""Bound of a place at a change of itinerary beyond which the motion is lost or another one."""
MARGIN = 1e-2
"""Distance of the largest multiplier from 1, if stability bounds the best and no margin is given:
a run needs a thousand periods there."""
_PIECES = 3  # moves to a better piece: of 91 optima two needed one, a place far away needs three
_EVALUATIONS = 30  # of a search on a piece, at most: it begins near to an optimum
_JUMP = 100  # times the change that the gradient explains: more is another motion, not a kink


def polish(program: Program, place: Place) -> LocalOptimum | None:
    """Local optimum next to a place, with a margin if stability bounds it.

    It may be without solved conditions. None if the equations of the motion's orbit are not solved.
    """
    found = _over_pieces(program, place)
    if found is None or program.margin is not None:
        return found
    if found.kkt_satisfied and found.place.motion.multiplier <= 1:
        return found
    if not found.kkt_satisfied and place.motion.multiplier <= 1 - MARGIN:
        return found
    return _over_pieces(replace(program, margin=MARGIN), place)


def with_limit(best: LocalOptimum) -> LocalOptimum:
    """The same with its bifurcation, and the limit of the objective as the margin goes to 0.

    Along the optima the objective is a smooth function of the margin of stability, also at a fold.
    The result is unchanged unless the margin is active, there and at optima of smaller margins.
    """
    place, values = best.place, list[float]()
    margins = min(best.program.margin or 0.0, MARGIN) / np.array([2, 4, 8])
    for margin in margins if best.at_margin else ():
        program = replace(best.program, margin=float(margin))
        closer = _on_piece(program, place)
        if not (closer and closer.kkt_satisfied and closer.at_margin):
            return best  # the best is stable within the given margin, or this one is not solved
        place = closer.place
        values.append(place.objective)
    if not values:
        return best
    limit = np.polynomial.Polynomial.fit(margins, values, 2)(0.0) if margins.any() else values[-1]
    return replace(best, bifurcation=bifurcation_of(place.motion), limit=float(limit))


def bifurcation_of(motion: Motion) -> str:
    """The bifurcation that is near, by the largest multiplier; empty without equations."""
    if motion.orbit is None:
        return ""
    largest = complex(floquet_multipliers(motion.orbit)[0])
    if abs(largest.imag) > 1e-6 * abs(largest):  # rounding of a double real multiplier
        return kinds.NEIMARK_SACKER
    return kinds.FOLD if largest.real > 0 else kinds.PERIOD_DOUBLING


def _over_pieces(program: Program, place: Place) -> LocalOptimum | None:
    """Best place next to a place, by at most three moves to a better piece.

    It counts as not solved if they do not suffice; None if the first piece has no equations.
    """
    found = _on_piece(program, place)
    for _ in range(_PIECES):
        if found is None or not found.active_borders:
            return found
        level = found.place.beyond, found.place.objective - SOLVED
        sides = [*_around(program, found)]
        others = (_on_piece(program, side) for side in sides if side)
        better = next((one for one in others if one and one.place.rank < level), None)
        if better is None:
            names = [found.place.motion.itinerary]
            names += [side.motion.itinerary if side else () for side in sides]
            found = replace(_inset(found), border=tuple(dict.fromkeys(map(" ".join, names))))
            if None in sides:
                found = replace(found, bifurcation=LOST, limit=found.place.objective)
            return found
        found = better
    return found and replace(found, kkt_satisfied=found.kkt_satisfied and not found.active_borders)


def _on_piece(program: Program, place: Place) -> LocalOptimum | None:
    """Optimum on the piece of a place, or the best near it; None if its orbit has no equations.

    If the conditions are not solved there, or not as good, a search on the piece comes nearer.
    """
    piece = Piece(program, place)
    first = piece.at(place.u)
    if first is None:
        return None
    best, found = first, stationary(piece, first)
    if found is None or not _as_good(found, best):
        best = local_search(piece, first, _EVALUATIONS)[0]
        found = stationary(piece, best)
    if found is None or not _as_good(found, best):
        found = balanced(piece, best)
    return found


def _as_good(found: LocalOptimum, best: Place) -> bool:
    """True if an optimum is as good as a place, or the place violates a limit.

    A gain of the place by violations within KEPT does not count; the multipliers estimate it.
    """
    gained = float(found.multipliers @ np.maximum(-best.slacks, 0.0))
    return best.beyond > 0 or found.place.objective <= best.objective + gained + SOLVED


def _around(program: Program, found: LocalOptimum) -> Iterator[Place | None]:
    """Places across at most three borders that hold a place; None for a lost or another motion."""
    place, normals = found.place, _normals(found)
    far = CLOSE + place.slacks[found.active_borders[:3]].max()
    slope = 1 + abs(program.by_u(place.objective_by)).max()
    most = (_JUMP * CLOSE + 2 * far) * slope
    for inward in 1 - 2 * np.eye(len(normals)):  # beyond one border, within the others
        way = np.linalg.lstsq(normals, inward, rcond=SOLVED)[0]
        if np.any(way):
            u = np.clip(place.u + far * way / np.linalg.norm(way), 0.0, 1.0)
            side = program.beside(place, u)
            yield side if side and abs(side.objective - place.objective) <= most else None


def _normals(found: LocalOptimum) -> Matrix:
    """Slopes of at most three borders that hold a place, by the variables at no bound."""
    place = found.place
    normals: Matrix = found.program.by_u(place.slacks_by[found.active_borders[:3]])
    return normals * ((place.u > 0.0) & (place.u < 1.0))


def _inset(found: LocalOptimum) -> LocalOptimum:
    """Result moved slightly within the borders of its piece, where rounding cannot change it."""
    place, normals = found.place, _normals(found)
    way = np.linalg.lstsq(normals, np.ones(len(normals)), rcond=SOLVED)[0]
    way /= max(float(np.linalg.norm(way)), 1.0)
    assert isinstance(found.model, Piece)
    inside = found.model.at(np.clip(place.u + SOLVED * way, 0.0, 1.0))
    return found if inside is None else replace(found, place=inside)
