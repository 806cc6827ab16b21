"""Switches of a run judged by 50 digits: which are true, and how far off their times are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from capsule_sym.map import Trajectory, simulate
from capsule_sym.map.backend import Backend, Number, NumpyBackend, backend
from capsule_sym.map.expansion import Guard, expand
from capsule_sym.map.location import Departure, Flow, Switch, locate
from capsule_sym.map.simulate import _Run
from capsule_sym.map.transitions import State, start_at
from capsule_sym.parameters import Parameters

CONTRACT = 8.0
"""Largest error of a switching time t*, in units of u (t* + M/|g'(t*)|)."""

_GRID = np.arange(1, 17) / 16


@dataclass(frozen=True)
class Start:
    """The start of a run and its length, the arguments of `simulate`."""

    parameters: Parameters
    state: tuple[float, float, float] = (0.0, 0.0, 0.0)
    phase: float = 0.0
    periods: int = 1
    max_segments: int = 3


@dataclass(frozen=True)
class Judgement:
    """A run in double precision beside the one in 50 digits.

    `found` and `true` are the fields passed, in order; `error` is the largest error of a switching
    time over all segments, each judged from its own start, in units of u (t* + M/|g'(t*)|).
    """

    run: Trajectory
    found: tuple[int, ...]
    true: tuple[int, ...]
    error: float
    wrong: str

    @property
    def passed(self) -> bool:
        """Whether every switch is true and within the accuracy contract."""
        return not self.wrong and self.found == self.true and self.error <= CONTRACT


def judge(start: Start) -> Judgement:
    """The run from a start, judged segment by segment and as a whole."""
    run = _Judged(NumpyBackend(), start.parameters, start.phase, settle=True)
    found = run.go(start.state, start.periods, start.max_segments)
    true = simulate(
        start.parameters,
        start.state,
        start.phase,
        start.periods,
        backend="mpmath",
        max_segments=start.max_segments,
    )
    return Judgement(found, _fields(found), _fields(true), run.error, run.wrong)


def error(
    numbers: Backend, parameters: Parameters, departure: Departure, found: Switch, exact: Switch
) -> float:
    """Error of a switching time in units of u (t* + M/|g'(t*)|), M the largest term of g.

    Zero where g'(t*) = 0: there the contract asks for no digits.
    """
    c = numbers.constants(departure.field, parameters)
    guard = exact.guards[0]
    slope = abs(expand(numbers, c, exact.point)[guard].values[1])
    if slope == 0:
        return 0.0
    term = largest_term(parameters, departure, guard, float(exact.duration))
    scale = exact.duration + numbers.number(term) / slope
    return float(abs(numbers.number(found.duration) - exact.duration) / scale) * 2.0**53


def largest_term(parameters: Parameters, departure: Departure, guard: Guard, h: float) -> float:
    """The largest value that a term of a guard's closed form takes up to a duration h.

    The terms of x_r and v_r are the start's own and the responses to spring and friction, velocity
    and forcing, the last with its amplitude over all phases; those of v_c are the momenta of the
    relative motion, of friction and of forcing.
    """
    numbers = NumpyBackend()
    c, start = numbers.constants(departure.field, parameters), departure.start
    kernels, times = numbers.kernels, h * _GRID
    free = c._replace(alpha=0.0, push=0.0)
    force = max(abs(c.push), c.m * abs(start.x_r), c.m * c.kappa * abs(start.gap))

    def response(constants: Any, v_r: float = 0.0, cosine: float = 0.0, sine: float = 0.0) -> Any:
        rest = kernels.Start(0.0, 0.0, v_r, 0.0, 0.0, cosine, sine)
        return np.abs(kernels.flow(constants, rest, times)[:2])

    forced = c._replace(push=0.0)
    amplitude = np.hypot(response(forced, cosine=1.0), response(forced, sine=1.0))
    responses = (response(free._replace(push=force)), response(free, start.v_r), amplitude)
    x_r, v_r = np.max(responses, axis=(0, 2))
    x_r = max(abs(start.x_r), c.delta, x_r)
    if guard is Guard.GAP:
        return float(x_r)
    if guard is Guard.DRIFT:
        momenta = (v_r, abs(c.friction) * h, c.alpha * min(h, 2 / c.omega))
        return float(max(abs(start.v_c), max(momenta) / (1 + c.gamma)))
    return float(max((1 + c.kappa) * x_r, 2 * c.zeta * max(v_r, abs(start.v_r)), c.f_b))


def _fields(run: Trajectory) -> tuple[int, ...]:
    """Fields of the segments that end in a switch."""
    return tuple(segment.field for segment in run.segments if segment.target)


def names(switch: Switch) -> str:
    """The guards that fired at a switch, or its outcome if none did."""
    return " and ".join(guard.value for guard in switch.guards) or switch.outcome.value


class _Judged(_Run):
    """A run of which every switch is also located in 50 digits, from the same start."""

    error, wrong = 0.0, ""

    def _locate(self, state: State, departure: Departure, limit: Number) -> tuple[Flow, Switch]:
        flow, switch = super()._locate(state, departure, limit)
        with backend("mpmath") as numbers:
            c = numbers.constants(departure.field, self.parameters)
            start = start_at(c, self._exactly(numbers, state))
            exact = replace(departure, start=start._replace(zeros=departure.start.zeros))
            true = locate(Flow(numbers, c, exact), numbers.number(limit))
            if set(switch.guards) != set(true.guards):
                self.wrong = self.wrong or f"F{flow.field}: {names(switch)}, not {names(true)}"
            elif true.guards:
                self.error = max(
                    self.error, error(numbers, self.parameters, departure, switch, true)
                )
        return flow, switch
