"""Python and C against the same kernels at 50 digits, in units of conditioning.

The bound on an error is 16 units of roundoff of what a kernel adds up: about as many roundings as
stand between an input and a result (constants 4, response functions 6, sum 6).
"""

from collections.abc import Callable
from dataclasses import astuple
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from capsule_sym import Parameters
from capsule_sym._native import core
from capsule_sym.generated.capsule import DIGEST
from tests.crosscheck import DIGITS, UNIT, Case, cases, double, exact, flow_scale, jacobian_scale
from tests.sampling import many, sampled


def damping_ratio(case: Case) -> float:
    """Fast rate over sqrt(K): 1 up to critical damping."""
    c = case.constants(double, float)
    return float(c.fast / np.sqrt(c.K))


GENERATED_C = Path(__file__).parents[2] / "generated" / "capsule" / "c"
BOUND = 16.0
STRONG = 4.0  # ratio of the fast rate to sqrt(K) from which damping is strong

FLOWS = list(cases(many(400, 60), seed=1))
JACOBIANS = [case for case in cases(many(45, 10), seed=2) if damping_ratio(case) < STRONG]
STRONGLY_DAMPED = [case for case in cases(many(300, 50), seed=3) if damping_ratio(case) >= STRONG]
Rows = list[Any]
Evaluate = Callable[[list[Case]], list[Rows]]


@cache
def exact_flow(case: Case) -> Rows:
    with mp.workdps(DIGITS):
        c, start = case.constants(exact, mpf), case.start(exact, mpf)
        return list(exact.flow(c, start, mpf(case.duration), advance=True))


@cache
def exact_jacobian(case: Case) -> Rows:
    with mp.workdps(DIGITS):
        c, start = case.constants(exact, mpf), case.start(exact, mpf)
        return exact.jacobian(c, start, mpf(case.duration))


def scalar(kernel: Callable[..., Any], **options: bool) -> Evaluate:
    def evaluate(batch: list[Case]) -> list[Rows]:
        results = []
        for case in batch:
            c, start = case.constants(double, float), case.start(double, float)
            results.append(list(kernel(c, start, case.duration, **options)))
        return results

    return evaluate


def native(batch: list[Case]) -> list[tuple[Rows, Rows]]:
    """Values and Jacobians by the C kernels."""
    if core is None:
        pytest.skip("the C core was not compiled")
    found = []
    for case in batch:
        fields = core.fields(np.array(astuple(case.parameters)))
        start = np.array(case.start(double, float))
        values, rows = fields.closed_form(case.field, start, case.duration)
        count = 4 if case.constants(double, float).drift else 2
        found.append((values[:count], rows[:count]))
    return found


def native_flow(batch: list[Case]) -> list[Rows]:
    return [values for values, _ in native(batch)]


def native_jacobian(batch: list[Case]) -> list[Rows]:
    return [rows for _, rows in native(batch)]


def worst_flow(evaluate: Evaluate, batch: list[Case]) -> tuple[float, Case]:
    def units(case: Case, result: Rows) -> float:
        errors = [
            abs(value - mpf(float(r))) for value, r in zip(exact_flow(case), result, strict=True)
        ]
        return max(float(e) / (UNIT * s) for e, s in zip(errors, flow_scale(case), strict=False))

    measured = [(units(c, r), c) for c, r in zip(batch, evaluate(batch), strict=True)]
    return max(measured, key=lambda pair: pair[0])


def worst_jacobian(evaluate: Evaluate, batch: list[Case]) -> tuple[float, str, Case]:
    measured = []
    for case, result in zip(batch, evaluate(batch), strict=True):
        rows = zip(exact_jacobian(case), result, jacobian_units(case), strict=True)
        for (i, row), column in product(enumerate(rows), range(len(double.JACOBIAN_COLUMNS))):
            value, found, unit = (part[column] for part in row)
            error = float(abs(value - mpf(float(found))))
            if error:
                entry = f"row {i}, {double.JACOBIAN_COLUMNS[column]}"
                measured.append((error / unit if unit else np.inf, entry, case))
    return max(measured, key=lambda found: found[0])


@cache
def jacobian_units(case: Case) -> list[list[float]]:
    return [[UNIT * size for size in row] for row in jacobian_scale(case)]


FLOW_OF = {
    "scalars": scalar(double.flow, advance=True),
    "c": native_flow,
}
JACOBIAN_OF = {
    "scalars": scalar(double.jacobian),
    "c": native_jacobian,
}


@sampled
@pytest.mark.parametrize("of", FLOW_OF)
def test_flows(of: str) -> None:
    units, case = worst_flow(FLOW_OF[of], FLOWS)
    assert units < BOUND, case


@sampled
@pytest.mark.parametrize("of", JACOBIAN_OF)
def test_jacobians(of: str) -> None:
    units, entry, case = worst_jacobian(JACOBIAN_OF[of], JACOBIANS)
    assert units < BOUND, (entry, case)


def test_flow_under_strong_damping_from_a_slow_forcing() -> None:
    """Found among 6000 random segments: damping rate 711, stiffness 12, forcing 0.007."""
    parameters = Parameters(1.05, 0.0073, 0.49, 57.2, 3.86, 0.0875, 1.0)
    case = Case(parameters, 1, (0.6034, 0.9262, 0.1486), 1.1709, 0.000865)
    units, _ = worst_flow(scalar(double.flow, advance=True), [case])
    assert units < BOUND


@sampled
def test_jacobian_under_strong_damping() -> None:
    units, entry, case = worst_jacobian(scalar(double.jacobian), STRONGLY_DAMPED)
    assert units < BOUND, (entry, case)


def test_a_wrong_constant_is_seen() -> None:
    """A stiffness wrong by 1e-13 of itself is far outside the bound."""

    def evaluate(batch: list[Case]) -> list[Rows]:
        results = []
        for case in batch:
            c, start = case.constants(double, float), case.start(double, float)
            wrong = c._replace(m=c.m * (1 + 1e-13))
            results.append(list(double.flow(wrong, start, case.duration, advance=True)))
        return results

    units, _ = worst_flow(evaluate, FLOWS)
    assert units > 10 * BOUND


def test_library_is_of_the_same_inputs() -> None:
    assert f'#define CAPSULE_DIGEST "{DIGEST}"' in (GENERATED_C / "capsule_kernels.h").read_text()


def test_jets() -> None:
    """Jets agree to a unit of roundoff of their magnitudes a step, and never exceed these."""
    order = double.JET_ORDER
    steps = [*range(1, order + 1), *range(1, order + 2)]
    for case in FLOWS:
        c, start = case.constants(double, float), case.start(double, float)
        inputs = [start.x_r, start.gap, start.v_r, start.cos_theta, start.sin_theta]
        with mp.workdps(DIGITS):
            truth = exact.jet(case.constants(exact, mpf), *map(mpf, inputs))
        sizes = double.jet_magnitudes(c, *map(abs, inputs[:3]))
        for value, right, size, n in zip(double.jet(c, *inputs), truth, sizes, steps, strict=True):
            assert abs(value - right) <= 4 * n * UNIT * size, case
        pairs = zip(truth, sizes, strict=True)
        assert all(abs(right) <= size * (1 + BOUND * UNIT) for right, size in pairs)
