"""Switches of a run checked by 50 digits: which are true, and how far off their times are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from capsule_sym import Parameters, simulate
from capsule_sym._map.interface import (
    Backend,
    Course,
    End,
    Guard,
    NativeRun,
    Number,
    NumpyBackend,
    Run,
    SegmentStart,
    State,
    backend,
    expand,
    locate,
    start_at,
)
from capsule_sym._parameters import of_paper
from capsule_sym.generated.interface import Precision
from capsule_sym.results import Trajectory

CONTRACT = 8.0
"""Largest error of a switching time t*, in units of u (t* + M/|g'(t*)|); see `Error` for M."""

WIDE = "c, 106 bits"
"""The C core deciding every switch by double-doubles."""

_GRID = np.arange(1, 17) / 16


@dataclass(frozen=True)
class Start:
    """The start of a run and its length."""

    parameters: Parameters
    state: tuple[float, float, float] = (0.0, 0.0, 0.0)
    phase: float = 0.0
    periods: int = 1
    max_segments: int = 3

    def run(self, backend: str | None = None) -> Trajectory:
        """The run, by a backend of `simulate`, or by the C core in 106 bits (`WIDE`)."""
        if backend == WIDE:
            run = NativeRun(self.parameters, escalate=True)
            run.precision = Precision.DOUBLE_DOUBLE
            return run.go(self.state, self.phase, self.periods, self.max_segments)
        return simulate(
            self.parameters,
            self.state,
            self.phase,
            self.periods,
            backend=backend,
            max_segments=self.max_segments,
        )


@dataclass(frozen=True)
class ReferenceCheck:
    """A run in double precision beside the one in 50 digits.

    `found` and `true` are the fields passed, in order; `error` is the largest error of a switching
    time over all segments, each checked from its own start.
    """

    run: Trajectory
    found: tuple[int, ...]
    true: tuple[int, ...]
    error: Error
    wrong: str

    @property
    def passed(self) -> bool:
        """True if every switch is true and within the accuracy contract."""
        return not self.wrong and self.found == self.true and self.error.amplitude <= CONTRACT


def check(start: Start) -> ReferenceCheck:
    """The run from a start, checked segment by segment and as a whole."""
    run = _Checked(NumpyBackend(), start.parameters, escalate=True)
    found = run.go(start.state, start.phase, start.periods, start.max_segments)
    return ReferenceCheck(found, _fields(found), _fields(start.run("mpmath")), run.error, run.wrong)


class Error(NamedTuple):
    """Error of a switching time in units of u (t* + M/|g'(t*)|), with either reading of M.

    The contract is checked by `amplitude`, where the forced term of g counts with its amplitude
    over all forcing phases: so large are the numbers that the forced response is added up from.
    `phase` counts only the largest value that it takes at the start's own phase, which is smaller.
    """

    amplitude: float
    phase: float


def error(
    numbers: Backend,
    parameters: Parameters,
    begin: SegmentStart,
    duration: float,
    exact: End,
    negligible: float = 0.0,
) -> Error:
    """The error of a switching time that is found to be `duration` where `exact` is true.

    Zero where g'(t*) = 0: there the contract requires no digits. An error that is certainly no more
    than `negligible` is given by a bound.
    """
    c = numbers.constants(begin.field, parameters)
    guard = exact.guards[0]
    slope = abs(expand(numbers, c, exact.point)[guard].values[1])
    if slope == 0:
        return Error(0.0, 0.0)
    off = abs(numbers.number(duration) - exact.duration) * 2**53

    def units(term: float) -> float:
        return float(off / (exact.duration + term / slope))

    # M is no less than a term of the start; mostly the error is little enough with that already.
    most = units(_term_of_start(c, begin, guard))
    if most <= negligible:
        return Error(most, most)
    return Error(*map(units, largest_terms(parameters, begin, guard, float(exact.duration))))


def _term_of_start(c: Any, begin: SegmentStart, guard: Guard) -> float:
    start = begin.start
    if guard is Guard.DRIFT:
        return float(abs(start.v_c))
    x_r = max(abs(start.x_r), c.delta)
    return float(x_r if guard is Guard.GAP else c.force_change_size(x_r, 0))


def largest_terms(
    parameters: Parameters, begin: SegmentStart, guard: Guard, h: float
) -> tuple[float, float]:
    """The largest value that a term of a guard's closed form takes up to a duration h: M.

    The terms of x_r and v_r are the start's own and the responses to spring and friction, to the
    velocity and to the forcing; those of v_c are the momenta of the relative motion, of friction
    and of forcing. The first number takes the forced response with its amplitude over all phases,
    the second as it is at the start's phase.
    """
    numbers = NumpyBackend()
    c, begun = numbers.constants(begin.field, parameters), begin.start
    x, gap, v, v_c, _, angle = (float(value) for value in begun[:6])
    kernels, times = numbers.kernels, h * _GRID
    free = c._replace(alpha=0.0, push=0.0)
    sizes = (abs(x), 0.0), (0.0, abs(gap))
    unpushed = c._replace(push=0.0)
    force = max(abs(c.push), *(unpushed.rest_force_size(*size) for size in sizes))

    def response(constants: Any, v_r: float = 0.0, cosine: float = 0.0, sine: float = 0.0) -> Any:
        rest = kernels.Start(0.0, 0.0, v_r, 0.0, 0.0, cosine, sine)
        return np.transpose([kernels.flow(constants, rest, time)[:2] for time in times.tolist()])

    forced = c._replace(push=0.0)
    in_phase, quadrature = response(forced, cosine=1.0), response(forced, sine=1.0)
    own = [response(free._replace(push=force)), response(free, v)]
    cosine, sine = numbers.cos_sin(angle)
    impulse = c.alpha * min(h, 2 / c.omega)
    at_phase = c.alpha * np.abs(np.sin(angle + c.omega * times) - sine).max() / c.omega

    def largest(driven: Any, impulse: float) -> float:
        x_r, v_r = np.abs([*own, driven]).max(axis=(0, 2))
        x_r = max(abs(x), c.delta, x_r)
        if guard is Guard.GAP:
            return float(x_r)
        if guard is Guard.DRIFT:
            momenta = max(v_r, abs(c.friction) * h, impulse)
            return float(max(abs(v_c), momenta / (1 + c.gamma)))
        in_x, in_v = (x_r, 0.0), (0.0, max(v_r, abs(v)))
        return float(max(*(c.force_change_size(*part) for part in (in_x, in_v)), c.f_b))

    amplitude = largest(np.hypot(in_phase, quadrature), impulse)
    return amplitude, largest(cosine * in_phase + sine * quadrature, at_phase)


def _fields(run: Trajectory) -> tuple[int, ...]:
    """Fields of the segments that end in a switch."""
    return tuple(segment.field for segment in run.segments if segment.target)


def names(switch: End) -> str:
    """The guards that fired at a switch, or its outcome if none did."""
    return " and ".join(guard.value for guard in switch.guards) or switch.outcome.value


class _Checked(Run):
    """A run of which every switch is also located in 50 digits, from the same start."""

    error, wrong = Error(0.0, 0.0), ""

    def first_switch(self, state: State, begin: SegmentStart, limit: Number) -> tuple[Course, End]:
        with backend("mpmath") as numbers:
            given = self.exactly(numbers, state)
        flow, switch = super().first_switch(state, begin, limit)
        with backend("mpmath") as numbers:
            c = numbers.constants(begin.field, self.parameters)
            exact = replace(begin, start=start_at(c, given)._replace(zeros=begin.start.zeros))
            true = locate(Course(numbers, c, exact), numbers.number(limit))
            if set(switch.guards) != set(true.guards):
                self.wrong = self.wrong or f"F{flow.field}: {names(switch)}, not {names(true)}"
            elif true.guards:
                off = error(numbers, of_paper(self.parameters), begin, switch.duration, true)
                self.error = Error(*map(max, self.error, off))
        return flow, switch
