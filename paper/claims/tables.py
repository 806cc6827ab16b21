"""Checks of Tables 1, 2 and 3, and of the passages on lines and at corners."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

import sympy as sp

from capsule_sym._symbolic.model.geometry import PIECES, SCENARIOS, SURFACES
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.proof import consistent, evaluate, example
from capsule_sym._symbolic.model.switching import (
    LocalMap,
    allowed_maps,
    derivatives,
    local_maps,
)
from capsule_sym._symbolic.model.symbols import alpha, delta, force, v_c, v_r, zeta
from capsule_sym._symbolic.proofs import reachability
from capsule_sym._symbolic.proofs.appendices import within_bound
from capsule_sym._symbolic.proofs.formula import formula, same
from capsule_sym._symbolic.proofs.geometry_proofs import lines_at
from capsule_sym._symbolic.proofs.inner_products import FIELDS, outward
from capsule_sym._symbolic.proofs.parts import PARTS, Part, bifurcations, part
from capsule_sym._symbolic.proofs.relations import Texts, derived, listed, same_sets, scope
from capsule_sym._symbolic.proofs.rows import EACH, FACTS, FILTERS, WITNESSES, Context, checker
from capsule_sym._symbolic.proofs.table_proofs import (
    ASSUMED,
    Pairs,
    maps_by_number,
    occurring,
    on,
    passages_at,
)
from paper.claims.errata import CASE_STUDY, CREST, at_crest, point_text
from paper.printed import Entry, Paper

Rows = Sequence[Sequence[Any]]

_DAMPED = scope(["zeta > 0"])


def _written(source: int, target: int) -> tuple[str, str, str]:
    return f"F{source}", f"F{target}", f"{SEGMENTS[source - 1].mode} → {SEGMENTS[target - 1].mode}"


def _pairs(rows: Rows) -> Pairs:
    return frozenset((source, target) for _, source, target, *_ in rows)


@checker
def table_rows(place: str, printed: Rows, pairs: Sequence[tuple[int, int]] = ()) -> bool:
    """Check that rows are exactly the passages of a place, and each is right in every column.

    With `pairs`, check that these are the passages, and the rows are others, right in each column.
    """
    told = [(source, target) for _, source, target, *_ in printed]
    right = all(_written(source, target) == tuple(rest) for _, source, target, *rest in printed)
    occurs = on(place) == set(pairs) != set(told) if pairs else on(place) == set(told)
    return occurs and right and len(set(told)) == len(told)


@checker
def leads_elsewhere(printed: Texts, rows: Rows, piece: str) -> bool:
    """Check that a printed set holds states of a piece with none of the printed passages."""
    told = _pairs(rows)
    holds = consistent([*scope(printed), *PIECES[piece].relations, *_DAMPED])
    return holds and bool(told and on(piece)) and not told & on(piece)


@checker
def unlike_its_lines(
    corner: str, printed: str, expected: Rows, lines: Sequence[tuple[str, Pairs]]
) -> bool:
    """Check that a corner has the expected passages, which no row of Table 2 for a line there has.

    The printed line has to be one of the lines that meet there.
    """
    narrow = (*_DAMPED, SCENARIOS["δ < f_b"])
    here, rows = (*PIECES[corner].relations, *narrow, ASSUMED["L1"]), dict(lines)
    return (
        passages_at(corner, here, may=True) == set(expected)
        and printed in rows
        and rows.keys() == lines_at(corner, narrow)
        and all(row != set(expected) for row in rows.values())
    )


@checker
def occurs(local_map: LocalMap, mode: str) -> bool:
    """Check that a local map occurs, and its field has the printed mode."""
    return local_map in occurring("") and SEGMENTS[local_map.field - 1].mode == mode


@checker
def lacks(scenario: str, printed: Sequence[LocalMap], missing: Rows) -> bool:
    """Check that exactly these maps are missing from the printed ones, which all occur."""
    allowed = frozenset(local_maps())
    if scenario:
        allowed = allowed_maps([SCENARIOS[scenario], *_DAMPED])
    shown = occurring(scenario)
    return (
        allowed == shown
        and len(set(printed)) == len(printed)
        and set(printed) <= shown
        and shown - set(printed) == set(maps_by_number(missing))
    )


@checker
def restricted(scenario: str, printed: Sequence[LocalMap], missing: Rows, to: str) -> bool:
    """The same in the position of the gap to which the paper restricts itself."""
    return same_sets([[to]], [[scenario]]) and lacks(scenario, printed, missing)


@checker
def excluded(scenario: str, printed: Sequence[LocalMap], count: int) -> bool:
    """Check that so many of the printed maps cannot occur in a position of the gap."""
    return len(set(printed) - allowed_maps([SCENARIOS[scenario], *_DAMPED])) == count


def printed_maps(paper: Paper) -> tuple[LocalMap, ...]:
    """Local maps of Table 3, in its order."""
    return tuple(LocalMap(t, field, s) for t, field, s, _ in paper["table.3"]["rows"])


@checker
def adding_only_on(printed: Sequence[str]) -> bool:
    """Check that within Appendix A's bounds stick can touch only these parts of L1-L4."""
    found = {p.name for p in PARTS if p.line in ("L2", "L3") and "adding" in bifurcations(p)}
    others = ("adding" in bifurcations(within_bound(line)) for line in ("L1", "L4"))
    return found == set(printed) and not any(others)


