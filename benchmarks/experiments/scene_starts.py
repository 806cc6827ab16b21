"""Random starts of any scene that lead close to a tangency, a corner or an edge, or begin there.

The state to be met is chosen first, at a distance between 1e-2 and 1e-17 from the degenerate one or
on it, at a time that is an edge of the drive or any other; the start is where a field comes from to
meet it. Rounding moves it by a few units more: the judge decides the real outcome.
"""

from __future__ import annotations

import math
from random import Random
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from tests.scenes import GENERAL, Form, Start

KINDS = ("graze", "sliding", "corner", "landing", "impact start", "slip start", "anywhere")
EDGES = ("graze", "sliding", "corner", "landing", "crossing", "break", "edge start")
_LONGEST = 4.0  # duration before the state to be met, over the field's rate


class HardStart(NamedTuple):
    """A start, its kind, and its distance from a degenerate one, infinite if there is none.

    If two conditions are to hold the distance is the larger one; a rate counts squared, as it moves
    a minimum by the square.
    """

    kind: str
    distance: float
    start: Start


class Field(NamedTuple):
    """A field of the general form: level, contact and way, and the equations in it."""

    p: dict[str, float]
    form: Form
    level: int
    contact: int
    way: int

    @property
    def kappa(self) -> float:
        """Stiffness ratio of the contact, 0 without one."""
        return (0.0, self.p["beta_1"], self.p["beta_2"])[self.contact]

    @property
    def stop(self) -> float:
        """x_r at which the contact begins, 0 without one."""
        return (0.0, self.p["delta_1"], -self.p["delta_2"])[self.contact]

    @property
    def friction(self) -> float:
        """Friction on the capsule, with its sign."""
        return (-self.p["f_minus"], 0.0, self.p["f_plus"])[self.way + 1]

    def push(self, level: int, t: float) -> tuple[float, float]:
        """The drive and its rate."""
        if self.form.pulsed:
            return self.p["alpha_low" if level else "alpha"], 0.0
        angle = self.p["omega"] * t
        return self.p["alpha"] * math.cos(angle), -self.p["omega"] * self.p["alpha"] * math.sin(
            angle
        )

    def matrix(self) -> np.ndarray:
        """Rates of (x_r, v_r, v_c, cosine, sine, 1)."""
        p = self.p
        force = np.array([1 + self.kappa, 2 * p["zeta"], 0, 0, 0, -self.kappa * self.stop])
        drive = np.zeros(6)
        if self.form.pulsed:
            drive[5] = self.push(self.level, 0)[0]
        else:
            drive[3] = p["alpha"]
        slip = np.zeros(6)
        if self.way:
            slip = force - self.form.reacts * drive
            slip[5] -= self.friction
            slip /= p["gamma"]
        a = np.zeros((6, 6))
        a[0, 1] = 1
        a[1] = drive - force - slip
        a[1, 5] -= p["s"]
        a[2] = slip
        if not self.form.pulsed:
            a[3, 4], a[4, 3] = -p["omega"], p["omega"]
        return a

    def before(self, state: tuple[float, ...], t: float, h: float) -> tuple[float, float, float]:
        """The state so much earlier."""
        angle = self.p["omega"] * t
        z = np.array([*state, math.cos(angle), math.sin(angle), 1.0])
        x, v, c = map(float, (expm(-h * self.matrix()) @ z)[:3])
        return x, v, c if self.way else 0.0

    def position(self, force: float, v_r: float) -> float:
        """x_r at which P has this value."""
        forces = force - 2 * self.p["zeta"] * v_r + self.kappa * self.stop
        return forces / (1 + self.kappa)

    def holds(self, state: tuple[float, float, float], t: float) -> bool:
        """True if the state is in the field's region or about on its boundary, of moderate size."""
        x, v, c = state
        front, back = self.p["delta_1"], -self.p["delta_2"]
        if not all(math.isfinite(value) and abs(value) < 1e3 for value in state):
            return False
        if (x > front) != (self.contact == 1) and x != front:
            return False
        if self.form.stops == 2 and (x < back) != (self.contact == 2) and x != back:
            return False
        if self.way:
            return self.way * c >= 0
        force = x + 2 * self.p["zeta"] * v + self.kappa * (x - self.stop)
        q = force - self.form.reacts * self.push(self.level, t)[0]
        return -1.5 * self.p["f_minus"] <= q <= 1.5 * self.p["f_plus"]


def hard_start(form: Form, r: Random) -> HardStart:
    """A start of one of the kinds; `r` decides everything."""
    while True:
        parameters = _parameters(form, r)
        p = dict(zip(GENERAL, form.general(parameters), strict=True))
        contact, way = r.randint(0, form.stops), r.randint(-1, 1)
        field = Field(p, form, r.randint(0, int(form.pulsed)), contact, way)
        period = 2 * math.pi / p["omega"]
        begins, ends = 0.0, period
        if form.pulsed:
            begins, ends = ((0.0, p["D"] * period), (p["D"] * period, period))[field.level]
        at_edge = form.pulsed and r.random() < 0.5
        kind = r.choice(EDGES if at_edge else KINDS)
        t = ends if at_edge else r.uniform(begins, ends)
        target = _target(r, kind, field, t)
        if target is None:
            continue
        state, distance = target
        if kind in {"impact start", "slip start", "anywhere"}:
            start = t
        elif kind == "edge start":
            distance = abs(_offset(r))
            start = t - distance * period
        else:
            rate = math.sqrt((1 + field.kappa) * (1 + 1 / p["gamma"])) + 2 * p["zeta"]
            h = r.uniform(0.01, 1.0) * _LONGEST / rate
            if form.pulsed:
                h = min(h, (t - begins) * r.choice([1.0, r.random()]))
            start = t - h
            state = field.before(state, t, h)
        start = start % period if not form.pulsed else max(start, begins)
        if start < period and field.holds(state, start):
            name = f"edge at {kind}" if at_edge and kind != "edge start" else kind
            return HardStart(name, distance, Start(parameters, state, start))


