"""The reference map takes a segment that the core leaves open, from and to its state records."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from capsule_sym._map.reference import Run, RunState
from capsule_sym._map.segments import plane_name, plane_number
from capsule_sym._map.transitions import State

_ROOM = 256  # segments of the reference map at a time

__all__ = ["Run", "step", "write"]


def step(run: Run, record: NDArray[np.void], periods: int, most: int = _ROOM) -> RunState:
    """One segment of the reference map from a state record of the core.

    More, up to `most`, as long as 50 digits have to escalate them, or they do not advance: a record
    has no digits, nor a count of such segments, to go on from.
    """
    x_r, gap, v_r, v_c, angle, rest, position, period, bound, plane, _ = record.tolist()
    source = plane_name(plane)
    state = State(x_r, gap, v_r, v_c, angle, bound, rest)
    run_state = run.begin_segment(state, source, period, position)
    if run_state.begin is not None and not source and v_c == 0:
        run_state = run_state._replace(source=f"Σ{run_state.begin.field}")
    run_state, taken = run.follow(run_state, periods, 1), 1
    while (run.exact is not None or run.still) and taken < most:
        if run_state.begin is None or run_state.periods >= periods:
            break
        taken += 1
        run_state = run.follow(run_state, periods, taken)
    return run_state


def write(record: NDArray[np.void], run_state: RunState) -> None:
    """Puts where a run of the reference map stands into a state record of the core."""
    state, source = run_state.state, run_state.source
    plane = plane_number(source)
    field = run_state.begin.field if run_state.begin else 0
    rest, place = (
        state.angle_rest,
        (run_state.position, run_state.periods, state.bound, plane, field),
    )
    record[...] = (*state[:5], rest, *place)
