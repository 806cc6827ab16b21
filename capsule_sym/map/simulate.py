"""Running the map: first switch, exact advance, next segment, until the periods are over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from capsule_sym.errors import CapsuleError, InvalidInput, Outcome
from capsule_sym.map.backend import Backend, Number, backend
from capsule_sym.map.expansion import Guard, Point
from capsule_sym.map.location import Flow, Start, Switch, locate
from capsule_sym.map.trajectory import Instant, Segment, Trajectory, Triple, instant, is_finite
from capsule_sym.map.transitions import Departure, State, Undetermined, depart
from capsule_sym.parameters import Parameters


class Undecided(CapsuleError):
    """A switch that 50 digits do not decide: an exact tangency or corner."""


def simulate(
    parameters: Parameters,
    state: Sequence[float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    periods: int = 100,
    *,
    backend: str = "numpy",
) -> Trajectory:
    """The exact trajectory over whole excitation periods, from a state (x_r, v_r, v_c) and phase.

    All quantities are dimensionless; the phase is a time in [0, 2 pi/omega), the run ends at
    phase 0 after `periods` periods. The backend is "numpy" (double precision) or "mpmath"
    (50 digits). Where double precision cannot decide a switch, 50 digits do; the trajectory's
    `settled` counts how often.

    Raises InvalidInput for a value that is not allowed, Undecided for a switch that 50 digits
    leave open.
    """
    values = _checked_state(state)
    _check_phase(phase, parameters)
    if isinstance(periods, bool) or not isinstance(periods, int) or periods < 1:
        raise InvalidInput("periods", periods, "a whole number >= 1")
    with _backend(backend) as numbers:
        return _Run(numbers, parameters).go(values, phase, periods)


_backend = backend  # the parameter of `simulate` has the same name


def _checked_state(state: Sequence[float]) -> tuple[float, float, float]:
    allowed = "three finite numbers (x_r, v_r, v_c)"
    try:
        values = tuple(float(value) for value in state)
    except (TypeError, ValueError):
        raise InvalidInput("state", state, allowed) from None
    if len(values) != 3 or not is_finite(values):
        raise InvalidInput("state", state, allowed)
    return values


def _check_phase(phase: float, parameters: Parameters) -> None:
    allowed = f"a time in [0, 2 pi/omega) = [0, {parameters.period!r})"
    if isinstance(phase, bool) or not isinstance(phase, int | float):
        raise InvalidInput("phase", phase, allowed)
    if not 0.0 <= phase < parameters.period:
        raise InvalidInput("phase", phase, allowed)


class _Run:
    """One run: the constants of all segments, and what has been passed so far."""

    def __init__(self, numbers: Backend, parameters: Parameters) -> None:
        self.numbers, self.parameters = numbers, parameters
        self.constants = [numbers.constants(field, parameters) for field in range(1, 7)]
        self.omega, self.delta = numbers.number(parameters.omega), numbers.number(parameters.delta)
        self.segments: list[Segment] = []
        self.stroboscopic: list[Triple] = []
        self.settled = 0

    def go(self, values: tuple[float, float, float], phase: float, periods: int) -> Trajectory:
        number = self.numbers.number
        x_r, v_r, v_c = map(number, values)
        state = State(x_r, x_r - self.delta, v_r, v_c, number(phase) * self.omega)
        turns, source, position = 0, "", number(0)
        if phase == 0.0:
            self.stroboscopic.append((x_r, v_r, v_c))
        while turns < periods:
            departure = self._depart(state)
            if source == "" and state.v_c == 0:
                source = f"Σ{departure.field}"
            limit = (periods - turns) * self._period() - state.angle / self.omega
            flow, switch = self._locate(departure, limit)
            angle = state.angle + self.omega * switch.duration
            passed, angle = self.numbers.turns(angle)
            if switch.outcome is Outcome.END:
                passed, angle = periods - turns, angle * 0
            self._strobe(flow, state.angle, passed, switch)
            end_state, target = self._arrive(departure, switch, angle)
            advance = self._advance(flow, switch.duration)
            self.segments.append(
                Segment(
                    field=departure.field,
                    source=source,
                    target=target,
                    start=instant(turns, state.angle, self.omega),
                    end=instant(turns + passed, angle, self.omega),
                    start_state=(state.x_r, state.v_r, state.v_c),
                    end_state=(end_state.x_r, end_state.v_r, end_state.v_c),
                    duration=switch.duration,
                    outcome=switch.outcome,
                    evaluations=switch.evaluations,
                    position=position,
                    advance=advance,
                    closed=flow.closed,
                )
            )
            turns += passed
            state, source, position = end_state, target, position + advance
        return Trajectory(
            self.parameters,
            self.numbers.name,
            tuple(self.segments),
            tuple(self.stroboscopic),
            self.settled,
        )

    def _period(self) -> Number:
        return self.numbers.full_turn / self.omega

    def _depart(self, state: State) -> Departure:
        try:
            return depart(self.numbers, self.constants, state)
        except Undetermined as open_question:
            if self.numbers.name == "numpy":
                return self._settle_departure(state)
            raise Undecided(f"no certain departure: {open_question}") from None

    def _locate(self, departure: Departure, limit: Number) -> tuple[Flow, Switch]:
        flow = Flow(self.numbers, self.constants[departure.field - 1], departure.start)
        switch = locate(flow, limit)
        if switch.outcome in (Outcome.REGULAR, Outcome.END):
            return flow, switch
        if self.numbers.name == "numpy":
            return flow, self._settle_switch(departure, limit)
        raise Undecided(
            f"{switch.outcome} of guard {switch.guard} in F{departure.field} "
            f"after {switch.duration}: open at this precision"
        )

    # Fifty digits look at the same doubles; what they decide comes back rounded once.
    def _settle_departure(self, state: State) -> Departure:
        self.settled += 1
        with _backend("mpmath") as numbers:
            exact = State(*map(numbers.number, state[:5]), bound=state.bound)
            constants = [numbers.constants(field, self.parameters) for field in range(1, 7)]
            try:
                settled = depart(numbers, constants, exact)
            except Undetermined as open_question:
                raise Undecided(f"no certain departure: {open_question}") from None
            start = settled.start
            rounded = Start(*map(float, start[:6]), zeros=start.zeros)
        return Departure(settled.field, rounded)

    def _settle_switch(self, departure: Departure, limit: Number) -> Switch:
        self.settled += 1
        with _backend("mpmath") as numbers:
            start = departure.start
            exact = Start(*map(numbers.number, start[:6]), zeros=start.zeros)
            constants = numbers.constants(departure.field, self.parameters)
            switch = locate(Flow(numbers, constants, exact), numbers.number(limit))
            if switch.outcome not in (Outcome.REGULAR, Outcome.END):
                raise Undecided(
                    f"{switch.outcome} of guard {switch.guard} in F{departure.field} "
                    f"after {float(switch.duration)!r}: open at 50 digits"
                )
            point = Point(*map(float, switch.point))
            return Switch(
                switch.outcome, switch.guard, float(switch.duration), point, switch.evaluations
            )

    def _arrive(self, departure: Departure, switch: Switch, angle: Number) -> tuple[State, str]:
        """The state at a switch, with what is known exactly there, and its switching plane."""
        c, point, zero = self.constants[departure.field - 1], switch.point, angle * 0
        state = State(point.x_r, point.gap, point.v_r, point.v_c, angle)
        if switch.guard is None:
            return state, ""
        if switch.guard is Guard.GAP:
            state = state._replace(x_r=self.delta, gap=zero)
        elif switch.guard is Guard.DRIFT:
            state = state._replace(v_c=zero)
        else:
            state = state._replace(bound=1 if switch.guard is Guard.UPPER else -1)
        if c.drift == 0:
            state = state._replace(v_c=zero)
        return state, self._plane(state)

    def _plane(self, state: State) -> str:
        """The switching plane of a state, Eq. (24)."""
        if state.v_c == 0:
            return f"Σ{self._depart(state).field}"
        forward, inward = state.v_c > 0, state.v_r > 0
        return {(True, True): "Σ7", (True, False): "Σ8", (False, True): "Σ9"}.get(
            (forward, inward), "Σ10"
        )

    def _advance(self, flow: Flow, duration: Number) -> Number:
        if not flow.c.drift:
            return duration * 0
        return self.numbers.number(self.numbers.kernels.flow(flow.c, flow.closed, duration, True)[3])

    def _strobe(self, flow: Flow, angle: Number, passed: int, switch: Switch) -> None:
        """Record the states at the ends of the excitation periods that a segment passes."""
        for turn in range(1, passed + 1):
            h = min((turn * self.numbers.full_turn - angle) / self.omega, switch.duration)
            point = flow(h) if h > 0 else flow.origin
            self.stroboscopic.append((point.x_r, point.v_r, point.v_c))


__all__ = ["Instant", "Undecided", "simulate"]
