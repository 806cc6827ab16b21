"""Appendices A and B as theorems: which way stick ends on L1-L4, and the bifurcations there.

On each of L1-L4 the inner product of the normal that points out of stick with the field of stick
is +-(k v_r) - 2 zeta f_b +- 2 zeta alpha cos(omega tau), with k = 1 on L1, L2 and 1 + beta on
L3, L4. Bounds are compared after multiplication by 2 zeta or 4 zeta^2, so that every claim is
linear; a statement that needs damping says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import PIECES, empty
from capsule_sym._symbolic.model.proof import always_solvable, consistent, implies, sign_under
from capsule_sym._symbolic.model.switching import leaves_of
from capsule_sym._symbolic.model.symbols import alpha, beta, delta, f_b, force, v_c, v_r, x_r, zeta
from capsule_sym._symbolic.proofs.inner_products import FIELDS, outward
from capsule_sym._symbolic.proofs.items import Item, implications, signed, vanishes

EDGES = ("L1", "L2", "L3", "L4")
_UNKNOWNS = (x_r, v_r, v_c, force)
_DAMPED = sp.Gt(zeta, 0)
_STIFFNESS = {"L1": sp.S.One, "L2": sp.S.One, "L3": 1 + beta, "L4": 1 + beta}


@dataclass(frozen=True)
class Bound:
    """On a line, stick ends (side 1) or begins (side -1) everywhere, always, if and only if.

    `smaller <= larger` is the condition on the parameters, free of fractions; `alpha_bound` the
    same solved for alpha.
    """

    line: str
    side: int
    smaller: sp.Expr
    larger: sp.Expr
    alpha_bound: sp.Expr


_FOUR = 4 * zeta**2
BOUNDS = (
    Bound("L1", +1, _FOUR * (alpha + f_b), f_b - delta, (f_b - delta) / _FOUR - f_b),
    Bound(
        "L4",
        +1,
        _FOUR * (alpha + f_b),
        (1 + beta) * (f_b + delta),
        (1 + beta) * (f_b + delta) / _FOUR - f_b,
    ),
    Bound("L2", -1, f_b + delta, _FOUR * (f_b - alpha), f_b - (f_b + delta) / _FOUR),
    Bound(
        "L3",
        -1,
        (1 + beta) * (f_b - delta),
        _FOUR * (f_b - alpha),
        f_b - (1 + beta) * (f_b - delta) / _FOUR,
    ),
)
"""Appendix A for L1 and L4, and what corresponds to it on L2 and L3."""


def _one_way(bound: Bound) -> sp.Expr:
    return bound.side * outward(bound.line)


def _sharp(claim: tuple[Bound, Relation]) -> bool:
    """Whether a bound is sufficient, and for every parameter beyond it some point violates it."""
    bound, condition = claim
    here = PIECES[bound.line].relations
    wrong = sp.Le(_one_way(bound), 0)
    return implies([_DAMPED, *here, condition], _one_way(bound) > 0) and always_solvable(
        [_DAMPED, sp.Not(condition)], [*here, wrong], _UNKNOWNS
    )


def _bound_items(bound: Bound) -> Iterator[Item]:
    way = "leaves" if bound.side > 0 else "enters"
    condition = sp.Le(bound.smaller, bound.larger)
    equation = "Eqs. (A.1)-(A.4)" if bound.line == "L1" else "Appendix A"
    formula = (
        rf"\forall x\in {bound.line[0]}_{bound.line[1]},\tau:\ "
        rf"{sp.latex(_one_way(bound))}>0\iff\alpha\le {sp.latex(bound.alpha_bound)}"
    )
    yield Item(
        id=f"appendix.A.{bound.line}.sharp",
        equation=equation,
        statement=(
            f"for zeta > 0 stick {way} {bound.line} at every point and time if and only if "
            f"alpha <= {bound.alpha_bound}: sufficient, necessary, and reached at the end point"
        ),
        claim=(bound, condition),
        check=_sharp,
        mutant=(bound, sp.Lt(bound.smaller, bound.larger)),
        formula=formula,
    )
    yield Item(
        id=f"appendix.A.{bound.line}.solved",
        equation=equation,
        statement=f"the condition {condition} is alpha <= {bound.alpha_bound}",
        claim=_cleared(bound, bound.alpha_bound),
        check=vanishes,
        mutant=_cleared(bound, -bound.alpha_bound),
        formula=sp.latex(condition),
    )


def _cleared(bound: Bound, alpha_bound: sp.Expr) -> sp.Expr:
    """Zero when smaller <= larger is alpha <= alpha_bound multiplied by 4 zeta^2."""
    return bound.larger - bound.smaller - sp.expand(_FOUR * (alpha_bound - alpha))


def _appendix_a() -> Iterator[Item]:
    for bound in BOUNDS:
        yield from _bound_items(bound)
    first, second = BOUNDS[:2]
    yield Item(
        id="appendix.A.intersection",
        equation="Section 3.3, Appendix A",
        statement=(
            "the bound for L1 implies the bound for L4, so the printed intersection of the two "
            "ranges of alpha is the first of them"
        ),
        claim=(((sp.Le(first.smaller, first.larger),), sp.Le(second.smaller, second.larger)),),
        check=implications,
        mutant=(((sp.Le(second.smaller, second.larger),), sp.Le(first.smaller, first.larger)),),
        formula=rf"{sp.latex(first.alpha_bound)}\le {sp.latex(second.alpha_bound)}",
    )
    at_end = (_DAMPED, sp.Eq(first.smaller, first.larger))
    outside = (*PIECES["L1"].closure.relations, *at_end, sp.Le(outward("L1"), 0))
    corner = (*PIECES["O1"].relations, *at_end, sp.Eq(force, -alpha))
    only = ((outside, sp.Eq(x_r, delta)), (outside, sp.Eq(force, -alpha)))
    yield Item(
        id="appendix.A.endpoint",
        equation="Eq. (A.4)",
        statement=(
            "at the end point of the bound (22) vanishes on the closure of L1 only at O1, which is "
            "not on L1 (open at delta), at the instants cos(omega tau) = -1"
        ),
        claim=(*only, (corner, sp.Eq(outward("L1"), 0))),
        check=implications,
        mutant=(*only, (corner, sp.Gt(outward("L1"), 0))),
        formula=sp.latex(sp.Eq(outward("L1"), 0)),
    )
    yield Item(
        id="appendix.A.undamped",
        equation="Appendix A",
        statement=(
            "without damping L1 exists only for delta > f_b, and there (22) is v_r: no bound on "
            "alpha makes its sign positive everywhere; L4 does not exist"
        ),
        claim=(("L1", sp.Le(delta, f_b), v_r), "L4"),
        check=_undamped,
        mutant=(("L1", sp.Ge(delta, f_b), v_r), "L4"),
        formula=r"\zeta=0:\ \langle\nabla P_3^+,F_2\rangle=v_r",
        verdict="conditional",
    )


def _undamped(claim: tuple[tuple[str, Relation, sp.Expr], str]) -> bool:
    (line, absent, value), other = claim
    here = [sp.Eq(zeta, 0), *PIECES[line].relations]
    return (
        empty(PIECES[line], [sp.Eq(zeta, 0), absent])
        and implies(here, sp.Eq(outward(line), value))
        and consistent([*here, outward(line) < 0])
        and empty(PIECES[other], [sp.Eq(zeta, 0)])
    )


@dataclass(frozen=True)
class Part:
    """L_i^(j): the part of a line within bounds on k v_r, and what stick does there.

    `side` is +1 where stick always ends, -1 where it always begins, None where that depends on
    time. `interval` is LaTeX for the range of v_r.
    """

    line: str
    number: int
    within: tuple[Relation, ...]
    side: int | None
    interval: str

    @property
    def name(self) -> str:
        """The paper's name, such as `L2^(1)`."""
        return f"{self.line}^({self.number})"

    @property
    def relations(self) -> tuple[Relation, ...]:
        """The relations of the part."""
        return (*PIECES[self.line].relations, *self.within)


