"""Section 3.3: what happens on the lines and their parts."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial

import sympy as sp

from capsule_sym._paper import Paper
from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import PIECES
from capsule_sym._symbolic.model.proof import consistent, example
from capsule_sym._symbolic.model.symbols import alpha, force, zeta
from capsule_sym._symbolic.paper.appendix import BY_LINE, of
from capsule_sym._symbolic.paper.compare import comparison, listed
from capsule_sym._symbolic.paper.erratum import CASE_STUDY, at_crest, described
from capsule_sym._symbolic.paper.tables import Pairs, on_line, passages, spaces
from capsule_sym._symbolic.proofs.appendices import BOUNDS, PARTS, Part, bifurcations, part
from capsule_sym._symbolic.proofs.inner_products import FIELDS, outward
from capsule_sym._symbolic.proofs.items import Item

_DAMPED = sp.Gt(zeta, 0)


def _on(place: str) -> Pairs:
    """Sources and targets that occur on a line or on a part of it."""
    if "^" not in place:
        return on_line(place)
    return passages(place[:2], [*of(place).relations, _DAMPED])


_PASSAGES: dict[str, tuple[Pairs, str, str]] = {
    "L2^(1)": (
        frozenset({(1, 3), (2, 3), (3, 3)}),
        "stick ends into backward drift on L2",
        "A reading error would explain it: Table 2 has Ω3.",
    ),
    "L2^(3)": (
        frozenset({(1, 2)}),
        "where stick begins on L2 nothing arrives from Ω3",
        "See the erratum on Table 2's source Ω3.",
    ),
    "L4": (
        frozenset({(4, 6), (5, 6), (6, 6)}),
        "P4 = -f_b on L4, so that stick ends into backward drift",
        "Appendix A has it right; Table 2 repeats Ω4 in three columns.",
    ),
}


def _passages(paper: Paper) -> Iterator[Item]:
    entry = paper["section.3.3.passages"]
    for place, sources, targets in entry["rows"]:
        pairs = frozenset((s, t) for s in sources for t in targets)
        text = f"{place}: {spaces(pairs)}"
        if place in _PASSAGES:
            derived, proof, consequence = _PASSAGES[place]
            here = PIECES[place].relations if "^" not in place else of(place).relations
            yield comparison(
                entry,
                f"section.3.3.{place}.passages",
                f"on {place}: {spaces(derived)}",
                text,
                (place, pairs, derived),
                lambda claim: _on(claim[0]) == claim[2] != claim[1],
                (place, pairs, pairs),
                derived=f"{place}: {spaces(derived)}",
                verdict="refuted",
                proof=proof,
                consequence=consequence,
                witness=partial(at_crest, here),
            )
            continue
        yield comparison(
            entry,
            f"section.3.3.{place}.passages",
            f"on {text}",
            text,
            (place, pairs),
            lambda claim: _on(claim[0]) == claim[1],
            (place, pairs - {min(pairs)}),
            proof="the signs of the derivatives of the functions that bound each field's cell",
        )


def _within_bound(line: str) -> Part:
    bound = BY_LINE[line]
    return Part(line, 0, (_DAMPED, sp.Lt(bound.smaller, bound.larger)), bound.side, "")


def _occur(claim: tuple[Part, tuple[str, ...]]) -> bool:
    one, kinds = claim
    return len(set(kinds)) == len(kinds) and bifurcations(one) == set(kinds)


_ROLE = {"grazing": 0, "adding": 1, "crossing": 2, "switching": 2}  # which of `FIELDS`


def _comes_from(claim: tuple[str, str, int]) -> bool:
    """Whether a bifurcation on a line begins with a trajectory of a field."""
    place, kind, field = claim
    return FIELDS[place[:2]][_ROLE[kind]] == field


def _bifurcations(paper: Paper) -> Iterator[Item]:
    entry, origins = paper["section.3.3.bifurcations"], paper["section.3.3.origins"]
    for name, kinds in entry.printed.items():
        one = of(name) if "^" in name else _within_bound(name)
        yield comparison(
            entry,
            f"section.3.3.{name}.bifurcations",
            f"sliding bifurcations possible on {name}: {listed(kinds)}",
            f"{name}: {listed(kinds)}",
            (one, tuple(kinds)),
            _occur,
            (one, ("adding", "switching", *kinds[1:1])),
            derived="as printed, " + ("with the derived interval" if "2^" in name else "in scope"),
            verdict="conditional",
            proof="the signs of n and of its rate where each kind of trajectory meets the part",
        )
    for place, kind, field in origins["rows"]:
        yield comparison(
            origins,
            f"section.3.3.{place}.{kind}",
            f"{kind}-sliding on {place} begins with a trajectory of F{field}",
            f"{place}: {kind}-sliding of a trajectory from Ω{field}",
            (place, kind, field),
            _comes_from,
            (place, kind, field % 6 + 1),
            proof="grazing touches P1 = 0 from the drift beside the line, crossing and switching "
            "arrive from the drift opposite",
        )


def _adding_within(claim: tuple[str, ...]) -> bool:
    """Whether the parts on which stick can touch a line, within Appendix A's bounds, are these."""
    found = {
        one.name for one in PARTS if one.line in ("L2", "L3") and "adding" in bifurcations(one)
    }
    return found == set(claim) and not any(
        "adding" in bifurcations(_within_bound(line)) for line in ("L1", "L4")
    )


