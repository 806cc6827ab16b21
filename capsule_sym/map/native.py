"""The map by the C core; where that leaves a switch open, the reference map takes one segment."""

from __future__ import annotations

import math
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._native import Watch
from capsule_sym._native import core as _core
from capsule_sym.errors import InvalidInput, Outcome
from capsule_sym.generated.interface import Precision
from capsule_sym.map.backend import NumpyBackend
from capsule_sym.map.simulate import TIME_IS_UP, Journey, Run
from capsule_sym.map.trajectory import Segment, Trajectory, Triple, instant
from capsule_sym.map.transitions import State
from capsule_sym.parameters import Parameters

_ROOM = 1024  # segments taken from the core at a time


def core() -> Any:
    """The binding; raises InvalidInput where the core was not compiled."""
    if _core is None:
        raise InvalidInput("backend", "c", "numpy or mpmath: the C core was not compiled")
    return _core


class NativeRun:
    """One run by the core, and the reference map for what it leaves open."""

    def __init__(
        self,
        parameters: Parameters,
        settle: bool,
        deadline: float = math.inf,
        progress: Callable[[int], object] | None = None,
    ) -> None:
        self.parameters, self.settle, self.deadline = parameters, settle, deadline
        self.progress = progress
        self.precision = Precision.AS_NEEDED if settle else Precision.DOUBLE
        self.map = core().Map(np.array(list(parameters.to_dict().values())))
        self.closed = NumpyBackend().kernels.Start
        self.segments: list[Segment] = []
        self.stroboscopic: list[Triple] = []
        self.settled = 0

    def go(
        self, values: tuple[float, float, float], phase: float, periods: int, most: int
    ) -> Trajectory:
        """The trajectory, as the reference map gives it."""
        angle = phase * self.parameters.omega
        record = self.map.state_at(*values, phase)
        strobe = np.empty((min(periods + 1, core().ROWS), 3))
        buffer = np.empty(min(_ROOM, most), core().SEGMENT)
        watch = Watch()
        watch.deadline = self.deadline
        if phase == 0.0:
            self.stroboscopic.append(values)
        stopped = ""
        while record["turn"] < periods and not stopped:
            room = buffer[: most - len(self.segments)]
            stop = self._piece(record, periods, room, strobe, watch)
            if stop == core().OPEN and len(self.segments) < most:
                run = Run(NumpyBackend(), self.parameters, self.settle, self.deadline)
                journey = step(run, record, periods, most - len(self.segments))
                self.segments += run.segments
                self.settled += run.settled
                self.stroboscopic += run.stroboscopic
                if journey.departure is None:
                    stopped = run.stopped(journey, periods, most)
                write(record, journey)
            if self.progress is not None:
                self.progress(int(record["turn"]))
            if not stopped and len(self.segments) == most:
                stopped = f"after {most} segments"
            if not stopped and perf_counter() > self.deadline:
                stopped = TIME_IS_UP
        return Trajectory(
            self.parameters,
            "c",
            (instant(0, angle, self.parameters.omega), values),
            tuple(self.segments),
            tuple(self.stroboscopic),
            self.settled,
            stopped if record["turn"] < periods else "",
        )

    def _piece(
        self,
        record: NDArray[np.void],
        periods: int,
        room: NDArray[np.void],
        strobe: NDArray[np.float64],
        watch: Watch,
    ) -> int:
        """As many segments as there is room for, and why there are no more."""
        before = record.copy()
        stop, count, _ = self.map.run(
            record, periods, room, strobe=strobe, watch=watch, precision=self.precision
        )
        first, last, rows = int(before["turn"]) + 1, int(record["turn"]), len(strobe)
        if last - first >= rows and count > 1:
            # The last segment rests for ever, and its states took the places of those before it.
            record[...] = before
            return self._piece(record, periods, room[: count - 1], strobe, watch)
        self.segments += [self._segment(s) for s in room[:count].tolist()]
        marks = strobe[np.arange(max(first, last + 1 - rows), last + 1) % rows]
        self.stroboscopic += map(tuple, marks.tolist())
        return int(stop)

    def _segment(self, s: tuple[Any, ...]) -> Segment:
        (turn, end_turn, angle, end_angle, start, end, duration, position, advance, *closed) = s[
            :13
        ]
        field, source, target, outcome, evaluations, wide = s[13:]
        self.settled += wide
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

    More, up to `most`, as long as 50 digits have to settle them, or they do not advance: a record
    has no digits, nor a count of such segments, to go on from.
    """
    x_r, gap, v_r, v_c, angle, rest, position, turn, bound, plane, _ = record.tolist()
    source = f"Σ{plane}" if plane else ""
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
    plane = int(source[1:]) if source else 0
    field = journey.departure.field if journey.departure else 0
    rest, place = state.angle_rest, (journey.position, journey.turns, state.bound, plane, field)
    record[...] = (*state[:5], rest, *place)
