"""Printed formulas as SymPy expressions: arithmetic over a closed list of names, nothing else.

The text is parsed with Python's syntax, and its tree is translated node by node. Nodes that are not
listed here are refused, so that a formula can never run code.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import (
    P1,
    P2,
    P3,
    P4,
    PARAMETERS,
    STATE,
    Relation,
    tau,
    vanishes,
    zeta,
)

NAMES: dict[str, sp.Expr] = {
    **{str(symbol): symbol for symbol in (*PARAMETERS, tau, *STATE)},
    **{"P1": P1, "P2": P2, "P3": P3, "P4": P4},
}
"""Dimensionless quantities of Sections 2 to 4."""

_FUNCTIONS: dict[str, Callable[[sp.Expr], sp.Expr]] = {
    "abs": sp.Abs,
    "cos": sp.cos,
    "sign": sp.sign,
    "sqrt": sp.sqrt,
}
_OPERATIONS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}
_RELATIONS: dict[type[ast.cmpop], Callable[[Any, Any], Relation]] = {
    ast.Lt: sp.Lt,
    ast.LtE: sp.Le,
    ast.Gt: sp.Gt,
    ast.GtE: sp.Ge,
    ast.Eq: sp.Eq,
}


class NotAFormula(ValueError):
    """Raised for a text of the transcription that is not a formula over the known names."""


def _translated(node: ast.expr, names: Mapping[str, sp.Expr]) -> Any:
    match node:
        case ast.Constant(value=int(number)) if not isinstance(number, bool):
            return sp.Integer(number)
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_translated(operand, names)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATIONS:
            return _OPERATIONS[type(op)](_translated(left, names), _translated(right, names))
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in _FUNCTIONS:
            return _FUNCTIONS[name](_translated(argument, names))
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _RELATIONS:
            return _RELATIONS[type(op)](_translated(left, names), _translated(right, names))
    raise NotAFormula(ast.unparse(node))


def formula(text: str, names: Mapping[str, sp.Expr] = NAMES) -> Any:
    """Printed expression or relation; raises `NotAFormula` if it is not one."""
    try:
        tree = ast.parse(text, mode="eval")
    except SyntaxError:
        raise NotAFormula(text) from None
    return _translated(tree.body, names)


def relations(texts: Iterable[str], names: Mapping[str, sp.Expr] = NAMES) -> tuple[Relation, ...]:
    """Printed relations, each as the linear ones it consists of.

    |P| < f_b becomes two; fractions are cleared of their denominators, which are positive for
    zeta > 0, because exact decisions need relations that are linear.
    """
    return tuple(plain for text in texts for plain in _plain(formula(text, names)))


def _plain(relation: Relation) -> Iterable[Relation]:
    if relation in (sp.true, sp.false):
        return (relation,)
    left, right = relation.lhs, relation.rhs
    if isinstance(left, sp.Abs):
        kind = type(relation)
        if kind not in (sp.StrictLessThan, sp.LessThan):
            raise NotAFormula(relation)
        (inner,) = left.args
        return kind(inner, right), kind(-inner, right)
    return (cleared(relation),)


def cleared(relation: Relation) -> Relation:
    """A relation multiplied by its denominators, products of zeta, gamma, 1 + beta and numbers."""
    sides = [sp.together(side) for side in (relation.lhs, relation.rhs)]
    scale = sp.lcm(*map(sp.denom, sides))
    positive = scale.subs(zeta, sp.Symbol("zeta", positive=True)).is_positive
    if not positive:
        raise NotAFormula(relation)
    left, right = (sp.expand(sp.cancel(side * scale)) for side in sides)
    return type(relation)(left, right)


def same(first: sp.Expr, second: sp.Expr) -> bool:
    """True if two expressions are identically equal."""
    return vanishes(first - second)