def _adding_beyond(claim: tuple[str, Relation]) -> bool:
    """Whether adding-sliding occurs on a line for some parameters, never under the condition."""
    line, condition = claim
    middle = part(line, 2)
    never = not consistent([*middle.relations, sp.Eq(outward(line), 0), _DAMPED, condition])
    return "adding" in bifurcations(middle) and never


_TURN = {"L1": {"tau": "pi/(2 omega)"}, "L4": {"tau": "3 pi/(2 omega)"}}


def _adding_witness(line: str) -> dict[str, str]:
    """A point where stick touches the line, at an instant where it turns back for every omega."""
    strong = {**CASE_STUDY, zeta: Fraction(1), alpha: Fraction(9)}
    touching = (sp.Eq(outward(line), 0), sp.Eq(force, 0))
    point = example([*part(line, 2).relations, *touching], strong)
    return {**described(point), **_TURN[line]}


def _adding(paper: Paper) -> Iterator[Item]:
    entry = paper["section.4.adding"]
    names = tuple(entry["only_on"])
    printed = f"adding-sliding can only happen on {listed(names)}"
    yield comparison(
        entry,
        "section.4.adding",
        f"within Appendix A's bounds adding-sliding can only happen on {listed(names)}",
        printed,
        names,
        _adding_within,
        names[1:],
        derived="as printed, while alpha is within both bounds of Appendix A",
        verdict="conditional",
        proof="stick touches a line where n = 0 and its rate turns it back",
    )
    for bound in BOUNDS[:2]:
        condition = sp.Le(bound.smaller, bound.larger)
        yield comparison(
            entry,
            f"section.4.adding.{bound.line}",
            f"adding-sliding occurs on {bound.line}^(2) too, but not while {condition}",
            printed,
            (bound.line, condition),
            _adding_beyond,
            (bound.line, sp.Ge(bound.smaller, bound.larger)),
            derived=f"so it is while alpha is within the bound of Appendix A; else on {bound.line} "
            "too",
            verdict="conditional",
            proof="within the bound n > 0 on the whole line, so stick cannot touch it from inside; "
            "beyond it n = 0 occurs, with a rate of either sign",
            consequence="The case study (ζ = 0.05, α ≤ 2) is far within the bound.",
            formula=sp.latex(condition),
            witness=partial(_adding_witness, bound.line),
        )


def items(paper: Paper) -> Iterator[Item]:
    """The passages and bifurcations of Section 3.3."""
    yield from _passages(paper)
    yield from _bifurcations(paper)
    yield from _adding(paper)
