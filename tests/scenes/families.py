"""Starts of expansions that show what the terms of the certificate are for that scenes bring."""

import math
from collections.abc import Callable
from dataclasses import replace
from random import Random

from tests.native.certificate import mp, mpf
from tests.scenes import Form
from tests.scenes.certificate import Place, Start, Truth, log

REACTION, PULSES = Form(reacts=True), Form(reacts=True, pulsed=True)
STOPS = Form(stops=2)
BOTH = ("1", "106 bits")


def _reacting(random: Random) -> dict[str, float]:
    return {
        "alpha": log(random, 1e-1, 3.0),
        "omega": log(random, 1e-1, 1e1),
        "delta": log(random, 1e-3, 3.0),
        "zeta": log(random, 1e-3, 1.0),
        "beta": log(random, 1e-1, 1e2),
        "gamma": log(random, 1e-1, 3e1),
        "f_b": 1.0,
    }


def reacting(random: Random) -> Start:
    """Anywhere, in rest or drift."""
    p, way, contact = _reacting(random), random.choice((-1, 0, 1)), random.randint(0, 1)
    x_r = p["delta"] + (1 if contact else -1) * abs(random.gauss(0, 1))
    state = x_r, random.gauss(0, 1), way * abs(random.gauss(0, 1))
    return Start(REACTION, p, Place(0, contact, way), state, random.uniform(0, 2 * math.pi))


def driven(random: Random) -> Start:
    """At rest under the drive alone, which Q has at once and the motion only later."""
    p = {**_reacting(random), "zeta": 1e-3, "delta": 50.0, "f_b": 100.0, "alpha": 5.0}
    p["omega"] = random.uniform(10, 30)
    state = (1e-9 * random.random(), 1e-9 * random.random(), 0.0)
    return Start(REACTION, p, Place(0, 0, 0), state, random.uniform(0, 2 * math.pi))


def ahead(random: Random) -> Start:
    """The drive's angle is off, so fast a drive that it moves hardly the mass."""
    start, off = driven(random), 1e-6
    reach = 4.0 / start.parameters["omega"]
    size = off * start.parameters["alpha"] * reach
    errors, moved = (size, 0.0, off), (0.0, 0.0, 0.0, off * (1 - 1e-9))
    return replace(start, errors=errors, off=moved)


def pushed_off(random: Random) -> Start:
    """A drift on a long expansion, where what its series leaves out is largest."""
    p = {**_reacting(random), "zeta": 0.02, "omega": random.uniform(0.3, 1.0), "alpha": 1.0}
    state = (random.gauss(0, 1), random.uniform(0.5, 2), 50.0)
    return Start(
        REACTION, {**p, "delta": 50.0}, Place(0, 0, 1), state, random.uniform(0, 2 * math.pi)
    )


def from_a_bound(random: Random) -> Start:
    """At rest under the drive alone, from where Q is at a bound exactly."""
    start, way = driven(random), random.choice((1, -1))
    p = {**start.parameters, "f_b": random.uniform(0.1, 4.9)}
    angle = math.acos(-way * p["f_b"] / p["alpha"])
    angle = angle if way * math.sin(angle) < 0 else 2 * math.pi - angle
    return replace(start, parameters=p, angle=angle, bound_at=way, state=(0.0, 0.0, 0.0))


def late_bound(random: Random) -> Start:
    """Q meets a bound late on a long expansion, by the drive alone."""
    start = driven(random)
    p, angle = start.parameters, random.uniform(0, 2 * math.pi)
    t = random.uniform(0.9, 0.97) * 4.5 / p["omega"]
    truth = Truth(replace(start, angle=angle))
    pull = truth.pull(mpf(t))
    start = replace(
        start, parameters={**p, "f_b": float(abs(pull))}, angle=angle, hints=(t,), steps=4
    )
    before = (min(Truth(start).guards(mpf(t * k / 50))) for k in range(50))
    return start if abs(pull) > 0.1 and min(before) > 0 else late_bound(random)


def _between(random: Random) -> dict[str, float]:
    gaps = {"delta_1": random.uniform(0.01, 0.3), "delta_2": random.uniform(0.0, 0.3)}
    return {
        **gaps,
        "alpha": random.uniform(1, 3),
        "omega": random.uniform(0.3, 1.0),
        "zeta": random.uniform(0.01, 0.3),
        "beta_1": random.uniform(1, 10),
        "beta_2": random.uniform(1, 10),
        "gamma": log(random, 0.3, 3),
        "f_b": random.uniform(0.3, 1.0),
    }


