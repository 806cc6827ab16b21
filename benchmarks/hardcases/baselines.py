"""Two baseline methods to find switches, for comparison: sampling with Brent, and SciPy's events.

Both are set up with care: surfaces are met from the right side only, and what vanishes at a switch
is put to zero. Neither proves anything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from benchmarks.hardcases.reference import Start
from capsule_sym import Parameters
from capsule_sym._map.interface import NumpyBackend
from capsule_sym.generated.capsule.facts import FIELD_OF

_SAMPLES = 200  # per excitation period
_MOST_SAMPLES = 200_000
_BLOCK = 100
_MOST_CALLS = 15_000  # of the right-hand side
_MODES = {field: mode for mode, field in FIELD_OF.items()}

State = tuple[float, float, float]


_First = Callable[[int, float, State, float], tuple[float, State, int] | None]


class GaveUp(Exception):
    """A baseline method that did not come to the end of the run within its limit."""


def sampling(start: Start) -> tuple[int, ...]:
    """Fields left by a switch, with guards sampled 200 times a period, and Brent's method.

    The motion is the exact one. Raises GaveUp beyond 200,000 samples.
    """
    return _fields(start, _Sampling(start.parameters).first_switch)


def solve_ivp(start: Start) -> tuple[int, ...]:
    """Fields left by a switch, by SciPy's DOP853 at tolerances of 1e-10 with its event search.

    Raises GaveUp beyond 15,000 evaluations of the equation of motion, or if SciPy does.
    """
    return _fields(start, _Integration(start.parameters).first_switch)


def _fields(start: Start, first_switch: _First) -> tuple[int, ...]:
    p, state, now = start.parameters, start.state, start.phase
    end = start.periods * p.period
    contact, drift = int(state[0] >= p.delta), _sign(state[2])
    field = FIELD_OF[contact, drift or _drift_at_rest(p, contact, state)]
    fields: list[int] = []
    while len(fields) < start.max_segments:
        passed = first_switch(field, now, state, end)
        if passed is None:
            break
        now, state, fired = passed
        fields.append(field)
        contact, drift = _MODES[field]
        if fired == 0:
            contact, state = 1 - contact, (p.delta, *state[1:])
        else:
            state = (*state[:2], 0.0)
            drift = _drift_at_rest(p, contact, state) if drift else (1 if fired == 1 else -1)
        field = FIELD_OF[contact, drift]
    return tuple(fields)


def _sign(value: float) -> int:
    return (value > 0) - (value < 0)


def _force(p: Parameters, contact: int, x_r: Any, v_r: Any) -> Any:
    c = NumpyBackend().constants(FIELD_OF[contact, 0], p)
    return c.force(x_r, x_r - p.delta, v_r)


def _drift_at_rest(p: Parameters, contact: int, state: State) -> int:
    force = _force(p, contact, state[0], state[1])
    return 0 if abs(force) <= p.f_b else _sign(force)


def _guards(p: Parameters, field: int, x_r: Any, v_r: Any, v_c: Any) -> list[Any]:
    contact, drift = _MODES[field]
    gap = x_r - p.delta if contact else p.delta - x_r
    if drift:
        return [gap, drift * v_c]
    force = _force(p, contact, x_r, v_r)
    return [gap, p.f_b - force, p.f_b + force]


class _Sampling:
    def __init__(self, parameters: Parameters) -> None:
        self.parameters, self.numbers, self.taken = parameters, NumpyBackend(), 0

    def first_switch(
        self, field: int, now: float, state: State, end: float
    ) -> tuple[float, State, int] | None:
        p, kernels = self.parameters, self.numbers.kernels
        c = self.numbers.constants(field, p)
        x_r, v_r, v_c = state
        force = _force(p, c.contact, x_r, v_r)
        angle = p.omega * now
        closed = kernels.Start(
            x_r, x_r - p.delta, v_r, v_c, force - c.friction, math.cos(angle), math.sin(angle)
        )

        def at(h: float) -> tuple[float, float, float]:
            values = kernels.flow(c, closed, h)
            return x_r + values[0], values[1], v_c + (values[2] if c.drift else 0.0)

        for times in self._blocks(end - now):
            sampled = _guards(p, field, *np.transpose([at(time) for time in times.tolist()]))
            found = [
                (int(np.argmax(crossed)), guard)
                for guard, g in enumerate(sampled)
                if np.any(crossed := (g[:-1] > 0) & (g[1:] <= 0))
            ]
            if found:
                from scipy.optimize import brentq

                first = min(index for index, _ in found)
                roots = [
                    (brentq(self._value(field, guard, at), times[index], times[index + 1]), guard)
                    for index, guard in found
                    if index == first
                ]
                h, fired = min(roots)
                x, v, w = (float(value) for value in at(h))
                return now + h, (x, v, w), fired
        return None

    def _value(self, field: int, guard: int, at: Callable[[float], Any]) -> Callable[[float], Any]:
        return lambda h: _guards(self.parameters, field, *at(h))[guard]

    def _blocks(self, length: float) -> Iterator[Any]:
        step, first = self.parameters.period / _SAMPLES, 0
        count = math.ceil(length / step)
        while first < count:
            last = min(first + _BLOCK, count)
            self.taken += last - first
            if self.taken > _MOST_SAMPLES:
                raise GaveUp(f"over {_MOST_SAMPLES} samples")
            yield np.minimum(np.arange(first, last + 1) * step, length)
            first = last


class _Integration:
    def __init__(self, parameters: Parameters) -> None:
        self.parameters, self.calls = parameters, 0

    def first_switch(
        self, field: int, now: float, state: State, end: float
    ) -> tuple[float, State, int] | None:
        from scipy.integrate import solve_ivp

        p = self.parameters
        contact, drift = _MODES[field]

        def rates(t: float, y: Any) -> list[float]:
            self.calls += 1
            if self.calls > _MOST_CALLS:
                raise GaveUp(f"over {_MOST_CALLS} evaluations")
            force = _force(p, contact, y[0], y[1])
            slip = (force - drift * p.f_b) / p.gamma if drift else 0.0
            return [y[1], p.alpha * math.cos(p.omega * t) - force - slip, slip]

        def event(guard: int) -> Callable[[float, Any], float]:
            def value(_: float, y: Any) -> float:
                return float(_guards(p, field, *y)[guard])

            value.terminal, value.direction = True, -1.0  # type: ignore[attr-defined]
            return value

        events = [event(guard) for guard in range(2 if drift else 3)]
        if now >= end:
            return None
        done = solve_ivp(
            rates, (now, end), state, method="DOP853", rtol=1e-10, atol=1e-10, events=events
        )
        if done.status < 0:
            raise GaveUp(done.message)
        if done.status == 0:
            return None
        fired = next(guard for guard, times in enumerate(done.t_events or ()) if len(times))
        x, v, w = (float(value) for value in done.y[:, -1])
        return float(done.t[-1]), (x, v, w), fired
