"""The roundings that the generator counts on a formula's operations, beside those that are made."""

import random
from typing import Any

import pytest
import sympy as sp
from mpmath import MPContext

from capsule_sym._parameters import scene
from capsule_sym.codegen._derived import formulas as formulas_of_the_model
from capsule_sym.codegen._derived import lowered
from capsule_sym.codegen._lower import lower
from capsule_sym.codegen._rounding import results_of, units
from capsule_sym.scenes import SHIPPED
from tests.sampling import many, sampled

mp = MPContext()
mp.dps = 50

x, y, z = sp.symbols("x y z", real=True)
COUNTED = [
    (x + y, 1),
    (x + y + z, 2),
    (2 * x, 0),
    (-x, 0),
    (3 * x, 1),
    (x * y * z, 2),
    (x / y, 1),
    (x**3, 2),
    (x * y / (z * z), 3),
    (x * (y + z), 2),
    (2 * x * y + z, 2),
]


@pytest.mark.parametrize(("expression", "count"), COUNTED, ids=str)
def test_operations_are_counted(expression: sp.Expr, count: int) -> None:
    kernel = lower("f", "", [(sp.Symbol("r"), expression)], ("x", "y", "z"), ("r",), frozenset())
    assert units(kernel, {}) == count + 1  # and one for higher orders


def test_what_is_off_already_is_counted() -> None:
    kernel = lower("f", "", [(sp.Symbol("r"), x * y + z)], ("x", "y", "z"), ("r",), frozenset())
    assert units(kernel, {"x": 5}) == 5 + 2 + 1
    assert units(kernel, {"x": 5}, "z") == 1 + 1


def test_a_denominator_whose_terms_cancel_is_refused() -> None:
    kernel = lower("f", "", [(sp.Symbol("r"), x / (y - z))], ("x", "y", "z"), ("r",), frozenset())
    with pytest.raises(ValueError, match="terms cancel"):
        units(kernel, {})


def test_sizes_are_what_the_counted_terms_add_up_to() -> None:
    for formula in formulas_of_the_model():
        if not formula.sized:
            continue
        counted = results_of(lowered(formula), {})
        for terms, (_, size) in zip(counted, formula.size.results, strict=True):
            found = sp.expand(sp.Add(*(one.size for one in terms)))
            named = {s: sp.Symbol(s.name, positive=True) for s in size.free_symbols}
            ones = {sp.Symbol(name, positive=True): 1 for name in ("cos_theta", "sin_theta")}
            assert sp.simplify(found.subs(ones) - size.xreplace(named)) == 0, formula.name


ARGUMENTS = {
    "force": 3,
    "pull": 4,
    "margin_at": 4,
    "force_change": 2,
    "pull_rate": 3,
    "rest_force": 2,
    "v_rate": 4,
}
ANGULAR = ("pull", "margin_at", "pull_rate", "v_rate")


def numbers(of: str, p: list[float], field: int) -> tuple[Any, Any, Any]:
    """Formulas of a scene, constants in doubles, and the same in 50 digits."""
    given = scene(of)
    exact = given.kernels_by(mp).constants(field, *map(mp.mpf, p))
    return given.formulas.Formulas, given.kernels.constants(field, *p), exact


@sampled
@pytest.mark.parametrize("name", ARGUMENTS)
@pytest.mark.parametrize("of", SHIPPED)
def test_no_formula_is_off_by_more_and_some_by_a_good_part(of: str, name: str) -> None:
    """On many draws in double precision, beside 50 digits of the same doubles."""
    facts, draw, worst = scene(of).facts, random.Random(f"{of} {name}"), 0.0
    for _ in range(many(2000, 300 if of != "capsule" else 600)):
        p = [draw.uniform(0, 2) * 10 ** draw.uniform(-2, 2) for _ in facts.PARAMETERS]
        own, c, true_c = numbers(of, p, draw.randint(1, len(facts.FIELDS)))
        given = [draw.gauss(0, 1) * 10 ** draw.uniform(-2, 2) for _ in range(ARGUMENTS[name])]
        sizes = list(map(abs, given))
        if name in ANGULAR:
            given[-1] = draw.uniform(-1, 1)  # a cosine or sine, which both have alike
            sizes.pop()
        true = getattr(own, name)(true_c, *map(mp.mpf, given))
        size = getattr(own, f"{name}_size")(c, *sizes)
        worst = max(worst, float(abs(getattr(own, name)(c, *given) - true) / size) * 2**53)
    allowed = getattr(own, f"{name.upper()}_UNITS")
    assert allowed / 8 < worst < allowed


@pytest.mark.parametrize("of", SHIPPED)
def test_a_coefficient_of_a_response_is_off_by_no_more(of: str) -> None:
    facts, draw, worst = scene(of).facts, random.Random(0), 0.0
    for _ in range(1000 if of == "capsule" else 300):
        p = [draw.uniform(0.1, 2) for _ in facts.PARAMETERS]
        own, c, true_c = numbers(of, p, draw.randint(1, len(facts.FIELDS)))
        n, reach = draw.randint(0, 20), draw.uniform(0.1, 2)
        given = [draw.gauss(0, 1) for _ in range(3)]
        true = own.response_next(true_c, n, mp.mpf(reach), *map(mp.mpf, given))
        found = own.response_next(c, n, reach, *given)
        size = own.response_next_size(c, n, reach, *map(abs, given))
        worst = max(worst, float(abs(found - true) / size) * 2**53)
    most = max(getattr(own, f"RESPONSE_NEXT_{part}_UNITS") for part in ("DRIVE", "LAST", "BEFORE"))
    assert most / 8 < worst < most
