"""Where, between two states of a family, a bifurcation is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.continuation.bifurcations import (
    SMOOTH,
    SmoothEvent,
    rotations,
    zero_of_test_function,
)
from capsule_sym._orbits.continuation.events import (
    CUSP,
    FOLD,
    NEIMARK_SACKER,
    BorderCollision,
)
from capsule_sym._orbits.continuation.family import Family
from capsule_sym._orbits.continuation.path import Vector, corrected
from capsule_sym._orbits.continuation.states import Event, State
from capsule_sym._orbits.shooting.admissibility import (
    DURATION,
    LANDING,
    MINIMUM,
    Inequality,
    inequalities,
)
from capsule_sym._orbits.shooting.changes import Change, insert_segment
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.symmetry import whole_orbit

_TOGETHER = 1e-7  # shares of a step that are one event
_BEFORE = 1e-3  # share of a step before an event at which all else is asked to hold
_NEAR = (1e-6, 1e-8)  # and distances along it, where these are nearer
_DOUBT = 0.1  # of a step: by how much its ends may mislead about where an inequality fails


def smooth_between(
    family: Family, old: State, new: State, until: float
) -> list[tuple[str, SmoothEvent]]:
    """The smooth bifurcations between two states of one itinerary, up to a share, in order."""
    change = new.u - old.u
    normal = change / np.linalg.norm(change)

    def between(share: float) -> Orbit | None:
        solution = corrected(family.equations, old.u + share * change, normal)
        return solution.at.made if solution else None

    names = [name for name in family.watched if old.tests[name] * new.tests[name] < 0]
    # The parameters turn back along a curve of folds.
    turns = family.critical == FOLD and float(old.tangent[-2:] @ new.tangent[-2:]) < 0
    found = []
    for name in (*names, *((CUSP,) if turns else ())):
        one = _meeting(family, name, old, new, between)
        if one is None and name in SMOOTH:
            one = zero_of_test_function(name, between)
        if one is not None and one.share <= until:
            found.append((name, one))
    return sorted(found, key=lambda pair: pair[1].share)


def _meeting(
    family: Family, name: str, old: State, new: State, between: Callable[[float], Orbit | None]
) -> SmoothEvent | None:
    """Where a test function vanishes between two states of a curve, by its extended system.

    None where that has no solution between: what changes its sign at a pole has no zero.
    """
    if name == CUSP:
        first, last = (float(np.linalg.norm(state.tangent[-2:])) for state in (old, new))
    else:
        first, last = abs(old.tests[name]), abs(new.tests[name])
    guess = between(first / (first + last))
    conditions = tuple(one for one in (family.critical, name) if one is not None)
    zero_segment = () if family.zero_segment is None else (family.zero_segment,)
    found = family.solved(guess, conditions, zero_segment) if guess is not None else None
    if found is None:
        return None
    step = new.u - old.u
    share = float(step @ (family.unknowns(found.z, found.values) - old.u) / (step @ step))
    if not 0 <= share <= 1:
        return None
    orbit, errors = found.orbit(family.numbers.name), found.uncertainties
    residual, steps = float(found.residual), found.iterations
    if name == NEIMARK_SACKER and not rotations(orbit):
        return None
    return SmoothEvent(share, orbit, 0.0, residual, steps, orbit.status, errors)


def first_event(family: Family, old: State, new: State, failing: list[Inequality]) -> Event | None:
    """The first event between two states; None if nothing fails or it is not located."""
    shares = [_failing_share(old.held, failed) for failed in failing]
    found = [_locate(family, old, new, *one) for one in zip(failing, shares, strict=True)]
    events = [one for one in found if one is not None]
    if not events:
        return None
    nearest = min(one.share for one in events)
    for share, one in zip(shares, found, strict=True):
        if one is None and share < nearest - _DOUBT:
            return None
    together = [one for one in events if one.share - nearest < _TOGETHER]
    # A segment that shrinks to nothing may take other inequalities with it: it is the event.
    return min(together, key=lambda one: one.failed.kind != DURATION)


def hides(family: Family, old: State, new: State, event: Event) -> bool:
    """Whether another inequality fails before the event, which beyond it is not asked for."""
    if event.failed.kind == MINIMUM:
        return False
    change = new.u - old.u
    length = float(np.linalg.norm(change))
    for before in (_BEFORE, *(near / length for near in _NEAR if near < _BEFORE * length)):
        u = old.u + max(event.share - before, event.share / 2) * change
        solution = corrected(family.equations, u, change / length)
        if solution is None:
            return True
        orbit = solution.at.made
        held = inequalities(family.numbers, orbit.itinerary, orbit.system, family.zero_segment)
        if any(one.value <= 0 for one in held):
            return True
    return False


def _locate(
    family: Family, old: State, new: State, failed: Inequality, share: float
) -> Event | None:
    orbit, there = family.orbit(old.u + share * (new.u - old.u)), new.orbit
    if failed.guard is Guard.GAP:
        # The second spring is on one side only: its touch has no mirror image.
        orbit, there = whole_orbit(orbit), whole_orbit(there)
    itinerary = orbit.itinerary
    if failed.kind == DURATION:
        change, segment = (
            Change(itinerary, orbit.z, tuple(range(len(itinerary)))),
            failed.segment,
        )
    else:
        try:
            change, segment = insert_segment(
                family.numbers, itinerary, orbit.z, there.system, failed
            )
        except InvalidInput:
            return None
    segments: tuple[int, ...] = (segment,)
    if family.zero_segment is not None:
        before = change.kept[family.zero_segment]
        if before is None:
            return None
        segments = (before, segment)
    like = replace(orbit, itinerary=change.itinerary, z=change.z)
    names = () if family.critical is None else (family.critical,)
    located = family.solved(like, names, segments)
    if located is None:
        return None
    here = _collapsed(family, old, failed, located)
    step = new.u - old.u
    if here is None:
        q = family.unknowns(old.orbit.z, located.values)[-1]
        along = float((q - old.u[-1]) / step[-1])
    else:
        along = float(step @ (here - old.u) / (step @ step))
    if not -1e-6 <= along <= 1 + 1e-6:
        return None
    return Event(failed, segment, change, located, along)


def _collapsed(
    family: Family, old: State, failed: Inequality, located: BorderCollision
) -> Vector | None:
    """The unknowns, in the present itinerary, of an event in that with another segment."""
    z, segment = located.z, 4 + failed.segment
    if failed.kind == LANDING:
        z = np.delete(z, segment + 1)
    elif failed.kind == MINIMUM:
        if family.itinerary.segments[0].guard is None:
            return None
        z = np.array(
            [*z[:segment], z[segment] + z[segment + 1] + z[segment + 2], *z[segment + 3 :]]
        )
    return family.unknowns(z[: 4 + len(family.itinerary)], located.values)


def _failing_share(held: list[Inequality], failed: Inequality) -> float:
    """The share of a step after which an inequality fails, by its values at both ends."""
    before = matching(held, failed)
    if before is None or before.value <= 0:
        return 1.0
    return float(before.value / (before.value - failed.value))


def matching(held: list[Inequality], wanted: Inequality) -> Inequality | None:
    """The inequality of the same kind, segment and guard, of several minima the nearest in time."""
    same = [
        i
        for i in held
        if (i.kind, i.segment, i.guard) == (wanted.kind, wanted.segment, wanted.guard)
    ]
    return min(same, key=lambda i: abs(float(i.time - wanted.time)), default=None)