def _parts(line: str) -> tuple[Part, ...]:
    """The three parts, in order of v_r, from the extremes of the force over a period."""
    centre = outward(line).subs(alpha, 0)
    slope = sp.diff(centre, v_r)  # +k on L1, L3; -k on L2, L4
    sense = 1 if slope.is_positive else -1
    speed = _STIFFNESS[line] * v_r
    turn = sense * sp.expand(sense * speed - centre)  # where the product vanishes without force
    low, high = turn - 2 * zeta * alpha, turn + 2 * zeta * alpha
    cut = [sp.latex(sp.factor(edge) / _STIFFNESS[line]) for edge in (low, high)]
    return (
        Part(line, 1, (sp.Lt(speed, low),), -sense, rf"v_r<{cut[0]}"),
        Part(line, 2, (speed >= low, speed <= high), None, rf"{cut[0]}\le v_r\le {cut[1]}"),
        Part(line, 3, (sp.Gt(speed, high),), sense, rf"v_r>{cut[1]}"),
    )


PARTS: tuple[Part, ...] = tuple(part for line in EDGES for part in _parts(line))
"""L1^(1) to L4^(3) as derived (Appendix B)."""


def unsettled(part: Part) -> bool:
    """Whether at every v_r inside a part both signs of the product are taken at some phase."""
    return _both_signs((part, (1, -1)))


