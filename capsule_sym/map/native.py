"""The map by the C core; where that leaves a switch open, the reference map takes one segment."""

from __future__ import annotations

import math
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._native import core as _core
from capsule_sym.errors import InvalidInput, Outcome
from capsule_sym.map.backend import LONGEST_NATIVE_RUN, NumpyBackend
from capsule_sym.map.simulate import TIME_IS_UP, Journey, Run
from capsule_sym.map.trajectory import Segment, Trajectory, instant
from capsule_sym.map.transitions import State
from capsule_sym.parameters import Parameters

_ROOM = 4096  # segments taken from the core at a time


def core() -> Any:
    """The binding; raises InvalidInput where the core was not compiled."""
    if _core is None:
        raise InvalidInput("backend", "c", "numpy or mpmath: the C core was not compiled")
    return _core


class NativeRun:
    """One run by the core, and the reference map for what it leaves open."""

    def __init__(self, parameters: Parameters, settle: bool, deadline: float = math.inf) -> None:
        self.parameters, self.settle, self.deadline = parameters, settle, deadline
        self.map = core().Map(np.array(list(parameters.to_dict().values())))
        self.closed = NumpyBackend().kernels.Start
        self.segments: list[Segment] = []
        self.settled = 0

    def go(
        self, values: tuple[float, float, float], phase: float, periods: int, most: int
    ) -> Trajectory:
        """The trajectory, as the reference map gives it."""
        if periods > LONGEST_NATIVE_RUN:
            raise InvalidInput("periods", periods, f"at most {LONGEST_NATIVE_RUN} by backend c")
        angle = phase * self.parameters.omega
        record = self.map.state_at(*values, phase)
        strobe = np.full((periods + 1, 3), np.nan)
        strobe[0] = values
        buffer = np.empty(min(_ROOM, most), core().SEGMENT)
        stopped = ""
        while record["turn"] < periods and not stopped:
            if len(self.segments) == most:
                stopped = f"after {most} segments"
                break
            if perf_counter() > self.deadline:
                stopped = TIME_IS_UP
                break
            room = buffer[: most - len(self.segments)]
            stop, count, _ = self.map.run(record, periods, segments=room, strobe=strobe)
            self.segments += [self._segment(s) for s in buffer[:count].tolist()]
            if stop == core().OPEN and len(self.segments) < most:
                run = Run(NumpyBackend(), self.parameters, self.settle, self.deadline)
                journey = step(run, record, periods, most - len(self.segments))
                self.segments += run.segments
                self.settled += run.settled
                passed = np.array(run.stroboscopic, dtype=float).reshape(-1, 3)
                strobe[journey.turns - len(passed) + 1 : journey.turns + 1] = passed
                if journey.departure is None:
                    stopped = run.stopped(journey, periods, most)
                write(record, journey)
        marks = strobe[0 if phase == 0.0 else 1 : int(record["turn"]) + 1]
        # Of a segment over very many periods the reference map records the last marks only.
        marks = marks[~np.isnan(marks[:, 0])]
        return Trajectory(
            self.parameters,
            "c",
            (instant(0, angle, self.parameters.omega), values),
            tuple(self.segments),
            tuple(map(tuple, marks.tolist())),
            self.settled,
            stopped,
        )

    def _segment(self, s: tuple[Any, ...]) -> Segment:
        (turn, end_turn, angle, end_angle, start, end, duration, position, advance, *closed) = s[
            :13
        ]
        field, source, target, outcome, evaluations = s[13:]
        omega = self.parameters.omega
        start, end = start.tolist(), end.tolist()
        gap, margin, cosine, sine = closed
        return Segment(
            field=field,
            source=f"Σ{source}" if source else "",
            target=f"Σ{target}" if target else "",
            start=instant(turn, angle, omega),
            end=instant(end_turn, end_angle, omega),
            start_state=tuple(start),
            end_state=tuple(end),
            duration=duration,
            outcome=_OUTCOMES[outcome],
            tangencies=(),
            evaluations=evaluations,
            position=position,
            advance=advance,
            closed=self.closed(start[0], gap, start[1], start[2], margin, cosine, sine),
        )


_OUTCOMES = [Outcome(name) for name in _core.OUTCOMES] if _core is not None else []


def step(run: Run, record: NDArray[np.void], periods: int, most: int = _ROOM) -> Journey:
    """One segment of the reference map from a state record of the core.

    More, up to `most`, as long as 50 digits have to settle them: a record has none to go on from.
    """
    x_r, gap, v_r, v_c, angle, rest, position, turn, bound, plane = record.tolist()
    source = f"Σ{plane}" if plane else ""
    state = State(x_r, gap, v_r, v_c, angle, bound, rest)
    journey = run.depart(state, source, turn, position)
    if journey.departure is not None and not source and v_c == 0:
        journey = journey._replace(source=f"Σ{journey.departure.field}")
    journey, taken = run.follow(journey, periods, 1), 1
    while run.exact is not None and taken < most and journey.departure and journey.turns < periods:
        taken += 1
        journey = run.follow(journey, periods, taken)
    return journey


def write(record: NDArray[np.void], journey: Journey) -> None:
    """Puts where a run of the reference map stands into a state record of the core."""
    state, source = journey.state, journey.source
    plane = int(source[1:]) if source else 0
    rest, place = state.angle_rest, (journey.position, journey.turns, state.bound, plane)
    record[...] = (*state[:5], rest, *place)