@checker
def adding_beyond(line: str, within: Texts) -> bool:
    """Check that adding-sliding occurs on a line for some parameters, never under a condition."""
    middle = part(f"{line}^(2)")
    touching = [*middle.relations, sp.Eq(outward(line), 0), *_DAMPED, *scope(within)]
    return "adding" in bifurcations(middle) and not consistent(touching)


_ROLE = {"grazing": 0, "adding": 1, "crossing": 2, "switching": 2}  # which of `FIELDS`


@checker
def comes_from(place: str, kind: str, field: int) -> bool:
    """Check that a sliding bifurcation on a line begins with a trajectory of a field."""
    return FIELDS[place[:2]][_ROLE[kind]] == field


@checker
def extreme(printed: str, greatest: str, end: str) -> bool:
    """Check that a relation is -alpha > `greatest` with v_r at the end of its range."""
    relation, value, bound = map(formula, (printed, greatest, end))
    return (
        isinstance(relation, sp.StrictGreaterThan)
        and same(relation.lhs, -alpha)
        and same(relation.rhs, value.subs(v_r, bound.rhs))
    )


@checker
def other_interval(place: str, printed: Texts) -> bool:
    """Check that a printed interval of v_r is not that of a part, by a state in one of them."""
    try:
        return bool(example(_beyond(place, printed), CASE_STUDY))
    except ValueError:
        return False


def _beyond(place: str, printed: Texts) -> tuple[Any, ...]:
    """Relations of states in exactly one of the printed and the derived interval."""
    one, told = part(place), scope(printed)
    here = (*PIECES[one.line].relations, CREST)
    for inside, outside in ((told, one.within), (one.within, told)):
        for relation in outside:
            other = (*here, *inside, sp.Not(relation))
            if consistent([*other, *_DAMPED]):
                return other
    raise ValueError(f"{place} is as printed")


def _elsewhere(row: Mapping[str, Any]) -> dict[str, str]:
    """State of a printed set with wide gap, its printed relations there, and what follows."""
    values = {**CASE_STUDY, delta: Fraction(3, 2)}
    here = [*scope(row["printed"]), *PIECES[row["piece"]].relations, CREST]
    point = example(here, values)
    there = (formula(text) for text in row["printed"][2:])
    sides = (f"{evaluate(r.lhs, point)} {r.rel_op} {evaluate(r.rhs, point)}" for r in there)
    return {
        **point_text(point),
        "printed relations there": f"{'; '.join(sides)}, true",
        "passage there": f"{_spaces(on(row['piece']))}, not {_spaces(_pairs(row['rows']))}",
    }


def _touching(line: str) -> dict[str, str]:
    """Point where stick touches a line, at an instant where it turns back for every omega."""
    strong = {**CASE_STUDY, zeta: Fraction(1), alpha: Fraction(9)}
    touching = (sp.Eq(outward(line), 0), sp.Eq(force, 0))
    point = example([*part(f"{line}^(2)").relations, *touching], strong)
    return point_text(point) | {"tau": {"L1": "pi/(2 omega)", "L4": "3 pi/(2 omega)"}[line]}


def _shown_map(numbers: Sequence[int]) -> dict[str, str]:
    """First stored witness of a local map."""
    (wanted,) = maps_by_number([numbers])
    shown = next(w for w in reachability.witnesses() if w.local_map == wanted)
    return {"local map": str(wanted), **reachability.witness_text(shown)}


def _rows_of(table: Entry, place: str) -> tuple[tuple[Any, ...], ...]:
    """Rows of Table 1 or 2 for one surface or line."""
    return tuple(tuple(row) for row in table["rows"] if row[0] == place)


