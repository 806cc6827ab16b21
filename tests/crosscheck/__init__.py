"""Kernels at random starts, and the size of each sum: the unit of their errors.

A kernel is checked on its own inputs: the doubles of a start are exact numbers, also at 50 digits.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import astuple, dataclass
from typing import Any

from mpmath import mp, mpf

from capsule_sym import Parameters
from capsule_sym._closed_forms import Kernels
from capsule_sym._parameters import CAPSULE

double, exact = CAPSULE.kernels, CAPSULE.kernels_by(mp)
UNIT = 2.0**-53  # unit roundoff of double precision
DIGITS = 50


@dataclass(frozen=True)
class Case:
    """One segment: parameters, field, start (x_r, v_r, v_c), forcing angle and duration."""

    parameters: Parameters
    field: int
    state: tuple[float, float, float]
    theta: float
    duration: float

    def constants(self, kernels: Kernels, number: Any) -> Any:
        """The segment's constants, from the parameters as exact numbers."""
        return kernels.constants(self.field, *map(number, astuple(self.parameters)))

    def start(self, kernels: Kernels, number: Any) -> Any:
        """The start in doubles, each converted to the kernel's kind of number."""
        x_r, v_r, v_c = self.state
        gap = x_r - self.parameters.delta
        with mp.workdps(DIGITS):
            c = self.constants(exact, mpf)
            margin = float(x_r + c.kappa * gap + 2 * mpf(self.parameters.zeta) * v_r - c.friction)
        angle = math.cos(self.theta), math.sin(self.theta)
        return kernels.Start(*map(number, (x_r, gap, v_r, v_c, margin, *angle)))


def cases(count: int, seed: int) -> Iterator[Case]:
    """Random segments: all fields, three to six decades of every rate, and the confluences.

    A fifth lies at or beside resonance, a fifth at or one ulp beside critical damping.
    """
    rng = random.Random(seed)
    for _ in range(count):
        field = rng.randint(1, 6)
        zeta = rng.choice([0.0, 1e-12, 0.05, 1.0, rng.uniform(0, 2), 10 ** rng.uniform(-3, 2)])
        beta = rng.choice([0.0, 1.5, 10 ** rng.uniform(-2, 4)])
        gamma = rng.choice([3.3, 10 ** rng.uniform(-2, 3)])
        omega = rng.choice([0.8, 1.0, 10 ** rng.uniform(-3, 3)])
        inertia = 1.0 if field in (2, 5) else (gamma + 1) / gamma
        stiffness = inertia * (1 + beta * (field > 3))
        confluence = rng.random()
        if confluence < 0.2:
            omega = math.sqrt(stiffness) * (1 + rng.choice([0, 1e-12, 1e-6, 1e-2, 0.1]))
            zeta = rng.choice([0.0, 1e-9, 0.01])
        elif confluence < 0.4:
            critical = math.sqrt(stiffness) / inertia
            zeta = critical * (1 + rng.choice([0, 2.3e-16, -1.2e-16, 1e-9, -1e-9, 1e-3]))
        delta = rng.uniform(0, 0.5)
        x_r = delta + 10 ** rng.uniform(-4, 0) if field > 3 else rng.uniform(-1, 1)
        parameters = Parameters(rng.uniform(0, 2), omega, delta, zeta, beta, gamma, 1.0)
        state = (x_r, rng.uniform(-1, 1), rng.uniform(-1, 1))
        yield Case(parameters, field, state, rng.uniform(0, 6.28), 10 ** rng.uniform(-6, 1.3))


@dataclass(frozen=True)
class _Sizes:
    """Bounds on what the flow adds up: position, velocity, and the momentum of both bodies."""

    position: float
    velocity: float
    momentum: float
    moment: float  # integral of the momentum

    @staticmethod
    def of(case: Case) -> _Sizes:
        p, h = case.parameters, case.duration
        c, start = case.constants(exact, mpf), case.start(exact, float)
        m, kappa, K, fast = map(float, (c.m, c.kappa, c.K, c.fast))
        # Each response function by its bound up to h, each force by its terms' magnitudes.
        velocity_response, position_response = min(h, 1 / fast), min(h * h / 2, 2 / K)
        force = abs(float(c.push)) + m * (abs(start.x_r) + kappa * abs(start.gap))
        speed, forced = abs(start.v_r), p.alpha * min(h * h / 2, h / math.sqrt(K))
        position = speed * velocity_response + force * position_response + forced
        velocity = speed + force * velocity_response + p.alpha * h
        impulse = h * (p.f_b + p.alpha)
        return _Sizes(
            position, velocity, velocity + speed + impulse, position + speed * h + impulse * h
        )


