"""Inner products of the normals of surfaces and lines with the fields beside them, Eqs. (16)-(23).

A normal of P1 = 0 or P2 = delta points to the side of the field it is multiplied with: positive
is repelling, negative attracting. A normal of P3 or P4 on L1-L4 points out of the region of
stick: positive is leaving stick, negative entering it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import (
    CELLS,
    LINES,
    P1,
    P2,
    P3,
    P4,
    PIECES,
    SEGMENTS,
    STATE,
    SURFACES,
    Linear,
    Relation,
    Sign,
    Statement,
    StateSet,
    consistent,
    reduced,
    sign_under,
)

STICK_EDGE = {"L1": (P3, +1), "L2": (P3, -1), "L3": (P4, +1), "L4": (P4, -1)}
"""Function whose bound +f_b or -f_b is reached on L1-L4."""

FIELDS = {"L1": (1, 2, 3), "L2": (3, 2, 1), "L3": (4, 5, 6), "L4": (6, 5, 4)}
"""For each line the drift beside it, tangent to P1 = 0 there, then stick, then the other drift."""

_GRAZE = "L9"


@dataclass(frozen=True)
class InnerProduct:
    """A normal's inner product with a field, on a surface or line.

    `sign` is None where it is conditional, and then positive exactly where `positive` holds.
    """

    place: str
    normal: str
    field: int
    expression: sp.Expr
    sign: Sign | None

    @property
    def relations(self) -> tuple[Relation, ...]:
        """Relations of the place."""
        return PIECES[self.place].relations

    @property
    def positive(self) -> Relation:
        """Exact condition under which the inner product is positive."""
        return sp.Gt(reduced(self.expression, self.relations), 0)


def along(function: sp.Expr, field: Linear) -> sp.Expr:
    """Inner product of the gradient of a function of the state with a field."""
    pairs = zip(STATE, field.field, strict=True)
    return sp.expand(sum(function.diff(symbol) * rate for symbol, rate in pairs))


def outward(line: str) -> sp.Expr:
    """Inner product of the normal pointing out of stick on L1-L4 with the field of stick."""
    function, side = STICK_EDGE[line]
    field = SEGMENTS[1] if function == P3 else SEGMENTS[4]
    return reduced(side * along(function, field), PIECES[line].relations)


def _adjacent(piece: StateSet) -> Iterator[Linear]:
    for field, cell in zip(SEGMENTS, CELLS, strict=True):
        if consistent([*piece.relations, *cell.closure.relations]):
            yield field


def _normals(piece: StateSet, field: Linear) -> Iterator[tuple[str, sp.Expr]]:
    on_rest = sign_under(P1, piece.relations) == 0
    on_plane = sp.Eq(P2, sp.Symbol("delta", nonnegative=True)) in piece.relations
    if on_rest:
        side = -1 if field.drift < 0 else 1
        yield f"∇P1{'+' if side > 0 else '−'}", side * P1
    if on_plane:
        yield f"∇P2{'+' if field.contact else '−'}", (P2 if field.contact else -P2)
    if piece.name in STICK_EDGE:
        function, side = STICK_EDGE[piece.name]
        name = "P3" if function == P3 else "P4"
        yield f"∇{name}{'+' if side > 0 else '−'}", side * function


@cache
def inner_products() -> tuple[InnerProduct, ...]:
    """All inner products of Section 3: every surface and line with every field beside it."""
    return tuple(
        InnerProduct(name, normal, field.index, expression, sign_under(expression, piece.relations))
        for name, piece in PIECES.items()
        if name in (*SURFACES, *LINES) and name != _GRAZE
        for field in _adjacent(piece)
        for normal, function in _normals(piece, field)
        for expression in [along(function, field)]
    )


def has_sign(product: InnerProduct, sign: Sign | Relation) -> bool:
    """Check that an inner product has a sign; a relation: both, positive exactly where it holds.

    The place is the whole surface or line.
    """
    here = product.relations
    if not isinstance(sign, sp.Rel):
        return sign_under(product.expression, here) == sign
    return (
        consistent([*here, product.expression > 0])
        and consistent([*here, product.expression < 0])
        and not consistent([*here, sign, product.expression <= 0])
        and not consistent([*here, sp.Not(sign), product.expression > 0])
    )


def _latex(product: InnerProduct) -> str:
    function, side = product.normal[1:-1], product.normal[-1].replace("−", "-")
    inner = rf"\langle\nabla {function[0]}_{function[1]}^{{{side}}},F_{product.field}\rangle"
    return f"{inner}={sp.latex(product.expression)}"


def inner() -> Iterator[Statement]:
    """Sign of every inner product, or the condition under which it is positive."""
    words = {1: "> 0", -1: "< 0", 0: "= 0"}
    for product in inner_products():
        if product.sign is None:
            sign: Any = product.positive
            wrong: Any = sp.Lt(*sign.args)
            told = f"> 0 exactly where {sign}"
            after = r"\quad\text{positive iff }" + sp.latex(sign)
        else:
            sign, wrong, told = product.sign, -product.sign or 1, words[product.sign]
            after = told if product.sign else ""
        normal = product.normal[1:].replace("−", "-")
        yield Statement(
            f"inner.{product.place}.{normal}.F{product.field}",
            "Section 3",
            f"on {product.place}, ⟨{product.normal}, F{product.field}⟩ {told}",
            has_sign,
            {"product": product, "sign": sign},
            {"sign": wrong},
            formula=_latex(product) + after,
            verdict="conditional" if product.sign is None else "proved",
        )
