"""Runs in double precision as guesses of passages."""

from __future__ import annotations

import math
from bisect import bisect_right

from capsule_sym._enclosures.interface import Leg
from capsule_sym._orbits.interface import guard_between
from capsule_sym.results import Trajectory


def steps_of(trajectory: Trajectory, first: float, last: float) -> list[Leg]:
    """The segments of a run between two times, both in excitation periods."""
    turn = math.tau / trajectory.parameters.omega
    whole = math.floor(first)

    def time(period: int, phase: float) -> float:
        return (period - whole) * turn + phase - (first - whole) * turn

    found, reach = [], (last - first) * turn
    segments = trajectory.segments
    begun = bisect_right(
        segments, 0.0, key=lambda one: time(one.start.period, float(one.start.phase))
    )
    for k in range(max(begun - 1, 0), len(segments)):
        segment = segments[k]
        begin = max(0.0, time(segment.start.period, float(segment.start.phase)))
        end = time(segment.end.period, float(segment.end.phase))
        if end <= 0 or begin >= reach:
            continue
        if end >= reach or k + 1 == len(segments):
            found.append(Leg(segment.field, reach - begin, None))
            break
        guard = guard_between(segment.field, segments[k + 1].field)
        found.append(Leg(segment.field, end - begin, guard))
    return found


def itinerary_of(steps: list[Leg]) -> tuple[int, ...]:
    """Fields of a turn: the first and the last segment are parts of one."""
    fields = [step.field for step in steps]
    if len(fields) > 1 and fields[0] == fields[-1]:
        del fields[-1]
    return tuple(fields)
