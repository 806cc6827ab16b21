"""Claims of Section 3: Eqs. (13)-(24), the corners, and the normals with their products."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from capsule_sym._symbolic.theory import (
    PIECES,
    Statement,
)
from paper.claims.beside import beside, braces, next_field
from paper.claims.errata import at_crest, equal, misprint, same_union
from paper.claims.fields import domain, slope_jumps
from paper.claims.formula import relations
from paper.claims.motions import impact_without
from paper.claims.relations import absent, corner_lines, follows, latex, listed, same_sets, scope
from paper.claims.space import (
    alike,
    crosses,
    derived_uses,
    elsewhere,
    gradient,
    held_by,
    impact_planes,
    leads_elsewhere,
    never_ends_on,
    outside_all,
    points,
    product,
    product_means,
    product_sign,
    subspace_of,
    tangent,
    unlike_its_lines,
)
from paper.claims.tables import pairs_of, printed_maps, rows_of, spaces
from paper.printed import Paper

NARROW = ("zeta > 0", "delta < f_b")
"""Damping, and the position of the gap to which Section 3.1 restricts what follows."""


def pieces(paper: Paper) -> Iterator[Statement]:
    """Eqs. (13) and (14): the surfaces and lines."""
    both = "each of the two sets includes the other"
    for name in ("equation.13", "equation.14.friction"):
        for key, texts in paper[name].printed.items():
            yield beside(
                paper[name],
                f"{name[:11]}.{key}",
                same_sets,
                {"printed": [texts], "expected": [[key]]},
                {"expected": [[f"{key[0]}{int(key[1:]) % 9 + 1}"]]},
                says=f"{key} is as printed: {listed(texts)}",
                printed=f"{key} = {braces(texts)}",
                proof=both,
                formula=PIECES[key].latex,
            )
    impact = paper["equation.14.impact"]
    for key, parts, end, others in (
        ("L5", ["L5"], "P3 - f_b", ["L6"]),
        ("L6", ["L6", "O1"], "P3 - f_b", ["L5"]),
        ("L7", ["L7", "O2"], "P3 + f_b", ["L5", "L6"]),
        ("L8", ["L8"], "P3 + f_b", ["L5", "L6"]),
    ):
        yield beside(
            impact,
            f"equation.14.{key}",
            same_union,
            {"whole": impact[key], "pieces": parts, "within": NARROW, "end": end},
            {"pieces": others},
            says=f"for zeta > 0 and delta < f_b the printed {key} is {' and '.join(parts)} of this "
            "derivation",
            printed=f"{key} = {braces(impact[key])}",
            derived="as printed for delta < f_b",
            verdict="conditional",
            proof=both,
            formula=latex(scope(impact[key])),
        )
    for key, where, derived, proof, consequence in (
        (
            "L7",
            "to stick in Ω2",
            "for delta > f_b the part of L7 above O1 (L10: P3 > f_b) leads Ω6 to forward drift Ω1",
            "on L10 P3 > f_b, so F1 gives v_c' = (P3 - f_b)/gamma > 0",
            "L10 is missing from the paper, and with it P_{Σ1,F6,Σ6} and P_{Σ1,F6,Σ9}. Section 3.1 "
            "restricts what follows it to delta < f_b, where L10 does not exist; Eq. (14) itself "
            "stands before the restriction.",
        ),
        (
            "L5",
            "into contact, Ω3 to Ω4",
            "L5 needs v_r > 0 as well: for delta > f_b the printed bound is negative",
            "contact begins where P2 rises through delta, that is v_r > 0; for delta > f_b the "
            "printed L5 holds points of L10, where contact ends",
            "For delta > f_b the printed L5 and L7 overlap, and L5 holds a point of L9.",
        ),
    ):
        claim = {"printed": impact[key], "rows": rows_of(paper, "table.2", key), "piece": "L10"}
        yield beside(
            impact,
            f"equation.14.{key}",
            leads_elsewhere,
            claim,
            {"piece": key},
            printed=f"{key} = {braces(impact[key])} leads {where}, for every delta",
            derived=derived,
            verdict="refuted",
            place="Eq. (14), Table 2",
            proof=proof,
            consequence=consequence,
            witness=partial(elsewhere, **claim),
        )


def subspaces(paper: Paper) -> Iterator[Statement]:
    """Eq. (15): the subspace of each surface and line."""
    entry, members = paper["equation.15"], subspace_of(paper)
    for key, subspace in members.items():
        if key not in ("L7", "L8"):
            yield beside(
                entry,
                f"equation.15.{key}",
                held_by,
                {"piece": key, "subspace": subspace},
                {"subspace": next_field(subspace)},
                says=f"{key} is in Ω{subspace}, by Eqs. (7)-(12) and Eq. (15)",
                printed=f"{key} ⊂ Ω{subspace}",
                proof="the relations of the piece imply those of one of Eqs. (7)-(12), |P4| in "
                "(11)",
            )
    # Lines of P2 = delta that Eqs. (11), (12) count to contact, though it ends there.
    for key, held, equation in (("L7", 5, 11), ("L8", 6, 12)):
        subspace = members[key]
        yield beside(
            entry,
            f"equation.15.{key}",
            held_by,
            {"piece": key, "subspace": subspace},
            {"subspace": next_field(subspace)},
            correction={"subspace": held},
            says=f"by Eqs. (7)-(12) {key} is in Ω{held}, by Eq. (15) in Ω{subspace}",
            printed=f"{key} ⊂ Ω{subspace}",
            derived=f"{key} ⊂ Ω{held} by Eq. ({equation}), which has P2 >= delta; the motion that "
            f"follows is in Ω{subspace}",
            verdict="refuted",
            proof=f"P4 = P3 on P2 = delta, and {key} has the values of P3 of Ω{held}",
            consequence=f"Harmless: F{subspace} = F{held} on P2 = delta. The two definitions of "
            "the subspaces are not the same.",
            witness=partial(at_crest, [key]),
        )
    moving = paper["equation.15.moving"]
    for key, texts in moving.printed.items():
        field = int(key[-1])
        yield beside(
            moving,
            f"equation.15.{key}",
            same_sets,
            {"printed": [texts], "expected": domain(field)[:1]},
            {"expected": domain(next_field(field))[:1]},
            says=f"off P1 = 0, {key} is {listed(texts)}",
            printed=braces(texts),
            proof="each of the two sets includes the other",
        )
    shown = {
        **paper["equation.13"].printed,
        **paper["equation.14.friction"].printed,
        **paper["equation.14.impact"].printed,
    }
    sets = [*(shown[name] for name in members), *moving.printed.values()]
    yield beside(
        entry,
        "equation.15.O3",
        outside_all,
        {"point": "O3", "sets": [relations(texts) for texts in sets], "within": NARROW},
        {"point": "S5"},
        says="Eq. (15) leaves out the state (delta, 0, 0) for delta < f_b",
        printed="the subspaces of Eq. (15) fill the state space",
        derived="(delta, 0, 0) is in none of them; Eq. (11) has it in Ω5",
        verdict="refuted",
        proof="S1-S6 and L1-L4 have P2 ≠ delta, L5-L8 have v_r ≠ 0, and the other parts have "
        "P1 ≠ 0",
        consequence="Harmless: the fields agree there. It is the point O3 of this derivation.",
        formula=r"(\delta,0,0)\notin\bigcup_i\Omega_i",
        witness=lambda: {"x_r": "1/50", "v_r": "0", "v_c": "0", "delta": "1/50", "f_b": "1"},
    )


def planes(paper: Paper) -> Iterator[Statement]:
    """Eq. (24): the switching planes of the map."""
    entry, members = paper["equation.24"], subspace_of(paper)
    sets = entry["planes"]
    plane_of = {name: f"Σ{i}" for i, names in enumerate(sets, start=1) for name in names}
    for key, plane in plane_of.items():
        if key not in ("S7", "S8", "S9", "S10"):
            subspace = members[key]
            yield beside(
                entry,
                f"equation.24.{key}",
                equal,
                {"printed": plane, "expected": f"Σ{subspace}"},
                {"expected": f"Σ{next_field(subspace)}"},
                says=f"{key} is in {plane}: the plane has the number of the subspace of Eq. (15)",
                printed=f"{key} ⊂ {plane}",
                proof="the two sets of names are compared",
            )
    impacts = {plane: name for name, plane in plane_of.items() if name not in members}
    yield beside(
        entry,
        "equation.24.impacts",
        impact_planes,
        {
            "planes": tuple(impacts),
            "names": tuple(impacts.values()),
            "maps": printed_maps(paper),
        },
        {"planes": tuple(impacts)[::-1]},
        says="Σ7 to Σ10 are S7 to S10: every map of Table 3 that begins or ends on one of them "
        "does so on that surface",
        printed=", ".join(f"{plane} = {name}" for plane, name in impacts.items()),
        proof="Table 1 as derived gives the fields that reach and leave each surface",
    )
    ends = ((2, "Σ1"), (2, "Σ3"), (5, "Σ4"), (5, "Σ6"))
    cups = "; ".join(f"Σ{i} = {' ∪ '.join(names)}" for i, names in enumerate(sets[:6], start=1))
    yield beside(
        entry,
        "equation.24.stick",
        never_ends_on,
        {"ends": ends, "planes": plane_of},
        {"ends": (*ends, (1, "Σ3"))},
        says="with Eq. (24) as printed stick never ends on Σ1, Σ3 (F2) or Σ4, Σ6 (F5)",
        printed=f"{cups}, and P_{{Σ1,F2,Σ2}}, P_{{Σ3,F2,Σ2}}, P_{{Σ4,F5,Σ5}}, P_{{Σ6,F5,Σ5}} are "
        "local maps",
        derived="stick ends on L1-L4 (or at impacts): a point of them belongs to the plane of the "
        "subspace that follows, Σ1-Σ6 for Ω1-Ω6",
        verdict="refuted",
        proof="before it ends, stick has |P3| < f_b (F2) or |P4| < f_b (F5), so by continuity it "
        "ends on no point of S1, S3, S4, S6, L5 or L8; the signs of the derivatives exclude every "
        "other piece",
        consequence="Table 3 and Section 4 use the derived rule, which is the one used here.",
        formula=r"L_1,L_2\subset\Sigma_2,\ L_3,L_4\subset\Sigma_5",
        witness=partial(at_crest, ["L2", "n_L2 > 0"]),
    )


def corners(paper: Paper) -> Iterator[Statement]:
    """The corners O1 and O2 of Section 3.1, and the cases of Fig. 2."""
    entry = paper["section.3.1.corners"]
    for key in ("O1", "O2"):
        yield beside(
            entry,
            f"section.3.1.{key}.lines",
            corner_lines,
            {"corner": key, "printed": entry[key], "within": NARROW},
            {"printed": entry[key][1:]},
            says=f"for delta < f_b the lines that meet at {key} are {listed(sorted(entry[key]))}",
            printed=f"{key} is the intersection of {listed(entry[key])}",
            derived="as printed for delta < f_b",
            verdict="conditional",
            proof="the relations of the corner imply those of each line's closure, of no other",
        )
    for key, corner, part, gap in (
        ("O1_at", "O1", "O1", "f_b > 0"),
        ("O2_at", "O2", "O2", "f_b > 0"),
        ("O1_equal", "O1.equal", "O1", "δ = f_b"),
    ):
        yield beside(
            entry,
            f"section.3.1.{corner}.place",
            same_sets,
            {
                "printed": [[*entry[key][:3], "zeta > 0", gap]],
                "expected": [[part, "zeta > 0", gap]],
            },
            {"expected": [["S1"]]},
            says=f"for zeta > 0 and {gap} {part} is at {listed(entry[key])}",
            printed=f"{part} at {listed(entry[key])}",
            proof="P3 has the value of the bound there, and P2 = delta",
        )
    quarters = paper["section.3.1.quarters"]
    for case, gap, other in (
        ("less", "δ < f_b", "v_r < 0"),
        ("equal", "δ = f_b", "v_r > 0"),
        ("greater", "δ > f_b", "v_r > 0"),
    ):
        texts = quarters[f"O1_{case}"]
        yield beside(
            quarters,
            f"section.3.1.O1.{case}",
            follows,
            {"here": ["O1", "zeta > 0", "delta > 0", gap], "printed": texts},
            {"printed": ["x_r > 0", other]},
            says=f"for {gap} O1 has {' and '.join(texts)}",
            printed=f"O1 has {' and '.join(texts)} for {gap}",
            proof="x_r = delta and 2 zeta v_r = f_b - delta at O1",
        )
    for key, gap in (("b", "δ < f_b"), ("c", "δ = f_b"), ("d", "δ > f_b")):
        text = paper["figure.2"][key]
        yield beside(
            paper["figure.2"],
            f"figure.2.{key}",
            same_sets,
            {"printed": [[text]], "expected": [[gap]]},
            {"printed": [["delta < 2*f_b"]]},
            says=f"Fig. 2({key}) is the case {gap}, by the place of O1",
            printed=f"Fig. 2({key}): {text}",
            proof="v_r at O1 is positive, zero and negative in the three cases",
        )
    yield beside(
        quarters,
        "section.3.1.O2.always",
        follows,
        {"here": ["O2", "delta > 0"], "printed": quarters["O2"]},
        {"printed": ["x_r > 0", "v_r > 0"]},
        says=f"O2 is always at {' and '.join(quarters['O2'])}",
        printed=f"O2 always has {' and '.join(quarters['O2'])}",
        proof="x_r = delta and 2 zeta v_r = -f_b - delta at O2",
    )
    # Lines that hold a corner, by each reading of the two lost indices.
    lost = paper["section.3.1.corner_line"]
    for key, passages, rises, new in (
        (
            "O1",
            ((1, 4), (2, 4), (3, 4)),
            "P4 = f_b rises",
            "P_{Σ4,F2,Σ2}, P_{Σ4,F1,Σ1} and P_{Σ4,F1,Σ8}",
        ),
        (
            "O2",
            ((4, 3), (5, 3), (6, 3)),
            "P3 = -f_b falls",
            "P_{Σ3,F5,Σ5}, P_{Σ3,F6,Σ6} and P_{Σ3,F6,Σ9}",
        ),
    ):
        lines = tuple((name, pairs_of(rows_of(paper, "table.2", name))) for name in entry[key])
        summary = spaces(passages) + "".join(
            f"; read as {name}, Table 2 gives {spaces(pairs)}" for name, pairs in lines
        )
        yield beside(
            lost,
            f"section.3.1.{key}.line",
            unlike_its_lines,
            {"corner": key, "printed": lost[key], "expected": passages, "lines": lines},
            {"expected": ((1, 5), (2, 5), (3, 5))},
            says=f"at {key}, within Appendix A's bounds on alpha: {summary}",
            printed=f"{key} ∈ {lost[key]}",
            derived=f"{summary}. No reading makes the row of Table 2 right",
            verdict="refuted",
            proof=f"at {key} {rises} along stick, and v_c = v_c' = 0 along the drift beside, whose "
            "v_c'' has the sign of its own sense",
            consequence=f"A corner has a row of its own. It adds {new} to Table 3.",
            witness=partial(at_crest, [key]),
        )


_WAY = {2: "stick", 1: "forward drift", 3: "backward drift"}
_BOUND = {2: "P3 < f_b", 1: "P3 > f_b", 3: "P3 < -f_b"}
_WIDE = {
    **{"alpha": "0.9", "omega": "0.8", "delta": "1", "zeta": "0.05", "beta": "1.5"},
    **{"gamma": "3.3", "f_b": "1"},
}
"""Parameters with delta = f_b at which a first impact follows backward drift."""


def starts(paper: Paper) -> Iterator[Statement]:
    """The start from rest, for each position of the gap."""
    entry = paper["section.3.1.start"]
    start = entry["start"][:3]
    for key, gap in (("less", "δ < f_b"), ("equal", "δ = f_b")):
        yield beside(
            entry,
            f"section.3.1.start.{key}",
            follows,
            {"here": [*start, gap, "delta > 0"], "printed": [f"S{entry[key]}"]},
            {"printed": ["S1"]},
            says=f"for {gap} the capsule starts from (0, 0, 0) in {_WAY[entry[key]]}",
            proof="P3 = 0 and P2 = 0 < delta there",
        )
    yield misprint(
        entry,
        "section.3.1.wide",
        [*start, "δ > f_b"],
        _BOUND[entry["greater"]],
        "P3 < f_b",
        at={"delta": "3/2"},
        printed=f"for δ > f_b the capsule starts from (0, 0, 0) in {_WAY[entry['greater']]}",
        derived="P3(0, 0, 0) = 0 < f_b for every delta: the capsule starts in stick",
        proof="P3 = x_r + 2 zeta v_r is 0 there",
        consequence="Forward drift can begin only after P3 has reached f_b, on L1.",
    )
    for gap in entry["absent_for"]:
        yield beside(
            entry,
            f"section.3.1.absent.{'equal' if '==' in gap else 'greater'}",
            absent,
            {"piece": entry["absent"], "within": [gap]},
            {"piece": "L5"},
            says=f"for {gap} {entry['absent']} does not exist: no contact begins in stick",
            printed=f"for {gap} {entry['absent']} does not exist",
            proof="L6 has 0 < v_r and 2 zeta v_r + delta < f_b",
        )
    drift = entry["equal_before_impact"]
    yield beside(
        entry,
        "section.3.1.equal",
        impact_without,
        {"at": _WIDE, "drift": drift},
        {"drift": "backward"},
        says="for delta = f_b from (0, 0, 0) an impact can come before any forward drift",
        printed=f"for delta = f_b the capsule must have {drift} drift before any impact",
        derived="true of impacts from stick (L6 is empty); backward drift can lead to an impact",
        verdict="refuted",
        proof="with damping, at the witness, the motion from rest is followed in ball arithmetic: "
        "stick, backward drift, impact",
        consequence="P_{Σ9,F3,Σ3} can be the first impact for delta = f_b as well.",
        formula=r"S_2\to L_2\to S_9",
        witness=lambda: {
            **_WIDE,
            "start": "(0, 0, 0) at tau = 0",
            "fields": "F2, F3, F6: S2 to L2 to S9",
        },
    )


def uses(paper: Paper) -> Iterator[Statement]:
    """The use of surfaces and lines in Section 3.1."""
    entry, found = paper["section.3.1.uses"], derived_uses()
    for key, use in (
        ("stick_on", "stick occurs on the surfaces"),
        ("impact_entered_by", "contact begins on"),
        ("impact_left_by", "contact ends on"),
        ("sliding_lines", "stick borders on drift, P1 = 0, on the lines"),
        ("crossing_lines", "P1 = 0 and P2 = delta meet, for delta < f_b, in the lines"),
    ):
        names = tuple(sorted(entry[key]))
        yield beside(
            entry,
            f"section.3.1.{key}",
            equal,
            {"printed": names, "expected": tuple(sorted(found[key]))},
            {"printed": names[1:]},
            says=f"{use} {listed(entry[key])}",
            proof="read off the derived surfaces, lines and Table 1",
        )
    yield beside(
        entry,
        "section.3.1.smooth",
        slope_jumps,
        {"line": entry["smooth"], "size": "beta*(gamma + 1)/gamma"},
        {"size": "-beta*(gamma + 1)/gamma"},
        says="the fields are continuous on L9, but their slope jumps by beta (gamma+1)/gamma",
        printed=f"{listed(entry['smooth'])} is smooth for all vector functions",
        derived="continuous (saltation.F1.F4); differentiable only for beta = 0",
        verdict="conditional",
        proof="∂F4/∂x_r − ∂F1/∂x_r on P2 = delta, from the fields",
        consequence="A graze on L9 keeps the orbit's slope in a parameter but changes its "
        "curvature: no square root, since the force is continuous.",
        formula=r"\partial_{x_r}(F_4-F_1)"
        r"=(0,-\frac{\beta \left(\gamma + 1\right)}{\gamma},\frac{\beta}{\gamma})",
    )


def normals(paper: Paper) -> Iterator[Statement]:
    """The normals of Sections 3.2 and 3.3, and what the signs of the inner products mean."""
    for key, texts in paper["normals"].printed.items():
        yield beside(
            paper["normals"],
            f"normal.{key}",
            gradient,
            {"normal": key, "printed": texts},
            {"normal": key[:2] + ("-" if key[2] == "+" else "+")},
            says=f"the normal ∇{key} is ({listed(texts)})",
            printed=f"∇{key} = ({listed(texts)})",
            proof="the gradient of the auxiliary function, with the sign of its side",
        )
    for key, (inside, outside) in paper["normals.point"].printed.items():
        yield beside(
            paper["normals.point"],
            f"normal.{key}",
            points,
            {"line": key, "printed": (inside, outside)},
            {"printed": (outside, inside)},
            says=f"the normal on {key} points from {inside} to {outside}",
            printed=f"the normal of {key} points from {inside} to {outside}",
            proof="the bound is not reached on the one surface, and exceeded on the other",
        )
    entry = paper["figure.3"]
    shown = tuple(entry["surfaces"])
    examples = tuple(dict.fromkeys(paper[f"equation.{n}"]["on"] for n in range(16, 22)))
    yield beside(
        entry,
        "figure.3",
        equal,
        {"printed": shown, "expected": examples},
        {"printed": shown[1:]},
        says=f"the examples are those of Eqs. (16)-(21), {listed(examples)}",
        printed=listed(shown),
        proof="the printed names are compared",
    )
    for key, sign in (("positive", 1), ("negative", -1)):
        yield beside(
            entry,
            f"figure.3.{key}",
            product_means,
            {"sign": sign, "printed": entry[key]},
            {"sign": -sign},
            says=f"of a drift that meets P1 = 0 or P2 = delta a {key} inner product is "
            f"{entry[key]}",
            printed=f"a {key} inner product is {entry[key]}",
            proof="whether the drift's trajectories come from its cell, or go into it, on every "
            "surface",
        )
    yield beside(
        entry,
        "figure.3.zero",
        product_means,
        {"sign": 0, "printed": entry["zero"]},
        {"sign": 1},
        says=f"a drift with inner product 0 is {entry['zero']} if the next derivative is not 0: on "
        "L1-L4 and L9 it comes from its cell and goes back into it, or has no trajectory there",
        printed=f"a zero inner product indicates {entry['zero']}",
        derived="of drifts, where the next derivative is not 0",
        verdict="conditional",
        proof="the sign of the second derivative of P1 or P2 along each drift, on each line",
    )


def mechanisms(paper: Paper) -> Iterator[Statement]:
    """The mechanisms on surfaces and lines of Sections 3.2 and 3.3."""
    for key, text in paper["section.3.2.bounds"].printed.items():
        yield beside(
            paper["section.3.2.bounds"],
            f"section.3.2.{key}.bound",
            follows,
            {"here": [key], "printed": [text]},
            {"printed": ["v_r > 0"]},
            says=f"on {key} {text}",
            printed=f"{text} on both sides of {key}",
            proof="Eq. (13)",
        )
    for key, names in paper["section.3.2.alike"].printed.items():
        yield beside(
            paper["section.3.2.alike"],
            f"section.3.2.{key}.alike",
            alike,
            {"surface": key, "printed": names},
            {"printed": ()},
            says=f"the surfaces with a mechanism like that of {key} are {listed(names)}",
            printed=f"{listed(names)}: as {key}",
            proof="Table 1 as derived: how many sources, and whether contact or drift changes",
        )
    for key, sources, target in paper["section.3.3.crossings"]["rows"]:
        omegas = " and ".join(f"Ω{source}" for source in sources)
        yield beside(
            paper["section.3.3.crossings"],
            f"section.3.3.{key}.crossing",
            crosses,
            {"line": key, "sources": sources, "target": target},
            {"sources": (2, 3)},
            says=f"on {key} there is a boundary-intersection crossing for trajectories from "
            f"{omegas}, and for no others; all enter Ω{target}",
            printed=f"{key}: boundary-intersection crossing from {omegas} to Ω{target}",
            proof="beside the line these trajectories meet one of two surfaces first, and have "
            "another field in between; the others have the same fields on both sides",
        )
    line = paper["section.3.3.grazing"]["line"]
    yield beside(
        paper["section.3.3.grazing"],
        "section.3.3.grazing",
        tangent,
        {"line": line},
        {"line": "L5"},
        says=f"on {line} the inner product of ∇P2 with every field is 0, and nowhere else on "
        "P2 = delta",
        printed=f"{line} satisfies the condition of grazing",
        proof="it is v_r",
    )


def products(paper: Paper) -> Iterator[Statement]:
    """Eqs. (16)-(23): the inner products of normals and fields."""
    equations = {
        n: "on {on}, ⟨∇{normal}, F{field}⟩ = {value}".format(**paper[f"equation.{n}"].printed)
        for n in range(16, 24)
    }
    for number in range(16, 23):
        entry = paper[f"equation.{number}"]
        on, normal, field, value = (entry[key] for key in ("on", "normal", "field", "value"))
        yield beside(
            entry,
            entry.id,
            product,
            {"place": on, "normal": normal, "field": field, "printed": value},
            {"printed": f"-({value})"},
            says=equations[number],
            proof="the normal multiplied with the field, component by component",
        )
    for number in range(16, 22):
        entry = paper[f"equation.{number}"]
        on, normal, field, sign = (entry[key] for key in ("on", "normal", "field", "sign"))
        inner = f"⟨∇{normal}, F{field}⟩ {sign} 0"
        yield beside(
            entry,
            f"{entry.id}.sign",
            product_sign,
            {"place": on, "normal": normal, "field": field, "printed": sign},
            {"printed": "<" if sign == ">" else ">"},
            says=f"on {on}, {inner}: {on} is {'repelling' if sign == '>' else 'attracting'} there",
            printed=inner,
            proof=f"the sign on all of {on}, by elimination",
        )
    entry = paper["equation.23"]
    yield misprint(
        entry,
        "equation.23",
        [entry["on"]],
        f"-P3_F2 == {entry['value']}",
        "-P3_F2 == -v_r - 2*zeta*f_b - 2*zeta*alpha*cos(omega*tau)",
        printed=equations[23],
        derived="on L2, ⟨∇P3-, F2⟩ = -v_r - 2*zeta*f_b - 2*zeta*alpha*cos(omega*tau)",
        proof="P3 = -f_b on L2, so F2 = (v_r, f_b + alpha cos omega tau, 0) there; with ∇P3- = "
        "(-1, -2 zeta, 0) the product is -v_r - 2 zeta (f_b + alpha cos omega tau)",
        consequence="P3 = -f_b makes the elastic force in F2 +f_b, and the normal is -(1, 2 zeta, "
        "0): both terms change sign. Everything that Appendix B says about L2 shifts by 4 zeta "
        "f_b.",
    )


STATEMENTS = (
    pieces,
    subspaces,
    planes,
    corners,
    starts,
    uses,
    normals,
    mechanisms,
    products,
)
