"""Bifurcations between two states of a family: by test functions, and by inequalities that fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.expansion import Guard
from capsule_sym._map.isolation import LEAST, brent
from capsule_sym._orbits.continuation.families.arclength import Vector
from capsule_sym._orbits.continuation.families.family import Family
from capsule_sym._orbits.continuation.families.states import Event, SmoothEvent, State
from capsule_sym._orbits.continuation.points.conditions import (
    evaluate_test_functions,
    has_rotations,
    noise,
)
from capsule_sym._orbits.continuation.points.extended import EventSolution
from capsule_sym._orbits.continuation.points.kinds import CUSP, FOLD, NEIMARK_SACKER, SMOOTH
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

_STEP = 1e-4  # of the way between two states, for the slope of a test function
_EXACT = 1e-14  # of the way, by which Brent's method may miss a root
_OUTSIDE = 1e-6  # of the way, by which an event may seem to be beyond its ends

Between = Callable[[float], Orbit | None]


def smooth_between(family: Family, old: State, new: State, until: float) -> list[SmoothEvent]:
    """The smooth bifurcations between two states of one itinerary, up to a share, in order."""
    change = new.u - old.u
    normal = change / np.linalg.norm(change)

    def between(share: float) -> Orbit | None:
        solution = family.corrected(old.u + share * change, normal)
        return solution.at.made if solution else None

    names = [name for name in family.watched if _changes_sign(name, old, new)]
    # The parameters turn back along a curve of folds.
    if family.critical == FOLD and float(old.tangent[-2:] @ new.tangent[-2:]) < 0:
        names.append(CUSP)
    found = []
    for name in names:
        one = _solved_between(family, name, old, new, between)
        if one is None and name in SMOOTH:
            one = zero_of_test_function(name, between)
            ends = (np.array(family.problem.values(state.orbit)) for state in (old, new))
            one = one and _scaled(one, abs(np.subtract(*ends)))
        if one is not None and one.share <= until:
            found.append(one)
    return sorted(found, key=lambda one: one.share)


def _changes_sign(name: str, old: State, new: State) -> bool:
    """Whether a test function vanishes on the way; one that is rounding at both ends does not.

    All multipliers of a motion without dissipation lie on the unit circle, on all of its branch.
    """
    ends = old.tests[name], new.tests[name]
    if not ends[0] * ends[1] < 0:
        return False
    return name not in SMOOTH or any(
        abs(end) > noise(state.orbit) for end, state in zip(ends, (old, new), strict=True)
    )


def _scaled(one: SmoothEvent, widths: Vector) -> SmoothEvent:
    """The event with uncertainties of the parameters, from that of its share of the way."""
    uncertainties = tuple((widths * one.solution.uncertainties[0]).tolist())
    return one._replace(solution=one.solution._replace(uncertainties=uncertainties))


def _solved_between(
    family: Family, name: str, old: State, new: State, between: Between
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
    segments = () if family.zero_segment is None else (family.zero_segment,)
    found = family.solved(guess, conditions, segments) if guess is not None else None
    if found is None or not 0 <= (share := _share(family, old, new, found)) <= 1:
        return None
    if name == NEIMARK_SACKER and not has_rotations(found.orbit):
        return None
    return SmoothEvent(name, share, found)


def _share(family: Family, old: State, new: State, found: EventSolution) -> float:
    """How far on the way between two states an orbit of the family is."""
    step = new.u - old.u
    return float(step @ (family.unknowns(found.orbit) - old.u) / (step @ step))


class _Lost(Exception):
    """The path between two points cannot be followed."""


def zero_of_test_function(name: str, between: Between) -> SmoothEvent | None:
    """The orbit of a smooth bifurcation between two orbits where the test's signs differ.

    `between` gives the path's orbit at a share in [0, 1] of the way; the uncertainty is one of that
    share. Where the path or the root is lost on the way the event is not solved. None where the
    signs do not differ, and where the multipliers are not those of the bifurcation: a real pair
    mu, 1/mu for that of Neimark-Sacker.
    """
    tried = 0

    def at(share: float) -> Orbit:
        orbit = between(share)
        if orbit is None:
            raise _Lost
        return orbit

    def test(share: float) -> float:
        nonlocal tried
        tried += 1
        return evaluate_test_functions(at(share))[name]

    try:
        sides = at(0.0), at(1.0)
    except _Lost:
        return None
    known = {float(k): evaluate_test_functions(one)[name] for k, one in enumerate(sides)}
    if not known[0.0] * known[1.0] < 0:
        return None
    share, orbit, residual, doubt, solved = 0.0, sides[0], abs(known[0.0]), 1.0, False
    try:
        share = brent(lambda t: known[t] if t in known else test(t), 0.0, 1.0, 5e-16, LEAST)
        orbit, iterations = at(share), tried
        residual = abs(evaluate_test_functions(orbit)[name])
        low, high = max(share - _STEP, 0.0), min(share + _STEP, 1.0)
        slope, error = abs(test(high) - test(low)) / (high - low), noise(orbit)
        solved = residual <= error + slope * _EXACT and orbit.success
        doubt = error / slope if solved else 1.0
        rotating = has_rotations(orbit)
    except _Lost:
        share, orbit, iterations = 0.0, sides[0], tried
        rotating = all(map(has_rotations, sides))
    if name == NEIMARK_SACKER and not rotating:
        return None
    orbit, largest = replace(orbit, iterations=iterations), max(residual, float(orbit.residual))
    return SmoothEvent(name, share, EventSolution(orbit, (), largest, (doubt,)), solved)


def first_event(family: Family, old: State, new: State, failing: list[Inequality]) -> Event | None:
    """The first event between two states; None if nothing fails or it is not located."""
    shares = [_failing_share(old.held, failed) for failed in failing]
    found = [_locate(family, old, new, *one) for one in zip(failing, shares, strict=True)]
    events = [one for one in found if one is not None]
    if not events:
        return None
    nearest = min(one.share for one in events)
    for share, one in zip(shares, found, strict=True):
        if one is None and share < nearest - family.settings.share_error:
            return None
    together = [one for one in events if one.share - nearest < family.settings.same_share]
    # A segment that shrinks to nothing may take other inequalities with it: it is the event.
    return min(together, key=lambda one: one.failed.kind != DURATION)


def hides(family: Family, old: State, new: State, event: Event) -> bool:
    """Whether another inequality fails before the event, which beyond it is not asked for."""
    if event.failed.kind == MINIMUM:
        return False
    change = new.u - old.u
    length, share = float(np.linalg.norm(change)), family.settings.before_share
    nearer = (near / length for near in family.settings.before_lengths if near < share * length)
    for before in (share, *nearer):
        u = old.u + max(event.share - before, event.share / 2) * change
        solution = family.corrected(u, change / length)
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
    itinerary, segment = orbit.itinerary, failed.segment
    change = Change(itinerary, orbit.z, tuple(range(len(itinerary))))
    if failed.kind != DURATION:
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
    found = family.solved(like, names, segments)
    if found is None:
        return None
    here = _collapsed(family, failed, found)
    if here is None:
        q = family.axes[-1].share(found.orbit.values)
        along = float((q - old.u[-1]) / (new.u - old.u)[-1])
    else:
        along = _share(family, old, new, found._replace(orbit=here))
    if not -_OUTSIDE <= along <= 1 + _OUTSIDE:
        return None
    return Event(failed, segment, change, found, along)


def _collapsed(family: Family, failed: Inequality, found: EventSolution) -> Orbit | None:
    """The orbit of an event, its unknowns those of the itinerary without the segment.

    None where that itinerary has one segment.
    """
    z, segment = found.orbit.z, 4 + failed.segment
    if failed.kind == LANDING:
        z = np.delete(z, segment + 1)
    elif failed.kind == MINIMUM:
        if family.itinerary.segments[0].guard is None:
            return None
        z = np.array([*z[:segment], sum(z[segment : segment + 3]), *z[segment + 3 :]])
    return replace(found.orbit, z=z[: 4 + len(family.itinerary)])


def _failing_share(held: list[Inequality], failed: Inequality) -> float:
    """The share of a step after which an inequality fails, by its values at both ends."""
    before = matching(held, failed)
    if before is None or before.value <= 0:
        return 1.0
    return float(before.value / (before.value - failed.value))


def matching(held: list[Inequality], wanted: Inequality) -> Inequality | None:
    """The inequality of the same kind, segment and guard, of several minima the nearest in time."""
    same = [one for one in held if one[:3] == wanted[:3]]
    return min(same, key=lambda one: abs(float(one.time - wanted.time)), default=None)
