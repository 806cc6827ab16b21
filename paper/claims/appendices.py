"""Claims of Appendices A and B, and of Section 3.3 on the lines and their parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import PIECES, Statement, alpha, consistent, force, v_r, zeta
from paper.claims.beside import beside, next_field
from paper.claims.case_study import point
from paper.claims.errata import (
    CASE_STUDY,
    CREST,
    at_crest,
    misprint,
    point_text,
    positive,
    same_formula,
)
from paper.claims.formula import formula, same
from paper.claims.motions import below
from paper.claims.relations import Texts, follows, listed, same_sets, scope
from paper.claims.space import points
from paper.claims.tables import spaces
from paper.derived.appendices import BY_LINE, sliding, stick_does, within_bound
from paper.derived.inner_products import FIELDS, outward
from paper.derived.parts import PARTS, Part, bifurcations, part
from paper.derived.points import example
from paper.derived.tables import passages
from paper.printed import Paper

_DAMPED = scope(["zeta > 0"])


def adding_only_on(printed: Sequence[str]) -> bool:
    """Check that within Appendix A's bounds stick can touch only these parts of L1-L4."""
    found = {p.name for p in PARTS if p.line in ("L2", "L3") and "adding" in bifurcations(p)}
    others = ("adding" in bifurcations(within_bound(line)) for line in ("L1", "L4"))
    return found == set(printed) and not any(others)


def adding_beyond(line: str, within: Texts) -> bool:
    """Check that adding-sliding occurs on a line for some parameters, never under a condition."""
    middle = part(f"{line}^(2)")
    touching = [*middle.relations, sp.Eq(outward(line), 0), *_DAMPED, *scope(within)]
    return "adding" in bifurcations(middle) and not consistent(touching)


_ROLE = {"grazing": 0, "adding": 1, "crossing": 2, "switching": 2}  # which of `FIELDS`


def comes_from(place: str, kind: str, field: int) -> bool:
    """Check that a sliding bifurcation on a line begins with a trajectory of a field."""
    return FIELDS[place[:2]][_ROLE[kind]] == field


def extreme(printed: str, greatest: str, end: str) -> bool:
    """Check that a relation is -alpha > `greatest` with v_r at the end of its range."""
    relation, value, bound = map(formula, (printed, greatest, end))
    return (
        isinstance(relation, sp.StrictGreaterThan)
        and same(relation.lhs, -alpha)
        and same(relation.rhs, value.subs(v_r, bound.rhs))
    )


def other_interval(place: str, printed: Texts) -> bool:
    """Check that a printed interval of v_r is not that of a part, by a state in one of them."""
    try:
        return bool(example(_beyond(place, printed), CASE_STUDY))
    except ValueError:
        return False


def _beyond(place: str, printed: Texts) -> tuple[Any, ...]:
    """Relations of states in exactly one of the printed and the derived interval."""
    one, given = part(place), scope(printed)
    here = (*PIECES[one.line].relations, CREST)
    for inside, outside in ((given, one.within), (one.within, given)):
        for relation in outside:
            other = (*here, *inside, sp.Not(relation))
            if consistent([*other, *_DAMPED]):
                return other
    raise ValueError(f"{place} is as printed")


def _beyond_text(place: str, printed: Texts) -> dict[str, str]:
    """State in exactly one of the printed and the derived interval."""
    return at_crest(_beyond(place, printed))


def _touching(line: str) -> dict[str, str]:
    """Point where stick touches a line, at an instant where it turns back for every omega."""
    strong = {**CASE_STUDY, zeta: Fraction(1), alpha: Fraction(9)}
    touching = (sp.Eq(outward(line), 0), sp.Eq(force, 0))
    point = example([*part(f"{line}^(2)").relations, *touching], strong)
    return point_text(point) | {"tau": {"L1": "pi/(2 omega)", "L4": "3 pi/(2 omega)"}[line]}


def _interval(one: Part) -> tuple[Any, ...]:
    """Range of v_r on a part; that of L3^(3) with the end of L3's range, as printed."""
    end = scope(["2*zeta*v_r <= f_b - delta"]) if one.name == "L3^(3)" else ()
    return (*one.within, *end, *_DAMPED)


_INSIDE = "as printed, with the derived interval"


