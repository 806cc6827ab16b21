"""Checks of Section 2 in physical quantities: Eqs. (1)-(5), scaled as printed."""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from capsule_sym._symbolic.theory import PARAMETERS, SEGMENTS, Linear, delta, tau, x_r
from paper.claims.errata import CASE_STUDY, CREST
from paper.claims.formula import NotAFormula, formula, same
from paper.claims.relations import derived, scope
from paper.derived.points import example
from paper.printed import Paper

Printed = Mapping[str, str]
"""Printed texts of Section 2 by key, for one of the two cases of contact."""

_POSITIVE = ("k_1", "k_2", "c", "G", "P_d", "P_f", "Omega", "M_c", "mu", "g")
_REAL = ("X_m", "X_c", "V_m", "V_c", "A_m", "A_c", "F_f", "t")
_W = sp.Symbol("W", positive=True)  # the natural frequency; with M_m = k_1/W^2 all is rational
_PHYSICAL: dict[str, sp.Expr] = {
    **{name: sp.Symbol(name, positive=True) for name in _POSITIVE},
    **{name: sp.Symbol(name, real=True) for name in _REAL},
}
_PHYSICAL["M_m"] = _PHYSICAL["k_1"] / _W**2
_BOUND = _PHYSICAL["P_f"]
_FRICTION, _SPEED = _PHYSICAL["F_f"], _PHYSICAL["V_c"]


def _scaling(texts: Printed) -> dict[str, sp.Expr]:
    """Printed dimensionless quantities in terms of physical ones, for dry friction."""
    names = _PHYSICAL | {"F_max": _BOUND}
    names["Omega_0"] = formula(texts["Omega_0"], names)
    scaled = {str(s): formula(texts[str(s)], names) for s in (*PARAMETERS, tau)}
    for kind, letter in (("x", "X"), ("v", "V"), ("a", "A")):
        for body in "mc":
            place = names | {letter: _PHYSICAL[f"{letter}_{body}"]}
            scaled[f"{kind}_{body}"] = formula(texts[kind], place)
    return scaled | {name: formula(texts[name], scaled) for name in ("x_r", "v_r")}


def _in_physical(expression: sp.Expr, scaled: Mapping[str, sp.Expr]) -> sp.Expr:
    """Dimensionless expression in physical quantities."""
    return expression.xreplace({s: scaled[str(s)] for s in expression.free_symbols})


def _side(text: str, unknown: str) -> sp.Expr:
    """Value of an unknown according to a printed equation."""
    equation, symbol = formula(text, _PHYSICAL), _PHYSICAL[unknown]
    if not isinstance(equation, sp.Eq):
        raise NotAFormula(text)
    zero = sp.expand(equation.lhs - equation.rhs)
    slope = zero.coeff(symbol)
    return sp.expand(symbol - zero / slope)


def _friction(texts: Printed, segment: Linear) -> sp.Expr:
    if segment.stick:
        return _side(texts["reaction"], "F_f")
    return _side(texts["slip"], "F_f").xreplace({sp.sign(_SPEED): sp.Integer(segment.drift)})


def newton(field: int, texts: Printed) -> bool:
    """Check that the printed equations of motion, scaled as printed, give a field at f_b = 1."""
    segment, scaled = SEGMENTS[field - 1], _scaling(texts)
    mass = _side(texts["mass"], "A_m")
    capsule = _side(texts["capsule"], "A_c").xreplace({_FRICTION: _friction(texts, segment)})
    place = {_PHYSICAL["A_m"]: mass, _PHYSICAL["A_c"]: capsule}
    accelerations = {name: scaled[name].xreplace(place) for name in ("a_m", "a_c")}
    found = (scaled["v_r"], accelerations["a_m"] - accelerations["a_c"], accelerations["a_c"])
    return scaled["f_b"] == 1 and all(
        same(value, _in_physical(rate, scaled))
        for value, rate in zip(found, segment.field, strict=True)
    )


def rates(texts: Printed) -> bool:
    """Check that v is the rate of x, and a that of v, in the printed time."""
    names = _PHYSICAL | {"X": sp.Symbol("X"), "V": sp.Symbol("V"), "A": sp.Symbol("A")}
    names["Omega_0"] = formula(texts["Omega_0"], names)
    rate = sp.diff(formula(texts["tau"], names), _PHYSICAL["t"])
    x, v, a = (formula(texts[kind], names) for kind in ("x", "v", "a"))
    return same(x.subs(names["X"], names["V"]) / rate, v) and same(
        v.subs(names["V"], names["A"]) / rate, a
    )


def positive_scaling(texts: Printed) -> bool:
    """Check that every parameter of the model is positive for positive physical quantities."""
    scaled = _scaling(texts)
    return all(scaled[str(symbol)].is_positive for symbol in PARAMETERS)


def physical(printed: str, expected: str) -> bool:
    """Check that printed physical formulas agree for dry friction, equations side by side."""
    names = _PHYSICAL | {"F_max": _BOUND}
    pair = [formula(text, names) for text in (printed, expected)]
    if not any(isinstance(one, sp.Rel) for one in pair):
        return same(*pair)
    return all(isinstance(one, sp.Eq) for one in pair) and all(
        same(getattr(pair[0], side), getattr(pair[1], side)) for side in ("lhs", "rhs")
    )


_KINDS = {"<": sp.StrictLessThan, "<=": sp.LessThan, ">": sp.StrictGreaterThan}


def scaled_condition(printed: str, kind: str, force: str, texts: Printed) -> bool:
    """Check that a printed condition on a magnitude, scaled, is |force| kind f_b."""
    scaled = _scaling(texts)
    reaction = {_FRICTION: _side(texts["reaction"], "F_f")} if "F_f" in printed else {}
    relation = formula(printed, _PHYSICAL)
    if not isinstance(relation, _KINDS[kind]) or not isinstance(relation.lhs, sp.Abs):
        return False
    inner = relation.lhs.args[0].xreplace(reaction) / relation.rhs
    wanted = _in_physical(derived(force), scaled) / scaled["f_b"]
    return same(inner, wanted) or same(inner, -wanted)


def scaled_gap(printed: str, kind: str, texts: Printed) -> bool:
    """Check that a printed condition, scaled, is x_r kind delta."""
    relation = formula(printed, _PHYSICAL)
    found = _PHYSICAL["k_1"] / _BOUND * (relation.lhs - relation.rhs)
    return bool(relation.rel_op == kind) and same(found, _in_physical(x_r - delta, _scaling(texts)))


HELD_NOT = (
    *scope(["v_c == 0", "x_r > delta", "P3 < f_b", "P3 > -f_b", "P4 > f_b"]),
    CREST,
)
"""States in contact in which |P3| < f_b < P4."""


def omits_spring(printed: str, texts: Printed) -> bool:
    """Check that a condition of stick in contact is |P3| < f_b, where |P4| can exceed f_b."""
    point = example(HELD_NOT, CASE_STUDY)
    return scaled_condition(printed, "<", "P3", texts) and point[x_r] > point[delta]


def texts_of(paper: Paper, frame: int) -> dict[str, str]:
    """Printed texts of Section 2 by key, with Eq. (3) or (5) for the capsule."""
    return {
        **paper["scaling.parameters"].printed,
        **paper["scaling.state"].printed,
        "slip": paper["equation.1"]["slip"],
        "reaction": paper[f"equation.{frame}.stick"]["reaction"],
        "mass": paper[f"equation.{frame - 1}"]["motion"],
        "capsule": paper[f"equation.{frame}"]["motion"],
    }
