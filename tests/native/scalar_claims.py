"""Claims about a start: its field is the successor or rests, forever or long, a run continues
from its end, and whether one side by side with others switches as one alone.

Starts where a rounding decides, and which of these answers are false.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from random import Random

from capsule_sym import Parameters
from tests.native.certificate import WIDTHS, Core, Start, Truth, mpf
from tests.native.families import before, growth, stopped

_WAY = {1: 1, 2: 0, 3: -1, 4: 1, 5: 0, 6: -1}


def _any(random: Random) -> Parameters:
    delta, omega, zeta = (random.uniform(0.2, 2.0) for _ in range(3))
    return Parameters(1.0, omega, delta, zeta, random.uniform(0.1, 3), random.uniform(0.5, 4))


def touching(random: Random) -> Start:
    """x_r is delta, at rest there, and the forcing holds it but for a rounding."""
    p, field, angle = _any(random), random.choice((2, 5)), random.uniform(0, 1.2)
    p = p.replace(alpha=p.delta / math.cos(angle), f_b=9.0)
    return Start(p, field, (p.delta, 0.0, 0.0), angle, zeros=(2, 0))


def bound(random: Random) -> Start:
    """A resting capsule whose P is +-f_b but for a rounding."""
    return _at_bound(random, random.choice((1, 2, 3, 4, 5, 6)))


def _at_bound(random: Random, field: int) -> Start:
    p, side = _any(random), 1 if field > 3 else -1
    x_r = p.delta + side * random.uniform(0.1, 2.0)
    spring = p.beta * (x_r - p.delta) if field > 3 else 0.0
    sign = _WAY[field] or random.choice((1, -1))
    v_r = (sign * p.f_b - x_r - spring) / (2 * p.zeta)
    zeros = (0, 1 if _WAY[field] else 0)
    return Start(p, field, (x_r, v_r, 0.0), random.uniform(0, 2 * math.pi), zeros=zeros)


def turning(random: Random) -> Start:
    """P is +-f_b exactly, and neither rises nor falls there but for a rounding."""
    start = _at_bound(random, random.choice((1, 2, 3, 4, 5, 6)))
    p, way = start.parameters, _WAY[start.field]
    x_r, v_r, _ = start.state
    pull = x_r + 2 * p.zeta * v_r + (p.beta * (x_r - p.delta) if start.field > 3 else 0.0)
    stiff = 1 + (p.beta if start.field > 3 else 0.0)
    # P' = stiff v + 2 zeta v' vanishes where v' = alpha cos(angle) - P - v_c' is this.
    needed = pull - stiff * v_r / (2 * p.zeta) + (pull - way * p.f_b) / p.gamma * (way != 0)
    p = p.replace(alpha=abs(needed / math.cos(start.angle)))
    if needed / math.cos(start.angle) < 0:
        start = replace(start, angle=(start.angle + math.pi) % (2 * math.pi))
    zeros = (0, 2 if way else (1 if pull > 0 else -1))
    return replace(start, parameters=p, zeros=zeros)


def resting(random: Random) -> Start:
    """Without damping |x_r| comes as close to delta as to a rounding."""
    omega = random.choice((random.uniform(0.2, 3.0), 10.0 ** random.uniform(2, 4)))
    alpha = random.uniform(0.1, 0.5) * omega if omega > 3 else 0.3
    p = Parameters(alpha, omega, 1.0, 0.0, 1.5, 3.3)
    angle, x_r = random.uniform(0, 2 * math.pi), 1e-3 * random.gauss(0, 1)
    v_r = (
        p.alpha / (1 - omega**2) * -omega * math.sin(angle) if omega > 3 else 0.1 * random.random()
    )
    return _meeting(random, Start(p, 2, (x_r, v_r, 0.0), angle), 1e-15)


def resonant(random: Random) -> Start:
    """The same near resonance, where K - omega^2 cancels."""
    p = Parameters(1e-6, 1.0 + 10.0 ** random.uniform(-6, -4), 1.0, 0.0, 1.5, 3.3)
    angle = random.uniform(0, 2 * math.pi)
    return _meeting(random, Start(p, 2, (0.1 * random.random(), 0.0, 0.0), angle), 1e-12)


def resting_displaced(random: Random) -> Start:
    """The same, where the true motion is off by what the errors allow."""
    start, turn, size = resting(random), random.uniform(0, 2 * math.pi), 1e-4
    off = (size * math.cos(turn), size * math.sin(turn), 0.0, 0.0)
    return _meeting(random, replace(start, errors=(size, 0.0, 0.0), off=off), 1e-5)


def resting_out_of_phase(random: Random) -> Start:
    """The same, where the forcing's angle is off."""
    start, size = resting(random), 1e-4
    off = (0.0, 0.0, 0.0, random.choice((1, -1)) * size)
    return _meeting(random, replace(start, errors=(0.0, 0.0, size), off=off), 1e-5)