def _both_signs(claim: tuple[Part, tuple[int, ...]]) -> bool:
    """Whether at every v_r inside the part each of the signs is taken at some phase."""
    part, signs = claim
    product = outward(part.line)
    low, high = part.within
    inside = (_DAMPED, alpha > 0, sp.Gt(low.lhs, low.rhs), sp.Lt(high.lhs, high.rhs))
    return (
        all(always_solvable(inside, [sp.Gt(sign * product, 0)], [force]) for sign in signs)
        and sign_under(product, [*part.relations, *inside]) is None
    )


BIFURCATIONS = ("adding", "crossing", "grazing", "switching")


def bifurcations(part: Part) -> frozenset[str]:
    """Sliding bifurcations possible on a part, from the signs of the product and its rate.

    Crossing and switching: the trajectory arrives transversally from the drift opposite, and
    stick ends or begins there. Grazing: it touches P1 = 0 from the drift beside. Adding: it
    touches the line from within stick. The force is taken short of its extremes: there its rate
    can have either sign, and any size by the choice of omega.
    """
    moving = (sp.Lt(force, alpha), sp.Gt(force, -alpha))
    line = part.line
    beside, stick, opposite = FIELDS[line]
    kinds = {
        "crossing": (opposite, beside),
        "switching": (opposite, stick),
        "grazing": (beside, beside),
        "adding": (stick, stick),
    }
    return frozenset(
        kind
        for kind, (source, target) in kinds.items()
        for leaf in leaves_of(line)
        if source in leaf.arrives
        and target in leaf.departs
        and consistent([*part.relations, *leaf.condition, *moving])
    )


def _possible(claim: tuple[Part, frozenset[str]]) -> bool:
    part, kinds = claim
    return bifurcations(part) == kinds


def _expected(part: Part) -> frozenset[str]:
    return frozenset(
        {1: ("crossing", "grazing"), -1: ("switching",), None: BIFURCATIONS}[part.side]
    )


def _part_items(part: Part) -> Iterator[Item]:
    name = f"appendix.B.{part.name}"
    product = outward(part.line)
    formula = rf"{part.line[0]}_{part.line[1]}^{{({part.number})}}:\ {part.interval}"
    if part.side is None:
        yield Item(
            id=name,
            equation="Appendix B",
            statement=f"on {part.name} the sign depends on time: inside it both signs are taken",
            claim=(part, (1, -1)),
            check=_both_signs,
            mutant=(_widened(part), (1, -1)),
            formula=formula,
            verdict="conditional",
        )
    else:
        does = "ends" if part.side > 0 else "begins"
        yield Item(
            id=name,
            equation="Appendix B",
            statement=f"on {part.name} stick {does} at all times",
            claim=(product, part.relations, part.side),
            check=signed,
            mutant=(product, part.relations, -part.side),
            formula=formula,
        )
    kinds = _expected(part)
    yield Item(
        id=f"{name}.bifurcations",
        equation="Section 3.3",
        statement=f"sliding bifurcations possible on {part.name}: {', '.join(sorted(kinds))}",
        claim=(part, kinds),
        check=_possible,
        mutant=(part, frozenset(BIFURCATIONS) - kinds),
        formula=formula,
    )


def part(name: str) -> Part:
    """A part by its name, such as L2^(1)."""
    return next(one for one in PARTS if one.name == name)


def _widened(part: Part) -> Part:
    low, high = part.within
    return replace(part, within=(sp.Ge(low.lhs, low.rhs - zeta * f_b), high))


_RANGES = {
    "L1": sp.Gt(2 * zeta * v_r, f_b - delta),
    "L2": sp.Gt(2 * zeta * v_r, -f_b - delta),
    "L3": sp.Lt(2 * zeta * v_r, f_b - delta),
    "L4": sp.Lt(2 * zeta * v_r, -f_b - delta),
}


def _is_range(claim: tuple[str, Relation]) -> bool:
    """Whether a line holds a point with a given v_r if and only if the relation holds."""
    line, relation = claim
    here = PIECES[line].relations
    return implies(here, relation) and always_solvable([relation], here, (x_r, v_c))


def _range_item(line: str) -> Item:
    relation = _RANGES[line]
    return Item(
        id=f"appendix.B.{line}.range",
        equation="Appendix B",
        statement=f"{line} has a point of relative velocity v_r if and only if {relation}",
        claim=(line, relation),
        check=_is_range,
        mutant=(line, type(relation)(-relation.lhs, relation.rhs)),
        formula=sp.latex(relation),
    )


def items() -> tuple[Item, ...]:
    """The theorems of Appendix A, and the parts of L1-L4 of Appendix B with what occurs there."""
    parts = (item for part in PARTS for item in _part_items(part))
    return (*_appendix_a(), *map(_range_item, EDGES), *parts)