def flow_scale(case: Case) -> list[float]:
    """Size of what `flow` adds up for each component, times 1 + rate h; dimensionless.

    A relative error u of a rate shifts the phase of motion by u rate h.
    """
    p, h, size = case.parameters, case.duration, _Sizes.of(case)
    c, start = case.constants(exact, mpf), case.start(exact, float)
    kappa, rate = float(c.kappa), float(c.rate)
    if rate * h < 1:
        damping = 2 * p.zeta * (size.position + abs(start.v_r) * h)
        growth = (1 + kappa) * size.position * h + damping
        drift = (abs(start.margin) * h + growth) / p.gamma
    else:
        drift = size.momentum / (p.gamma + 1)
    advance = abs(start.v_c) * h + size.moment / (p.gamma + 1)
    scales = (size.position, size.velocity, drift, advance)
    return [scale * (1 + rate * h) for scale in scales]


def jacobian_scale(case: Case) -> list[list[float]]:
    """Size of what each entry of `jacobian` adds up, times 1 + rate h; rows as the kernel's.

    An entry of x_r or v_r is affine in the start. Its size is the sum of the magnitudes that each
    part of the start, and friction, give it alone; the largest at h, 5h/8 and 3h/8, for it may pass
    through zero. Those of v_c and x_c follow by the momentum of both bodies.
    """
    with mp.workdps(20):
        c, start = case.constants(exact, mpf), case.start(exact, mpf)
        # cos and sin of the angle are 1 in turn, so that no angle hides a term.
        parts = {"x_r": start.x_r, "gap": start.gap, "v_r": start.v_r}
        parts |= {"cos_theta": mpf(1), "sin_theta": mpf(1)}
        zero = exact.Start(*[mpf(0)] * 7)
        rows = [[0.0] * len(exact.JACOBIAN_COLUMNS) for _ in range(2)]
        for h in (mpf(case.duration) * part for part in (1, mpf(5) / 8, mpf(3) / 8)):
            still = exact.jacobian(c, zero, h)[:2]
            alone = [exact.jacobian(c, zero._replace(**{k: v}), h) for k, v in parts.items()]
            for i, row in enumerate(still):
                for j, base in enumerate(row):
                    size = abs(base) + sum(abs(part[i][j] - base) for part in alone)
                    rows[i][j] = max(rows[i][j], float(size))
        rows[0][0] += 1.0  # the increment of x_r is added to x_r
    if c.drift != 0:
        rows += _by_momentum(case, rows)
    growth = 1 + float(c.rate) * case.duration
    return [[growth * value for value in row] for row in rows]


def _by_momentum(case: Case, rows: list[list[float]]) -> list[list[float]]:
    p, h, size = case.parameters, case.duration, _Sizes.of(case)
    whole = p.gamma + 1
    force = p.alpha + p.f_b
    # Bounds on derivatives of v_r - friction h + alpha (sin(theta + omega h) - sin(theta))/omega.
    momentum = {"v_r": 1, "theta": p.alpha * h, "h": force, "alpha": h, "omega": p.alpha * h * h}
    momentum |= {"f_b": h, "gamma": size.momentum / whole, "v_c": whole}
    moment = {name: value * h for name, value in momentum.items()}
    moment |= {"h": size.momentum + whole * abs(case.state[2]), "gamma": size.moment / whole}
    return [
        [
            (inner + sums.get(name, 0.0)) / whole
            for name, inner in zip(exact.JACOBIAN_COLUMNS, row, strict=True)
        ]
        for row, sums in ((rows[1], momentum), (rows[0], moment))
    ]
