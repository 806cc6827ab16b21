"""Random starts that lead close to a tangency or a corner, or begin close to one.

The state to be met is chosen first, at a distance between 1e-1 and 1e-17 from the degenerate one
or on it; the start is where a field comes from to meet it. Rounding moves it by a few units more:
what really happens is for the reference check to say.
"""

from __future__ import annotations

import math
from random import Random
from typing import Any, NamedTuple

import numpy as np

from benchmarks.hardcases.reference import Start
from capsule_sym import Parameters
from capsule_sym._map.interface import NumpyBackend

KINDS = ("graze", "sliding", "corner", "impact start", "slip start", "anywhere")
_LONGEST = 4.0  # duration before the state to be met, over the segment's rate


class RandomStart(NamedTuple):
    """A start, of which kind it is, and how far from degenerate.

    The distance is that of the state to be met, as chosen: the larger one if two conditions are
    to hold, where a rate counts squared, like its shift of a minimum; infinite if none is.
    """

    kind: str
    distance: float
    start: Start


class _Target(NamedTuple):
    state: tuple[float, float, float]
    distance: float


def random_start(random: Random) -> RandomStart:
    """A start of one of the kinds; `random` decides everything."""
    numbers = NumpyBackend()
    while True:
        parameters = _parameters(random)
        kind, field = random.choice(KINDS), random.randint(1, 6)
        angle = random.uniform(0.0, 2 * math.pi)
        c = numbers.constants(field, parameters)
        target = _target(random, kind, c, angle)
        if target is None:
            continue
        state = target.state
        if kind in KINDS[:3]:
            h = random.uniform(0.01, 1.0) * _LONGEST / c.rate
            angle = (angle - c.omega * h) % (2 * math.pi)
            state = _before(numbers, c, angle, h, state)
        phase = angle / parameters.omega
        if _inside(c, state) and phase < parameters.period:
            start = Start(parameters, state, phase, periods=2, max_segments=1)
            return RandomStart(kind, target.distance, start)


def _parameters(random: Random) -> Parameters:
    def log(low: float, high: float) -> float:
        return math.exp(random.uniform(math.log(low), math.log(high)))

    special = random.random()
    return Parameters(
        alpha=0.0 if special < 0.03 else log(1e-2, 1e1),
        omega=log(1e-1, 1e1),
        delta=0.0 if 0.03 < special < 0.06 else log(1e-3, 3.0),
        zeta=0.0 if 0.06 < special < 0.1 else log(1e-3, 3.0),
        beta=log(1e-1, 1e3),
        gamma=log(1e-1, 3e1),
    )


def _offset(random: Random) -> float:
    """1e-1 to 1e-17 with a random sign; or 0."""
    if random.random() < 0.1:
        return 0.0
    distance: float = 10.0 ** random.uniform(-17.0, -1.0) * random.choice((-1.0, 1.0))
    return distance


def _moved(value: float, offset: float) -> float:
    """A value off by so much, relative if it is larger than 1."""
    return value + offset * max(1.0, abs(value))


def _target(random: Random, kind: str, c: Any, angle: float) -> _Target | None:
    """The state to be met (or to start from), None where the kind does not fit the field."""
    delta: float = c.delta
    speed = random.gauss(0.0, 1.0)
    v_c = float(c.drift) * abs(random.gauss(0.0, 1.0))
    first, second = _offset(random), _offset(random)
    touching, meeting = max(abs(first), second * second), max(abs(first), abs(second))
    if kind == "graze":
        return _Target((_moved(delta, first), second, v_c), touching)
    if kind == "corner" and c.drift:
        return _Target((_moved(delta, first), speed, second), meeting)
    if kind == "impact start":
        if random.random() < 0.5:
            return _Target((_moved(delta, first), speed, v_c), abs(first))
        return _Target((_moved(delta, first), second, v_c), touching)
    force = random.choice((-1.0, 1.0)) * _moved(c.f_b, first)
    if kind == "sliding" and not c.drift:
        v_r = c.turning_velocity(c.alpha * math.cos(angle) - force)
        return _Target((_position(c, force, v_r), _moved(v_r, second), 0.0), touching)
    if kind == "corner" and c.zeta:
        v_r = float(c.velocity_at(force))
        return _Target((_moved(delta, second), v_r, 0.0), meeting)
    if kind == "slip start":
        return _Target((_position(c, force, speed), speed, 0.0), abs(first))
    if kind == "anywhere":
        return _Target((delta + random.gauss(0.0, 1.0), speed, v_c), math.inf)
    return None


def _position(c: Any, force: float, v_r: float) -> float:
    """x_r at which the interaction force has this value."""
    return float(c.position_at(force, v_r))


def _before(
    numbers: NumpyBackend, c: Any, angle: float, h: float, target: tuple[float, float, float]
) -> tuple[float, float, float]:
    """The state a duration h before the target; the closed form is affine in the start."""
    cosine, sine = numbers.cos_sin(angle)

    def reached(x_r: float, v_r: float) -> Any:
        margin = c.margin_at(x_r, x_r - c.delta, v_r)
        closed = numbers.kernels.Start(x_r, x_r - c.delta, v_r, 0.0, margin, cosine, sine)
        values = [float(value) for value in numbers.kernels.flow(c, closed, h)]
        return np.array([x_r + values[0], values[1], values[2] if c.drift else 0.0])

    at_zero = reached(0.0, 0.0)
    columns = np.column_stack([reached(1.0, 0.0) - at_zero, reached(0.0, 1.0) - at_zero])
    x_r, v_r = np.linalg.solve(columns[:2], np.array(target[:2]) - at_zero[:2])
    drifted = reached(float(x_r), float(v_r))[2]
    return float(x_r), float(v_r), float(target[2] - drifted) if c.drift else 0.0


def _inside(c: Any, state: tuple[float, float, float]) -> bool:
    """True if the state is in the field's region or on its boundary, and of moderate size."""
    x_r, v_r, v_c = state
    gap = x_r - c.delta
    if not all(abs(value) < 1e3 for value in state) or (gap > 0 and not c.contact):
        return False
    if c.drift:
        return (gap >= 0 or not c.contact) and c.drift * v_c >= 0
    force = c.force(x_r, gap, v_r)
    return (gap >= 0 or not c.contact) and abs(force) <= 1.5 * c.f_b
