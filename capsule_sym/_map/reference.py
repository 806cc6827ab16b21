"""The reference map: first switch, exact advance, next segment, until the periods are over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import Outcome, Status
from capsule_sym._map.backend import Backend, MpmathBackend, Number
from capsule_sym._map.course import Course, SegmentStart
from capsule_sym._map.expansion import Guard, Point, pulsed
from capsule_sym._map.location import End, locate
from capsule_sym._map.segments import (
    Instant,
    Segment,
    Triple,
    instant,
    plane_name,
    plane_number,
    start_of,
)
from capsule_sym._map.steady import LONGEST
from capsule_sym._map.trajectory import (
    FINISHED,
    TIME_IS_UP,
    Trajectory,
    after,
)
from capsule_sym._map.transitions import (
    State,
    reached,
    select_field,
    start_at,
    tells,
)
from capsule_sym._native import Watch
from capsule_sym._parameters import Scene, SceneParameters

# Below this, doubles soon underflow. A motion without forcing that is this small stays small.
_NOTHING = 1e-200
# After a start on several surfaces at once a few segments of almost no duration may follow.
_MOST_STILL = 16
_ROOM = 256  # segments that follow one another from a record of the core


class RunState(NamedTuple):
    """State of a run: state, next segment, switching plane, whole periods passed, and x_c."""

    state: State
    begin: SegmentStart | None
    source: str
    periods: int
    position: Number


class Run:
    """One run: the constants of all segments, and the results so far."""

    def __init__(
        self,
        numbers: Backend,
        parameters: SceneParameters,
        escalate: bool,
        watch: Watch | None = None,
        progress: Callable[[int], object] | None = None,
    ) -> None:
        self.numbers, self.parameters, self.scene = numbers, parameters, parameters.scene
        self.watch, self.progress = watch or Watch(), progress
        self.escalate = escalate and numbers.name != "mpmath"
        self.constants = [numbers.constants(field, parameters) for field in self.scene.facts.FIELDS]
        self.omega, facts = numbers.number(parameters.omega), self.scene.facts
        self.stops = tuple(getattr(parameters, name) for name, _ in facts.STOPS)
        """Distances of the stops in front and behind."""
        self.pulsed = facts.PULSED
        self.segments: list[Segment] = []
        self.stroboscopic: list[Triple] = []
        self.stroboscopic_periods: list[int] = []
        self.marks = 2 * LONGEST
        """Number of last periods at whose ends segments are recorded, for `steady`."""
        self.escalations = 0
        self.exact: State | None = None
        """Present state in 50 digits, if they decided the switch that led to it."""
        self.still = 0
        """Number of last segments that did not advance in time."""

    def go(
        self, values: tuple[float, float, float], phase: float, periods: int, most: int
    ) -> Trajectory:
        """Trajectory from a state at a phase, of at most `most` segments, all of them kept."""
        number = self.numbers.number
        x_r, v_r, v_c = origin = (number(values[0]), number(values[1]), number(values[2]))
        angle, rest = self.numbers.angle(number(phase), self.omega)
        state = self._state(x_r, v_r, v_c, angle)._replace(angle_rest=rest)
        state = state._replace(level=self.level(angle, rest))
        if phase == 0.0:
            self.stroboscopic.append((x_r, v_r, v_c))
            self.stroboscopic_periods.append(0)
        state, begin = self._begin(state)
        source = f"Σ{begin.field}" if begin and state.v_c == 0 else ""
        run_state = self.follow(RunState(state, begin, source, 0, number(0)), periods, most)
        kind = object if self.numbers.name == "mpmath" else float
        return Trajectory.of_segments(
            self.parameters,
            self.numbers.name,
            (Instant(0, number(phase), self.omega), origin),
            tuple(self.segments),
            self.ended(run_state, periods, most),
            self.escalations,
            stroboscopic=np.array(self.stroboscopic, dtype=kind).reshape(-1, 3),
            stroboscopic_periods=np.array(self.stroboscopic_periods, np.int64),
        )

    def ended(self, run_state: RunState, periods: int, most: int) -> tuple[Status, str]:
        """Status and reason of the end of the run."""
        if run_state.periods >= periods:
            return Status.FINISHED, FINISHED
        if self.watch.over:
            return Status.TIME_LIMIT, TIME_IS_UP
        if run_state.begin is not None:
            return Status.SEGMENT_LIMIT, after(most)
        last = self.segments[-1].outcome if self.segments else None
        if last is Outcome.STALLED:
            return Status.STALLED, "stalled: rounding lets no step advance in time"
        if last is Outcome.UNDECIDED:
            why = "undecided: no switch found or excluded within the limit of evaluations"
        else:
            why = "undecided: no field leaves the last state with certainty"
        return Status.UNDECIDED, why

    def follow(self, run_state: RunState, periods: int, most: int) -> RunState:
        """Continue until the periods are over, for at most `most` segments in all.

        It ends earlier if the watch is over, or without a next segment.
        """
        state, begin, source, turns, position = run_state
        while begin and turns < periods and len(self.segments) < most:
            if self.watch.over:
                break
            left = (periods - turns) * self.numbers.full_turn - (state.angle + state.angle_rest)
            flow, switch = self.first_switch(state, begin, left / self.omega)
            passed, angle, rest = _turned(flow, state, switch)
            if switch.duration * max(flow.c.rate, self.omega) > self.numbers.unit:
                self.still = 0
            elif self.still < _MOST_STILL:
                self.still += 1
            else:
                switch = replace(switch, outcome=Outcome.STALLED, guards=())
                passed = 0 if self.pulsed else passed
            if switch.outcome in (Outcome.END, Outcome.NEVER):
                passed, angle = periods - turns, angle * 0
                switch = replace(switch, point=flow.at_mark(switch.duration))
            self._strobe(flow, state.angle, turns, passed, switch)
            end_state, begin, target = self._arrive(flow, switch, angle, rest)
            advance = self._advance(flow, switch.duration)
            self.segments.append(
                Segment(
                    field=flow.field,
                    source=source,
                    target=target,
                    start=instant(turns, state.angle, self.omega),
                    end=instant(turns + passed, angle, self.omega),
                    start_state=(state.x_r, state.v_r, state.v_c),
                    end_state=(end_state.x_r, end_state.v_r, end_state.v_c),
                    duration=switch.duration,
                    outcome=switch.outcome,
                    tangencies=switch.tangencies,
                    evaluations=switch.evaluations,
                    position=position,
                    advance=advance,
                    closed=start_of(*flow.closed),
                    scene=self.parameters.scene,
                )
            )
            turns += passed
            state, source, position = end_state, target, position + advance
            if self.progress is not None:
                self.progress(turns)
        return RunState(state, begin, source, turns, position)

    def _state(self, x_r: Number, v_r: Number, v_c: Number, angle: Number) -> State:
        """State whose gaps are known by the position alone."""
        front, *behind = map(self.numbers.number, self.stops)
        back = x_r + behind[0] if behind else None
        return State(x_r, x_r - front, v_r, v_c, angle, back=back)

    def level(self, angle: Number, rest: Number) -> int:
        """Level of pulses just after an angle: 1 for the low level; 0 without pulses."""
        if not self.pulsed:
            return 0
        fall, fall_rest = self.numbers.edge(self.constants[0].high_share())
        return int((angle - fall) + (rest - fall_rest) >= 0)

    def _begin(self, state: State) -> tuple[State, SegmentStart | None]:
        """State at which a segment begins, and the successor field; None if undecided.

        Unforced, with the capsule at rest, a state next to rest becomes exact rest.
        """
        size = max(abs(state.x_r), abs(state.v_r))
        unforced = self.parameters.alpha == 0 and not self.pulsed
        if unforced and state.v_c == 0 and 0 < size < _NOTHING:
            self.exact, zero = None, size * 0
            state = self._state(zero, zero, zero, state.angle)._replace(angle_rest=state.angle_rest)
            return state, self.next_segment(state)
        if self.exact is None:
            return state, self.next_segment(state)
        return state, self._escalate_start(state)

    def next_segment(self, state: State) -> SegmentStart | None:
        """Successor field at a state; None if undecided."""
        begin = select_field(self.numbers, self.constants, state)
        if begin is None and self.escalate:
            return self._escalate_start(state)
        return begin or select_field(self.numbers, self.constants, state, vanish=True)

    def first_switch(self, state: State, begin: SegmentStart, limit: Number) -> tuple[Course, End]:
        """Closed form of the segment from a state, and its first switch up to a duration."""
        flow = Course(self.numbers, self.constants[begin.field - 1], begin)
        switch = locate(flow, limit, self.watch)
        decided = switch.outcome is Outcome.UNDECIDED or (switch.certain and tells(flow, switch))
        if self.escalate and not decided:
            switch = self._escalate_switch(state, begin, limit)
        else:
            self.exact = None
        return flow, switch

    # Fifty digits start from the same doubles, or continue from their own last state; results are
    # rounded once.
    def exactly(self, numbers: Backend, state: State) -> State:
        """Present state in a wider number system."""
        if self.exact is not None:
            return self.exact
        return state.exactly(numbers.number, *self.stops)

    def _escalate_start(self, state: State) -> SegmentStart | None:
        self.escalations += self.exact is None
        numbers = MpmathBackend(scene=self.scene)
        exact = self.exactly(numbers, state)
        settled = Run(numbers, self.parameters, False).next_segment(exact)
        if settled is None:
            return None
        cosine, _ = self.numbers.cos_sin(state.angle, state.angle_rest)
        start = start_at(self.constants[settled.field - 1], state, cosine)
        return replace(settled, start=start._replace(zeros=settled.start.zeros))

    def _escalate_switch(self, state: State, begin: SegmentStart, limit: Number) -> End:
        self.escalations += 1
        numbers = MpmathBackend(scene=self.scene)
        c = numbers.constants(begin.field, self.parameters)
        given = self.exactly(numbers, state)
        cosine, _ = numbers.cos_sin(given.angle, given.angle_rest)
        start = start_at(c, given, cosine)._replace(zeros=begin.start.zeros)
        flow = Course(numbers, c, replace(begin, start=start))
        switch = locate(flow, numbers.number(limit), self.watch)
        _, angle, rest = _turned(flow, given, switch)
        self.exact = reached(flow, switch, angle)._replace(angle_rest=rest)
        return replace(
            switch,
            duration=float(switch.duration),
            point=Point(*(None if value is None else float(value) for value in switch.point)),
            tangencies=tuple((outcome, float(at)) for outcome, at in switch.tangencies),
        )

    def _arrive(
        self, flow: Course, switch: End, angle: Number, rest: Number
    ) -> tuple[State, SegmentStart | None, str]:
        """State at a switch with its exactly known quantities, the successor, and its plane."""
        state = reached(flow, switch, angle)._replace(angle_rest=rest)
        if not switch.guards:
            return state, None, ""
        state, following = self._begin(state)
        return state, following, plane(self.scene, state, following, Guard.EDGE in switch.guards)

    def _advance(self, flow: Course, duration: Number) -> Number:
        if not flow.c.drift:
            return duration * 0
        advance = self.numbers.kernels.flow(flow.c, flow.closed, duration, True)[3]
        return self.numbers.number(advance)

    def _strobe(self, flow: Course, angle: Number, turns: int, passed: int, switch: End) -> None:
        """Record the states at the ends of the excitation periods that a segment passes."""
        for turn in range(max(1, passed + 1 - self.marks), passed + 1):
            h = min((turn * self.numbers.full_turn - angle) / self.omega, switch.duration)
            point = flow.at_mark(h) if h > 0 else flow.origin
            if self.pulsed:  # the segment ends there
                point = switch.point
            self.stroboscopic.append((point.x_r, point.v_r, point.v_c))
            self.stroboscopic_periods.append(turns + turn)


def _turned(flow: Course, state: State, switch: End) -> tuple[int, Number, Number]:
    """Whole turns up to a switch, the angle there, and its rounding error."""
    c, numbers = flow.c, flow.backend
    turned = c.omega * switch.duration + state.angle_rest
    if not pulsed(c):
        return *numbers.turns(state.angle + turned), turned * 0
    if Guard.EDGE not in switch.guards:
        return 0, state.angle + turned, turned * 0
    if c.high:
        return 0, *numbers.edge(c.high_share())
    return 1, turned * 0, turned * 0


def step(run: Run, record: NDArray[np.void], periods: int, most: int = _ROOM) -> RunState:
    """Take one segment of the reference map from a state record of the core.

    Take more, up to `most`, while 50 digits must decide them or they do not advance: a record
    contains neither digits nor a count of such segments.
    """
    told = dict(zip(record.dtype.names or (), record.tolist(), strict=True))
    source, v_c, rest = plane_name(told["plane"]), told["v_c"], told["angle_rest"]
    known = ("x_r", "gap", "v_r", "v_c", "angle", "bound", "angle_rest", "back")
    state = State(**{name: told[name] for name in known if name in told})
    state = state._replace(level=run.level(state.angle, rest))
    period, position = told["period"], told["position"]
    run_state = RunState(*run._begin(state), source, period, position)
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
    """Write the run state of the reference map into a state record of the core."""
    state, source = run_state.state, run_state.source
    told = {
        **state._asdict(),
        "position": run_state.position,
        "period": run_state.periods,
        "plane": plane_number(source),
        "field": run_state.begin.field if run_state.begin else 0,
    }
    record[...] = tuple(told[name] for name in record.dtype.names or ())


def plane(scene: Scene, state: State, following: SegmentStart | None, edge: bool) -> str:
    """Switching plane of a state, Eq. (24); at rest of the capsule that of the successor field.

    At an edge of the drive it is that of the edge. It is empty without a successor.
    """
    if following is None:
        return ""
    if edge:
        return f"Σ{scene.switching.EDGE_PLANES[state.level]}"
    if state.v_c == 0:
        return f"Σ{following.field}"
    signs = 1 if state.v_c > 0 else -1, 1 if state.v_r > 0 else -1
    return f"Σ{scene.switching.IMPACT_PLANES[1 if state.gap == 0 else 2, *signs]}"
