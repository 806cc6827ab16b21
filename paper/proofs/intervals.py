"""Section 4 complete: every bifurcation on a branch over alpha, and every interval between."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from capsule_sym import Parameters, continue_orbit, solve_orbit
from capsule_sym._enclosures.interface import (
    Ball,
    Proved,
    Shooting,
    Signs,
    Unproved,
    arb,
    ball,
    enclose,
    guess_of,
    held,
    precision,
    prove_event,
    restarted,
    shooting_of,
)
from capsule_sym._orbits.interface import PARAMETERS
from capsule_sym.results import Bifurcation, Itinerary, Orbit
from paper.proofs.branches import Box, march

THRESHOLD_BITS, BRANCH_BITS = 320, 128
GAP = 6e-13  # radius of the balls around bifurcations that are left out
_NEAR = 0.05  # distance from a touch within which the segment's duration is the parameter
_SHARE = 0.4  # of an interval, at most
Report = Callable[[Box], object]


@dataclass(frozen=True)
class ProvedInterval:
    """An open interval of alpha between two bifurcations, proved except for the gaps.

    `low` and `high` are the least and largest alpha proved, `boxes` the number of boxes.
    """

    itinerary: Itinerary
    low: Ball
    high: Ball
    boxes: int


def approximate(
    parameters: Parameters, first: float, last: float
) -> tuple[tuple[Bifurcation, ...], Orbit]:
    """The bifurcations between two amplitudes, in double precision, and the orbit at the first."""
    start = solve_orbit(parameters.replace(alpha=first))
    if not start.success:
        raise Unproved("search", start.message)
    branch = continue_orbit(start, "alpha", last)
    return branch.bifurcations, start


def threshold(found: Bifurcation, exact: Mapping[str, Any]) -> Proved:
    """A bifurcation with a segment of duration 0, proved; raises Unproved."""
    if found.segment is None:
        raise Unproved("type", f"a {found.type} has no segment of duration 0")
    with precision(THRESHOLD_BITS):
        return prove_event(found.orbit, (found.segment,), (found.parameter,), exact)


@dataclass(frozen=True)
class _End:
    """One end of an interval: the orbit there, and the segment inserted like a square root."""

    shooting: Shooting
    columns: Sequence[Ball]
    value: Ball
    segment: int | None = None
    gap: float = 0.0

    def edge(self, sign: int) -> float:
        """Alpha at the end of the gap, or just beyond the value where there is none."""
        found = float((self.value + sign * self.gap).mid())
        return found if self.gap else float(np.nextafter(found, -sign * np.inf))


def _ends(event: Proved) -> tuple[_End, _End]:
    """Both sides of a bifurcation: the itinerary with the inserted segment, and the other one."""
    assert event.other is not None
    value = event.values["alpha"]
    zero_segment = event.segments[0] if event.order == 2 else None
    with_segment = _End(event.tube.shooting, event.tube.hull(), value, zero_segment, GAP)
    return with_segment, _End(event.other.shooting, event.other.centre, value, None, GAP)


def _rotated(end: _End, itinerary: Itinerary) -> _End | None:
    """The same end for a rotation of its itinerary; None if this itinerary is none."""
    n, own = len(itinerary), end.shooting.itinerary
    shifts = [k for k in range(n) if len(own) == n and own.rotated(k).fields == itinerary.fields]
    if not shifts:
        return None
    if n == 1:
        return end
    shooting, columns = rotated(end.shooting, end.columns, shifts[0])
    segment = None if end.segment is None else (end.segment - shifts[0]) % n
    return replace(end, shooting=shooting, columns=columns, segment=segment)


def rotated(shooting: Shooting, columns: Sequence[Ball], by: int) -> tuple[Shooting, list[Ball]]:
    """The equations and the columns of the same orbit, begun at another segment."""
    n, given = len(shooting.itinerary), shooting.parameters(columns)
    itinerary = shooting.itinerary.rotated(by)
    other = Shooting(itinerary, [given[name] for name in PARAMETERS], shooting.varied)
    found = shooting.evaluate(columns, shooting.fields(columns))
    segments = [(by + k) % n for k in range(n)]
    return other, restarted(shooting, columns, found.nodes, other, segments, found.durations)


def _at(shooting: Shooting, columns: Sequence[Ball], column: int, value: float) -> list[Ball]:
    """The orbit near these columns at one value of a column."""
    there = list(columns)
    there[column] = arb(value)
    return enclose(shooting, there, {**held(shooting), column: 0.0}).hull()


def _inserted(end: _End, sign: int, length: float) -> tuple[int, float, float]:
    """Column, first and last duration of the inserted segment, as the parameter next to an end."""
    assert end.segment is not None
    shooting, there = end.shooting, end.columns
    column, alpha = shooting.durations[end.segment], shooting.parameter("alpha")

    def distance(h: float) -> float:
        nonlocal there
        there = _at(shooting, there, column, h)
        return float((sign * (there[alpha] - end.value)).mid())

    least = math.sqrt(end.gap)
    for _ in range(3):
        least *= (0.5 * end.gap / distance(least)) ** 0.5
    most, reached = least, 0.5 * end.gap
    while reached < min(_NEAR, _SHARE * length):
        ahead = distance(1.3 * most)
        if ahead < reached:  # the branch turns back: alpha is no function of the duration
            break
        most, reached = 1.3 * most, ahead
    return column, least, most


def prove_interval(low: _End, high: _End, report: Report = lambda box: None) -> ProvedInterval:
    """Every orbit of one itinerary between two ends, glued from box to box; raises Unproved."""
    watch, shooting = Signs(), low.shooting
    alpha, length = shooting.parameter("alpha"), float((high.value - low.value).mid())
    latest: Box | None = None
    count = 0

    def go(guess: Sequence[Ball], column: int, begin: float, end: float, step: float) -> list[Ball]:
        nonlocal latest, count
        boxes = march(shooting, guess, column, begin, end, step=step, watch=watch, before=latest)
        for latest in boxes:
            report(latest)
            count += 1
        assert latest is not None
        return latest.at(1)

    columns, begin, step = low.columns, low.edge(1), 0.1 * low.gap or 1e-4
    first = ball(begin)
    if low.segment is not None:
        column, least, most = _inserted(low, 1, length)
        first = _at(shooting, low.columns, column, least)[alpha]
        columns = _at(shooting, go(columns, column, least, most, 0.2 * least), column, most)
        begin, step = float(np.nextafter(float(columns[alpha].lower()), 0.0)), 1e-4
    if high.segment is None:
        goal = high.edge(-1)
        go(columns, alpha, begin, goal, step)
        last = ball(goal)
    else:
        column, least, most = _inserted(high, -1, length)
        goal = float(_at(shooting, high.columns, column, most)[alpha].mid())
        columns = _at(shooting, go(columns, alpha, begin, goal, step), alpha, goal)
        most = float(columns[column].upper()) * (1 + 1e-15)
        go(columns, column, most, least, 0.05 * most)
        last = _at(shooting, high.columns, column, least)[alpha]
    return ProvedInterval(shooting.itinerary, first, last, count)


def prove_intervals(
    events: Sequence[Proved],
    start: Orbit,
    exact: Mapping[str, Any],
    first: Ball,
    last: Ball,
    report: Report = lambda box: None,
) -> Iterator[ProvedInterval]:
    """The intervals between the bifurcations of a branch, in order; raises Unproved.

    Neighbouring intervals are the two sides of one proved bifurcation.
    """
    with precision(BRANCH_BITS):
        shooting = shooting_of(start.itinerary, start.values, ("alpha",), exact)
        low = _End(shooting, guess_of(shooting, start), first)
        for event in events:
            sides = _ends(event)
            fitting = [_rotated(side, low.shooting.itinerary) for side in sides]
            high = next((end for end in fitting if end is not None), None)
            if high is None:
                raise Unproved(
                    "gluing", f"no side of {event.type} has the itinerary {low.shooting.itinerary}"
                )
            yield prove_interval(low, high, report)
            low = sides[1 - fitting.index(high)]
        yield prove_interval(low, _End(low.shooting, low.columns, last), report)