def appendix_a(paper: Paper) -> Iterator[Statement]:
    """Appendix A: the bounds within which stick always ends on L1 and L4."""
    bounds = paper["section.3.3.bounds"]
    for key, text in bounds.printed.items():
        bound = BY_LINE[key].alpha_bound
        yield beside(
            bounds,
            f"appendix.A.{key}.bound",
            same_formula,
            {"printed": text, "expected": bound},
            {"expected": f"-({bound})"},
            says=f"alpha < {text} is sufficient for stick to end everywhere and always on {key}",
            printed=f"the sign on {key} is positive for 0 < alpha < {text}",
            derived="as printed; necessary too, and the end point may be added "
            f"(appendix.A.{key}.sharp)",
            verdict="conditional",
            proof="the infimum of n over the line is at its corner, where v_r ends its range, and "
            "over time at alpha cos(omega tau) = -alpha (L1) or alpha (L4)",
        )
    end = point(paper, paper["figure.6"]["range"][1])
    for key, text in bounds.printed.items():
        yield beside(
            bounds,
            f"section.3.3.{key}.study",
            below,
            {"at": end, "bound": text},
            {"bound": f"-({text})"},
            says=f"Section 4 is within Appendix A's bound of {key}, up to α = {end['alpha']}",
            printed=f"the example assumes α < {text}",
            proof="the bound at the printed parameters",
        )
    for key, (first, second) in paper["appendix.A.ways"].printed.items():
        yield beside(
            paper["appendix.A.ways"],
            f"appendix.A.{key}.way",
            points,
            {"line": key, "printed": (first, second)},
            {"printed": (second, first)},
            says=f"within the bound {key} leads from {first} to {second} only",
            printed=f"the mechanism on {key} is uni-directional, from {first} to {second}",
            derived="as printed, within the bound",
            verdict="conditional",
            proof=f"the normal out of stick points that way, and n > 0 (appendix.A.{key}.sharp)",
        )
    entry = paper["appendix.A"]
    for key, how in (("A.1", ""), ("A.2", ", times 2 zeta")):
        yield beside(
            entry,
            f"appendix.{key}",
            positive,
            {"printed": entry[key], "expected": "n_L1"},
            {"expected": "-n_L1"},
            says=f"Eq. ({key}) states that (22) is positive: {entry[key]}",
            printed=entry[key],
            proof=f"the two sides subtracted{how}",
        )
    yield beside(
        entry,
        "appendix.A.range",
        positive,
        {"printed": entry["L1"], "expected": "2*zeta*v_r - (f_b - delta)"},
        {"expected": "f_b - delta - 2*zeta*v_r"},
        says=f"on L1 {entry['L1']}, and every such v_r occurs there",
        printed=entry["L1"],
        proof="P3 = f_b and P2 < delta",
    )
    extremes = paper["appendix.A.extremes"]
    least, greatest = extremes["least"], extremes["greatest"]
    yield beside(
        extremes,
        "appendix.A.3",
        positive,
        {"printed": f"{least} > {greatest}", "expected": "n_L1"},
        {"printed": f"{greatest} > {least}"},
        says=f"min({least}) > max({greatest}) is Eq. (A.2) at its worst",
        printed=f"min({least}) > max({greatest})",
        proof="the sides of Eq. (A.2)",
    )
    yield beside(
        entry,
        "appendix.A.4",
        extreme,
        {"printed": entry["A.4"], "greatest": greatest, "end": entry["L1"]},
        {"end": "v_r > (f_b + delta)/(2*zeta)"},
        says=f"{entry['A.4']} is Eq. (A.3) with its extremes, -alpha and the end of L1's range",
        printed=entry["A.4"],
        proof="alpha cos(omega tau) >= -alpha, and v_r > (f_b - delta)/(2 zeta) on L1",
    )


