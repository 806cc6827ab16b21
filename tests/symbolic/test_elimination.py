"""Exact elimination with each of the number types that SymPy takes when it is installed beside."""

import io
import os
import subprocess
import sys
from contextlib import redirect_stdout
from importlib.util import find_spec

import pytest
from sympy.external.gmpy import GROUND_TYPES

SUBSTITUTED = """
from fractions import Fraction
import sympy as sp
from sympy.external.gmpy import GROUND_TYPES
from capsule_sym._symbolic.model.elimination import constraint_of
from capsule_sym._symbolic.model.symbols import alpha, delta, f_b

wanted = constraint_of(sp.Eq(3 * delta + alpha - 2 * f_b, 0))
values = [(Fraction(1, 3), 1), (Fraction(1, 3), Fraction(7, 8)), (Fraction(-1, 3), 3)]
print(GROUND_TYPES, *(wanted.at({delta: d, alpha: a}).holds() for d, a in values))
"""


@pytest.mark.parametrize(("types", "package"), [("python", "mpmath"), ("flint", "flint")])
def test_fractions_are_put_in_whatever_sympy_computes_with(types: str, package: str) -> None:
    if find_spec(package) is None:
        pytest.skip(f"{package} is not installed")
    # 3/3 + 1 = 2, 3/3 + 7/8 < 2, -3/3 + 3 = 2.
    assert _printed(types).split() == [types, "True", "False", "True"]


def _printed(types: str) -> str:
    """Output of the lines: here, if SymPy takes these types here, else in another process."""
    if types == GROUND_TYPES:
        with redirect_stdout(io.StringIO()) as printed:
            exec(SUBSTITUTED, {})
        return printed.getvalue()
    done = subprocess.run(
        [sys.executable, "-c", SUBSTITUTED],
        env={**os.environ, "SYMPY_GROUND_TYPES": types},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout
