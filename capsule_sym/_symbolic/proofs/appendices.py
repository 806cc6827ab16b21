"""Checks of Appendices A and B: conditions under which stick ends on L1-L4, and bifurcations."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import PIECES, empty
from capsule_sym._symbolic.model.proof import always_solvable, consistent, implies, sign_under
from capsule_sym._symbolic.model.symbols import alpha, delta, f_b, force, v_c, v_r, x_r, zeta
from capsule_sym._symbolic.proofs.inner_products import outward
from capsule_sym._symbolic.proofs.markdown import text
from capsule_sym._symbolic.proofs.parts import (
    BIFURCATIONS,
    BOUNDS,
    PARTS,
    RANGES,
    Part,
    StickBound,
    bifurcations,
    part,
)
from capsule_sym._symbolic.proofs.statement import Relations, Statement, follow, vanishes

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


def solved(line: str, bound: sp.Expr) -> bool:
    """Check that the condition of a line is alpha <= bound, multiplied by 4 zeta^2."""
    smaller, larger = BY_LINE[line].condition
    return vanishes(larger - smaller - sp.expand(4 * zeta**2 * (bound - alpha)))


def undamped(line: str, absent: Relation, product: sp.Expr, other: str) -> bool:
    """Check that without damping a line exists only as stated, and another one does not.

    On the line the inner product out of stick is as stated, and can be negative.
    """
    flat = sp.Eq(zeta, 0)
    here = [flat, *PIECES[line].relations]
    return (
        empty(PIECES[line], [flat, absent])
        and implies(here, sp.Eq(outward(line), product))
        and consistent([*here, outward(line) < 0])
        and empty(PIECES[other], [flat])
    )


def all_follow(cases: Sequence[tuple[Relations, Relation]]) -> bool:
    """Check that in each case a relation holds everywhere in a set of states."""
    return all(implies(here, then) for here, then in cases)


def has_velocity(line: str, condition: Relation) -> bool:
    """Check that a line has a point with a given v_r if and only if the condition holds."""
    here = PIECES[line].relations
    return implies(here, condition) and always_solvable([condition], here, (x_r, v_c))


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


def appendix_a() -> Iterator[Statement]:
    """Bounds on alpha within which stick always ends on L1 and L4, or always begins on L2 and L3.

    Yields:
        Each bound as sufficient and necessary, and solved for alpha; then the smaller of the two
        for stick to end, its end point, and what remains without damping.
    """
    lines = {"L1": "Eqs. (A.1)-(A.4)", "L4": "Appendix A", "L2": "Appendix A", "L3": "Appendix A"}
    for line, equation in lines.items():
        bound = BY_LINE[line]
        within = sp.Le(*bound.condition)
        yield Statement(
            f"appendix.A.{line}.sharp",
            equation,
            f"for zeta > 0 stick {'leaves' if bound.side > 0 else 'enters'} {line} at every point "
            f"and time if and only if alpha <= {bound.alpha_bound}: sufficient, necessary, and "
            "reached at the end point",
            sharp,
            {"line": line, "condition": within},
            {"condition": sp.Lt(*bound.condition)},
            formula=rf"\forall x\in {line[0]}_{line[1]},\tau:\ {sp.latex(_one_way(bound))}>0"
            rf"\iff\alpha\le {sp.latex(bound.alpha_bound)}",
        )
        yield Statement(
            f"appendix.A.{line}.solved",
            equation,
            f"the condition {within} is alpha <= {bound.alpha_bound}",
            solved,
            {"line": line, "bound": bound.alpha_bound},
            {"bound": -bound.alpha_bound},
            formula=sp.latex(within),
        )
    first, second = (BY_LINE[line] for line in ("L1", "L4"))
    smaller, larger = sp.Le(*first.condition), sp.Le(*second.condition)
    yield Statement(
        "appendix.A.intersection",
        "Section 3.3, Appendix A",
        "the bound for L1 implies the bound for L4, so the printed intersection of the two ranges "
        "of alpha is the first of them",
        follow,
        {"here": (smaller,), "then": (larger,)},
        {"here": (larger,), "then": (smaller,)},
        formula=rf"{sp.latex(first.alpha_bound)}\le {sp.latex(second.alpha_bound)}",
    )
    n, end = outward("L1"), sp.Eq(*first.condition)
    vanishes_there = (*PIECES["L1"].closure.relations, _DAMPED, end, sp.Le(n, 0))
    crest = sp.Eq(force, -alpha)
    places = ((vanishes_there, sp.Eq(x_r, delta)), (vanishes_there, crest))
    at_corner = (*PIECES["O1"].relations, _DAMPED, end, crest)
    yield Statement(
        "appendix.A.endpoint",
        "Eq. (A.4)",
        "at the end point of the bound (22) vanishes on the closure of L1 only at O1, which is not "
        "on L1 (open at delta), at the instants cos(omega tau) = -1",
        all_follow,
        {"cases": (*places, (at_corner, sp.Eq(n, 0)))},
        {"cases": (*places, (at_corner, sp.Gt(n, 0)))},
        formula=sp.latex(sp.Eq(n, 0)),
    )
    yield Statement(
        "appendix.A.undamped",
        "Appendix A",
        "without damping L1 exists only for delta > f_b, and there (22) is v_r: no bound on alpha "
        "makes its sign positive everywhere; L4 does not exist",
        undamped,
        {"line": "L1", "absent": sp.Le(delta, f_b), "product": v_r, "other": "L4"},
        {"absent": sp.Ge(delta, f_b)},
        formula=r"\zeta=0:\ \langle\nabla P_3^+,F_2\rangle=v_r",
        verdict="conditional",
    )


_STICK = {1: ("ends", "begins"), -1: ("begins", "ends"), None: ("?", "ends")}
"""Claim about stick on a part, and a wrong one, by the behaviour of stick there."""
_OCCUR = {1: ("crossing", "grazing"), -1: ("switching",), None: BIFURCATIONS}
"""Sliding bifurcations claimed for a part, by the behaviour of stick there."""


def appendix_b() -> Iterator[Statement]:
    """Range of v_r on L1-L4, and on each part of them stick and the bifurcations."""
    speed = 2 * zeta * v_r
    for line, (beyond, end) in RANGES.items():
        when = beyond(speed, end)
        yield Statement(
            f"appendix.B.{line}.range",
            "Appendix B",
            f"{line} has a point of relative velocity v_r if and only if {when}",
            has_velocity,
            {"line": line, "condition": when},
            {"condition": beyond(-speed, end)},
            formula=sp.latex(when),
        )
    for one in PARTS:
        formula = rf"L_{one.line[1]}^{{({one.number})}}:\ {one.interval}"
        does, wrong = _STICK[one.side]
        yield Statement(
            f"appendix.B.{one.name}",
            "Appendix B",
            f"on {one.name} "
            + (
                f"stick {does} at all times"
                if one.side
                else "the sign depends on time: inside it both signs are taken"
            ),
            stick_does,
            {"place": one.name, "printed": does},
            {"printed": wrong},
            formula=formula,
            verdict="proved" if one.side else "conditional",
        )
        yield Statement(
            f"appendix.B.{one.name}.bifurcations",
            "Section 3.3",
            f"sliding bifurcations possible on {one.name}: {', '.join(_OCCUR[one.side])}",
            sliding,
            {"place": one.name, "printed": _OCCUR[one.side]},
            {"printed": tuple(kind for kind in BIFURCATIONS if kind not in _OCCUR[one.side])},
            formula=formula,
        )


PRINTED_BOUNDS = {
    "L1": "(f_b - delta)/(4*zeta**2) - f_b",
    "L4": "(1 + beta)*(f_b + delta)/(4*zeta**2) - f_b",
}
"""Bounds of alpha in Section 3.3 and Appendix A, Eq. (A.4)."""

PRINTED_PARTS = {
    "L2^(1)": ("v_r > -(f_b + delta)/(2*zeta)", "v_r < 2*zeta*f_b - 2*zeta*alpha"),
    "L2^(2)": ("v_r >= 2*zeta*f_b - 2*zeta*alpha", "v_r <= 2*zeta*f_b + 2*zeta*alpha"),
    "L2^(3)": ("v_r > 2*zeta*f_b + 2*zeta*alpha",),
    "L3^(1)": ("v_r < 2*zeta*(f_b - alpha)/(1 + beta)",),
    "L3^(2)": ("v_r >= 2*zeta*(f_b - alpha)/(1 + beta)", "v_r <= 2*zeta*(f_b + alpha)/(1 + beta)"),
    "L3^(3)": ("v_r > 2*zeta*(f_b + alpha)/(1 + beta)", "v_r <= (f_b - delta)/(2*zeta)"),
}
"""Ranges of v_r in Appendix B."""

_WAYS = {1: "ends", -1: "begins", None: "either"}


def _short(formula: str) -> str:
    """Formula with Greek letters, without blanks between factors."""
    return re.sub(r"(?<=[\dζ]) (?=[ζαf(])", "", text(formula))


def bounds() -> Iterator[tuple[str, ...]]:
    """Bounds of Appendix A: line, what stick always does, the bound, and the printed one."""
    for bound in BOUNDS:
        printed = PRINTED_BOUNDS.get(bound.line)
        texts = f"alpha <= {bound.alpha_bound}", f"alpha < {printed}" if printed else ""
        yield bound.line, _WAYS[bound.side], *map(_short, texts)


def parts_of_lines() -> Iterator[tuple[str, ...]]:
    """Parts of Appendix B: part, what stick does on it, the range of v_r, and the printed one."""
    for one in PARTS:
        texts = one.interval_on_line, PRINTED_PARTS.get(one.name, ())
        yield one.name, _WAYS[one.side], *(_short(", ".join(range_)) for range_ in texts)
