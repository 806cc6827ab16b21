"""Enclosure of a run, with its double-precision segments as the guess."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from itertools import pairwise

from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    ball,
    precision,
)
from capsule_sym._enclosures.passage.exchanges import TIME, hull
from capsule_sym._enclosures.passage.segments import Leg, Passage
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._orbits.shooting.itinerary import guard_between

_BITS, _BITS_A_SEGMENT = 128, 4  # roundings grow from segment to segment


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

    The start and the parameters are the decimals as which the run's doubles print; `exact` replaces
    parameters by name. Raises Unproved with the segment that fails, for a run that did not finish,
    and for one without segments; InvalidInput if segments were not kept.
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
        start = arb_mat([[ball(exactly(x))] for x in trajectory.origin[1]])
        steps = [
            Leg(one.field, float(one.duration), guard_between(one.field, after.field))
            for one, after in pairwise(segments)
        ]
        steps.append(Leg(segments[-1].field, float(segments[-1].duration), None))
        passage = Passage(values)
        begun = passage.start(start, values["omega"] * phases[0])
        ends = [hull(one.ended) for one in passage.segments(begun, steps, total)]
        times = tuple(one[TIME, 0] for one in ends[:-1])
        return EnclosedRun(times, tuple(arb_mat(one.tolist()[:3]) for one in [start, *ends]))
