"""Enclosure of a run, with its double-precision segments as the guess."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    ball,
    matrix,
    precision,
)
from capsule_sym._enclosures.passage.exchanges import TIME, hull
from capsule_sym._enclosures.passage.segments import BALLS, Interval, Passage, Step
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._orbits.shooting.itinerary import guard_between

_BITS, _BITS_A_SEGMENT = 128, 4  # roundings grow from segment to segment


def steps_of(trajectory: Trajectory, first: float, last: float) -> list[Step]:
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
            found.append(Step(segment.field, reach - begin, None))
            break
        guard = guard_between(segment.field, segments[k + 1].field)
        found.append(Step(segment.field, end - begin, guard))
    return found


def itinerary_of(steps: list[Step]) -> tuple[int, ...]:
    """Fields of a turn: the first and the last segment are parts of one."""
    fields = [step.field for step in steps]
    if len(fields) > 1 and fields[0] == fields[-1]:
        del fields[-1]
    return tuple(fields)


def exactly(value: float) -> str:
    """Decimal as which a double prints, without an exponent."""
    return format(Decimal(repr(float(value))), "f")


@dataclass(frozen=True)
class EnclosedRun:
    """Instants of a run's switches, counted from its start, and its states (3, 1) in balls.

    The first state is the start, the last the end, and those between are at the switches.
    """

    times: tuple[Ball, ...]
    states: tuple[Matrix, ...]

    @property
    def state(self) -> Matrix:
        """The state at the end."""
        return self.states[-1]


def enclose_run(trajectory: Trajectory, exact: Mapping[str, str] | None = None) -> EnclosedRun:
    """Enclose a run in double precision: its segments are proved, its end is in a box.

    The start and the parameters are the decimals as which the run's doubles print, or those in
    `exact` by name. Raises Unproved with the segment that fails.
    """
    segments = trajectory.segments
    if not segments or not trajectory.success:
        raise Unproved(
            "first switch", "the run has no segment" if trajectory.success else trajectory.message
        )
    with precision(_BITS + _BITS_A_SEGMENT * len(segments)):
        values = {
            name: ball((exact or {}).get(name, exactly(value)))
            for name, value in trajectory.parameters.to_dict().items()
        }
        period = 2 * arb.pi() / values["omega"]
        begin, end = trajectory.origin[0], segments[-1].end
        phases = [ball(exactly(one.phase)) for one in (begin, end)]
        total = (end.period - begin.period) * period + phases[1] - phases[0]
        start = matrix(3, 2, ((i, 0, ball(exactly(x))) for i, x in enumerate(trajectory.origin[1])))
        steps = [
            Step(one.field, float(one.duration), guard_between(one.field, after.field))
            for one, after in pairwise(segments)
        ]
        steps.append(Step(segments[-1].field, float(segments[-1].duration), None))
        passage = Passage(values, Interval(values["alpha"]), BALLS)
        begun = passage.start(start, values["omega"] * phases[0])
        ends = [hull(one.ended) for one in passage.segments(begun, steps, total)]
        times = tuple(one[TIME, 0] for one in ends[:-1])
        return EnclosedRun(times, tuple(map(_first_three, [start, *ends])))


def _first_three(found: Matrix) -> Matrix:
    return matrix(3, 1, ((i, 0, found[i, 0]) for i in range(3)))