def appendix_b(paper: Paper) -> Iterator[Statement]:
    """Appendix B: the parts of L2 and L3, and the sign of Eq. (23) on them."""
    entry = paper["appendix.B"]
    lower, upper = entry["B.2"]
    yield misprint(
        entry,
        "appendix.B.1",
        ["L2"],
        f"-P3_F2 == {entry['B.1']}",
        "-P3_F2 == n_L2",
        place="Eq. (B.1)",
        printed=f"on L2, ⟨∇P3-, F2⟩ = {entry['B.1']}",
        derived="as Eq. (23) has to read: -v_r - 2*zeta*f_b - 2*zeta*alpha*cos(omega*tau)",
        proof="see the erratum on Eq. (23)",
        consequence="Appendix B repeats Eq. (23), so that it is no misprint of the equation.",
    )
    yield beside(
        entry,
        "appendix.B.2.upper",
        follows,
        {"here": ["L2", "P3_F2 == 0"], "printed": [lower]},
        {"printed": [upper]},
        says=f"where (23) vanishes, {lower}",
        printed=lower,
        proof="v_r = -2 zeta (f_b + alpha cos omega tau) there",
    )
    yield misprint(
        entry,
        "appendix.B.2",
        ["L2", "-P3_F2 == 0"],
        upper,
        "v_r <= -2*zeta*(f_b - alpha)",
        place="Eq. (B.2)",
        printed=f"where (23) vanishes, {upper}",
        derived="where (23) vanishes, -2 zeta (f_b + alpha) <= v_r <= -2 zeta (f_b - alpha)",
        proof="v_r = -2 zeta (f_b + alpha cos omega tau) there",
        consequence="The interval is that of the printed Eq. (23).",
    )
    on_l2, on_l3 = paper["appendix.B.L2"], paper["appendix.B.L3"]
    for key, texts in on_l2.printed.items():
        one = part(key)
        within = " and ".join(map(str, one.within))
        yield beside(
            on_l2,
            f"appendix.B.{key}",
            other_interval,
            {"place": key, "printed": texts},
            {"printed": one.within},
            says=f"{key} is {within}, not {' and '.join(texts)}",
            printed=f"{key}: {' and '.join(texts)}",
            derived=f"{key}: {within}",
            verdict="refuted",
            proof="the extremes of n = -v_r - 2 zeta (f_b + alpha cos omega tau) over a period",
            consequence="The printed intervals are those of the printed Eq. (23); all are too high "
            "by 4 zeta f_b.",
            formula=one.interval,
            witness=partial(_beyond_text, key, texts),
        )
    for key, texts in on_l3.printed.items():
        yield beside(
            on_l3,
            f"appendix.B.{key}",
            same_sets,
            {"printed": [("zeta > 0", *texts)], "expected": [_interval(part(key))]},
            {"expected": [["v_r < 0", "zeta > 0"]]},
            says=f"{key} is {' and '.join(texts)}",
            printed=f"{key}: {' and '.join(texts)}",
            proof="the extremes of n over a period",
            formula=part(key).interval,
        )
    stick = paper["section.3.3.stick"]
    for key, does in stick.printed.items():
        yield beside(
            stick,
            f"section.3.3.{key}.stick",
            stick_does,
            {"place": key, "printed": does},
            {"printed": {"ends": "begins", "begins": "ends"}[does]},
            says=f"stick {does} on {key}, at all times (with the derived interval)",
            printed=f"on {key} stick {does}",
            derived=_INSIDE,
            verdict="conditional",
            proof="the bounds of cos omega tau put in, and the variables eliminated",
        )
    signs = paper["section.3.3.signs"]
    for key, expected, sign, way in (
        ("L2^(1)", "-P3_F2 > 0", "positive", "ends"),
        ("L2^(3)", "P3_F2 > 0", "negative", "begins"),
    ):
        yield misprint(
            signs,
            f"appendix.B.{key}.sign",
            [key],
            f"-P3_F2 {signs[key]} 0",
            expected,
            printed=f"on {key}, ⟨∇P3-, F2⟩ {signs[key]} 0",
            derived=f"on {key} it is {sign}: the normal points from S2 to S3, so that out of stick "
            "is positive",
            proof="-v_r - 2 zeta (f_b + alpha cos omega tau) on the derived interval",
            consequence="The printed sign contradicts both Eq. (23) and the text beside it; the "
            f"role of {key} in the text (stick {way}) is right.",
        )
    first = on_l2["L2^(1)"]
    yield misprint(
        on_l2,
        "appendix.B.L2^(1).role",
        ["L2", first[0], first[1], "zeta > 0"],
        "-P3_F2 > 0",
        "-P3_F2 > 0",
        inside=["L2^(1)"],
        printed=f"for {' and '.join(first)} stick {stick['L2^(1)']}, at all times",
        derived="stick ends at all times for v_r < -2 zeta (f_b + alpha) only",
        proof="n >= -v_r - 2 zeta (f_b + alpha), positive on the derived interval",
        consequence="At v_r between -2 zeta (f_b + alpha) and 2 zeta (f_b - alpha) stick may begin "
        "on L2; with alpha = 0.7 of the case study the printed L2^(1) reaches to +0.03, the "
        "derived one to -0.17.",
    )
    senses = {"<": "negative", ">": "positive"}
    yield beside(
        signs,
        "section.3.3.L2^(2).sign",
        stick_does,
        {"place": "L2^(2)", "printed": signs["L2^(2)"]},
        {"printed": "begins"},
        says="on L2^(2) the sign of (23) depends on time (with the derived interval)",
        printed="on L2^(2) the sign is "
        + senses.get(signs["L2^(2)"], "one or the other, by the time"),
        derived=_INSIDE,
        verdict="conditional",
        proof="inside it both signs are taken in every period",
    )
    closed = on_l3["L3^(3)"][1]
    yield misprint(
        on_l3,
        "appendix.B.L3.end",
        ["O1", closed, "zeta > 0"],
        "x_r > delta",
        "x_r == delta",
        inside=["O1"],
        printed=f"L3^(3) is closed, {closed}: it holds the corner O1",
        derived="O1 has x_r = delta, so by Eq. (14) it is not on L3 (nor O2 on L2)",
        proof="Eq. (14) gives L3 with P2 > delta, and O1 has P2 = delta",
        consequence="Motion through a corner is a case of its own; see the errata on O1, O2. The "
        "scan distinguishes the closed end by its bracket.",
    )