def from_stop_to_stop(random: Random) -> Start:
    """x_r passes delta_1, v_c vanishes or Q meets a bound, x_r comes back and passes -delta_2."""
    p, way = _between(random), random.choice((1, 0, -1))
    first = random.choice((1, -1))  # the front's turn first, or that behind
    stop = p["delta_1"] if first > 0 else -p["delta_2"]
    past, angle = stop + first * 10 ** random.uniform(-4, -1.5), random.uniform(0, 2 * math.pi)
    v_r = first * random.uniform(0.0, 0.5)
    if way:
        target = (past, v_r, 0.0)
    else:
        target = (past, v_r, 0.0)
        p["f_b"] = abs(past + 2 * p["zeta"] * v_r)
    truth = Truth(Start(STOPS, p, Place(0, 0, way), target, angle))
    t = random.uniform(0.02, 0.5)
    state, began = truth.before(t), (angle - p["omega"] * t) % (2 * math.pi)
    start = Start(STOPS, p, Place(0, 0, way), state, began)
    again = Truth(start)
    fine = min(again.guards(mpf(0))) > 0
    return start if fine else from_stop_to_stop(random)


def beside_a_stop(random: Random) -> Start:
    """Hardly a motion next to the stop in front: all that is rounded is the gap behind."""
    tiny = 1e-9
    p = {**_between(random), "alpha": tiny, "delta_1": tiny, "omega": 1.0}
    p["delta_2"] = random.uniform(1.0, 2.0)
    state = (0.9 * tiny * random.random(), tiny * random.random(), 0.0)
    return Start(STOPS, p, Place(0, 0, 0), state, random.uniform(0, 6))


def resting(random: Random) -> Start:
    """Oscillations without damping, about as large as the smaller of both gaps."""
    p = {**_between(random), "alpha": 0.2, "omega": 0.5, "zeta": 0.0, "f_b": 10.0}
    state = (random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0.0)
    angle = random.uniform(0, 2 * math.pi)
    start = Start(STOPS, p, Place(0, 0, 0), state, angle)
    far = float(Truth(start).farthest())
    smaller = far * (1 + random.uniform(-0.1, 0.1))
    gaps = [smaller, 3 * far]
    random.shuffle(gaps)
    return replace(start, parameters={**p, "delta_1": gaps[0], "delta_2": gaps[1]})


def _pulsed(random: Random) -> dict[str, float]:
    p = _reacting(random)
    return {
        **p,
        "omega": random.uniform(0.3, 1.0),
        "zeta": random.uniform(0.02, 0.4),
        "gamma": random.uniform(0.2, 3.0),
        "alpha_low": random.uniform(-2, 2),
        "delta": 20.0,
        "D": 0.5,
    }


def _levelling(random: Random, depth: float, t: float) -> Start:
    """v_c falls, levels out about zero, comes back a little, and falls below zero.

    The edge lies between both. v_c' = v_c'' = 0 at the level, but for what the return takes:
    v_c = c - a t^3/6 + b t, with b = a w^2/2 for turns at -w and w.
    """
    p, way = _pulsed(random), random.choice((1, -1))
    w, place, friction = (3 * depth) ** (1 / 3), Place(0, 0, way), way * p["f_b"]
    v_r = 2 * p["zeta"] * friction  # P' = v_r + 2 zeta v_r', where v_r' = u - P = -f
    x_r = friction + p["alpha"] - 2 * p["zeta"] * v_r
    third = mp.diff(Truth(Start(PULSES, p, place, (x_r, v_r, 0.0), 1.0)).velocity, 0, 3)
    if way * third >= 0:
        return _levelling(random, depth, t)
    a = float(-way * third)
    lift = way * p["gamma"] * a * w * w / 2
    level = way * a * w**3 / 3 * random.uniform(-0.3, 1.0)
    state = Truth(Start(PULSES, p, place, (x_r + lift, v_r, level), 1.0)).before(t)
    until, p["D"] = t + w * random.uniform(-1.0, 1.9), random.uniform(0.3, 0.9)
    angle = 2 * math.pi * p["D"] - p["omega"] * until
    hints = (t - 1.5 * w, t - w, t - 0.5 * w, t, t + w)
    return Start(PULSES, p, place, state, angle, steps=4, hints=hints)


def levelling(random: Random) -> Start:
    """By about a remainder of the form."""
    return _levelling(random, 10 ** random.uniform(-16, -11), random.uniform(0.2, 0.8))


