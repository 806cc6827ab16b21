"""Checks of the state space, Eqs. (13)-(15), and of the fields on its boundaries."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product

import sympy as sp

from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import (
    LINES,
    PIECES,
    SCENARIOS,
    SURFACES,
    disjoint,
    empty,
    meets,
)
from capsule_sym._symbolic.model.model import P3, P4, SEGMENTS
from capsule_sym._symbolic.model.proof import always_solvable
from capsule_sym._symbolic.model.switching import derivatives
from capsule_sym._symbolic.model.symbols import (
    STATE,
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
from capsule_sym._symbolic.proofs.field_graph import covered
from capsule_sym._symbolic.proofs.statement import Relations, Statement, follow, never, vanishes

_SIGNS = (sp.Lt, sp.Eq, sp.Gt)
_MOVING = ("S7", "S8", "S9", "S10", "L9")


def _cases(functions: tuple[sp.Expr, ...]) -> Iterator[tuple[Relation, ...]]:
    for relations in product(_SIGNS, repeat=len(functions)):
        yield tuple(r(f, 0) for r, f in zip(relations, functions, strict=True))


def _rest_cases() -> tuple[tuple[Relation, ...], ...]:
    rest = sp.Eq(v_c, 0)
    free = ((rest, sp.Lt(x_r, delta), *c) for c in _cases((P3 - f_b, P3 + f_b)))
    pressed = ((rest, sp.Gt(x_r, delta), *c) for c in _cases((P4 - f_b, P4 + f_b)))
    touching = ((rest, sp.Eq(x_r, delta), *c) for c in _cases((v_r, P3 - f_b, P3 + f_b)))
    return (*free, *pressed, *touching)


def _impact_cases() -> tuple[tuple[Relation, ...], ...]:
    cases = ((sp.Eq(x_r, delta), *c) for c in _cases((v_c, v_r)))
    return tuple(case for case in cases if not isinstance(case[1], sp.Eq))


def separate(without: Sequence[str]) -> bool:
    """Check that all pieces except these are pairwise disjoint."""
    pieces = [piece for name, piece in PIECES.items() if name not in without]
    return all(disjoint(a, b) for a, b in combinations(pieces, 2))


def exists_when(piece: str, condition: Relation, within: Relations) -> bool:
    """Check that, under hypotheses, a piece exists if and only if the condition holds."""
    one = PIECES[piece]
    return empty(one, [*within, sp.Not(condition)]) and always_solvable(
        [*within, condition], one.relations, (x_r, v_r, v_c)
    )


def lines_at(corner: str, hypotheses: Relations) -> frozenset[str]:
    """Lines whose closure contains a corner under hypotheses on the parameters."""
    point = PIECES[corner]
    return frozenset(name for name in LINES if meets(PIECES[name], point, hypotheses))


def meet_at(corner: str, lines: Sequence[str], within: Relations) -> bool:
    """Check that these lines meet at a corner, and no others."""
    return lines_at(corner, within) == set(lines)


def mixes(fields: Sequence[int], share: sp.Expr) -> bool:
    """Check that a share of the first field and the rest of the second make the third."""
    rates = [SEGMENTS[field - 1].field for field in fields]
    return all(vanishes(share * a + (1 - share) * b - c) for a, b, c in zip(*rates, strict=True))


def differ_by(drift: int, stick: int, excess: sp.Expr) -> bool:
    """Check that a drift is the field of stick plus (0, -excess, excess)."""
    rates = (SEGMENTS[field - 1].field for field in (drift, stick))
    change = (sp.S.Zero, -excess, excess)
    return all(vanishes(a - b - c) for a, b, c in zip(*rates, change, strict=True))


def agree_at_impact(free: int, pressed: int) -> bool:
    """Check that two fields agree on P2 = delta."""
    rates = (SEGMENTS[field - 1].field for field in (free, pressed))
    return all(vanishes((a - b).subs(x_r, delta)) for a, b in zip(*rates, strict=True))


def fourth_follows(field: int, stiffness: sp.Expr) -> bool:
    """Check that the fourth derivative of P in stick follows from the lower ones."""
    y, y1, y2, y3, y4 = derivatives(SEGMENTS[field - 1].interaction, field, 4)
    restoring = stiffness * y + 2 * zeta * y1 + y2
    return vanishes(y4 + omega**2 * restoring + stiffness * y2 + 2 * zeta * y3)


def _symbol(name: str) -> str:
    return rf"{name[0]}_{{{name[1:]}}}"


_DAMPED, _UNDAMPED = sp.Gt(zeta, 0), sp.Eq(zeta, 0)
_BELOW, _EQUAL, _ABOVE = SCENARIOS


def state_space() -> Iterator[Statement]:
    """Surfaces, lines and corners: that they cover the boundaries, where they exist and meet."""
    at_rest = tuple(name for name in PIECES if name not in _MOVING)
    yield Statement(
        "geometry.cover.friction",
        "Eqs. (13)-(14)",
        "S1-S6, L1-L8, L10, O1, O2, O3 cover the plane P1 = 0",
        covered,
        {"pieces": at_rest, "cases": _rest_cases()},
        {"pieces": at_rest[1:]},
        formula="P_1=0",
    )
    yield Statement(
        "geometry.cover.impact",
        "Eqs. (13)-(14)",
        "S7-S10 and L9 cover the plane P2 = delta where the capsule moves",
        covered,
        {"pieces": _MOVING, "cases": _impact_cases()},
        {"pieces": _MOVING[1:]},
        formula=r"P_2=\delta,\ P_1\ne0",
    )
    yield Statement(
        "geometry.disjoint",
        "Eqs. (13)-(14)",
        "surfaces, lines (L9 apart) and corners are pairwise disjoint",
        separate,
        {"without": ("O3", "L9")},
        {"without": ("O3",)},
        formula=r"S_i\cap S_j=S_i\cap L_j=L_i\cap L_j=\emptyset",
    )
    below, above = sp.Lt(delta, f_b), sp.Gt(delta, f_b)
    always = (("L6", below, above), ("L10", above, below))
    undamped = [(name, above, below) for name in ("S1", "L1", "L5")]
    undamped += [(name, below, above) for name in ("L3", "L7")]
    for piece, when, opposite in (*always, *undamped):
        free = piece in ("L6", "L10")
        yield Statement(
            f"geometry.exists.{piece}{'' if free else '.undamped'}",
            f"Eq. ({13 if piece in SURFACES else 14})",
            f"{'with or without' if free else 'without'} damping, {piece} exists if and only if "
            f"{when}",
            exists_when,
            {"piece": piece, "condition": when, "within": () if free else (_UNDAMPED,)},
            {"condition": opposite},
            formula=rf"{_symbol(piece)}\ne\emptyset\iff {sp.latex(when)}",
        )
    for piece in ("S6", "L4", "L8", "O2"):
        yield Statement(
            f"geometry.exists.{piece}.undamped",
            "Eqs. (13)-(14)",
            f"without damping {piece} does not exist: the corners go to infinity",
            follow,
            {"here": PIECES[piece].relations, "then": (_DAMPED,)},
            {"then": (sp.Lt(zeta, 0),)},
            formula=rf"\zeta=0\Rightarrow {_symbol(piece)}=\emptyset",
        )
    corners = {
        _BELOW: (("L1", "L3", "L5", "L6"), ("L2", "L4", "L7", "L8")),
        _EQUAL: (("L1", "L3", "L5", "L7", "L9"), ("L2", "L4", "L7", "L8")),
        _ABOVE: (("L1", "L3", "L7", "L10"), ("L2", "L4", "L7", "L8")),
    }
    for gap, both in corners.items():
        for corner, lines in zip(("O1", "O2"), both, strict=True):
            closures = r"\cap".join(rf"\bar{{L_{{{name[1:]}}}}}" for name in lines)
            yield Statement(
                f"geometry.corner.{corner}.{gap.replace(' ', '')}",
                "Section 3.1",
                f"for {gap} the lines that meet at {corner} are {', '.join(lines)}",
                meet_at,
                {"corner": corner, "lines": lines, "within": (_DAMPED, SCENARIOS[gap])},
                {"lines": lines[1:]},
                formula=rf"{corner[0]}_{corner[1]}\in{closures}",
            )
    for corner, reach in (("O1", f_b - delta), ("O2", -f_b - delta)):
        at = reach / (2 * zeta)
        yield Statement(
            f"geometry.corner.{corner}.place",
            "Section 3.1",
            f"for zeta > 0, {corner} = (delta, {at}, 0)",
            follow,
            {"here": (*PIECES[corner].relations, _DAMPED), "then": (sp.Eq(2 * zeta * v_r, reach),)},
            {"then": (sp.Eq(2 * zeta * v_r, -reach),)},
            formula=f"v_{{r}} = {sp.latex(at)}",
        )
    yield Statement(
        "geometry.origin",
        "Section 3.1",
        "for every delta > 0 the state (0, 0, 0) is in S2: the capsule starts in stick",
        follow,
        {
            "here": (*(sp.Eq(one, 0) for one in STATE), sp.Gt(delta, 0)),
            "then": PIECES["S2"].relations,
        },
        {"then": PIECES["S1"].relations},
        formula="P_3(0,0,0)=0",
    )


def fields_at_boundaries() -> Iterator[Statement]:
    """Fields on the boundaries: sliding, no escape, tangency, impact, and order of contact."""
    forces = (P3, (1, 2, 3)), (P4, (4, 5, 6))
    for force, (forward, stick, backward) in forces:
        share = (force + f_b) / (2 * f_b)
        yield Statement(
            f"fields.sliding.F{stick}",
            "Eqs. (8), (11)",
            f"F{stick} is the sliding field of F{forward} and F{backward}: their convex "
            "combination that keeps the capsule at rest",
            mixes,
            {"fields": (forward, backward, stick), "share": share},
            {"share": 1 - share},
            formula=rf"F{stick}=\lambda F{forward}+(1-\lambda)F{backward},\ "
            rf"\lambda={sp.latex(share)}",
        )
    for _, (forward, stick, backward) in forces:
        rates = [sp.expand(gamma * SEGMENTS[one - 1].field[2]) for one in (forward, backward)]
        yield Statement(
            f"fields.no_escape.F{stick}",
            "Table 1",
            f"F{forward} and F{backward} never both repel from P1 = 0",
            never,
            {"here": (rates[0] > 0, rates[1] < 0)},
            {"here": (rates[0] < 0, rates[1] > 0)},
            formula=r"P>f_b\ \wedge\ P<-f_b\ \text{is impossible}",
        )
    for force, (forward, stick, backward) in forces:
        for drift, sign in ((forward, 1), (backward, -1)):
            excess = (force - sign * f_b) / gamma
            yield Statement(
                f"fields.tangent.F{drift}F{stick}",
                "Section 3.3",
                f"F{drift} - F{stick} = (P - ({sign:+}) f_b)/gamma (0, -1, 1): along both, the "
                "first derivative of P that does not vanish on the line is the same",
                differ_by,
                {"drift": drift, "stick": stick, "excess": excess},
                {"excess": -excess},
                formula=rf"F{drift}-F{stick}={sp.latex(excess)}\,(0,-1,1)",
            )
    for free in (1, 2, 3):
        yield Statement(
            f"fields.impact.F{free}F{free + 3}",
            "L9, Section 3.1",
            f"F{free} and F{free + 3} agree on P2 = delta (their first derivatives in x_r differ, "
            "by multiples of beta)",
            agree_at_impact,
            {"free": free, "pressed": free + 3},
            {"pressed": (free + 3) % 6 + 1},
            formula=rf"F{free}=F{free + 3}\text{{ on }}P_2=\delta",
        )
    for field, stiffness, wrong in ((2, sp.S.One, sp.Integer(2)), (5, 1 + beta, sp.S.One)):
        k = sp.latex(stiffness)
        yield Statement(
            f"fields.order.F{field}",
            "Section 3.3",
            f"in F{field} the fourth derivative of P follows from the lower ones; where P = +-f_b "
            "and the first three vanish it does not, so stick is left or entered there at an order "
            "of at most four",
            fourth_follows,
            {"field": field, "stiffness": stiffness},
            {"stiffness": wrong},
            formula=rf"P^{{(4)}}=-\omega^2\bigl(({k})P+2\zeta P'+P''\bigr)-({k})P''"
            r"-2\zeta P^{(3)}",
        )