def _parameters(form: Form, r: Random) -> dict[str, float]:
    def log(low: float, high: float) -> float:
        return math.exp(r.uniform(math.log(low), math.log(high)))

    alpha = 0.0 if r.random() < 0.03 else log(1e-2, 1e1)
    share = r.choice([0.5, r.random(), 10 ** r.uniform(-8, -1)])
    drawn = {
        "alpha": alpha,
        "omega": log(1e-1, 1e1),
        "zeta": 0.0 if r.random() < 0.05 else log(1e-3, 3.0),
        "gamma": log(1e-1, 3e1),
        "f_b": 1.0,
        "s": r.choice([0.0, log(1e-3, 1.0) * r.choice((-1, 1))]),
        "f_plus": log(1e-1, 3.0),
        "alpha_low": r.choice([0.0, alpha, -alpha, *(log(1e-2, 1e1) * r.choice((-1, 1)),) * 3]),
        "D": min(max(share if r.random() < 0.5 else 1 - share, 1e-8), 1 - 1e-8),
    }
    drawn["f_minus"] = drawn["f_plus"] * r.choice([1.0, 100.0, 0.01, log(0.1, 10)])
    for gap in ("delta", "delta_1", "delta_2"):
        drawn[gap] = 0.0 if r.random() < 0.03 else log(1e-3, 3.0)
    if drawn["delta_1"] == drawn["delta_2"] == 0:
        drawn["delta_2"] = 0.5
    for stiffness in ("beta", "beta_1", "beta_2"):
        drawn[stiffness] = r.choice([900.0, *(log(1e-1, 1e3),) * 9])
    return {name: drawn[name] for name in form.names}


def _offset(r: Random) -> float:
    """1e-2 to 1e-17 with a random sign; or 0."""
    if r.random() < 0.1:
        return 0.0
    return float(10.0 ** r.uniform(-17.0, -2.0) * r.choice((-1.0, 1.0)))


def _moved(value: float, offset: float) -> float:
    """A value off by so much, relative if it is larger than 1."""
    return value + offset * max(1.0, abs(value))


_Target = tuple[tuple[float, float, float], float]


def _target(r: Random, kind: str, f: Field, t: float) -> _Target | None:
    """The state to be met (or to start from) and its distance; None where the kind does not fit."""
    p, speed = f.p, r.gauss(0.0, 1.0)
    surface = f.stop
    if not f.contact:
        surface = p["delta_1"] if f.form.stops == 1 or r.random() < 0.5 else -p["delta_2"]
    v_c = f.way * abs(r.gauss(0.0, 1.0))
    first, second = _offset(r), _offset(r)
    touching, meeting = max(abs(first), second * second), max(abs(first), abs(second))
    if kind == "graze":
        return (_moved(surface, first), second, v_c), touching
    if kind == "impact start":
        if r.random() < 0.5:
            return (_moved(surface, first), speed, v_c), abs(first)
        return (_moved(surface, first), second, v_c), touching
    if kind in {"anywhere", "edge start"}:
        return (surface + r.gauss(0.0, 1.0), speed, v_c), math.inf
    if kind in {"corner", "crossing"} and f.way:
        if kind == "corner":
            return (_moved(surface, first), speed, second), meeting
        gap = r.random() < 0.5
        x_r = _moved(surface, first) if gap else surface + r.gauss(0.0, 1.0)
        return (x_r, speed, v_c if gap else first), abs(first)
    drive, rate = f.push(f.level, t)
    bound = r.choice((p["f_plus"], -p["f_minus"]))
    if kind == "break":  # the edge of the drive changes Q
        drive = f.push(1 - f.level, t)[0]
    force = _moved(bound, first) + f.form.reacts * drive
    if kind == "landing":
        return ((f.position(force, speed), speed, second), meeting) if f.way else None
    if f.way:
        return None
    if kind == "sliding":
        turning = f.form.reacts * rate - 2 * p["zeta"] * (drive - p["s"] - force)
        v_r = _moved(turning / (1 + f.kappa), second)
        return (f.position(force, v_r), v_r, 0.0), touching
    if kind == "corner" and p["zeta"]:
        x_r = _moved(surface, second)
        v_r = (force - x_r - f.kappa * (x_r - f.stop)) / (2 * p["zeta"])
        return (x_r, v_r, 0.0), meeting
    if kind in {"slip start", "crossing", "break"}:
        return (f.position(force, speed), speed, 0.0), abs(first)
    return None
