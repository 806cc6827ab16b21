"""The reference map takes a segment that the core leaves open, from and to its state records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.reference import Journey, Run
from capsule_sym._map.segments import plane_name, plane_number
from capsule_sym._map.transitions import State

_ROOM = 256  # segments of the reference map at a time

__all__ = ["Run", "step", "write"]


def step(run: Run, record: NDArray[np.void], periods: int, most: int = _ROOM) -> Journey:
    """One segment of the reference map from a state record of the core.

    More, up to `most`, as long as 50 digits have to settle them, or they do not advance: a record
    has no digits, nor a count of such segments, to go on from.
    """
    x_r, gap, v_r, v_c, angle, rest, position, turn, bound, plane, _ = record.tolist()
    source = plane_name(plane)
    state = State(x_r, gap, v_r, v_c, angle, bound, rest)
    journey = run.depart(state, source, turn, position)
    if journey.departure is not None and not source and v_c == 0:
        journey = journey._replace(source=f"Σ{journey.departure.field}")
    journey, taken = run.follow(journey, periods, 1), 1
    while (run.exact is not None or run.still) and taken < most:
        if journey.departure is None or journey.turns >= periods:
            break
        taken += 1
        journey = run.follow(journey, periods, taken)
    return journey


def write(record: NDArray[np.void], journey: Journey) -> None:
    """Puts where a run of the reference map stands into a state record of the core."""
    state, source = journey.state, journey.source
    plane = plane_number(source)
    field = journey.departure.field if journey.departure else 0
    rest, place = state.angle_rest, (journey.position, journey.turns, state.bound, plane, field)
    record[...] = (*state[:5], rest, *place)
