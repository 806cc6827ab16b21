"""Checks of Appendices A and B: conditions under which stick ends on L1-L4, and bifurcations."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import PIECES, empty
from capsule_sym._symbolic.model.proof import always_solvable, consistent, implies, sign_under
from capsule_sym._symbolic.model.symbols import alpha, force, v_c, v_r, x_r, zeta
from capsule_sym._symbolic.proofs.inner_products import outward
from capsule_sym._symbolic.proofs.parts import BIFURCATIONS, BOUNDS, Bound, Part, bifurcations, part
from capsule_sym._symbolic.proofs.relations import derived, scope
from capsule_sym._symbolic.proofs.rows import FACTS, FILTERS, Context, checker
from capsule_sym._symbolic.proofs.statement import vanishes

_DAMPED = sp.Gt(zeta, 0)
BY_LINE = {bound.line: bound for bound in BOUNDS}


def _one_way(bound: Bound) -> sp.Expr:
    return bound.side * outward(bound.line)


@checker
def sharp(line: str, condition: Relation) -> bool:
    """Check that a bound is sufficient, and for each parameter beyond it some point violates it."""
    here, way = PIECES[line].relations, _one_way(BY_LINE[line])
    return implies([_DAMPED, *here, condition], way > 0) and always_solvable(
        [_DAMPED, sp.Not(condition)], [*here, sp.Le(way, 0)], (x_r, v_r, v_c, force)
    )


@checker
def solved(line: str, bound: sp.Expr) -> bool:
    """Check that the condition of a line is alpha <= bound, multiplied by 4 zeta^2."""
    smaller, larger = BY_LINE[line].condition
    return vanishes(larger - smaller - sp.expand(4 * zeta**2 * (bound - alpha)))


@checker
def undamped(line: str, absent: str, product: str, other: str) -> bool:
    """Check that without damping a line exists only as stated, and another one does not.

    On the line the inner product out of stick is as stated, and can be negative.
    """
    flat = scope(["zeta == 0"])
    here = [*flat, *PIECES[line].relations]
    return (
        empty(PIECES[line], [*flat, *scope([absent])])
        and implies(here, sp.Eq(outward(line), derived(product)))
        and consistent([*here, outward(line) < 0])
        and empty(PIECES[other], flat)
    )


@checker
def has_velocity(line: str, condition: str) -> bool:
    """Check that a line has a point with a given v_r if and only if the condition holds."""
    here, (relation,) = PIECES[line].relations, scope([condition])
    return implies(here, relation) and always_solvable([relation], here, (x_r, v_c))


def _both_signs(one: Part) -> bool:
    """True if at every v_r inside a part the product takes both signs at some phase."""
    product = outward(one.line)
    low, high = one.within
    inside = (_DAMPED, alpha > 0, sp.Gt(low.lhs, low.rhs), sp.Lt(high.lhs, high.rhs))
    return (
        all(always_solvable(inside, [sp.Gt(sign * product, 0)], [force]) for sign in (1, -1))
        and sign_under(product, [*one.relations, *inside]) is None
    )


@checker
def stick_does(place: str, printed: str) -> bool:
    """Check that on a part of a line stick always ends, always begins, or does either in time."""
    one = part(place)
    if printed == "?":
        return one.side is None and _both_signs(one)
    return sign_under(outward(one.line), one.relations) == {"ends": 1, "begins": -1}[printed]


def within_bound(line: str) -> Part:
    """L1 or L4 within its open bound in Appendix A."""
    bound = BY_LINE[line]
    return Part(line, 0, (_DAMPED, sp.Lt(*bound.condition)), bound.side, "")


@checker
def sliding(place: str, printed: Sequence[str]) -> bool:
    """Check that exactly these sliding bifurcations are possible on a part, or on L1 or L4."""
    one = part(place) if "^" in place else within_bound(place)
    return len(set(printed)) == len(printed) and bifurcations(one) == set(printed)


def _occurs(context: Context) -> tuple[str, ...]:
    """Sliding bifurcations claimed for a part, from the behaviour of stick there."""
    kinds = {1: ("crossing", "grazing"), -1: ("switching",), None: BIFURCATIONS}
    return kinds[context["part"].side]


FACTS |= {
    "part": lambda context: part(context["key"]),
    "bound": lambda context: BY_LINE[context["key"]],
    "within": lambda context: sp.Le(*context["bound"].condition),
    "one_way": lambda context: _one_way(context["bound"]),
    "way": lambda context: "leaves" if context["bound"].side > 0 else "enters",
    "kinds": _occurs,
    "bound_L1": lambda _: BY_LINE["L1"].alpha_bound,
    "bound_L4": lambda _: BY_LINE["L4"].alpha_bound,
    "n_L1_vanishes": lambda _: sp.Eq(outward("L1"), 0),
}
FILTERS |= {
    "negative": lambda expression: -expression,
    "strict": lambda relation: sp.Lt(*relation.args),
    "others": lambda kinds: tuple(kind for kind in BIFURCATIONS if kind not in kinds),
    "side": lambda one: "ends" if one.side > 0 else "begins",
    "other_way": {"ends": "begins", "begins": "ends"}.__getitem__,
    "part_symbol": lambda one: rf"L_{one.line[1]}^{{({one.number})}}",
}
