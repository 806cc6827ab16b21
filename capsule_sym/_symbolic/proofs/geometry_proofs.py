"""Statements about the state space, Eqs. (13)-(15), and about the fields on its boundaries."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, product

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import LINES, PIECES, SCENARIOS, disjoint, empty, meets
from capsule_sym._symbolic.model.model import P3, P4, SEGMENTS, Segment
from capsule_sym._symbolic.model.proof import always_solvable, consistent, implies
from capsule_sym._symbolic.model.switching import derivatives
from capsule_sym._symbolic.model.symbols import (
    beta,
    delta,
    f_b,
    gamma,
    omega,
    v_c,
    v_r,
    x_r,
    zeta,
)
from capsule_sym._symbolic.proofs.items import Item, implication, vanishes

_DAMPED = sp.Gt(zeta, 0)
_UNDAMPED = sp.Eq(zeta, 0)
_SIGNS = (sp.Lt, sp.Eq, sp.Gt)
_AT_REST = tuple(n for n in PIECES if n not in ("S7", "S8", "S9", "S10", "L9"))
_MOVING = ("S7", "S8", "S9", "S10", "L9")


def _cases(functions: tuple[sp.Expr, ...]) -> Iterator[tuple[Relation, ...]]:
    for relations in product(_SIGNS, repeat=len(functions)):
        yield tuple(r(f, 0) for r, f in zip(relations, functions, strict=True))


def _covered(claim: tuple[tuple[str, ...], tuple[tuple[Relation, ...], ...]]) -> bool:
    """Whether every consistent case lies in one of the pieces."""
    names, cases = claim
    pieces = [PIECES[name] for name in names]
    return all(
        any(all(implies(case, relation) for relation in piece.relations) for piece in pieces)
        for case in cases
        if consistent(case)
    )


def _rest_cases() -> tuple[tuple[Relation, ...], ...]:
    rest = sp.Eq(v_c, 0)
    free = ((rest, sp.Lt(x_r, delta), *c) for c in _cases((P3 - f_b, P3 + f_b)))
    pressed = ((rest, sp.Gt(x_r, delta), *c) for c in _cases((P4 - f_b, P4 + f_b)))
    touching = ((rest, sp.Eq(x_r, delta), *c) for c in _cases((v_r, P3 - f_b, P3 + f_b)))
    return (*free, *pressed, *touching)


def _impact_cases() -> tuple[tuple[Relation, ...], ...]:
    cases = ((sp.Eq(x_r, delta), *c) for c in _cases((v_c, v_r)))
    return tuple(case for case in cases if not isinstance(case[1], sp.Eq))


def _separate(claim: tuple[str, ...]) -> bool:
    """Whether pieces are pairwise disjoint."""
    pieces = [PIECES[name] for name in claim]
    return all(disjoint(a, b) for a, b in combinations(pieces, 2))


def _partition_items() -> Iterator[Item]:
    rest_cases, impact_cases = _rest_cases(), _impact_cases()
    yield Item(
        id="geometry.cover.friction",
        equation="Eqs. (13)-(14)",
        statement="S1-S6, L1-L8, L10, O1, O2, O3 cover the plane P1 = 0",
        claim=(_AT_REST, rest_cases),
        check=_covered,
        mutant=(tuple(n for n in _AT_REST if n != "L10"), rest_cases),
        formula=r"P_1=0",
    )
    yield Item(
        id="geometry.cover.impact",
        equation="Eqs. (13)-(14)",
        statement="S7-S10 and L9 cover the plane P2 = delta where the capsule moves",
        claim=(_MOVING, impact_cases),
        check=_covered,
        mutant=(_MOVING[1:], impact_cases),
        formula=r"P_2=\delta,\ P_1\ne0",
    )
    apart = tuple(name for name in PIECES if name not in ("O3", "L9"))
    yield Item(
        id="geometry.disjoint",
        equation="Eqs. (13)-(14)",
        statement="surfaces, lines (L9 apart) and corners are pairwise disjoint",
        claim=apart,
        check=_separate,
        mutant=(*apart, "L9"),
        formula=r"S_i\cap S_j=S_i\cap L_j=L_i\cap L_j=\emptyset",
    )


def _exactly(claim: tuple[str, Relation, tuple[Relation, ...]]) -> bool:
    """Whether, under the hypotheses, a piece exists if and only if the condition holds."""
    name, condition, hypotheses = claim
    piece = PIECES[name]
    return empty(piece, [*hypotheses, sp.Not(condition)]) and always_solvable(
        [*hypotheses, condition], piece.relations, (x_r, v_r, v_c)
    )


_EXISTENCE: dict[str, tuple[str, Relation, tuple[Relation, ...], str]] = {
    "L6": ("L6", sp.Lt(delta, f_b), (), "with or without damping, "),
    "L10": ("L10", sp.Gt(delta, f_b), (), "with or without damping, "),
    "S1.undamped": ("S1", sp.Gt(delta, f_b), (_UNDAMPED,), "without damping, "),
    "L1.undamped": ("L1", sp.Gt(delta, f_b), (_UNDAMPED,), "without damping, "),
    "L3.undamped": ("L3", sp.Lt(delta, f_b), (_UNDAMPED,), "without damping, "),
    "L5.undamped": ("L5", sp.Gt(delta, f_b), (_UNDAMPED,), "without damping, "),
    "L7.undamped": ("L7", sp.Lt(delta, f_b), (_UNDAMPED,), "without damping, "),
}


def _existence_items() -> Iterator[Item]:
    for key, (name, condition, hypotheses, prefix) in _EXISTENCE.items():
        opposite = type(condition)(condition.rhs, condition.lhs)
        yield Item(
            id=f"geometry.exists.{key}",
            equation="Eq. (14)" if name[0] == "L" else "Eq. (13)",
            statement=f"{prefix}{name} exists if and only if {condition}",
            claim=(name, condition, hypotheses),
            check=_exactly,
            mutant=(name, opposite, hypotheses),
            formula=rf"{name[0]}_{{{name[1:]}}}\ne\emptyset\iff {sp.latex(condition)}",
        )
    for name in ("S6", "L4", "L8", "O2"):
        yield Item(
            id=f"geometry.exists.{name}.undamped",
            equation="Eqs. (13)-(14)",
            statement=f"without damping {name} does not exist: the corners go to infinity",
            claim=((*PIECES[name].relations,), sp.Gt(zeta, 0)),
            check=implication,
            mutant=((*PIECES[name].relations,), sp.Lt(zeta, 0)),
            formula=rf"\zeta=0\Rightarrow {name[0]}_{{{name[1:]}}}=\emptyset",
        )


def lines_at(corner: str, hypotheses: tuple[Relation, ...]) -> frozenset[str]:
    """The lines whose closure holds a corner under hypotheses on the parameters."""
    point = PIECES[corner]
    return frozenset(name for name in LINES if meets(PIECES[name], point, hypotheses))


_O2 = frozenset({"L2", "L4", "L7", "L8"})
_CORNERS: dict[tuple[str, str], frozenset[str]] = {
    ("O1", "δ < f_b"): frozenset({"L1", "L3", "L5", "L6"}),
    ("O2", "δ < f_b"): _O2,
    ("O1", "δ = f_b"): frozenset({"L1", "L3", "L5", "L7", "L9"}),
    ("O2", "δ = f_b"): _O2,
    ("O1", "δ > f_b"): frozenset({"L1", "L3", "L7", "L10"}),
    ("O2", "δ > f_b"): _O2,
}


def _corner_items() -> Iterator[Item]:
    for (corner, scenario), lines in _CORNERS.items():
        hypotheses = (_DAMPED, SCENARIOS[scenario])
        listed = ", ".join(sorted(lines, key=lambda name: int(name[1:])))
        yield Item(
            id=f"geometry.corner.{corner}.{scenario.replace(' ', '')}",
            equation="Section 3.1",
            statement=f"for {scenario} the lines that meet at {corner} are {listed}",
            claim=(corner, hypotheses, lines),
            check=lambda claim: lines_at(*claim[:2]) == claim[2],
            mutant=(corner, hypotheses, lines - {"L1", "L2"}),
            formula=rf"{corner[0]}_{corner[1]}\in"
            + r"\cap".join(
                rf"\bar L_{{{n[1:]}}}"
                for n in listed.replace(",", "").replace("L", "").split()
                for n in ["L" + n]
            ),
        )
    for corner, side in (("O1", f_b - delta), ("O2", -f_b - delta)):
        yield Item(
            id=f"geometry.corner.{corner}.place",
            equation="Section 3.1",
            statement=f"for zeta > 0, {corner} = (delta, {side / (2 * zeta)}, 0)",
            claim=(PIECES[corner].relations, sp.Eq(2 * zeta * v_r, side)),
            check=implication,
            mutant=(PIECES[corner].relations, sp.Eq(2 * zeta * v_r, -side)),
            formula=sp.latex(sp.Eq(v_r, side / (2 * zeta))),
        )


def _field_items() -> Iterator[Item]:
    for forward, stick, backward in (SEGMENTS[:3], SEGMENTS[3:]):
        force = stick.interaction
        share = (force + f_b) / (2 * f_b)
        mix = [
            share * a + (1 - share) * b - c
            for a, b, c in zip(forward.field, backward.field, stick.field, strict=True)
        ]
        wrong = [
            (1 - share) * a + share * b - c
            for a, b, c in zip(forward.field, backward.field, stick.field, strict=True)
        ]
        yield Item(
            id=f"fields.sliding.{stick.name}",
            equation="Eqs. (8), (11)",
            statement=(
                f"{stick.name} is the sliding field of {forward.name} and {backward.name}: their "
                "convex combination that keeps the capsule at rest"
            ),
            claim=sum(term**2 for term in mix),
            check=vanishes,
            mutant=sum(term**2 for term in wrong),
            formula=rf"{stick.name}=\lambda {forward.name}+(1-\lambda){backward.name},\ "
            rf"\lambda={sp.latex(share)}",
        )
        opposed = (sp.Gt(forward.field[2], 0), sp.Lt(backward.field[2], 0))
        yield Item(
            id=f"fields.no_escape.{stick.name}",
            equation="Table 1",
            statement=f"{forward.name} and {backward.name} never both repel from P1 = 0",
            claim=opposed,
            check=lambda claim: not consistent(claim),
            mutant=(sp.Lt(forward.field[2], 0), sp.Gt(backward.field[2], 0)),
            formula=r"P>f_b\ \wedge\ P<-f_b\ \text{is impossible}",
        )
        for drift in (forward, backward):
            yield _tangent_item(drift, stick)
    for free, pressed in zip(SEGMENTS[:3], SEGMENTS[3:], strict=True):
        pairs = list(zip(free.field, pressed.field, strict=True))
        gap = sum((a - b).subs(x_r, delta) ** 2 for a, b in pairs)
        yield Item(
            id=f"fields.impact.{free.name}{pressed.name}",
            equation="L9, Section 3.1",
            statement=(
                f"{free.name} and {pressed.name} agree on P2 = delta (their first derivatives "
                "in x_r differ, by multiples of beta)"
            ),
            claim=gap,
            check=vanishes,
            mutant=sum((a.diff(x_r) - b.diff(x_r)).subs(x_r, delta) ** 2 for a, b in pairs),
            formula=rf"{free.name}={pressed.name}\text{{ on }}P_2=\delta",
        )


def _tangent_item(drift: Segment, stick: Segment) -> Item:
    excess = (stick.interaction - drift.drift * f_b) / gamma
    change = (sp.S.Zero, -excess, excess)
    rows = list(zip(drift.field, stick.field, change, strict=True))
    return Item(
        id=f"fields.tangent.{drift.name}{stick.name}",
        equation="Section 3.3",
        statement=(
            f"{drift.name} - {stick.name} = (P - ({drift.drift:+d}) f_b)/gamma (0, -1, 1): along "
            "both, the first derivative of P that does not vanish on the line is the same"
        ),
        claim=sum((a - b - c) ** 2 for a, b, c in rows),
        check=vanishes,
        mutant=sum((a - b + c) ** 2 for a, b, c in rows),
        formula=rf"{drift.name}-{stick.name}={sp.latex(excess)}\,(0,-1,1)",
    )


def _order_item(stick: Segment) -> Item:
    """On L1-L4 the order at which stick leaves or enters is at most four."""
    y, y1, y2, y3, y4 = derivatives(stick.interaction, stick.index, 4)
    k = 1 + beta if stick.contact else sp.S.One
    rule = -(omega**2) * (k * y + 2 * zeta * y1 + y2) - k * y2 - 2 * zeta * y3
    return Item(
        id=f"fields.order.{stick.name}",
        equation="Section 3.3",
        statement=(
            f"in {stick.name} the fourth derivative of P follows from the lower ones; where P = "
            "+-f_b and the first three vanish it does not, so stick is left or entered there at "
            "an order of at most four"
        ),
        claim=y4 - rule,
        check=vanishes,
        mutant=y4 + rule,
        formula=(
            rf"P^{{(4)}}=-\omega^2\bigl(({sp.latex(k)})P+2\zeta P'+P''\bigr)"
            rf"-({sp.latex(k)})P''-2\zeta P^{{(3)}}"
        ),
    )


def _rest_item() -> Item:
    origin = (sp.S.Zero, sp.S.Zero, sp.S.Zero)
    return Item(
        id="geometry.origin",
        equation="Section 3.1",
        statement="for every delta > 0 the state (0, 0, 0) is in S2: the capsule starts in stick",
        claim=("S2", origin),
        check=lambda claim: PIECES[claim[0]].contains(claim[1], [sp.Gt(delta, 0)]),
        mutant=("S1", origin),
        formula=r"P_3(0,0,0)=0",
    )


def items() -> tuple[Item, ...]:
    """Every statement about pieces, corners and the fields on the boundaries."""
    groups = (
        _partition_items(),
        _existence_items(),
        _corner_items(),
        _field_items(),
    )
    return (
        *(item for group in groups for item in group),
        *map(_order_item, (SEGMENTS[1], SEGMENTS[4])),
        _rest_item(),
    )
