"""Claims of Section 2: Eqs. (1)-(5) and the scaling, Eq. (6) read literally, Eqs. (7)-(12)."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from capsule_sym._symbolic.theory import PARAMETERS, SEGMENTS, Statement
from paper.claims.beside import beside, next_field, union
from paper.claims.dimensions import (
    HELD_NOT,
    newton,
    omits_spring,
    physical,
    positive_scaling,
    rates,
    scaled_condition,
    scaled_gap,
    texts_of,
)
from paper.claims.errata import CASE_STUDY, misprint, point_text, same_formula
from paper.claims.fields import COASTING, acting, domain, literal, literal_field, printed_field
from paper.claims.relations import listed, same_sets
from paper.derived.points import example
from paper.printed import Paper


def newton_equations(paper: Paper) -> Iterator[Statement]:
    """Eqs. (1)-(5), scaled as printed, beside the six fields."""
    for segment in SEGMENTS:
        frame = 5 if segment.contact else 3
        texts = texts_of(paper, frame)
        friction = texts["reaction" if segment.stick else "slip"]
        yield beside(
            paper[f"equation.{frame}"],
            f"equation.1-5.F{segment.index}",
            newton,
            {"field": segment.index, "texts": texts},
            {"texts": texts | {"gamma": "M_m/M_c", "alpha": "P_f/P_d"}},
            says=f"Eqs. (1)-(5), scaled as printed and at f_b = 1, are F{segment.index}",
            printed=f"{texts['mass']}; {texts['capsule']}; friction {friction}",
            proof="the field in the printed dimensionless quantities, less the scaled equations",
        )


def scaling(paper: Paper) -> Iterator[Statement]:
    """The scaling of state and parameters, and the bound of friction."""
    texts, state, dry = texts_of(paper, 3), paper["scaling.state"], paper["scaling.dry"]
    yield beside(
        state,
        "scaling.rates",
        rates,
        {"texts": texts},
        {"texts": texts | {"v": "k_1*V*Omega_0/P_f"}},
        says="velocities and accelerations are scaled as the derivatives of the displacements in "
        "tau",
        printed=f"x = {state['x']}, v = {state['v']}, a = {state['a']}, tau = {texts['tau']}",
        proof="d/dtau = (1/Omega_0) d/dt",
    )
    names = (*map(str, PARAMETERS), "Omega_0")
    yield beside(
        paper["scaling.parameters"],
        "scaling.positive",
        positive_scaling,
        {"texts": texts},
        {"texts": texts | {"omega": f"-{texts['omega']}"}},
        says="the parameters of the model are positive where the physical quantities are",
        printed=", ".join(f"{name} = {texts[name]}" for name in names),
        proof="their signs, for positive masses, springs, damper, gap and friction",
    )
    yield beside(
        dry,
        "scaling.dry",
        physical,
        {"printed": texts["f_b"], "expected": dry["f_b"]},
        {"expected": "2"},
        says="f_b is 1 for dry friction",
        printed=f"f_b = {texts['f_b']} = {dry['f_b']}",
        proof="the greatest friction of Eq. (1) is P_f",
    )
    bound = paper["equation.1"]["bound"]
    yield beside(
        paper["equation.1"],
        "equation.1.bound",
        physical,
        {"printed": bound, "expected": "P_f == mu*(M_m + M_c)*g"},
        {"printed": "P_f == mu*M_c*g"},
        says="the friction bound is mu times the weight of both bodies",
        printed=bound,
        proof="the capsule carries the inner mass",
    )


def conditions(paper: Paper) -> Iterator[Statement]:
    """The conditions of stick, slip and contact in physical quantities."""
    for frame, place, key, kind in (
        (3, "equation.3.stick", "slips", ">"),
        (3, "equation.1", "stick", "<="),
        (3, "equation.3.stick", "held", "<"),
        (5, "equation.5.stick", "slips", ">"),
        (5, "equation.1", "stick", "<="),
    ):
        text, texts = paper[place][key], texts_of(paper, frame)
        force, how = ("P3", "without") if frame == 3 else ("P4", "with")
        yield beside(
            paper[place],
            f"equation.{frame}.{key}",
            scaled_condition,
            {"printed": text, "kind": kind, "force": force, "texts": texts},
            {"force": f"{force} + f_b"},
            says=f"{how} contact, {text} is |{force}| {kind} f_b",
            printed=text,
            proof="scaled as printed; in stick the friction is the printed reaction",
        )
    for number, kind, frame in ((2, "<", 3), (4, ">=", 3)):
        where = paper[f"equation.{number}"]["where"]
        yield beside(
            paper[f"equation.{number}"],
            f"equation.{number}.where",
            scaled_gap,
            {"printed": where, "kind": kind, "texts": texts_of(paper, frame)},
            {"kind": "=="},
            says=f"{where} is x_r {kind} delta",
            printed=where,
            proof="scaled as printed",
        )
    stick = paper["equation.5.stick"]
    yield beside(
        stick,
        "equation.5.held",
        omits_spring,
        {"printed": stick["held"], "texts": texts_of(paper, 5)},
        {"printed": stick["slips"].replace(">", "<")},
        says="in contact the printed condition of stick leaves the second spring out",
        printed=f"in contact the capsule is held when {stick['held']}",
        derived="it is held when the second spring's force is counted too: |P4| < f_b, as the "
        "printed condition of slip beside it and S5 have it",
        verdict="refuted",
        proof="scaled, the printed condition is |P3| < f_b; at the witness it holds in contact and "
        "P4 > f_b",
        consequence="It is the condition that Eq. (11) repeats with |P3|, as the scan reads; if "
        "that index is misread, this condition still omits the spring.",
        witness=lambda: point_text(example(HELD_NOT, CASE_STUDY)),
    )


def equation_6(paper: Paper) -> Iterator[Statement]:
    """The auxiliary functions, and Eq. (6) read literally."""
    for key, text in paper["auxiliary"].printed.items():
        yield beside(
            paper["auxiliary"],
            f"auxiliary.{key}",
            same_formula,
            {"printed": text, "expected": key},
            {"expected": f"{key} + f_b"},
            says=f"{key} = {text}, as the model has it",
            printed=f"{key} = {text}",
            proof="P3 and P4 are the forces of the inner mass on the capsule",
        )
    entry = paper["equation.6"]
    texts = entry.printed
    shown = "; ".join(f"{key}' = {texts[key]}" for key in ("x_m", "v_m", "x_c", "v_c"))
    shown += "; " + ", ".join(f"{key} = H({texts[key]})" for key in ("H1", "H2", "H3"))
    swapped = {**texts, "H1": texts["H2"], "H2": texts["H1"]}
    for field in (1, 3, 4, 6, 2, 5):
        segment = SEGMENTS[field - 1]
        force, sense = "P4" if segment.contact else "P3", "<" if segment.stick else ">"
        yield beside(
            entry,
            f"equation.6.F{field}",
            literal_field,
            {"field": field, "texts": texts, "regions": acting(segment)},
            {"texts": swapped} if segment.stick else {"regions": [COASTING]},
            says=f"where |P| {sense} f_b Eq. (6) is F{field}, P being {force}",
            printed=shown,
            verdict="conditional",
            proof="the steps H1, H2, H3 are decided by elimination, then the rates compared",
        )
    yield beside(
        entry,
        "equation.6.rest",
        literal_field,
        {"field": 1, "texts": texts, "regions": [["v_c == 0", "x_r < delta", "P3 > f_b"]]},
        {"drift": 0},
        says="on S1 Eq. (6) is F1 if sign(v_c) is read as that of the drift to come, not with "
        "sign(0)=0",
        printed=entry["v_c"],
        derived="so it is on S3, S4 and S6; Eqs. (7)-(12) say it without a sign of 0",
        verdict="conditional",
        proof="the rates compared",
    )
    coasting = literal(texts, COASTING, 1)[2]
    yield misprint(
        entry,
        "equation.6",
        COASTING,
        f"F1_v_c == {coasting}",
        "F1_v_c < 0",
        inside=["v_c > 0", "x_r < delta", "P3 < f_b"],
        printed=f"v_c' = {coasting} for v_c > 0 and |P3| < f_b without contact",
        derived="a moving capsule has v_c' = (P3 - f_b)/gamma, or (P3 + f_b)/gamma backwards",
        proof="by Eqs. (7) and (9) F1 and F3 act wherever P1 ≠ 0 without contact; with P3 < f_b "
        "the first gives v_c' = (P3 - f_b)/gamma < 0",
        consequence="Taken literally Eq. (6) lets the capsule coast without friction; Eqs. "
        "(7)-(12), which the paper uses, are the model.",
    )


def six_fields(paper: Paper) -> Iterator[Statement]:
    """Eqs. (7)-(12): the six fields, and where they act."""
    for segment in SEGMENTS:
        field, entry = segment.index, paper[f"equation.{segment.index + 6}"]
        yield beside(
            entry,
            f"{entry.id}.field",
            printed_field,
            {"printed": entry["field"], "mode": entry["mode"], "field": field},
            {"field": next_field(field)},
            says=f"F{field}, {entry['mode']}, is as printed",
            printed=f"{entry['mode']}: ({listed(entry['field'])})",
            proof="Newton's equations of both bodies",
            formula=sp.latex(sp.Matrix(segment.field)),
        )
    for field in (1, 2, 3, 4, 6):
        entry = paper[f"equation.{field + 6}"]
        yield beside(
            entry,
            f"{entry.id}.domain",
            same_sets,
            {"printed": entry["domain"], "expected": domain(field)},
            {"expected": domain(next_field(field))},
            says=f"F{field} acts where printed: {union(entry['domain'])}",
            printed=union(entry["domain"]),
            proof="at rest a drift acts where its v_c' has its own sense; the sets include each "
            "other",
        )
    entry = paper["equation.11"]
    (stick,) = entry["domain"]
    yield beside(
        entry,
        "equation.11.domain",
        same_sets,
        {"printed": [stick[:2]], "expected": [["P1 == 0", "P2 >= delta"]]},
        {"expected": [["P2 >= delta"]]},
        says=f"but for its bound, F5 acts where printed: {listed(stick[:2])}",
        printed=listed(stick[:2]),
        proof="each of the two sets includes the other",
    )
    yield misprint(
        entry,
        "equation.11",
        stick,
        "P4 <= f_b",
        "P4 < f_b",
        inside=["S5"],
        printed=f"Omega5 = {union(entry['domain'])}",
        derived="Omega5 = {P1 == 0, P2 >= delta, |P4| <= f_b}, as S5 in Eq. (13) has it",
        proof="on S5 |P4| < f_b by Eq. (13), and P4 = P3 + beta (P2 - delta) can exceed f_b where "
        "|P3| <= f_b",
        consequence="In contact the second spring presses on the capsule too, so P4 decides. A "
        "misread index would make the equation right; the condition before Eq. (5), which is "
        "clear, has the same fault.",
    )


STATEMENTS = (newton_equations, scaling, conditions, equation_6, six_fields)