def passages_on_lines(paper: Paper) -> Iterator[Statement]:
    """The passages on lines and their parts, Section 3.3."""
    entry = paper["section.3.3.passages"]
    printed = {
        place: frozenset((source, target) for source in sources for target in targets)
        for place, sources, targets in entry["rows"]
    }
    for key, pairs in printed.items():
        if key not in ("L2^(1)", "L2^(3)", "L4"):
            yield beside(
                entry,
                f"section.3.3.{key}.passages",
                passages,
                {"place": key, "pairs": pairs},
                {"pairs": pairs - {min(pairs)}},
                says=f"on {key}: {spaces(pairs)}",
                printed=f"{key}: {spaces(pairs)}",
                proof="the signs of the derivatives of the functions that bound each field's cell",
            )
    for key, occur, other, proof, consequence in (
        (
            "L2^(1)",
            ((1, 3), (2, 3), (3, 3)),
            ((1, 3), (2, 3)),
            "stick ends into backward drift on L2",
            "A reading error would explain it: Table 2 has Ω3.",
        ),
        (
            "L2^(3)",
            ((1, 2),),
            ((1, 2), (2, 2)),
            "where stick begins on L2 nothing arrives from Ω3",
            "See the erratum on Table 2's source Ω3.",
        ),
        (
            "L4",
            ((4, 6), (5, 6), (6, 6)),
            ((4, 6), (5, 6)),
            "P4 = -f_b on L4, so that stick ends into backward drift",
            "Appendix A has it right; Table 2 repeats Ω4 in three columns.",
        ),
    ):
        yield beside(
            entry,
            f"section.3.3.{key}.passages",
            passages,
            {"place": key, "pairs": printed[key]},
            {"pairs": other},
            correction={"pairs": occur},
            says=f"on {key}: {spaces(occur)}",
            printed=f"{key}: {spaces(printed[key])}",
            derived=f"{key}: {spaces(occur)}",
            verdict="refuted",
            proof=proof,
            consequence=consequence,
            witness=partial(at_crest, [key]),
        )


def sliding_bifurcations(paper: Paper) -> Iterator[Statement]:
    """The sliding bifurcations possible on each part, Section 3.3 and Section 4."""
    entry = paper["section.3.3.bifurcations"]
    for key, kinds in entry.printed.items():
        yield beside(
            entry,
            f"section.3.3.{key}.bifurcations",
            sliding,
            {"place": key, "printed": kinds},
            {"printed": ("adding", "switching")},
            says=f"sliding bifurcations possible on {key}: {listed(kinds)}",
            printed=f"{key}: {listed(kinds)}",
            derived=_INSIDE if "2^" in key else "as printed, in scope",
            verdict="conditional",
            proof="the signs of n and of its rate where each kind of trajectory meets the part",
        )
    origins = paper["section.3.3.origins"]
    for place, kind, field in origins["rows"]:
        yield beside(
            origins,
            f"section.3.3.{place}.{kind}",
            comes_from,
            {"place": place, "kind": kind, "field": field},
            {"field": next_field(field)},
            says=f"{kind}-sliding on {place} begins with a trajectory of F{field}",
            printed=f"{place}: {kind}-sliding of a trajectory from Ω{field}",
            proof="grazing touches P1 = 0 from the drift beside the line, crossing and switching "
            "arrive from the drift opposite",
        )
    entry = paper["section.4.adding"]
    places = entry["only_on"]
    yield beside(
        entry,
        "section.4.adding",
        adding_only_on,
        {"printed": places},
        {"printed": places[1:]},
        says=f"within Appendix A's bounds adding-sliding can only happen on {listed(places)}",
        printed=f"adding-sliding can only happen on {listed(places)}",
        derived="as printed, while alpha is within both bounds of Appendix A",
        verdict="conditional",
        proof="stick touches a line where n = 0 and its rate turns it back",
    )
    for key in ("L1", "L4"):
        within = sp.Le(*BY_LINE[key].condition)
        yield beside(
            entry,
            f"section.4.adding.{key}",
            adding_beyond,
            {"line": key, "within": (within,)},
            {"within": (sp.Ge(*within.args),)},
            says=f"adding-sliding occurs on {key}^(2) too, but not while {within}",
            printed=f"adding-sliding can only happen on {listed(places)}",
            derived=f"so it is while alpha is within the bound of Appendix A; else on {key} too",
            verdict="conditional",
            proof="within the bound n > 0 on the whole line, so stick cannot touch it from inside; "
            "beyond it n = 0 occurs, with a rate of either sign",
            consequence="The case study (ζ = 0.05, α ≤ 2) is far within the bound.",
            formula=sp.latex(within),
            witness=partial(_touching, key),
        )


STATEMENTS = (appendix_a, appendix_b, passages_on_lines, sliding_bifurcations)
