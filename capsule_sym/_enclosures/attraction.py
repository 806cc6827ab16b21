"""The motion from rest, proved to tend to a periodic one."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from capsule_sym import simulate
from capsule_sym._enclosures.balls import Unproved, arb, ball, matrix, precision
from capsule_sym._enclosures.trajectories import Attraction, Step, System, contraction
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import guard_between
from capsule_sym._parameters import Parameters

_RADII = (1e-4, 1e-5, 1e-6, 1e-8)
_BITS, _BITS_A_PERIOD = 256, 12  # a box grows from period to period
_REPEATED = 1e-10  # change over a period below which the smallest box is entered


@dataclass(frozen=True)
class Tendency:
    """A motion that is proved to enter a contracted box after some periods, and its itinerary."""

    itinerary: tuple[int, ...]
    periods: int
    attraction: Attraction


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


def tendency(values: Mapping[str, object], periods: int = 400) -> Tendency:
    """The periodic motion to which that from (0, 0, 0) at tau = 0 tends; raises Unproved.

    `values` are the seven parameters by name, decimals as text or fraction.
    """
    given = {name: float(Fraction(str(values[name]))) for name in PARAMETERS}
    run = simulate(Parameters(**given), periods=periods)
    settled = _settled(run, periods)
    with precision(_BITS + _BITS_A_PERIOD * settled):
        exact = {name: ball(values[name]) for name in PARAMETERS}
        system = System(exact)
        period = 2 * arb.pi() / exact["omega"]
        state = matrix(3, 1)
        for turn in range(settled):
            state = system.passage(state, steps_of(run, turn, turn + 1), period).state
        steps = steps_of(run, settled, settled + 1)
        last: Unproved | None = None
        for radius in _RADII:
            try:
                found = contraction(system, state, steps, period, radius)
            except Unproved as error:
                last = error
                continue
            return Tendency(itinerary_of(steps), settled, found)
        raise last or Unproved("attraction", "no box was tried")


def _settled(run: Trajectory, periods: int) -> int:
    """The first period whose begin is that of the next one within a small part of a radius."""
    omega = run.parameters.omega
    times = [math.tau / omega * k for k in range(periods)]
    states = run(times)
    for k in range(periods - 1):
        if max(abs(states[k + 1] - states[k])) < _REPEATED:
            return k
    raise Unproved("attraction", f"the motion from rest has not settled after {periods} periods")


def itinerary_of(steps: list[Step]) -> tuple[int, ...]:
    """The fields of a turn: the first and the last segment are parts of one."""
    fields = [step.field for step in steps]
    if len(fields) > 1 and fields[0] == fields[-1]:
        del fields[-1]
    return tuple(fields)
