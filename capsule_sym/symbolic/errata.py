"""The relations printed in the paper that fail somewhere, each with what holds instead.

`findings` holds the errata that are not relations between the quantities at a point, and the
printed statements that turn out right.
"""

from __future__ import annotations

from fractions import Fraction

import sympy as sp

from capsule_sym.symbolic import printed
from capsule_sym.symbolic.appendices import part
from capsule_sym.symbolic.erratum import CASE_STUDY, Erratum, erratum_item
from capsule_sym.symbolic.geometry import PIECES
from capsule_sym.symbolic.inner_products import along
from capsule_sym.symbolic.items import Item
from capsule_sym.symbolic.model import P3, P4, SEGMENTS
from capsule_sym.symbolic.switching import derivatives
from capsule_sym.symbolic.symbols import (
    STATE,
    alpha,
    delta,
    f_b,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
    zeta,
)

_PULL = 2 * zeta * alpha * sp.cos(omega * tau)
_WIDE_GAP = {**CASE_STUDY, delta: Fraction(3, 2)}
OUT_2 = along(-P3, SEGMENTS[1])  # Eq. (23): out of S2 on L2
_ON_L2 = PIECES["L2"].relations
_ON_L4 = PIECES["L4"].relations
_L7_WIDE = (*printed.EQUATION_14["L7"].relations, zeta > 0, sp.Gt(delta, f_b))
_L5_WIDE = (*printed.EQUATION_14["L5"].relations, zeta > 0, sp.Gt(delta, f_b))
_O1_NARROW = (*PIECES["O1"].relations, zeta > 0, sp.Lt(delta, f_b))
_ORIGIN = tuple(sp.Eq(symbol, 0) for symbol in STATE)
_SPEED = {s: SEGMENTS[s - 1].field[2] for s in (1, 3, 4, 6)}

