"""Bifurcations between two states of a family: from test functions and failing inequalities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.continuation.conditions import (
    Collapse,
    EventSolution,
    evaluate_test_functions,
    has_rotations,
    noise,
)
from capsule_sym._orbits.continuation.problem import Event, Family, SmoothEvent, Spot
from capsule_sym._orbits.shooting.admissibility import (
    DURATION,
    MINIMUM,
    Inequality,
    inequalities,
)
from capsule_sym._orbits.shooting.changes import Exchange, insert_segment, zero_segments
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.symmetry import whole_orbit

_SAME_SHARE = 1e-7  # share of a step within which failing inequalities count as one event
_BEFORE_SHARE = 1e-3  # share of a step before an event at which all other inequalities have to hold
_BEFORE_LENGTHS = (1e-6, 1e-8)  # the same as lengths in u, where these are shorter
_SHARE_ERROR = 0.1  # error, as a share of a step, of the estimate of where an inequality fails
_OUTSIDE_SHARE = 1e-6  # share of a step by which an event may lie beyond its ends
_ZERO_HALVINGS = 8  # halvings of a step in the search for a zero of a test function


def smooth_between(family: Family, old: Spot, new: Spot, until: float) -> list[SmoothEvent]:
    """Smooth bifurcations between two states of one itinerary, up to a share, in order."""
    names = [name for name in family.watched if _changes_sign(name, old, new)]
    # Along a curve of folds the parameters turn back at a cusp.
    if family.critical == kinds.FOLD and float(old.tangent[-2:] @ new.tangent[-2:]) < 0:
        names.append(kinds.CUSP)
    found = [_zero_between(family, name, old, new) for name in names]
    events = [one for one in found if one is not None and one.share <= until]
    return sorted(events, key=lambda one: one.share)


def _changes_sign(name: str, old: Spot, new: Spot) -> bool:
    """True if a test function changes its sign on a step, by more than rounding.

    Without dissipation all multipliers lie on the unit circle along the whole branch.
    """
    ends = old.tests[name], new.tests[name]
    if not ends[0] * ends[1] < 0:
        return False
    both = zip(ends, (old, new), strict=True)
    return name not in kinds.SMOOTH or any(abs(end) > noise(state.orbit) for end, state in both)


def _zero_between(family: Family, name: str, old: Spot, new: Spot) -> SmoothEvent | None:
    """Zero of a test function between two states, from its extended system.

    If the extended system has no solution near the linear guess, the step is halved. The result is
    marked as unsolved if this fails too. It is None if the function has no change of sign between
    the corrected ends, if it is none of `kinds.SMOOTH` and the first guess fails, as at a pole, and
    for a Neimark-Sacker function whose multipliers are a real pair mu, 1/mu.
    """
    change = new.u - old.u
    normal = change / np.linalg.norm(change)
    if name == kinds.CUSP:
        ends = [float(np.linalg.norm(state.tangent[-2:])) for state in (old, new)]
    else:
        ends = [abs(old.tests[name]), abs(new.tests[name])]
    low, high, share = 0.0, 1.0, ends[0] / (ends[0] + ends[1])
    conditions = tuple(one for one in (family.critical, name) if one is not None)
    for _ in range(_ZERO_HALVINGS):
        guess = family.corrected(old.u + share * change, normal)
        if guess is None:
            break
        orbit = guess.at.orbit
        found = family.solved(orbit, conditions, family.segments)
        if found is not None and 0 <= (at := _share(family, old, new, found)) <= 1:
            real = name == kinds.NEIMARK_SACKER and not has_rotations(found.orbit)
            return None if real else SmoothEvent(name, (old, new), at, found)
        if name not in kinds.SMOOTH:
            break
        before = evaluate_test_functions(orbit)[name] * old.tests[name] > 0
        low, high = (share, high) if before else (low, share)
        share = (low + high) / 2
    real = name == kinds.NEIMARK_SACKER and not (
        has_rotations(old.orbit) and has_rotations(new.orbit)
    )
    if real or name not in kinds.SMOOTH:
        return None
    again = [family.corrected(state.u, normal) for state in (old, new)]
    signs = [np.sign(evaluate_test_functions(one.at.orbit)[name]) for one in again if one]
    if signs not in ([-1, 1], [1, -1]):
        return None
    both = zip(*(family.problem.values(state.orbit) for state in (old, new)), strict=True)
    interval = tuple(abs(after - before) for before, after in both)
    solution = EventSolution(old.orbit, (), abs(old.tests[name]), interval)
    return SmoothEvent(name, (old, new), 0.0, solution, solved=False)


def _share(family: Family, old: Spot, new: Spot, found: EventSolution) -> float:
    """Share of the step between two states at which an orbit of the family lies."""
    step = new.u - old.u
    return float(step @ (family.unknowns(found.orbit) - old.u) / (step @ step))


def first_event(family: Family, old: Spot, new: Spot, failing: list[Inequality]) -> Event | None:
    """First event between two states; None if nothing fails or it is not located."""
    shares = [_failing_share(old.held, failed) for failed in failing]
    found = [_locate(family, old, new, *one) for one in zip(failing, shares, strict=True)]
    located = [one for one in found if one is not None]
    events = [one for one in located if not any(_may_be(family, one, other) for other in located)]
    if not events:
        return None
    nearest = min(one.share for one in events)
    for share, one in zip(shares, found, strict=True):
        if one is None and share < nearest - _SHARE_ERROR:
            return None
    together = [one for one in events if one.share - nearest < _SAME_SHARE]
    # A segment that shrinks to 0 may let other inequalities fail with it; it is the event.
    return min(together, key=lambda one: one.failed.kind != DURATION)


def _may_be(family: Family, one: Event, other: Event) -> bool:
    """True if an event may be another one, of a shrinking segment, which is known better.

    Where two conditions vanish together, one of them to higher order, its zero is that of rounding
    and may be found before the other's. The uncertainties of equal events are about equal.
    """
    errors = one.solution.uncertainties
    if other.failed.kind != DURATION or max(errors) <= 2 * max(other.solution.uncertainties):
        return False
    both = zip(*(family.problem.values(at.solution.orbit) for at in (one, other)), strict=True)
    return all(abs(a - b) <= error for (a, b), error in zip(both, errors, strict=True))


def hides(family: Family, old: Spot, new: Spot, event: Event) -> bool:
    """True if another inequality fails, or the path is lost, just before the event.

    False for a failed minimum, without a test.
    """
    if event.failed.kind == MINIMUM:
        return False
    change = new.u - old.u
    length, share = float(np.linalg.norm(change)), _BEFORE_SHARE
    nearer = (near / length for near in _BEFORE_LENGTHS if near < share * length)
    for before in (share, *nearer):
        u = old.u + max(event.share - before, event.share / 2) * change
        solution = family.corrected(u, change / length)
        if solution is None:
            return True
        orbit = solution.at.orbit
        held = inequalities(family.numbers, orbit.itinerary, orbit.system, family.segments)
        if any(one.value <= 0 for one in held):
            return True
    return False


def _locate(family: Family, old: Spot, new: Spot, failed: Inequality, share: float) -> Event | None:
    orbit, there = family.orbit(old.u + share * (new.u - old.u)), new.orbit
    alone = len(family.problem.axes[0].path.scene.facts.STOPS) == 1
    if failed.guard is Guard.GAP and alone:
        # A single stop is on one side only: its touch has no mirror image.
        orbit, there = whole_orbit(orbit), whole_orbit(there)
    itinerary, segment = orbit.itinerary, failed.segment
    change = Exchange(itinerary, orbit.z, tuple(range(len(itinerary))))
    if failed.kind != DURATION:
        try:
            change, segment = insert_segment(
                family.numbers, itinerary, orbit.z, there.system, failed
            )
        except InvalidInput:
            return None
    vanishing = zero_segments(change.itinerary, change.z, segment)
    if failed.kind == DURATION:
        vanishing = zero_segments(itinerary, there.z, segment)
    kept = [change.kept[k] for k in family.segments]
    if None in kept:
        return None
    segments = (*(k for k in kept if k is not None), *vanishing)
    like = replace(orbit, itinerary=change.itinerary, z=change.z)
    collapse = _collapse(itinerary, failed, len(like.z))
    names = () if family.critical is None else (family.critical,)
    found = family.solved(like, names, segments, collapse)
    if found is None:
        return None
    parts = found.orbit.durations[[segment - 1, segment + 1 - len(found.orbit.durations)]]
    if failed.kind == MINIMUM and min(parts) < 0:
        return None  # it has moved into a neighbour of the segment
    found = found._replace(segments=(*segments[: len(kept)][:1], segment))
    if collapse is None and failed.kind != DURATION:
        q = family.axes[-1].share(found.orbit.values)
        along = float((q - old.u[-1]) / (new.u - old.u)[-1])
    else:
        here = found.orbit if collapse is None else collapse.orbit(found.orbit)
        along = _share(family, old, new, found._replace(orbit=here))
    outside = _OUTSIDE_SHARE
    if not -outside <= along <= 1 + outside:
        return None
    return Event(failed, segment, change, found, along)


def _collapse(itinerary: Itinerary, failed: Inequality, size: int) -> Collapse | None:
    """Orbits without the segment that an inequality inserts, from unknowns of so many entries.

    None if nothing is inserted, and if that itinerary has one segment.
    """
    if failed.kind == DURATION or itinerary.segments[0].guard is None:
        return None
    many, first = kinds.DURATIONS + len(itinerary), kinds.DURATIONS + failed.segment
    if failed.kind == MINIMUM:  # the parts before and after it are one
        of = [*range(first), *([first] * 3), *range(first + 1, many)]
        return Collapse(itinerary, np.eye(many)[:, of])
    inserted = range(first + 1, first + 1 + size - many)
    return Collapse(itinerary, np.delete(np.eye(size), inserted, axis=0))


def _failing_share(held: list[Inequality], failed: Inequality) -> float:
    """Share of a step after which an inequality fails, from its values at both ends."""
    before = matching(held, failed)
    if before is None or before.value <= 0:
        return 1.0
    return float(before.value / (before.value - failed.value))


def matching(held: list[Inequality], wanted: Inequality) -> Inequality | None:
    """Inequality of the same kind, segment and guard; of several minima the nearest in time."""
    same = [one for one in held if one[:3] == wanted[:3]]
    return min(same, key=lambda one: abs(float(one.time - wanted.time)), default=None)