def growing(random: Random) -> Start:
    """A slow growth near resonance to about delta or f_b, in eight periods."""
    omega, angle = 1 + random.uniform(-1e-3, 1e-3), random.uniform(0, 2 * math.pi)
    delta, f_b = random.sample((1.0, 9.0), 2)
    p = Parameters(random.choice((1e-4, 0.03)), omega, delta, 0.0, 1.5, 3.3, f_b)
    size, turn = random.uniform(0, 2), random.uniform(0, 2 * math.pi)
    return Start(p, 2, (size * math.cos(turn), size * math.sin(turn), 0.0), angle)


def growing_displaced(random: Random) -> Start:
    """The same, where the true motion is off by what the errors allow."""
    start = growing(random)
    x_r, v_r, _ = start.state
    size = 0.3 / max(math.hypot(x_r, v_r), 0.1)
    return replace(start, errors=(0.3, 0.0, 0.0), off=(size * x_r, size * v_r, 0.0, 0.0))


def _meeting(random: Random, start: Start, within: float) -> Start:
    """With delta or f_b where |x_r|, which is |P|, comes to."""
    most = float(Truth(start).farthest()) * (1 + within * random.uniform(-1, 1))
    bounds = (most, 9.0 * most) if random.random() < 0.5 else (9.0 * most, most)
    return replace(start, parameters=start.parameters.replace(delta=bounds[0], f_b=bounds[1]))


def interrupted(random: Random) -> Start:
    """A period ends as x_r meets delta, but for a rounding."""
    field = random.choice((1, 2, 4, 5))
    side, p = (1 if field > 3 else -1), _any(random).replace(zeta=0.05, f_b=9.0)
    target = (p.delta, -side * random.uniform(0.2, 1), 5.0 * _WAY[field])
    start = before(p, field, target, 0.0, random.uniform(0.05, 0.2) / growth(p, field))
    inside = start.angle > 0 and min(Truth(start).guards(mpf(0))) > 0
    return start if inside else interrupted(random)


def lasting(random: Random) -> Start:
    """A drift that takes 6 to 13 expansions, of a forcing that allows no rest."""
    gamma = random.uniform(0.5, 4)
    p = Parameters(1.1, random.uniform(0.05, 0.3), 9.0, 0.05, 1.5, gamma)
    t = random.uniform(9, 18) * math.sqrt(gamma / (gamma + 1))
    start = before(p, 1, (0.0, 0.0, 0.0), random.uniform(0, 2 * math.pi), t)
    truth = Truth(start)
    inside = all(min(truth.guards(mpf(t * i / 40))) > 0 for i in range(40))
    return start if inside else lasting(random)


def stopping(random: Random) -> Start:
    """A drift that ends where P is -+f_b within rounding, of a forcing that allows no rest."""
    start = stopped(random)
    return start if start.parameters.alpha > 0.4 else stopping(random)


SCALAR, LANES = ("1", "106 bits"), ("4", "8")
CLAIMS: dict[str, tuple[str, Callable[[Random], Start], tuple[str, ...]]] = {
    "touching": ("successor", touching, SCALAR),
    "bound": ("successor", bound, SCALAR),
    "turning": ("successor", turning, SCALAR),
    "resting": ("rests", resting, SCALAR),
    "resonant": ("rests", resonant, SCALAR),
    "resting displaced": ("rests", resting_displaced, SCALAR),
    "resting out of phase": ("rests", resting_out_of_phase, SCALAR),
    "growing": ("lasts", growing, SCALAR),
    "growing displaced": ("lasts", growing_displaced, SCALAR),
    "interrupted": ("goes_on", interrupted, (*WIDTHS,)),
    "lasting": ("the_same_as_alone", lasting, LANES),
    "stopping side by side": ("as_alone", stopping, LANES),
    "touching side by side": ("as_alone", touching, LANES),
}
"""Families of starts, the claims, and the widths at which they are checked."""


def first_false_answer(core: Core, family: str, width: str, starts: range) -> str:
    """A start with a false claim of the scalar code; empty if there is none."""
    question, draw, _ = CLAIMS[family]
    core.reach.value = 0.0
    for number in starts:
        start = draw(Random(f"{family} {number}"))
        said = core.asked(question, width, start)
        if question in ("goes_on", "as_alone", "the_same_as_alone"):
            if not said:
                return f"{question}: {start}"
            continue
        truth = Truth(start)
        if question == "successor" and said >= 0 and bool(said) != truth.takes_over():
            return f"takes over: {said}, {start}"
        p = start.parameters
        if question == "rests" and said and truth.farthest() >= min(p.delta, p.f_b):
            return f"rests for ever: {start}"
        times = (p.period * i / 8 for i in range(65))
        if question == "lasts" and said and any(min(truth.guards(mpf(t))) < 0 for t in times):
            return f"rests for eight periods: {start}"
    return ""