ERRATA: tuple[Erratum, ...] = (
    Erratum(
        id="equation.23",
        equation="Eq. (23)",
        printed="on L2, ⟨∇P3−, F2⟩ = −v_r + 2ζ f_b + 2ζ α cos ωτ",
        derived="on L2, ⟨∇P3−, F2⟩ = −v_r − 2ζ f_b − 2ζ α cos ωτ",
        proof=(
            "P3 = −f_b on L2, so F2 = (v_r, f_b + α cos ωτ, 0) there; with ∇P3− = (−1, −2ζ, "
            "0) the product is −v_r − 2ζ (f_b + α cos ωτ)"
        ),
        consequence=(
            "P3 = −f_b makes the elastic force in F2 +f_b, and the normal is −(1, 2ζ, 0): both "
            "terms change sign. Everything that Appendix B says about L2 shifts by 4ζ f_b."
        ),
        scope=_ON_L2,
        printed_relation=sp.Eq(OUT_2, -v_r + 2 * zeta * f_b + _PULL),
        derived_scope=_ON_L2,
        derived_relation=sp.Eq(OUT_2, -v_r - 2 * zeta * f_b - _PULL),
        values=CASE_STUDY,
    ),
    Erratum(
        id="appendix.B.L2.1",
        equation="Appendix B, Section 3.3",
        printed="for v_r < 2ζ(f_b − α), L2^(1), trajectories are driven out of S2 into Ω3",
        derived="trajectories are driven out of S2 at all times for v_r < −2ζ(f_b + α) only",
        proof=(
            "−v_r − 2ζ (f_b + α cos ωτ) ≥ −v_r − 2ζ (f_b + α), and that is positive for v_r "
            "< −2ζ (f_b + α)"
        ),
        consequence=(
            "At v_r between −2ζ(f_b + α) and 2ζ(f_b − α) stick may begin on L2; with the case "
            "study's α = 0.7 the printed L2^(1) reaches to +0.03, the derived one to −0.17."
        ),
        scope=(*_ON_L2, sp.Lt(v_r, 2 * zeta * (f_b - alpha))),
        printed_relation=sp.Gt(OUT_2, 0),
        derived_scope=(*_ON_L2, sp.Lt(v_r, -2 * zeta * (f_b + alpha))),
        derived_relation=sp.Gt(OUT_2, 0),
        values=CASE_STUDY,
    ),
    Erratum(
        id="appendix.B.L2.1.sign",
        equation="Section 3.3, Appendix B",
        printed="on L2^(1), ⟨∇P3−, F2⟩ < 0 (and trajectories are driven out of S2)",
        derived="on L2^(1), ⟨∇P3−, F2⟩ > 0: the normal points from S2 to S3, so out is positive",
        proof=(
            "−v_r − 2ζ (f_b + α cos ωτ) ≥ −v_r − 2ζ (f_b + α) > 0 on the derived L2^(1), "
            "v_r < −2ζ (f_b + α)"
        ),
        consequence=(
            "The printed sign contradicts both Eq. (23) and the text beside it; the role of "
            "L2^(1) in the text (stick ends) is right."
        ),
        scope=part("L2", 1).relations,
        printed_relation=sp.Lt(OUT_2, 0),
        derived_scope=part("L2", 1).relations,
        derived_relation=sp.Gt(OUT_2, 0),
        values=CASE_STUDY,
    ),
    Erratum(
        id="appendix.B.L2.3.sign",
        equation="Section 3.3, Appendix B",
        printed="on L2^(3), v_r > 2ζ(f_b + α), ⟨∇P3−, F2⟩ > 0",
        derived="for v_r > −2ζ(f_b − α), ⟨∇P3−, F2⟩ < 0: trajectories enter S2",
        proof=(
            "−v_r − 2ζ (f_b + α cos ωτ) ≤ −v_r − 2ζ (f_b − α), and that is negative for v_r "
            "> −2ζ (f_b − α)"
        ),
        consequence="The role of L2^(3) (stick begins) is right, its sign and its interval not.",
        scope=(*_ON_L2, sp.Gt(v_r, 2 * zeta * (f_b + alpha))),
        printed_relation=sp.Gt(OUT_2, 0),
        derived_scope=part("L2", 3).relations,
        derived_relation=sp.Lt(OUT_2, 0),
        values=CASE_STUDY,
    ),
    Erratum(
        id="appendix.B.L3.end",
        equation="Section 3.3, Appendix B",
        printed="L3^(3) is closed at v_r = (f_b − δ)/(2ζ): it holds the corner O1",
        derived="O1 has x_r = δ, so by Eq. (14) it is not on L3 (nor O2 on L2)",
        proof="Eq. (14) gives L3 with P2 > δ, and O1 has P2 = δ",
        consequence="Motion through a corner is a case of its own; see the errata on L6 and O1.",
        scope=(*PIECES["O1"].relations,),
        printed_relation=sp.Gt(x_r, delta),
        derived_scope=(*PIECES["O1"].relations,),
        derived_relation=sp.Eq(x_r, delta),
        values=CASE_STUDY,
    ),
    Erratum(
        id="equation.6",
        equation="Eq. (6)",
        printed="v_c′ = 0 whenever |P3| < f_b without contact, for a moving capsule too",
        derived="a moving capsule has v_c′ = (P3 − f_b)/γ, or (P3 + f_b)/γ backwards",
        proof=(
            "by Eqs. (7) and (9) F1 and F3 act wherever P1 ≠ 0 without contact; with P3 < "
            "f_b the first gives v_c′ = (P3 − f_b)/γ < 0"
        ),
        consequence=(
            "Taken literally Eq. (6) lets the capsule coast without friction; Eqs. (7)-(12), "
            "which the paper uses, are the model."
        ),
        scope=(sp.Gt(v_c, 0), sp.Lt(x_r, delta), sp.Lt(P3, f_b), sp.Gt(P3, -f_b)),
        printed_relation=sp.Eq(_SPEED[1], 0),
        derived_scope=(sp.Gt(v_c, 0), sp.Lt(x_r, delta), sp.Lt(P3, f_b)),
        derived_relation=sp.Lt(_SPEED[1], 0),
        values=CASE_STUDY,
    ),
    Erratum(
        id="equation.11",
        equation="Eq. (11)",
        printed="Ω5 = {P1 = 0, P2 ≥ δ, |P3| ≤ f_b} (as the scan reads)",
        derived="Ω5 = {P1 = 0, P2 ≥ δ, |P4| ≤ f_b}, as S5 in Eq. (13) has it",
        proof=(
            "on S5 |P4| < f_b by Eq. (13), and P4 = P3 + β (P2 − δ) can exceed f_b where |P3| ≤ f_b"
        ),
        consequence="In contact the second spring presses on the capsule too, so P4 decides.",
        scope=(sp.Eq(v_c, 0), sp.Gt(x_r, delta), sp.Le(P3, f_b), sp.Ge(P3, -f_b)),
        printed_relation=sp.Le(P4, f_b),
        derived_scope=PIECES["S5"].relations,
        derived_relation=sp.Lt(P4, f_b),
        values=CASE_STUDY,
    ),
    Erratum(
        id="table2.L4",
        equation="Table 2",
        printed="L4: Ω4, Ω5, Ω6 → Ω4 (F4, C-FD)",
        derived="L4: Ω4, Ω5, Ω6 → Ω6 (F6, C-BD), as Appendix A says",
        proof="P4 = −f_b on L4, so F4 gives v_c′ = (P4 − f_b)/γ = −2 f_b/γ < 0",
        consequence=(
            "On L4 F4 decelerates the capsule by 2 f_b/γ: it cannot go forwards from rest. See "
            "table2.L4 and table2.L4.one_way for the derived row."
        ),
        scope=_ON_L4,
        printed_relation=sp.Ge(_SPEED[4], 0),
        derived_scope=_ON_L4,
        derived_relation=sp.Eq(_SPEED[4], -2 * f_b / gamma),
        values=CASE_STUDY,
    ),
    Erratum(
        id="table2.L2.source",
        equation="Table 2, Section 3.3",
        printed="L2: Ω3 → Ω2, and on L2^(3) trajectories from Ω3 enter Ω2",
        derived="where stick begins on L2 (n < 0), no trajectory arrives from Ω3",
        proof="on L2 v_c = v_c′ = 0 along F3, and γ v_c″ = P3′ = −n, positive where n < 0",
        consequence=(
            "In F3 the capsule's velocity has a minimum 0 there: before, v_c was positive. The "
            "rows Ω3 → Ω2 and Ω2 → Ω2 need n = 0 (see table2.L2)."
        ),
        scope=part("L2", 3).relations,
        printed_relation=sp.Lt(derivatives(v_c, 3, 2)[2], 0),
        derived_scope=part("L2", 3).relations,
        derived_relation=sp.Gt(derivatives(v_c, 3, 2)[2], 0),
        values=CASE_STUDY,
    ),
    Erratum(
        id="table2.L3.source",
        equation="Table 2, Section 3.3",
        printed="L3: Ω4 → Ω5, and on L3^(1) trajectories from Ω4 enter Ω5",
        derived="where stick begins on L3 (n < 0), no trajectory arrives from Ω4",
        proof=(
            "on L3 v_c = v_c′ = 0 along F4, and γ v_c″ = P4′ = n, negative where n < 0: v_c "
            "has a maximum 0, and was negative before"
        ),
        consequence="As on L2; the rows Ω4 → Ω5 and Ω5 → Ω5 need n = 0 (see table2.L3).",
        scope=part("L3", 1).relations,
        printed_relation=sp.Gt(derivatives(v_c, 4, 2)[2], 0),
        derived_scope=part("L3", 1).relations,
        derived_relation=sp.Lt(derivatives(v_c, 4, 2)[2], 0),
        values=CASE_STUDY,
    ),
    Erratum(
        id="table2.L6.corner",
        equation="Eq. (14), Table 2",
        printed="L6 with its end O1 leads Ω1, Ω2, Ω3 to Ω5",
        derived="at O1, where P4′ > 0, trajectories go on in Ω4",
        proof="at O1 P4 = f_b, so v_c = v_c′ = 0 along F4, and γ v_c″ = P4′ > 0",
        consequence=(
            "P4 = f_b at O1 and rises: stick cannot go on. This adds P_{Σ4,F2,Σ2} and "
            "P_{Σ4,F1,Σ1}, P_{Σ4,F1,Σ8} to Table 3. Counted to L3 instead, as the closed end of "
            "L3^(3) suggests, O1 would have sources that the row of L3 does not list."
        ),
        scope=_O1_NARROW,
        printed_relation=sp.Le(derivatives(P4, 5, 1)[1], 0),
        derived_scope=(*_O1_NARROW, sp.Gt(derivatives(P4, 5, 1)[1], 0)),
        derived_relation=sp.Gt(derivatives(v_c, 4, 2)[2], 0),
        values=CASE_STUDY,
    ),
    Erratum(
        id="equation.14.L7",
        equation="Eq. (14), Table 2",
        printed="L7, for every δ, leads to stick in Ω2",
        derived="for δ > f_b the part of L7 above O1 (L10: P3 > f_b) leads Ω6 to forward drift Ω1",
        proof="on L10 P3 > f_b, so F1 gives v_c′ = (P3 − f_b)/γ > 0",
        consequence=("L10 is missing from the paper, and with it P_{Σ1,F6,Σ6} and P_{Σ1,F6,Σ9}."),
        scope=_L7_WIDE,
        printed_relation=sp.Le(P3, f_b),
        derived_scope=PIECES["L10"].relations,
        derived_relation=sp.Gt(_SPEED[1], 0),
        values=_WIDE_GAP,
    ),
    Erratum(
        id="equation.14.L5",
        equation="Eq. (14), Table 2",
        printed="L5 = {v_r > (f_b − δ)/(2ζ)}, for every δ, leads from Ω3 into contact (Ω4)",
        derived="L5 needs v_r > 0 as well: for δ > f_b the printed bound is negative",
        proof=(
            "contact begins where P2 rises through δ, that is v_r > 0; for δ > f_b the "
            "printed bound (f_b − δ)/(2ζ) is below 0"
        ),
        consequence="For δ > f_b the printed L5 and L7 overlap, and L5 holds a point of L9.",
        scope=_L5_WIDE,
        printed_relation=sp.Gt(v_r, 0),
        derived_scope=PIECES["L5"].relations,
        derived_relation=sp.Gt(v_r, 0),
        values=_WIDE_GAP,
    ),
    Erratum(
        id="equation.15.L7",
        equation="Eqs. (11), (15)",
        printed="Ω2 and Ω5 have no state in common (Eq. (15) puts L7 into Ω2 only)",
        derived="Eq. (11) holds on L7 too: |P4| < f_b there, so L7 is in Ω2 and in Ω5",
        proof="P4 = P3 on P2 = δ, and |P3| < f_b on L7",
        consequence="Harmless: F2 = F5 on P2 = δ. Likewise L8 is in Ω3 and in Ω6.",
        scope=PIECES["L7"].relations,
        printed_relation=sp.Gt(P4, f_b),
        derived_scope=PIECES["L7"].relations,
        derived_relation=sp.Lt(P4, f_b),
        values=CASE_STUDY,
    ),
    Erratum(
        id="section.3.1.wide",
        equation="Section 3.1",
        printed="for δ > f_b the capsule starts from (0, 0, 0) in forward drift",
        derived="P3(0, 0, 0) = 0 < f_b for every δ: the capsule starts in stick",
        proof="P3 = x_r + 2ζ v_r is 0 there",
        consequence="Forward drift can begin only after P3 has reached f_b, on L1.",
        scope=(*_ORIGIN, sp.Gt(delta, f_b)),
        printed_relation=sp.Gt(P3, f_b),
        derived_scope=(*_ORIGIN, sp.Gt(delta, f_b)),
        derived_relation=sp.Lt(P3, f_b),
        values=_WIDE_GAP,
    ),
)


def items() -> tuple[Item, ...]:
    """The errata as items."""
    return tuple(map(erratum_item, ERRATA))