def _at_corner(context: Context) -> tuple[tuple[str, Pairs], ...]:
    """Rows of Table 2 for each of the lines printed as meeting at a corner."""
    paper, corner = context["paper"], context["key"]
    lines = paper["section.3.1.corners"][corner]
    return tuple((line, _pairs(_rows_of(paper["table.2"], line))) for line in lines)


def _places(names: Sequence[str]) -> Any:
    def each(context: Context) -> Iterator[dict[str, Any]]:
        for name in dict.fromkeys([*names, *(row[0] for row in context["e"]["rows"])]):
            yield {"key": name}

    return each


def _each_map(context: Context) -> Iterator[dict[str, Any]]:
    modes = (mode for *_, mode in context["e"]["rows"])
    for local_map, mode in zip(printed_maps(context["paper"]), modes, strict=True):
        yield {"map": local_map, "mode": mode}


def _passages_of(context: Context) -> Pairs:
    """Passages that Section 3.3 prints for a line."""
    (row,) = (row for row in context["e"]["rows"] if row[0] == context["key"])
    return frozenset((source, target) for source in row[1] for target in row[2])


def _each_part(context: Context) -> Iterator[dict[str, Any]]:
    for name, texts in context["e"].printed.items():
        yield {"key": name, "text": texts, "part": part(name) if "^" in name else None}


def _spaces(pairs: Iterable[tuple[int, int]]) -> str:
    """Sources and targets of passages as text."""
    sources, targets = (sorted(set(ends)) for ends in zip(*pairs, strict=True))
    return f"{listed(f'Ω{s}' for s in sources)} → {listed(f'Ω{t}' for t in targets)}"


def _readings(lines: Sequence[tuple[str, Pairs]]) -> str:
    return "; ".join(f"read as {line}, Table 2 gives {_spaces(row)}" for line, row in lines)


def _interval(one: Part) -> tuple[Any, ...]:
    """Range of v_r on a part; that of L3^(3) with the end of L3's range, as printed."""
    end = scope(["2*zeta*v_r <= f_b - delta"]) if one.name == "L3^(3)" else ()
    return (*one.within, *end, *_DAMPED)


def _asked(context: Context) -> str:
    pair = (context["drift"], context["stick"])
    return "Ω{} → Ω{}".format(*pair) if pair in context["told"] else "no such row"


EACH |= {
    "surfaces": _places(SURFACES),
    "lines": _places([f"L{i}" for i in range(1, 9)]),
    "maps": _each_map,
    "parts": _each_part,
}
FACTS |= {
    "rows": lambda context: _rows_of(context["e"], context["key"]),
    "rows_of_table_2": lambda context: _rows_of(context["paper"]["table.2"], context["key"]),
    "told": lambda context: {row[1:3] for row in context["rows"]},
    "asked": _asked,
    "pairs": _passages_of,
    "table_3": lambda context: printed_maps(context["paper"]),
    "table_2_at": _at_corner,
    "total": lambda context: len(occurring(context["scenario"])),
    "force_on_L4": lambda _: derived("F4_v_c == -2*f_b/gamma"),
    "curve": lambda context: context["sign"] * derivatives(v_c, context["drift"], 2)[2],
}
FILTERS |= {
    "spaces": _spaces,
    "readings": _readings,
    "rows": lambda rows: "; ".join(
        f"Ω{s} → Ω{t} ({vs}, {vt}, {mode})" for _, s, t, vs, vt, mode in rows
    ),
    "swapped": lambda rows: tuple((on, t, s, vt, vs, mode) for on, s, t, vs, vt, mode in rows),
    "other_map": lambda one: LocalMap("Σ7" if one.target != "Σ7" else "Σ6", one.field, "Σ2"),
    "fewer": lambda pairs: pairs - {min(pairs)},
    "maps": lambda rows: ", ".join(map(str, maps_by_number(rows))),
    "map_formulas": lambda rows: r",\ ".join(one.formula for one in maps_by_number(rows)),
    "relations": lambda relations: " and ".join(map(str, relations)),
    "damped": lambda texts: ("zeta > 0", *texts),
    "interval": _interval,
    "sense": lambda sign: {"<": "negative", ">": "positive"}.get(
        sign, "one or the other, by the time"
    ),
    "of_interval": lambda name: "with the derived interval" if "2^" in name else "in scope",
    "reversed_relation": lambda relation: sp.Ge(*relation.args),
}
WITNESSES |= {
    "map": _shown_map,
    "elsewhere": _elsewhere,
    "touching": _touching,
    "beyond": lambda row: at_crest(_beyond(row["place"], row["printed"])),
}
