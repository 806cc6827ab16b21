"""NumPy (scalar and lanes) and C against the same kernels at 50 digits, in units of conditioning.

The bound on an error is 16 units of roundoff of what a kernel adds up: about as many roundings as
stand between an input and a result (constants 4, response functions 6, sum 6).
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections import defaultdict
from collections.abc import Callable
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from capsule_sym import Parameters
from capsule_sym.generated.capsule import DIGEST
from tests.crosscheck import (
    DIGITS,
    UNIT,
    Case,
    cases,
    double,
    exact,
    flow_scale,
    jacobian_scale,
)
from tests.sampling import many, sampled


def damping_ratio(case: Case) -> float:
    """Fast rate over sqrt(K): 1 up to critical damping."""
    c = case.constants(double, float)
    return float(c.fast / np.sqrt(c.K))


GENERATED_C = Path(__file__).parents[2] / "generated" / "capsule" / "c"
BOUND = 16.0
STRONG = 4.0  # ratio of the fast rate to sqrt(K) from which damping is strong

FLOWS = list(cases(many(400, 150), seed=1))
JACOBIANS = [case for case in cases(many(45, 20), seed=2) if damping_ratio(case) < STRONG]
STRONGLY_DAMPED = [case for case in cases(many(300, 100), seed=3) if damping_ratio(case) >= STRONG]
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


def lanes(kernel: Callable[..., Any], **options: bool) -> Evaluate:
    """All cases of one field in one call."""

    def evaluate(batch: list[Case]) -> list[Rows]:
        results: dict[Case, Rows] = {}
        fields = defaultdict(list)
        for case in batch:
            fields[case.field].append(case)
        for field, group in fields.items():
            # Constants of the mode (contact, drift) stay scalar, as the kernel expects them.
            columns = zip(*(case.parameters.__getstate__() for case in group), strict=True)
            c = double.constants(field, *map(np.array, columns))
            starts = zip(*(case.start(double, float) for case in group), strict=True)
            h = np.array([case.duration for case in group])
            values = kernel(c, double.Start(*map(np.array, starts)), h, **options)
            results |= {case: [v[..., i] for v in values] for i, case in enumerate(group)}
        return [results[case] for case in batch]

    return evaluate


class _Constants(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_double) for name in double.Constants._fields if name != "resonant"),
        ("resonant", ctypes.c_int),
    ]


class _Start(ctypes.Structure):
    _fields_ = [(name, ctypes.c_double) for name in double.Start._fields]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler `cc` on this machine")
    target = tmp_path_factory.mktemp("c") / "kernels.so"
    source = GENERATED_C / "capsule_kernels.c"
    flags = ["-std=c99", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror"]
    subprocess.run([compiler, *flags, "-shared", "-fPIC", "-o", target, source, "-lm"], check=True)
    loaded = ctypes.CDLL(str(target))
    loaded.capsule_flow_advance.restype = ctypes.c_double
    return loaded


def native_arguments(library: ctypes.CDLL, case: Case) -> tuple[_Constants, _Start]:
    c = _Constants()
    parameters = (ctypes.c_double * 7)(*case.parameters.to_dict().values())
    library.capsule_constants_of(case.field, parameters, ctypes.byref(c))
    return c, _Start(*case.start(double, float))


def native_flow(library: ctypes.CDLL) -> Evaluate:
    def evaluate(batch: list[Case]) -> list[Rows]:
        results = []
        for case in batch:
            c, start = native_arguments(library, case)
            out, h = (ctypes.c_double * 3)(), ctypes.c_double(case.duration)
            library.capsule_flow(ctypes.byref(c), ctypes.byref(start), h, out)
            if c.drift == 0:
                results.append(list(out[:2]))
                continue
            advance = library.capsule_flow_advance(
                ctypes.byref(c), ctypes.byref(start), ctypes.c_double(out[0]), h
            )
            results.append([*out, advance])
        return results

    return evaluate


def native_jacobian(library: ctypes.CDLL) -> Evaluate:
    def evaluate(batch: list[Case]) -> list[Rows]:
        results = []
        width = len(double.JACOBIAN_COLUMNS)
        for case in batch:
            c, start = native_arguments(library, case)
            rows = 2 if c.drift == 0 else 4
            out = (ctypes.c_double * (rows * width))()
            h = ctypes.c_double(case.duration)
            library.capsule_jacobian(ctypes.byref(c), ctypes.byref(start), h, out)
            results.append([out[i * width : (i + 1) * width] for i in range(rows)])
        return results

    return evaluate


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


@sampled
@pytest.mark.parametrize("of", ["scalars", "lanes", "c"])
def test_flows(of: str, request: pytest.FixtureRequest) -> None:
    by = {"scalars": scalar, "lanes": lanes}
    evaluate = (
        by[of](double.flow, advance=True)
        if of in by
        else native_flow(request.getfixturevalue("library"))
    )
    units, case = worst_flow(evaluate, FLOWS)
    assert units < BOUND, case


@sampled
@pytest.mark.parametrize(
    ("of", "batch"),
    [("scalars", JACOBIANS), ("lanes", JACOBIANS), ("c", JACOBIANS), ("scalars", STRONGLY_DAMPED)],
    ids=["scalars", "lanes", "c", "strong damping"],
)
def test_jacobians(of: str, batch: list[Case], request: pytest.FixtureRequest) -> None:
    by = {"scalars": scalar, "lanes": lanes}
    evaluate = (
        by[of](double.jacobian) if of in by else native_jacobian(request.getfixturevalue("library"))
    )
    units, entry, case = worst_jacobian(evaluate, batch)
    assert units < BOUND, (entry, case)


def test_flow_under_strong_damping_from_a_slow_forcing() -> None:
    """Found among 6000 random segments: damping rate 711, stiffness 12, forcing 0.007."""
    parameters = Parameters(1.05, 0.0073, 0.49, 57.2, 3.86, 0.0875, 1.0)
    case = Case(parameters, 1, (0.6034, 0.9262, 0.1486), 1.1709, 0.000865)
    units, _ = worst_flow(scalar(double.flow, advance=True), [case])
    assert units < BOUND


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
