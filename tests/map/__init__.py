"""Tests of the run-time map, with the true motion from the one-segment judge beside it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from math import sqrt
from random import Random
from typing import Any

from mpmath import mp, mpf

from capsule_sym import Parameters
from capsule_sym._map.backend import Backend, NumpyBackend
from capsule_sym._map.course import Begin, Course, SegmentStart
from capsule_sym._map.expansion import Guard
from tests.judges import CONTACT, DRIFT, taylor

FIELDS = tuple(DRIFT)
DIGITS = 30

REGIMES = {
    "case study": Parameters(),
    "no damping": Parameters(zeta=0.0),
    "critical in F2": Parameters(zeta=1.0),
    "critical in F5": Parameters(zeta=2.0, beta=3.0),
    "critical in F1 and F3": Parameters(zeta=0.5, gamma=1 / 3),
    "critical in F4 and F6": Parameters(zeta=1.0, gamma=1 / 3, beta=3.0),
    "overdamped": Parameters(zeta=50.0),
    "stiff spring": Parameters(beta=1e6),
    "light capsule": Parameters(gamma=1e-3),
    "heavy capsule": Parameters(gamma=1e4),
    "resonance in F2": Parameters(zeta=0.0, omega=1.0),
    "resonance in F5": Parameters(zeta=0.0, beta=3.0, omega=2.0),
    "resonance in F1 and F3": Parameters(zeta=0.0, gamma=1 / 3, omega=2.0),
    "beside resonance": Parameters(zeta=1e-9, beta=3.0, omega=sqrt(4.0) + 1e-9),
    "no forcing": Parameters(alpha=0.0),
    "strong forcing": Parameters(alpha=1e6),
    "slow forcing": Parameters(omega=1e-3),
    "fast forcing": Parameters(omega=100.0),
    "slow and overdamped": Parameters(omega=1e-4, zeta=200.0, beta=30.0),
    "no gap": Parameters(delta=0.0),
    "wide gap": Parameters(delta=100.0),
}


@dataclass(frozen=True)
class Motion:
    """A motion in one field from a state and forcing angle, all floats, taken exactly."""

    parameters: Parameters
    field: int
    state: tuple[float, float, float]
    angle: float

    def flow(self, numbers: Backend) -> Course:
        """The map's closed form of this motion."""
        number = numbers.number
        c = numbers.constants(self.field, self.parameters)
        x_r, v_r, v_c = map(number, self.state)
        gap = x_r - number(self.parameters.delta)
        margin = x_r + c.kappa * gap + 2 * c.zeta * v_r - c.friction
        start = Begin(x_r, gap, v_r, v_c, margin, number(self.angle), {})
        return Course(numbers, c, SegmentStart(self.field, start))

    @cache  # noqa: B019 (a test's motions live as long as the test)
    def state_at(self, h: Any) -> Any:
        """(x_r, v_r, v_c, x_c, cos, sin, 1) after a duration, by the judge, to `DIGITS` digits."""
        with mp.workdps(DIGITS + 10):
            angle, omega = mpf(self.angle), mpf(self.parameters.omega)
            turned = angle + omega * mpf(h)
            state = (*self.state, 0.0)
            if h:
                state = taylor.integrate(
                    self.parameters, self.field, state, angle / omega, h, digits=DIGITS
                )
            return mp.matrix([*map(mpf, state), mp.cos(turned), mp.sin(turned), 1])

    @cached_property
    def rows(self) -> dict[Guard, Any]:
        """Every watched guard as a functional of that vector, positive inside the region."""
        p, side = self.parameters, 1 if CONTACT[self.field] else -1
        beta = mpf(p.beta) if CONTACT[self.field] else mpf(0)
        gap = mp.matrix([[side, 0, 0, 0, 0, 0, -side * mpf(p.delta)]])
        if drift := DRIFT[self.field]:
            return {Guard.GAP: gap, Guard.DRIFT: mp.matrix([[0, 0, drift, 0, 0, 0, 0]])}
        with mp.workdps(DIGITS + 10):
            push = mp.matrix([[1 + beta, 2 * mpf(p.zeta), 0, 0, 0, 0, -beta * mpf(p.delta)]])
            bound = mp.matrix([[0, 0, 0, 0, 0, 0, mpf(p.f_b)]])
            return {Guard.GAP: gap, Guard.UPPER: bound - push, Guard.LOWER: bound + push}

    def derivatives(self, vector: Any, count: int) -> dict[Guard, list[Any]]:
        """Every guard and its time derivatives by the equations of motion, `count` in all."""
        matrix = taylor.system(self.parameters, self.field)
        powers = [vector]
        for _ in range(count - 1):
            powers.append(matrix * powers[-1])
        return {guard: [(row * z)[0] for z in powers] for guard, row in self.rows.items()}


def random_motion(parameters: Parameters, field: int, random: Random) -> Motion:
    """A motion that starts anywhere, its size that of friction's bound, or on x_r = delta."""
    x_r = parameters.delta if random.random() < 0.2 else random.gauss(0, 1)
    v_c = random.gauss(0, 1) * (DRIFT[field] != 0) * random.choice([0, 1, 1])
    state = (x_r, random.gauss(0, 1), v_c)
    return Motion(parameters, field, state, random.uniform(0, 6.28))


def constants(motion: Motion) -> Any:
    """The double constants of a motion's segment."""
    return NumpyBackend().constants(motion.field, motion.parameters)


def _cases() -> Iterator[tuple[Motion, Any]]:
    """A random motion in each field and regime, at its start and at a later time."""
    for name, parameters in REGIMES.items():
        for field in FIELDS:
            random = Random(f"{name} {field}")
            motion = random_motion(parameters, field, random)
            yield motion, 0.0
            yield motion, 10 ** random.uniform(-6, 3) / constants(motion).rate


CASES = list(_cases())
"""Random motions at their start and at a later time, in each regime and field."""