def grazing(random: Random) -> Start:
    """x_r passes the stop and comes back, just before the edge."""
    p, way, depth = _pulsed(random), random.choice((1, -1)), 10 ** random.uniform(-11, -5)
    p["delta"] = random.uniform(0.0, 1.0)
    target, place = (p["delta"] + depth, 0.0, 5.0 * way), Place(0, 0, way)
    begun = Truth(Start(PULSES, p, place, target, 1.0))
    if begun.moved(mpf(10) ** -9)[1] >= 0:
        return grazing(random)
    t = random.uniform(0.05, 0.6)
    p["D"] = random.uniform(0.5, 0.9)
    angle = 2 * math.pi * p["D"] - p["omega"] * (t + 10 ** random.uniform(-5, -0.5))
    state = begun.before(t)
    start = Start(PULSES, p, place, state, angle, steps=4, hints=(t,))
    return start if angle > 0 and min(Truth(start).guards(mpf(0))) > 0 else grazing(random)


def _corner(random: Random, t: float, until: float) -> tuple[Start, Truth]:
    p, way = _pulsed(random), random.choice((1, -1))
    p["delta"], p["D"] = random.uniform(0.0, 0.5), random.uniform(0.5, 0.9)
    target, place = (p["delta"], random.uniform(0.3, 1.0), 0.0), Place(0, 0, way)
    state = Truth(Start(PULSES, p, place, target, 1.0)).before(t)
    angle = 2 * math.pi * p["D"] - p["omega"] * until
    start = Start(PULSES, p, place, state, angle, hints=(t,))
    truth = Truth(start)
    fine = angle > 0 and min(truth.guards(mpf(0))) > 0 and min(truth.guards(mpf(0.5 * t))) > 0
    return (start, truth) if fine else _corner(random, t, until)


def corner_at_a_late_edge(random: Random) -> Start:
    """x_r meets delta and v_c vanishes at once, before the edge if that is as late as it may be."""
    t, off = random.uniform(0.1, 0.3), 1e-6
    start, _ = _corner(random, t, t - random.uniform(0.2, 0.8) * off)
    return replace(start, errors=(0.0, 0.0, off), off=(0.0, 0.0, 0.0, -off * (1 - 1e-9)))


def corner_of_a_displaced_motion(random: Random) -> Start:
    """And before the edge if x_r is as far ahead as it may be."""
    t, size = random.uniform(0.1, 0.3), 1e-6
    start, truth = _corner(random, t, t - 0.1 * random.uniform(0.2, 0.8) * size)
    off = size / math.sqrt(float(truth.K)) * (1 - 1e-9)
    return replace(start, errors=(size, 0.0, 0.0), off=(off, 0.0, 0.0, 0.0))


def breaking(random: Random) -> Start:
    """A rest that the edge breaks, or leaves."""
    p = {**_pulsed(random), "f_b": 0.5, "alpha": 0.4}
    level, share = random.randint(0, 1), random.uniform(0.3, 0.9)
    p["alpha_low"], p["D"] = p["alpha"] + random.uniform(-2, 2), share
    pull = random.uniform(-0.4, 0.4)
    x_r = pull + p["alpha_low" if level else "alpha"]
    edge = 2 * math.pi * (1.0 if level else share)
    t = random.uniform(0.01, 0.1)
    return Start(PULSES, p, Place(level, 0, 0), (x_r, 0.0, 0.0), edge - p["omega"] * t)


FAMILIES: dict[str, tuple[str, Callable[[Random], Start], float, tuple[str, ...]]] = {
    "reacting": ("reaction", reacting, 0.0, BOTH),
    "driven": ("reaction", driven, 0.0, BOTH),
    "ahead": ("reaction", ahead, 0.0, BOTH),
    "pushed off": ("reaction", pushed_off, 4.5, BOTH),
    "late bound": ("reaction", late_bound, 4.5, ("1",)),
    "late bound, 106 bits": ("reaction", late_bound, 9.0, ("106 bits",)),
    "from a bound": ("reaction", from_a_bound, 0.0, BOTH),
    "from stop to stop": ("two_stops", from_stop_to_stop, 3.0, ("1",)),
    "beside a stop": ("two_stops", beside_a_stop, 0.0, BOTH),
    "resting": ("two_stops", resting, 0.0, BOTH),
    "levelling": ("reaction_pulse", levelling, 0.0, ("1",)),
    "grazing": ("reaction_pulse", grazing, 0.0, ("1",)),
    "corner at a late edge": ("reaction_pulse", corner_at_a_late_edge, 0.0, BOTH),
    "corner of a displaced motion": ("reaction_pulse", corner_of_a_displaced_motion, 0.0, BOTH),
    "breaking": ("reaction_pulse", breaking, 0.0, BOTH),
}
"""Families by name: scene, how a start is drawn, length of expansions (0: the library), widths."""
