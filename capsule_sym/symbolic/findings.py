"""Errata about the tables and the planes as a whole, conditions, and statements found right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from functools import partial

import sympy as sp

from capsule_sym.symbolic import counterexample, printed
from capsule_sym.symbolic.appendices import BOUNDS, bifurcations, part
from capsule_sym.symbolic.elimination import Relation
from capsule_sym.symbolic.errata import OUT_2
from capsule_sym.symbolic.erratum import CASE_STUDY, CREST, described
from capsule_sym.symbolic.geometry import PIECES, SCENARIOS, disjoint, empty
from capsule_sym.symbolic.inner_products import outward
from capsule_sym.symbolic.items import Item, implications
from capsule_sym.symbolic.model import SEGMENTS
from capsule_sym.symbolic.proof import consistent, example, negations
from capsule_sym.symbolic.reachability import described as described_witness
from capsule_sym.symbolic.reachability import witnesses
from capsule_sym.symbolic.switching import LocalMap, allowed_maps, leaves_of, local_maps
from capsule_sym.symbolic.symbols import alpha, beta, delta, f_b, force, gamma, v_r, x_r, zeta


def _outside_all(claim: tuple[tuple[str, ...], tuple[Relation, ...]]) -> bool:
    """Whether the point O3 exists under hypotheses and is in none of the sets, of Eq. (15)."""
    names, hypotheses = claim
    point = PIECES["O3"]
    sets = [printed.EQUATION_14.get(name, PIECES[name]) for name in names]
    return consistent([*point.relations, *hypotheses]) and all(
        disjoint(point, one, hypotheses) for one in sets
    )


def _uncovered() -> Item:
    hypotheses = (sp.Gt(zeta, 0), sp.Lt(delta, f_b))
    names = tuple(printed.EQUATION_15)
    return Item(
        id="erratum.equation.15.O3",
        equation="Eq. (15)",
        statement="Eq. (15) leaves out the state (delta, 0, 0) for delta < f_b",
        claim=(names, hypotheses),
        check=_outside_all,
        mutant=((*names, "O3"), hypotheses),
        formula=r"(\delta,0,0)\notin\bigcup_i\Omega_i",
        verdict="refuted",
        printed="the subspaces of Eq. (15) fill the state space",
        derived="(δ, 0, 0) is in none of them; Eq. (11) has it in Ω5",
        proof=(
            "S1-S6 and L1-L4 have P2 ≠ δ, L5-L8 have v_r ≠ 0, and the other parts of Eq. (15) "
            "have P1 ≠ 0"
        ),
        consequence="Harmless: the fields agree there. It is the point O3 of this derivation.",
        witness=lambda: {"x_r": "1/50", "v_r": "0", "v_c": "0", "delta": "1/50", "f_b": "1"},
    )


_STICK_ENDS = ((2, "Σ1"), (2, "Σ3"), (5, "Σ4"), (5, "Σ6"))


def _never_ends_on(claim: tuple[tuple[int, str], ...]) -> bool:
    """Whether stick never ends on the planes, taken as Eq. (24) prints them."""
    return not any(
        field in leaf.may_arrive
        for field, plane in claim
        for name, printed_plane in printed.EQUATION_24.items()
        if printed_plane == plane
        for leaf in leaves_of(name)
    )


def _planes() -> Item:
    return Item(
        id="erratum.equation.24",
        equation="Eq. (24), Table 3",
        statement="with Eq. (24) as printed stick never ends on Σ1, Σ3 (F2) or Σ4, Σ6 (F5)",
        claim=_STICK_ENDS,
        check=_never_ends_on,
        mutant=(*_STICK_ENDS, (1, "Σ3")),
        formula=r"L_1,L_2\subset\Sigma_2,\ L_3,L_4\subset\Sigma_5",
        verdict="refuted",
        printed="L1, L2 ⊂ Σ2 and L3, L4 ⊂ Σ5, and P_{Σ1,F2,Σ2}, P_{Σ3,F2,Σ2}, P_{Σ4,F5,Σ5}, "
        "P_{Σ6,F5,Σ5} are local maps",
        derived="stick ends on L1-L4 (or at impacts): a point of them belongs to the plane of "
        "the subspace that follows, Σ1-Σ6 for Ω1-Ω6",
        proof=(
            "before it ends, stick has |P3| < f_b (F2) or |P4| < f_b (F5), so by continuity "
            "it ends on no point of S1, S3, S4, S6, L5 or L8; the signs of the derivatives "
            "exclude every other piece"
        ),
        consequence="Table 3 and Section 4 use the derived rule, which is the one used here.",
        witness=lambda: described(
            example([*PIECES["L2"].relations, sp.Gt(OUT_2, 0), CREST], CASE_STUDY)
        ),
    )


_MISSING = frozenset(
    LocalMap(f"Σ{target}", field, f"Σ{source}")
    for target, field, source in (
        *((4, 1, 1), (4, 1, 8), (4, 2, 2), (1, 4, 4), (1, 5, 5)),
        *((3, 5, 5), (1, 6, 6), (1, 6, 9), (3, 6, 6), (3, 6, 9)),
    )
)


def _is_missing(claim: frozenset[LocalMap]) -> bool:
    """Whether the maps are exactly those derived, shown to occur, and not printed."""
    shown = {witness.local_map for witness in witnesses()}
    return claim <= shown and claim == frozenset(local_maps()) - frozenset(printed.TABLE_3)


def _missing_maps() -> Item:
    shown = next(w for w in witnesses() if w.local_map == LocalMap("Σ4", 2, "Σ2"))
    return Item(
        id="erratum.table3.missing",
        equation="Table 3",
        statement=f"{len(_MISSING)} local maps occur that Table 3 does not list",
        claim=_MISSING,
        check=_is_missing,
        mutant=_MISSING - {LocalMap("Σ3", 5, "Σ5")},
        formula=r",\ ".join(local_map.formula for local_map in sorted(_MISSING)),
        verdict="refuted",
        printed="Table 3 lists all local maps: 42",
        derived="52: also " + ", ".join(map(str, sorted(_MISSING))),
        proof=(
            "each of the ten is shown by a trajectory that is enclosed in exact rational "
            "arithmetic (the table3 statements below); table3.complete excludes all others"
        ),
        consequence="All pass a corner or L10. Those of F2 and F5, and of F6 into Σ1, need one "
        "coincidence only: a family of orbits meets them at isolated parameters.",
        witness=lambda: {"local map": str(shown.local_map), **described_witness(shown)},
    )


def _absent(scenario: str) -> frozenset[LocalMap]:
    return frozenset(printed.TABLE_3) - allowed_maps([SCENARIOS[scenario], sp.Gt(zeta, 0)])


def _absent_count(claim: tuple[str, int]) -> bool:
    scenario, count = claim
    return len(_absent(scenario)) == count


def _wide_gap_maps() -> Iterator[Item]:
    for scenario, count in (("δ < f_b", 0), ("δ = f_b", 9), ("δ > f_b", 9)):
        found = f"for {scenario} and ζ > 0, {count} of the 42 printed maps cannot occur"
        if count:
            found += ": stick or backward drift into Σ5 (no L6), and F4 from Σ7 to rest"
        yield Item(
            id=f"erratum.table3.scenario.{scenario.replace(' ', '')}",
            equation="Table 3",
            statement=found,
            claim=(scenario, count),
            check=_absent_count,
            mutant=(scenario, count + 1),
            formula=sp.latex(SCENARIOS[scenario]),
            verdict="conditional",
            printed="Table 3 holds without a condition on δ",
            derived=found,
            proof=(
                "for δ ≥ f_b L6 is empty, and table3.never_rests excludes the maps of F4 from Σ7 "
                "to rest; all others occur by their witnesses"
            ),
            consequence="The search for orbits at δ ≥ f_b has fewer maps to consider.",
        )


def _counterexample() -> Item:
    return Item(
        id="erratum.section.3.1.equal",
        equation="Section 3.1",
        statement="for δ = f_b from (0, 0, 0) an impact can come before any forward drift",
        claim=counterexample.CLAIM,
        check=counterexample.impact_before_forward_drift,
        mutant=replace(counterexample.CLAIM, gamma=Fraction(1, 10)),
        formula=r"S_2\to L_2\to S_9",
        verdict="refuted",
        printed="for δ = f_b the capsule must have forward drift before any impact occurs",
        derived="true of impacts from stick (L6 is empty); backward drift can lead to an impact",
        proof=(
            "without damping stick from rest is a trigonometric polynomial; it ends on L2 at "
            "a rational state, and the backward drift that follows is enclosed in exact "
            "rational arithmetic up to its impact"
        ),
        consequence="P_{Σ9,F3,Σ3} can be the first impact for δ = f_b as well.",
        witness=counterexample.witness,
    )


def _adding_needs(claim: tuple[str, Relation]) -> bool:
    """Whether adding-sliding occurs on a line for some parameters, never under the condition."""
    line, condition = claim
    middle = part(line, 2)
    never = not consistent([*middle.relations, sp.Eq(outward(line), 0), zeta > 0, condition])
    return "adding" in bifurcations(middle) and never


_TURN = {"L1": {"tau": "pi/(2 omega)"}, "L4": {"tau": "3 pi/(2 omega)"}}


def _adding_witness(line: str) -> dict[str, str]:
    """A point where stick touches the line, at an instant where it turns back for every omega."""
    strong = {**CASE_STUDY, zeta: Fraction(1), alpha: Fraction(9)}
    touching = (sp.Eq(outward(line), 0), sp.Eq(force, 0))
    point = example([*part(line, 2).relations, *touching], strong)
    return {**described(point), **_TURN[line]}


def _adding() -> Iterator[Item]:
    for bound in BOUNDS[:2]:
        condition = sp.Le(bound.smaller, bound.larger)
        yield Item(
            id=f"erratum.adding.{bound.line}",
            equation="Section 4",
            statement=f"adding-sliding occurs on {bound.line}^(2) too, but not while {condition}",
            claim=(bound.line, condition),
            check=_adding_needs,
            mutant=(bound.line, sp.Ge(bound.smaller, bound.larger)),
            formula=sp.latex(condition),
            verdict="conditional",
            printed="adding-sliding can only happen on L2^(2) or L3^(2)",
            derived=f"so it is while α is within the bound of Appendix A; else on {bound.line} too",
            proof=(
                "within the bound n > 0 on the whole line, so stick cannot touch it from "
                "inside; beyond it n = 0 occurs, with a rate of either sign"
            ),
            consequence="The case study (ζ = 0.05, α ≤ 2) is far within the bound.",
            witness=partial(_adding_witness, bound.line),
        )


def _jump(claim: sp.Expr) -> bool:
    """Whether d(F4 - F1)/dx_r is (0, -claim, claim/(gamma + 1)) on P2 = delta."""
    free, pressed = SEGMENTS[0].field, SEGMENTS[3].field
    steps = [sp.diff(b - a, x_r) for a, b in zip(free, pressed, strict=True)]
    wanted = (sp.S.Zero, -claim, claim / (gamma + 1))
    return all(sp.expand(sp.together(s - w)) == 0 for s, w in zip(steps, wanted, strict=True))


def _smoothness() -> Item:
    size = beta * (gamma + 1) / gamma
    return Item(
        id="erratum.L9",
        equation="Section 3.1",
        statement="the fields are continuous on L9, but their slope jumps by beta (gamma+1)/gamma",
        claim=size,
        check=_jump,
        mutant=-size,
        formula=rf"\partial_{{x_r}}(F_4-F_1)=(0,-{sp.latex(size)},{sp.latex(beta / gamma)})",
        verdict="conditional",
        printed="L9 is smooth for all vector functions",
        derived="continuous (fields.impact); differentiable only for β = 0",
        proof="∂F4/∂x_r − ∂F1/∂x_r on P2 = δ, from the fields",
        consequence=(
            "A graze on L9 keeps the orbit's slope in a parameter but changes its curvature: no "
            "square root, since the force is continuous."
        ),
    )


def _confirmed(
    name: str, equation: str, text: str, claim: tuple[tuple[tuple[Relation, ...], Relation], ...]
) -> Item:
    hypotheses, conclusion = claim[0]
    return Item(
        id=f"confirmed.{name}",
        equation=equation,
        statement=text,
        claim=claim,
        check=implications,
        mutant=((hypotheses, negations(conclusion)[0]), *claim[1:]),
        formula=sp.latex(conclusion),
        printed=text,
        derived="as printed",
        proof="the bounds of cos ωτ put in, and the variables eliminated",
    )


def _confirmations() -> Iterator[Item]:
    out_3 = outward("L3")
    yield _confirmed(
        "roles.L2",
        "Section 3.3, Appendix B",
        "stick ends on L2^(1) and begins on L2^(3) (with the derived intervals)",
        (
            (part("L2", 1).relations, sp.Gt(OUT_2, 0)),
            (part("L2", 3).relations, sp.Lt(OUT_2, 0)),
        ),
    )
    low, high = (2 * zeta * (f_b - alpha), 2 * zeta * (f_b + alpha))
    on = PIECES["L3"].relations
    yield _confirmed(
        "roles.L3",
        "Section 3.3, Appendix B",
        "stick begins on L3^(1) and ends on L3^(3), with the printed intervals",
        (
            ((*on, sp.Lt((1 + beta) * v_r, low)), sp.Lt(out_3, 0)),
            ((*on, sp.Gt((1 + beta) * v_r, high)), sp.Gt(out_3, 0)),
        ),
    )
    for scenario in ("δ = f_b", "δ > f_b"):
        text = f"for {scenario} L6 does not exist: no contact begins in stick"
        yield Item(
            id=f"confirmed.L6.{scenario.replace(' ', '')}",
            equation="Section 3.1",
            statement=text,
            claim=("L6", SCENARIOS[scenario]),
            check=lambda claim: empty(PIECES[claim[0]], [claim[1]]),
            mutant=("L5", SCENARIOS[scenario]),
            formula=sp.latex(SCENARIOS[scenario]) + r"\Rightarrow L_6=\emptyset",
            printed=text,
            derived="as printed",
            proof="L6 has 0 < v_r and 2ζ v_r + δ < f_b",
        )
    yield _confirmed(
        "O2",
        "Section 3.1",
        "O2 is always at v_r < 0",
        ((PIECES["O2"].relations, sp.Lt(v_r, 0)),),
    )


def items() -> tuple[Item, ...]:
    """Every other erratum, every printed statement that needs a condition, and the confirmed."""
    return (
        _uncovered(),
        _planes(),
        _missing_maps(),
        *_wide_gap_maps(),
        _counterexample(),
        *_adding(),
        _smoothness(),
        *_confirmations(),
    )
