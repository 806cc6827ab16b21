"""Eqs. (13)-(15) and (24): surfaces, lines, subspaces and planes as printed and as derived."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, partial

import sympy as sp

from capsule_sym._paper import Paper
from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import PIECES, Piece, disjoint
from capsule_sym._symbolic.model.model import P3, SEGMENTS
from capsule_sym._symbolic.model.proof import consistent, implies
from capsule_sym._symbolic.model.switching import leaves_of, surface_transitions
from capsule_sym._symbolic.model.symbols import delta, f_b, v_r, zeta
from capsule_sym._symbolic.paper.compare import comparison
from capsule_sym._symbolic.paper.erratum import CASE_STUDY, at_crest, erratum_item
from capsule_sym._symbolic.paper.fields import domain, equal
from capsule_sym._symbolic.paper.formula import relations
from capsule_sym._symbolic.proofs.inner_products import outward
from capsule_sym._symbolic.proofs.items import Item

_DAMPED = sp.Gt(zeta, 0)
_NARROW = (_DAMPED, sp.Lt(delta, f_b))
_WIDE = (_DAMPED, sp.Gt(delta, f_b))
_WIDE_GAP = {**CASE_STUDY, delta: sp.Rational(3, 2)}


def printed_piece(name: str, texts: Sequence[str]) -> Piece:
    """A surface or line as Eq. (13) or (14) prints it."""
    return Piece(name, relations(texts))


def _is_piece(claim: tuple[str, tuple[str, ...]]) -> bool:
    name, texts = claim
    return equal(relations(texts), PIECES[name].relations)


def _pieces(paper: Paper) -> Iterator[Item]:
    for entry in (paper["equation.13"], paper["equation.14.friction"]):
        for name, texts in entry.printed.items():
            other = "S2" if name != "S2" else "S5"
            yield comparison(
                entry,
                f"{entry.id.removesuffix('.friction')}.{name}",
                f"{name} is as printed: {', '.join(texts)}",
                f"{name} = {{{', '.join(texts)}}}",
                (name, tuple(texts)),
                _is_piece,
                (other, tuple(texts)),
                proof="each of the two sets includes the other",
                formula=PIECES[name].latex,
            )


def _same_set(claim: tuple[Piece, tuple[Piece, ...], tuple[Relation, ...], sp.Expr]) -> bool:
    """Whether a set is the union of pieces, split by the sign of a function at its end."""
    whole, pieces, hypotheses, split = claim
    inside = all(
        implies([*piece.relations, *hypotheses], r) for piece in pieces for r in whole.relations
    )
    cases = [[*whole.relations, *hypotheses, r(split, 0)] for r in (sp.Lt, sp.Eq, sp.Gt)]
    return inside and all(
        any(all(implies(case, r) for r in piece.relations) for piece in pieces)
        for case in cases
        if consistent(case)
    )


_UNIONS = {
    "L5": (("L5",), P3 - f_b),
    "L6": (("L6", "O1"), P3 - f_b),
    "L7": (("L7", "O2"), P3 + f_b),
    "L8": (("L8",), P3 + f_b),
}


def _impact_lines(paper: Paper) -> Iterator[Item]:
    entry = paper["equation.14.impact"]
    for name, (pieces, split) in _UNIONS.items():
        whole = printed_piece(name, entry[name])
        union = tuple(PIECES[piece] for piece in pieces)
        wrong = tuple(PIECES[piece] for piece in ("L5", "L6") if piece != name)
        yield comparison(
            entry,
            f"equation.14.{name}",
            f"for zeta > 0 and delta < f_b the printed {name} is {' and '.join(pieces)} of this "
            "derivation",
            f"{name} = {{{', '.join(entry[name])}}}",
            (whole, union, _NARROW, split),
            _same_set,
            (whole, wrong, _NARROW, split),
            verdict="conditional",
            derived="as printed for delta < f_b",
            proof="each of the two sets includes the other",
            formula=r",\ ".join(map(sp.latex, whole.relations)),
        )
    above = (*relations(entry["L7"]), *_WIDE)
    yield erratum_item(
        entry,
        "equation.14.L7",
        f"L7 = {{{', '.join(entry['L7'])}}} leads to stick in Omega2, for every delta",
        place="Eq. (14), Table 2",
        derived="for delta > f_b the part of L7 above O1 (L10: P3 > f_b) leads Omega6 to "
        "forward drift Omega1",
        proof="on L10 P3 > f_b, so F1 gives v_c' = (P3 - f_b)/gamma > 0",
        consequence="L10 is missing from the paper, and with it P_{Σ1,F6,Σ6} and "
        "P_{Σ1,F6,Σ9}. Section 3.1 restricts what follows it to delta < f_b, where L10 does "
        "not exist; Eq. (14) itself stands before the restriction.",
        scope=above,
        printed_relation=sp.Le(P3, f_b),
        derived_scope=PIECES["L10"].relations,
        derived_relation=sp.Gt(SEGMENTS[0].field[2], 0),
        values=_WIDE_GAP,
    )
    yield erratum_item(
        entry,
        "equation.14.L5",
        f"L5 = {{{', '.join(entry['L5'])}}} leads into contact, for every delta",
        place="Eq. (14), Table 2",
        derived="L5 needs v_r > 0 as well: for delta > f_b the printed bound is negative",
        proof="contact begins where P2 rises through delta, that is v_r > 0; for delta > f_b "
        "the printed bound is below 0",
        consequence="For delta > f_b the printed L5 and L7 overlap, and L5 holds a point of L9.",
        scope=(*relations(entry["L5"]), *_WIDE),
        printed_relation=sp.Gt(v_r, 0),
        derived_scope=PIECES["L5"].relations,
        derived_relation=sp.Gt(v_r, 0),
        values=_WIDE_GAP,
    )


def members(paper: Paper) -> dict[str, int]:
    """The subspace of each surface and line on P1 = 0, Eq. (15)."""
    sets = paper["equation.15"]["members"]
    return {name: index for index, names in enumerate(sets, start=1) for name in names}


def planes(paper: Paper) -> dict[str, str]:
    """The switching plane of each surface and line, Eq. (24)."""
    sets = paper["equation.24"]["planes"]
    return {name: f"Σ{index}" for index, names in enumerate(sets, start=1) for name in names}


@cache
def _holders(name: str) -> frozenset[int]:
    """The subspaces of Eqs. (7)-(12), with |P4| in (11), that hold all of a piece."""
    piece = PIECES[name].relations
    return frozenset(
        segment.index
        for segment in SEGMENTS
        if any(all(implies(piece, r) for r in part) for part in domain(segment))
    )


def _holds(claim: tuple[str, int]) -> bool:
    name, subspace = claim
    return _holders(name) == {subspace}


def _held_elsewhere(claim: tuple[str, int, int]) -> bool:
    name, printed, derived = claim
    return _holders(name) == {derived} and printed != derived


_ON_IMPACT = {"L7": 5, "L8": 6}
"""Lines of P2 = delta that Eqs. (11), (12) count to contact, though it ends there."""


def _equation_15(paper: Paper) -> Iterator[Item]:
    entry, moving = paper["equation.15"], paper["equation.15.moving"]
    for name, subspace in members(paper).items():
        if name in _ON_IMPACT:
            derived = _ON_IMPACT[name]
            yield comparison(
                entry,
                f"equation.15.{name}",
                f"by Eqs. (7)-(12) {name} is in Ω{derived}, by Eq. (15) in Ω{subspace}",
                f"{name} ⊂ Ω{subspace}",
                (name, subspace, derived),
                _held_elsewhere,
                (name, derived, derived),
                derived=f"{name} ⊂ Ω{derived} by Eq. ({derived + 6}), which has P2 >= delta; the "
                f"motion that follows is in Ω{subspace}",
                verdict="refuted",
                proof=f"P4 = P3 on P2 = delta, and {name} has the values of P3 of Ω{derived}",
                consequence=f"Harmless: F{subspace} = F{derived} on P2 = delta. The two "
                "definitions of the subspaces are not the same.",
                witness=partial(at_crest, PIECES[name].relations),
            )
            continue
        yield comparison(
            entry,
            f"equation.15.{name}",
            f"{name} is in Ω{subspace}, by Eqs. (7)-(12) and Eq. (15)",
            f"{name} ⊂ Ω{subspace}",
            (name, subspace),
            _holds,
            (name, subspace % 6 + 1),
            proof="the relations of the piece imply those of one of Eqs. (7)-(12), |P4| in (11)",
        )
    for name, texts in moving.printed.items():
        index = int(name[-1])
        part = domain(SEGMENTS[index - 1])[0]
        yield comparison(
            moving,
            f"equation.15.{name}",
            f"off P1 = 0, {name} is {', '.join(texts)}",
            f"{{{', '.join(texts)}}}",
            (tuple(texts), part),
            lambda claim: equal(relations(claim[0]), claim[1]),
            (tuple(texts), domain(SEGMENTS[0 if index != 1 else 2])[0]),
            proof="each of the two sets includes the other",
        )
    yield _uncovered(paper)


def _outside_all(claim: tuple[tuple[tuple[Relation, ...], ...], tuple[Relation, ...]]) -> bool:
    """Whether the point O3 exists under hypotheses and is in none of the sets of Eq. (15)."""
    sets, hypotheses = claim
    point = PIECES["O3"]
    return consistent([*point.relations, *hypotheses]) and all(
        disjoint(point, Piece("set", one), hypotheses) for one in sets
    )


def _sets(paper: Paper) -> tuple[tuple[Relation, ...], ...]:
    """The parts of which Eq. (15) makes the subspaces, L5 to L8 as Eq. (14) prints them."""
    texts: dict[str, list[str]] = {
        **paper["equation.13"].printed,
        **paper["equation.14.friction"].printed,
        **paper["equation.14.impact"].printed,
    }
    shown = [texts[name] for name in members(paper)]
    return tuple(map(relations, [*shown, *paper["equation.15.moving"].printed.values()]))


def _uncovered(paper: Paper) -> Item:
    sets = _sets(paper)
    return comparison(
        paper["equation.15"],
        "equation.15.O3",
        "Eq. (15) leaves out the state (delta, 0, 0) for delta < f_b",
        "the subspaces of Eq. (15) fill the state space",
        (sets, _NARROW),
        _outside_all,
        ((*sets, PIECES["O3"].relations), _NARROW),
        derived="(delta, 0, 0) is in none of them; Eq. (11) has it in Ω5",
        verdict="refuted",
        proof="S1-S6 and L1-L4 have P2 ≠ delta, L5-L8 have v_r ≠ 0, and the other parts have "
        "P1 ≠ 0",
        consequence="Harmless: the fields agree there. It is the point O3 of this derivation.",
        formula=r"(\delta,0,0)\notin\bigcup_i\Omega_i",
        witness=lambda: {"x_r": "1/50", "v_r": "0", "v_c": "0", "delta": "1/50", "f_b": "1"},
    )


_STICK_ENDS = ((2, "Σ1"), (2, "Σ3"), (5, "Σ4"), (5, "Σ6"))


def _never_ends_on(claim: tuple[tuple[tuple[int, str], ...], tuple[tuple[str, str], ...]]) -> bool:
    """Whether stick never ends on the planes, taken as Eq. (24) prints them."""
    ends, printed = claim
    return not any(
        field in leaf.may_arrive
        for field, plane in ends
        for name, printed_plane in printed
        if printed_plane == plane
        for leaf in leaves_of(name)
    )


def _impact_planes(
    claim: tuple[tuple[tuple[str, str], ...], tuple[tuple[str, int, str], ...]],
) -> bool:
    """Whether every impact plane is one surface, on which the maps of Table 3 begin and end."""
    named, maps = claim
    surfaces: Mapping[str, str] = {plane: name for name, plane in named}
    passages = {t.surface: (t.source, t.target) for t in surface_transitions()}
    return len(surfaces) == 4 and all(
        (target not in surfaces or passages[surfaces[target]][0] == field)
        and (source not in surfaces or passages[surfaces[source]][1] == field)
        for target, field, source in maps
    )


def _equation_24(paper: Paper) -> Iterator[Item]:
    entry, subspaces = paper["equation.24"], members(paper)
    printed = planes(paper)
    for name, plane in printed.items():
        if name in subspaces:
            yield comparison(
                entry,
                f"equation.24.{name}",
                f"{name} is in {plane}: the plane has the number of the subspace of Eq. (15)",
                f"{name} ⊂ {plane}",
                (plane, subspaces[name]),
                lambda claim: claim[0] == f"Σ{claim[1]}",
                (plane, subspaces[name] + 1),
                proof="the two sets of names are compared",
            )
    impacts = tuple((name, plane) for name, plane in printed.items() if name not in subspaces)
    maps = tuple((t, f, s) for t, f, s, _ in paper["table.3"]["rows"])
    yield comparison(
        entry,
        "equation.24.impacts",
        "Σ7 to Σ10 are S7 to S10: every map of Table 3 that begins or ends on one of them does so "
        "on that surface",
        ", ".join(f"{plane} = {name}" for name, plane in impacts),
        (impacts, maps),
        _impact_planes,
        (tuple(zip([n for n, _ in impacts], [p for _, p in impacts[::-1]], strict=True)), maps),
        proof="Table 1 as derived says which field reaches and which leaves each surface",
    )
    pairs = tuple(sorted(printed.items()))
    sets = enumerate(entry["planes"][:6], start=1)
    shown = "; ".join(f"Σ{number} = {' ∪ '.join(names)}" for number, names in sets)
    yield comparison(
        entry,
        "equation.24.stick",
        "with Eq. (24) as printed stick never ends on Σ1, Σ3 (F2) or Σ4, Σ6 (F5)",
        shown + ", and P_{Σ1,F2,Σ2}, P_{Σ3,F2,Σ2}, P_{Σ4,F5,Σ5}, P_{Σ6,F5,Σ5} are local maps",
        (_STICK_ENDS, pairs),
        _never_ends_on,
        ((*_STICK_ENDS, (1, "Σ3")), pairs),
        derived="stick ends on L1-L4 (or at impacts): a point of them belongs to the plane of the "
        "subspace that follows, Σ1-Σ6 for Ω1-Ω6",
        verdict="refuted",
        proof="before it ends, stick has |P3| < f_b (F2) or |P4| < f_b (F5), so by continuity it "
        "ends on no point of S1, S3, S4, S6, L5 or L8; the signs of the derivatives exclude every "
        "other piece",
        consequence="Table 3 and Section 4 use the derived rule, which is the one used here.",
        formula=r"L_1,L_2\subset\Sigma_2,\ L_3,L_4\subset\Sigma_5",
        witness=lambda: at_crest([*PIECES["L2"].relations, sp.Gt(outward("L2"), 0)]),
    )


def items(paper: Paper) -> Iterator[Item]:
    """Eqs. (13), (14), (15) and (24)."""
    yield from _pieces(paper)
    yield from _impact_lines(paper)
    yield from _equation_15(paper)
    yield from _equation_24(paper)
