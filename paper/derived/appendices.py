"""Checks of Appendices A and B: conditions under which stick ends on L1-L4, and bifurcations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import sympy as sp

from capsule_sym._symbolic.theory import (
    PIECES,
    Relation,
    Statement,
    alpha,
    always_solvable,
    force,
    implies,
    sign_under,
    v_c,
    v_r,
    x_r,
    zeta,
)
from paper.derived.inner_products import outward
from paper.derived.parts import BIFURCATIONS, BOUNDS, PARTS, Part, StickBound, bifurcations, part

_DAMPED = sp.Gt(zeta, 0)
BY_LINE = {bound.line: bound for bound in BOUNDS}


def _one_way(bound: StickBound) -> sp.Expr:
    return bound.side * outward(bound.line)


def sharp(line: str, condition: Relation) -> bool:
    """Check that a bound is sufficient, and for each parameter beyond it some point violates it."""
    here, way = PIECES[line].relations, _one_way(BY_LINE[line])
    return implies([_DAMPED, *here, condition], way > 0) and always_solvable(
        [_DAMPED, sp.Not(condition)], [*here, sp.Le(way, 0)], (x_r, v_r, v_c, force)
    )


def _both_signs(one: Part) -> bool:
    """True if at every v_r inside a part the product takes both signs at some phase."""
    product = outward(one.line)
    low, high = one.within
    inside = (_DAMPED, alpha > 0, sp.Gt(low.lhs, low.rhs), sp.Lt(high.lhs, high.rhs))
    return (
        all(always_solvable(inside, [sp.Gt(sign * product, 0)], [force]) for sign in (1, -1))
        and sign_under(product, [*one.relations, *inside]) is None
    )


def stick_does(place: str, printed: str) -> bool:
    """Check that on a part of a line stick always ends, always begins, or does either in time."""
    one = part(place)
    if printed == "?":
        return one.side is None and _both_signs(one)
    return sign_under(outward(one.line), one.relations) == {"ends": 1, "begins": -1}[printed]


def within_bound(line: str) -> Part:
    """L1 or L4 within its open bound in Appendix A."""
    bound = BY_LINE[line]
    return Part(line, 0, (_DAMPED, sp.Lt(*bound.condition)), bound.side)


def sliding(place: str, printed: Sequence[str]) -> bool:
    """Check that exactly these sliding bifurcations are possible on a part, or on L1 or L4."""
    one = part(place) if "^" in place else within_bound(place)
    return len(set(printed)) == len(printed) and bifurcations(one) == set(printed)


def on_part(place: str, does: str, printed: Sequence[str]) -> bool:
    """Check what stick does on a part of a line, and which bifurcations are possible there."""
    return stick_does(place, does) and sliding(place, printed)


_STICK = {1: "ends", -1: "begins", None: "?"}
_OCCUR = {1: ("crossing", "grazing"), -1: ("switching",), None: BIFURCATIONS}
"""Sliding bifurcations claimed for a part, by the behaviour of stick there."""


def items() -> Iterator[Statement]:
    """Bounds on alpha within which stick always ends on L1 and L4, or always begins on L2 and L3.

    Yields:
        Each bound as sufficient and necessary; then for each part of L1-L4 what stick does there,
        and the sliding bifurcations.
    """
    for line, bound in BY_LINE.items():
        within = sp.Le(*bound.condition)
        yield Statement(
            f"appendix.A.{line}.sharp",
            "Appendix A, (A.1)-(A.4)",
            f"for zeta > 0 stick {'leaves' if bound.side > 0 else 'enters'} {line} at every point "
            f"and time if and only if alpha <= {bound.alpha_bound}: sufficient, necessary, and "
            "reached at the end point",
            sharp,
            {"line": line, "condition": within},
            {"condition": sp.Lt(*bound.condition)},
            formula=rf"\forall x\in {line[0]}_{line[1]},\tau:\ {sp.latex(_one_way(bound))}>0"
            rf"\iff\alpha\le {sp.latex(bound.alpha_bound)}",
        )
    for one in PARTS:
        does = "depends on time" if one.side is None else f"{_STICK[one.side]} at all times"
        yield Statement(
            f"appendix.B.{one.name}",
            "Appendix B, Section 3.3",
            f"on {one.name} stick {does}, and the possible sliding bifurcations are "
            + ", ".join(_OCCUR[one.side]),
            on_part,
            {"place": one.name, "does": _STICK[one.side], "printed": _OCCUR[one.side]},
            {"printed": _OCCUR[one.side][1:]},
            formula=rf"L_{one.line[1]}^{{({one.number})}}:\ {one.interval}",
            verdict="proved" if one.side else "conditional",
        )
