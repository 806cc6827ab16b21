"""Section 3.1: the corners, the three positions of the gap, and what the motion from rest does."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial

import sympy as sp

from capsule_sym._paper import Entry, Paper
from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import LINES, PIECES, SCENARIOS, SURFACES, empty
from capsule_sym._symbolic.model.model import P3, SEGMENTS
from capsule_sym._symbolic.model.proof import implies
from capsule_sym._symbolic.model.switching import leaves_of, surface_transitions
from capsule_sym._symbolic.model.symbols import (
    STATE,
    alpha,
    beta,
    delta,
    f_b,
    gamma,
    omega,
    v_r,
    x_r,
    zeta,
)
from capsule_sym._symbolic.paper.case_study import Point, first_fields
from capsule_sym._symbolic.paper.compare import comparison, listed
from capsule_sym._symbolic.paper.erratum import CASE_STUDY, at_crest, erratum_item
from capsule_sym._symbolic.paper.fields import follow
from capsule_sym._symbolic.paper.formula import formula, relations
from capsule_sym._symbolic.paper.tables import Pairs, passages, spaces
from capsule_sym._symbolic.proofs.geometry_proofs import lines_at
from capsule_sym._symbolic.proofs.inner_products import STICK_EDGE
from capsule_sym._symbolic.proofs.items import Item

_DAMPED = sp.Gt(zeta, 0)
_NARROW = (_DAMPED, SCENARIOS["δ < f_b"])
_KEYS = {"less": "δ < f_b", "equal": "δ = f_b", "greater": "δ > f_b"}


def _corners(paper: Paper) -> Iterator[Item]:
    entry, quarters = paper["section.3.1.corners"], paper["section.3.1.quarters"]
    for corner in ("O1", "O2"):
        lines = frozenset(entry[corner])
        yield comparison(
            entry,
            f"section.3.1.{corner}.lines",
            f"for delta < f_b the lines that meet at {corner} are {listed(sorted(lines))}",
            f"{corner} is the intersection of {listed(entry[corner])}",
            (corner, lines),
            lambda claim: lines_at(claim[0], _NARROW) == claim[1],
            (corner, lines - {"L1", "L2"}),
            verdict="conditional",
            derived="as printed for delta < f_b",
            proof="the relations of the corner imply those of each line's closure, of no other",
        )
        at = (entry[f"{corner}_at"],)
        here = (*PIECES[corner].relations, _DAMPED)
        yield comparison(
            entry,
            f"section.3.1.{corner}.place",
            f"for zeta > 0 {corner} is at {at[0]}",
            at[0],
            (here, at),
            follow,
            (here, (at[0].replace("==", ">"),)),
            proof="P3 has the value of the bound there, and P2 = delta",
        )
    for key, name in _KEYS.items():
        text = quarters[f"O1_{key}"]
        here = (*PIECES["O1"].relations, _DAMPED, SCENARIOS[name])
        yield comparison(
            quarters,
            f"section.3.1.O1.{key}",
            f"for {name} O1 has {text}",
            f"O1 has {text} for {name}",
            (here, (text,)),
            follow,
            (here, ("v_r > 0" if key != "less" else "v_r < 0",)),
            proof="2 zeta v_r = f_b - delta at O1",
        )
    figure = paper["figure.2"]
    for panel, name in zip("bcd", SCENARIOS, strict=True):
        yield comparison(
            figure,
            f"figure.2.{panel}",
            f"Fig. 2({panel}) is the case {name}, by the place of O1",
            f"Fig. 2({panel}): {figure[panel]}",
            (figure[panel], SCENARIOS[name]),
            lambda claim: formula(claim[0]) == claim[1],
            ("delta < 2*f_b", SCENARIOS[name]),
            proof="v_r at O1 is positive, zero and negative in the three cases",
        )
    yield comparison(
        quarters,
        "section.3.1.O2.always",
        "O2 is always at v_r < 0",
        f"O2 always has {quarters['O2']}",
        (PIECES["O2"].relations, (quarters["O2"],)),
        follow,
        (PIECES["O2"].relations, ("v_r > 0",)),
        proof="2 zeta v_r = -f_b - delta at O2",
    )


# The open interval of alpha in Appendix A, for which Table 2 is printed.
_ASSUMED = (*_NARROW, sp.Lt(4 * zeta**2 * (alpha + f_b), f_b - delta))


_CORNER_ROWS: dict[str, Pairs] = {
    "O1": frozenset({(1, 4), (2, 4), (3, 4)}),
    "O2": frozenset({(4, 3), (5, 3), (6, 3)}),
}


def _no_line_does(claim: tuple[str, str, Pairs, tuple[tuple[str, Pairs], ...]]) -> bool:
    """Whether a corner has the passages claimed, and no row of Table 2 for a line there has them.

    The line that is read has to be one of the lines that meet there.
    """
    corner, read, expected, rows = claim
    return (
        passages(corner, [*PIECES[corner].relations, *_ASSUMED], may=True) == expected
        and read in dict(rows)
        and set(dict(rows)) == lines_at(corner, _NARROW)
        and all(row != expected for _, row in rows)
    )


def _readings(paper: Paper) -> Iterator[Item]:
    """Which line holds a corner: what follows from each reading of the two lost indices."""
    entry, meeting = paper["section.3.1.corner_line"], paper["section.3.1.corners"]
    for corner, expected in _CORNER_ROWS.items():
        rows = tuple(
            (line, frozenset((s, t) for on, s, t, *_ in paper["table.2"]["rows"] if on == line))
            for line in meeting[corner]
        )
        follows = "; ".join(f"read as {line}, Table 2 gives {spaces(row)}" for line, row in rows)
        force = "P4 = f_b rises" if corner == "O1" else "P3 = -f_b falls"
        new = (
            "P_{Σ4,F2,Σ2}, P_{Σ4,F1,Σ1} and P_{Σ4,F1,Σ8}"
            if corner == "O1"
            else "P_{Σ3,F5,Σ5}, P_{Σ3,F6,Σ6} and P_{Σ3,F6,Σ9}"
        )
        yield comparison(
            entry,
            f"section.3.1.{corner}.line",
            f"at {corner}, within Appendix A's bounds on alpha: {spaces(expected)}; {follows}",
            f"{corner} ∈ {entry[corner]}",
            (corner, entry[corner], expected, rows),
            _no_line_does,
            (corner, entry[corner], rows[0][1], rows),
            derived=f"{spaces(expected)}; {follows}. No reading makes the row of Table 2 right",
            verdict="refuted",
            proof=f"at {corner} {force} along stick, and v_c = v_c' = 0 along the drift beside, "
            "whose v_c'' has the sign of its own sense",
            consequence=f"A corner has a row of its own. It adds {new} to Table 3.",
            witness=partial(at_crest, PIECES[corner].relations),
        )


_ORIGIN = tuple(sp.Eq(symbol, 0) for symbol in STATE)


def _begins_in(claim: tuple[int, tuple[Relation, ...]]) -> bool:
    """Whether the origin is in the surface of a field at rest."""
    field, hypotheses = claim
    return all(implies([*_ORIGIN, *hypotheses], r) for r in PIECES[f"S{field}"].relations)


def _starts(paper: Paper) -> Iterator[Item]:
    entry = paper["section.3.1.start"]
    modes = {2: "stick", 1: "forward drift", 3: "backward drift"}
    for key in ("less", "equal"):
        scope = (SCENARIOS[_KEYS[key]], sp.Gt(delta, 0))
        text = f"for {_KEYS[key]} the capsule starts from (0, 0, 0) in {modes[entry[key]]}"
        yield comparison(
            entry,
            f"section.3.1.start.{key}",
            text,
            text,
            (entry[key], scope),
            _begins_in,
            (1, scope),
            proof="P3 = 0 and P2 = 0 < delta there",
        )
    force = {1: sp.Gt(P3, f_b), 2: sp.Lt(P3, f_b), 3: sp.Lt(P3, -f_b)}[entry["greater"]]
    wide = (*_ORIGIN, SCENARIOS["δ > f_b"])
    yield erratum_item(
        entry,
        "section.3.1.wide",
        f"for δ > f_b the capsule starts from (0, 0, 0) in {modes[entry['greater']]}",
        derived="P3(0, 0, 0) = 0 < f_b for every delta: the capsule starts in stick",
        proof="P3 = x_r + 2 zeta v_r is 0 there",
        consequence="Forward drift can begin only after P3 has reached f_b, on L1.",
        scope=wide,
        printed_relation=force,
        derived_relation=sp.Lt(P3, f_b),
        values={**CASE_STUDY, delta: Fraction(3, 2)},
    )
    for text in entry["absent_for"]:
        (condition,) = relations([text])
        line = entry["absent"]
        yield comparison(
            entry,
            f"section.3.1.absent.{'equal' if '==' in text else 'greater'}",
            f"for {text} {line} does not exist: no contact begins in stick",
            f"for {text} {line} does not exist",
            (line, condition),
            lambda claim: empty(PIECES[claim[0]], [claim[1]]),
            ("L5", condition),
            proof="L6 has 0 < v_r and 2 zeta v_r + delta < f_b",
        )
    yield _impact_first(entry)


_EQUAL_GAP = {
    **{alpha: "0.9", omega: "0.8", delta: "1", zeta: "0.05", beta: "1.5", gamma: "3.3", f_b: "1"}
}


def _backward_first(claim: tuple[tuple[tuple[sp.Symbol, str], ...], str]) -> bool:
    """Whether from rest the capsule drifts backward into an impact before any forward drift."""
    values, drift = claim
    before = {"forward": 1, "backward": -1}[drift]
    fields = first_fields(Point(tuple((str(symbol), text) for symbol, text in values)))
    impact = next(i for i, field in enumerate(fields) if SEGMENTS[field - 1].contact)
    return not any(SEGMENTS[field - 1].drift == before for field in fields[:impact])


def _impact_first(entry: Entry) -> Item:
    values = tuple(_EQUAL_GAP.items())
    drift = entry["equal_before_impact"]
    return comparison(
        entry,
        "section.3.1.equal",
        "for delta = f_b from (0, 0, 0) an impact can come before any forward drift",
        f"for delta = f_b the capsule must have {drift} drift before any impact",
        (values, drift),
        _backward_first,
        (values, "backward"),
        derived="true of impacts from stick (L6 is empty); backward drift can lead to an impact",
        verdict="refuted",
        proof="with damping, at the witness, the motion from rest is followed in ball "
        "arithmetic: stick, backward drift, impact",
        consequence="P_{Σ9,F3,Σ3} can be the first impact for delta = f_b as well.",
        formula=r"S_2\to L_2\to S_9",
        witness=lambda: (
            {str(symbol): text for symbol, text in values}
            | {"start": "(0, 0, 0) at tau = 0", "fields": "F2, F3, F6: S2 to L2 to S9"}
        ),
    )


def _uses(paper: Paper) -> Iterator[Item]:
    entry = paper["section.3.1.uses"]
    into = {t.surface for t in surface_transitions() if _enters(t.source, t.target) > 0}
    out = {t.surface for t in surface_transitions() if _enters(t.source, t.target) < 0}
    stick = {n for n in SURFACES if {2, 5} & {f for o in leaves_of(n) for f in o.departs}}
    corners = {
        n for n in LINES if n != "L9" and n not in STICK_EDGE and not empty(PIECES[n], _NARROW)
    }
    for key, found, text in (
        ("stick_on", stick, "stick occurs on the surfaces"),
        ("impact_entered_by", into, "contact begins on"),
        ("impact_left_by", out, "contact ends on"),
        ("sliding_lines", set(STICK_EDGE), "stick borders on drift, P1 = 0, on the lines"),
        ("crossing_lines", corners, "P1 = 0 and P2 = delta meet, for delta < f_b, in the lines"),
    ):
        names = tuple(entry[key])
        yield comparison(
            entry,
            f"section.3.1.{key}",
            f"{text} {listed(names)}",
            f"{text} {listed(names)}",
            (names, frozenset(found)),
            lambda claim: len(set(claim[0])) == len(claim[0]) and set(claim[0]) == claim[1],
            (names[1:], frozenset(found)),
            proof="read off the derived surfaces, lines and Table 1",
        )
    yield _smoothness(entry)


def _enters(source: int, target: int) -> int:
    return SEGMENTS[target - 1].contact - SEGMENTS[source - 1].contact


def _jump(claim: tuple[tuple[str, ...], sp.Expr]) -> bool:
    """Whether on the named line F1 = F4, and d(F4 - F1)/dx_r = (0, -claim, claim/(gamma + 1))."""
    (line,), size = claim
    place = {x_r: delta, v_r: 0} if line == "L9" else {}
    free, pressed = SEGMENTS[0].field, SEGMENTS[3].field
    gaps = [sp.expand((b - a).subs(place)) for a, b in zip(free, pressed, strict=True)]
    steps = [sp.diff(b - a, x_r) for a, b in zip(free, pressed, strict=True)]
    wanted = (sp.S.Zero, -size, size / (gamma + 1))
    return not any(gaps) and all(
        sp.expand(sp.together(s - w)) == 0 for s, w in zip(steps, wanted, strict=True)
    )


def _smoothness(entry: Entry) -> Item:
    size = beta * (gamma + 1) / gamma
    lines = tuple(entry["smooth"])
    return comparison(
        entry,
        "section.3.1.smooth",
        "the fields are continuous on L9, but their slope jumps by beta (gamma+1)/gamma",
        f"{listed(lines)} is smooth for all vector functions",
        (lines, size),
        _jump,
        (lines, -size),
        derived="continuous (fields.impact); differentiable only for beta = 0",
        verdict="conditional",
        proof="∂F4/∂x_r − ∂F1/∂x_r on P2 = delta, from the fields",
        consequence="A graze on L9 keeps the orbit's slope in a parameter but changes its "
        "curvature: no square root, since the force is continuous.",
        formula=rf"\partial_{{x_r}}(F_4-F_1)=(0,-{sp.latex(size)},{sp.latex(beta / gamma)})",
    )


def items(paper: Paper) -> Iterator[Item]:
    """What Section 3.1 says beside its equations."""
    yield from _corners(paper)
    yield from _readings(paper)
    yield from _starts(paper)
    yield from _uses(paper)
