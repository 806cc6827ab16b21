"""Kernels against Taylor's method on the equations of motion, which shares no formula with them."""

from __future__ import annotations

import random
from collections.abc import Iterator
from dataclasses import astuple, replace
from typing import Any

import pytest
from mpmath import mp, mpf

from capsule_sym import Parameters
from capsule_sym.generated.capsule.mp import kernels as exact
from capsule_sym.generated.capsule.py import kernels as double
from tests.crosscheck import DIGITS, UNIT, Case, flow_scale
from tests.judges import DRIFT, taylor
from tests.sampling import many, sampled

AGREEMENT = mpf("1e-30")
BOUND = 24.0  # the 16 of a kernel's own roundings and 8 for those of its start

FIELDS = range(1, 7)
CONSTANTS = ("m", "kappa", "push", "friction", "sigma", "K")
DAMPING = ("weak", "resonant", "critical", "strong")


def segments(field: int, kind: str, count: int) -> Iterator[Case]:
    """Random segments of one field, of one kind of damping, of durations up to a few periods."""
    rng = random.Random(f"{field} {kind}")
    for _ in range(count):
        beta, gamma, delta = rng.uniform(0.5, 5), rng.uniform(0.3, 8), rng.uniform(0, 0.5)
        inertia = (gamma + 1) / gamma if DRIFT[field] else 1.0
        stiffness = inertia * (1 + beta * (field > 3))
        zeta = {"weak": 0.05, "resonant": 0.0, "critical": stiffness**0.5 / inertia}.get(kind, 4.0)
        omega = stiffness**0.5 if kind == "resonant" else rng.uniform(0.2, 5)
        parameters = Parameters(rng.uniform(0, 2), omega, delta, zeta, beta, gamma, 1.0)
        x_r = delta + rng.uniform(0, 0.5) if field > 3 else rng.uniform(-1, delta)
        v_c = DRIFT[field] * rng.uniform(0.1, 1)
        state = (x_r, rng.uniform(-1, 1), v_c)
        yield Case(parameters, field, state, rng.uniform(0, 6.28), 10 ** rng.uniform(-3, 1.1))


def judged(case: Case) -> list[Any]:
    """x_r, v_r, v_c and x_c at the end by the independent run; the angle is omega tau."""
    tau = mpf(case.theta) / mpf(case.parameters.omega)
    return list(
        taylor.integrate(
            case.parameters, case.field, (*case.state, 0.0), tau, case.duration, DIGITS
        )
    )


def closed(case: Case, **wrong: Any) -> list[Any]:
    """The same by the closed form, with the requested constants multiplied."""
    p = Parameters(*astuple(case.parameters))
    c = exact.constants(case.field, *map(mpf, astuple(p)))
    c = c._replace(**{name: getattr(c, name) * factor for name, factor in wrong.items()})
    x_r, v_r, v_c = map(mpf, case.state)
    gap = x_r - mpf(p.delta)
    margin = x_r + c.kappa * gap + 2 * mpf(p.zeta) * v_r - c.friction
    angle = mp.cos(mpf(case.theta)), mp.sin(mpf(case.theta))
    start = exact.Start(x_r, gap, v_r, v_c, margin, *angle)
    position, velocity, *rest = exact.flow(c, start, mpf(case.duration), advance=True)
    change, advance = rest or (mpf(0), v_c * mpf(case.duration))
    return [x_r + position, velocity, v_c + change, advance]


def differs(case: Case, right: list[Any], found: list[Any]) -> bool:
    size = max(*map(abs, case.state), *map(abs, right))
    return any(abs(a - b) > AGREEMENT * size for a, b in zip(right, found, strict=True))


@sampled
@pytest.mark.parametrize("kind", DAMPING)
@pytest.mark.parametrize("field", FIELDS)
def test_closed_form_is_the_solution_to_30_digits(field: int, kind: str) -> None:
    with mp.workdps(DIGITS):
        for case in segments(field, kind, many(3, 1)):
            right = judged(case)
            assert not differs(case, right, closed(case)), case


@pytest.mark.parametrize("field", FIELDS)
def test_constant_wrong_in_the_twelfth_digit_is_seen(field: int) -> None:
    with mp.workdps(DIGITS):
        case = next(segments(field, "weak", 1))
        case = replace(case, duration=1.5)
        right = judged(case)
        c = case.constants(exact, mpf)
        assert not differs(case, right, closed(case))
        for name in CONSTANTS:
            # K and sigma reach the flow also through what is derived from them, such as nu.
            if getattr(c, name) != 0:
                assert differs(case, right, closed(case, **{name: 1 + mpf("1e-12")})), name


@sampled
@pytest.mark.parametrize("kind", DAMPING)
@pytest.mark.parametrize("field", FIELDS)
def test_double_is_the_solution_to_units_of_its_conditioning(field: int, kind: str) -> None:
    for case in segments(field, kind, many(8, 2)):
        c, start = case.constants(double, float), case.start(double, float)
        position, velocity, *rest = double.flow(c, start, case.duration, advance=True)
        with mp.workdps(DIGITS):
            right = judged(case)
        right[0] -= mpf(case.state[0])
        right[2] -= mpf(case.state[2])
        found = [position, velocity, *(rest or (0.0, case.state[2] * case.duration))]
        for a, b, size in zip(right, found, flow_scale(case), strict=True):
            assert abs(a - mpf(float(b))) <= BOUND * UNIT * size, case
