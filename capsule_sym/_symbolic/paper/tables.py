"""Tables 1, 2 and 3, row by row, beside the derived ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cache, partial
from typing import Any

import sympy as sp

from capsule_sym._paper import Entry, Paper
from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import LINES, PIECES, SCENARIOS, SURFACES
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.proof import consistent
from capsule_sym._symbolic.model.switching import (
    LocalMap,
    allowed_maps,
    derivatives,
    leaves_of,
    local_maps,
    surface_transitions,
)
from capsule_sym._symbolic.model.symbols import alpha, beta, delta, f_b, gamma, v_c, zeta
from capsule_sym._symbolic.paper.compare import comparison, listed
from capsule_sym._symbolic.paper.erratum import at_crest, erratum_item
from capsule_sym._symbolic.paper.formula import relations
from capsule_sym._symbolic.proofs.appendices import part
from capsule_sym._symbolic.proofs.items import Item
from capsule_sym._symbolic.proofs.reachability import described as described_witness
from capsule_sym._symbolic.proofs.reachability import witnesses

Row = tuple[Any, ...]
Rows = tuple[Row, ...]
Pairs = frozenset[tuple[int, int]]

_DAMPED = sp.Gt(zeta, 0)
_BOUND = 4 * zeta**2 * (alpha + f_b)
_ASSUMED: dict[str, Relation] = {
    "L1": sp.Lt(_BOUND, f_b - delta),
    "L4": sp.Lt(_BOUND, (1 + beta) * (f_b + delta)),
}
"""Appendix A's open intervals of alpha, for which Table 2 is printed."""


def rows_of(entry: Entry, place: str) -> Rows:
    """The rows of Table 1 or 2 for one surface or line."""
    return tuple(tuple(row) for row in entry["rows"] if row[0] == place)


def _written(source: int, target: int) -> tuple[str, str, str]:
    modes = f"{SEGMENTS[source - 1].mode} → {SEGMENTS[target - 1].mode}"
    return f"F{source}", f"F{target}", modes


def _shown(rows: Rows) -> str:
    return "; ".join(f"Ω{s} → Ω{t} ({vs}, {vt}, {mode})" for _, s, t, vs, vt, mode in rows)


@cache
def _on_surface(surface: str) -> Pairs:
    return frozenset((t.source, t.target) for t in surface_transitions() if t.surface == surface)


@cache
def _passages(name: str, hypotheses: tuple[Relation, ...], may: bool) -> Pairs:
    return frozenset(
        (source, target)
        for leaf in leaves_of(name)
        if consistent([*leaf.condition, *hypotheses])
        for source in (leaf.may_arrive if may else leaf.arrives)
        for target in (leaf.may_depart if may else leaf.departs)
    )


def passages(name: str, hypotheses: Iterable[Relation], may: bool = False) -> Pairs:
    """Sources and targets that occur at a piece where the hypotheses can hold.

    With `may`, those too that the derivatives of the order considered leave open.
    """
    return _passages(name, tuple(hypotheses), may)


def on_line(line: str) -> Pairs:
    """Sources and targets that occur on a line for some state, time and parameters.

    On L1 and L4 alpha is within Appendix A's bounds; the corners are apart.
    """
    condition = [_DAMPED, _ASSUMED[line]] if line in _ASSUMED else []
    return passages(line, [*PIECES[line].relations, *condition])


def spaces(pairs: Pairs) -> str:
    """The sources and the targets of passages, in words."""
    sources, targets = (sorted({pair[i] for pair in pairs}) for i in (0, 1))
    return f"{listed(f'Ω{s}' for s in sources)} → {listed(f'Ω{t}' for t in targets)}"


def _matches(claim: tuple[str, Rows]) -> bool:
    """Whether the rows of a surface or line are exactly the derived ones, in every column."""
    place, rows = claim
    derived = _on_surface(place) if place in SURFACES else on_line(place)
    return _consistent(rows) and {(s, t) for _, s, t, *_ in rows} == derived


def _reversed(rows: Rows) -> Rows:
    return tuple((on, t, s, vt, vs, mode) for on, s, t, vs, vt, mode in rows)


def _places(entry: Entry) -> list[str]:
    return list(dict.fromkeys(row[0] for row in entry["rows"]))


def _table_1(paper: Paper) -> Iterator[Item]:
    entry = paper["table.1"]
    for place in dict.fromkeys([*SURFACES, *_places(entry)]):
        rows = rows_of(entry, place)
        yield comparison(
            entry,
            f"table1.{place}",
            f"on {place}: {_shown(rows)}",
            f"{place}: {_shown(rows)}",
            (place, rows),
            _matches,
            (place, _reversed(rows)),
            proof="the signs of the derivatives of the functions that bound each field's cell",
            formula=PIECES[place].latex,
        )


_SCOPE = {
    "L1": ", within Appendix A's bound on alpha",
    "L2": ", for some state and time each",
    "L3": ", for some state and time each",
}


def _table_2(paper: Paper) -> Iterator[Item]:
    entry = paper["table.2"]
    for place in dict.fromkeys([*LINES[:8], *_places(entry)]):
        rows = rows_of(entry, place)
        if place == "L4":
            yield _row_l4(entry, rows)
            continue
        yield comparison(
            entry,
            f"table2.{place}",
            f"on {place} (corners apart){_SCOPE.get(place, '')}: {_shown(rows)}",
            f"{place}: {_shown(rows)}",
            (place, rows),
            _matches,
            (place, _reversed(rows) if place not in ("L2", "L3") else rows[1:]),
            verdict="conditional" if place in _SCOPE else "proved",
            proof="the signs of the derivatives of the functions that bound each field's cell",
            formula=PIECES[place].latex,
        )
    yield from _sources(entry)


_L4: Pairs = frozenset({(4, 6), (5, 6), (6, 6)})


def _consistent(rows: Rows) -> bool:
    """Whether vectors and modes are those of the spaces, and no row stands twice."""
    pairs = [(source, target) for _, source, target, *_ in rows]
    return len(set(pairs)) == len(pairs) and all(
        _written(source, target) == tuple(rest) for _, source, target, *rest in rows
    )


def _differs(claim: tuple[str, Rows, Pairs]) -> bool:
    """Whether the derived pairs are these, and the printed rows are others, in all columns."""
    line, rows, derived = claim
    printed = {(source, target) for _, source, target, *_ in rows}
    return on_line(line) == derived and printed != derived and _consistent(rows)


def _row_l4(entry: Entry, rows: Rows) -> Item:
    return comparison(
        entry,
        "table2.L4",
        "on L4, within Appendix A's bound on alpha: Ω4, Ω5, Ω6 → Ω6",
        f"L4: {_shown(rows)}",
        ("L4", rows, _L4),
        _differs,
        ("L4", rows, frozenset((s, t) for _, s, t, *_ in rows)),
        derived="L4: Ω4, Ω5, Ω6 → Ω6 (F6, C-BD), as Appendix A says",
        verdict="refuted",
        proof="P4 = -f_b on L4, so F4 gives v_c' = (P4 - f_b)/gamma = -2 f_b/gamma < 0",
        consequence="On L4 F4 decelerates the capsule by 2 f_b/gamma: it cannot go forwards from "
        "rest. The columns of vectors and modes repeat Ω4, so that it is not a misread index.",
        formula=sp.latex(sp.Eq(SEGMENTS[3].field[2], -2 * f_b / gamma)),
        witness=partial(at_crest, PIECES["L4"].relations),
    )


def _sources(entry: Entry) -> Iterator[Item]:
    """On L2 and L3 a row asks for a source that cannot arrive where stick begins."""
    for line, number, drift, stick, sign in (("L2", 3, 3, 2, 1), ("L3", 1, 4, 5, -1)):
        here = part(line, number).relations
        curve = derivatives(v_c, drift, 2)[2]
        rows = [row for row in rows_of(entry, line) if row[1:3] == (drift, stick)]
        asked = f"Ω{drift} → Ω{stick}" if rows else "no such row"
        yield erratum_item(
            entry,
            f"table2.{line}.source",
            f"{line}: {asked}, also on {line}^({number})",
            place="Table 2, Section 3.3",
            derived=f"where stick begins on {line} (n < 0), none arrives from Ω{drift}",
            proof=f"on {line} v_c = v_c' = 0 along F{drift}, and gamma v_c'' = "
            + ("P3' = -n, positive where n < 0" if sign > 0 else "P4' = n, negative there"),
            consequence=f"In F{drift} the capsule's velocity has an extremum 0 there: before, it "
            f"had the other sign. The rows Ω{drift} → Ω{stick} and Ω{stick} → Ω{stick} need "
            f"n = 0 (see table2.{line}).",
            scope=here,
            printed_relation=sp.Lt(sign * curve, 0),
            derived_relation=sp.Gt(sign * curve, 0),
        )


Maps = frozenset[LocalMap]


def printed_maps(paper: Paper) -> tuple[LocalMap, ...]:
    """The local maps of Table 3, in its order."""
    return tuple(LocalMap(t, field, s) for t, field, s, _ in paper["table.3"]["rows"])


@cache
def occurring(scenario: str | None) -> Maps:
    """The local maps with a witness, in one position of the gap with damping or in any."""
    return frozenset(
        w.local_map for w in witnesses() if scenario is None or w.regime == (scenario, True)
    )


def _is_row(claim: tuple[LocalMap, str]) -> bool:
    local_map, mode = claim
    return local_map in occurring(None) and SEGMENTS[local_map.field - 1].mode == mode


def _missing(claim: tuple[str | None, Sequence[LocalMap], Maps]) -> bool:
    """Whether exactly these maps are missing from the printed ones, which all occur."""
    scenario, printed, missing = claim
    allowed = (
        frozenset(local_maps())
        if scenario is None
        else allowed_maps([SCENARIOS[scenario], _DAMPED])
    )
    shown = occurring(scenario)
    return (
        allowed == shown
        and len(set(printed)) == len(printed)
        and set(printed) <= shown
        and shown - set(printed) == missing
    )


def _maps(*rows: tuple[int, int, int]) -> Maps:
    return frozenset(LocalMap(f"Σ{target}", field, f"Σ{source}") for target, field, source in rows)


_NARROW_MISSING = _maps((4, 1, 1), (4, 1, 8), (4, 2, 2), (3, 5, 5), (3, 6, 6), (3, 6, 9))
_WIDE_MISSING = _maps((1, 4, 4), (1, 5, 5), (1, 6, 6), (1, 6, 9))


def _table_3(paper: Paper) -> Iterator[Item]:
    entry = paper["table.3"]
    printed = printed_maps(paper)
    for local_map, (*_, mode) in zip(printed, entry["rows"], strict=True):
        other = LocalMap("Σ7" if local_map.target != "Σ7" else "Σ6", local_map.field, "Σ2")
        yield comparison(
            entry,
            f"table3.{local_map.target}.F{local_map.field}.{local_map.source}",
            f"{local_map} ({mode}) is printed, and occurs",
            f"{local_map}, {mode}",
            (local_map, mode),
            _is_row,
            (other, mode),
            proof="a witness in exact rational arithmetic (table3 below)",
            formula=local_map.formula,
        )
    for scenario, missing in (
        ("δ < f_b", _NARROW_MISSING),
        (None, _NARROW_MISSING | _WIDE_MISSING),
    ):
        yield _missing_maps(paper, scenario, missing)
    yield from _wide_gap_maps(paper)


def _missing_maps(paper: Paper, scenario: str | None, missing: Maps) -> Item:
    """What Table 3 lacks: in the scenario to which Section 3.1 restricts it, and for every gap."""
    entry, printed = paper["table.3"], printed_maps(paper)
    (restriction,) = relations([paper["section.3.1.start"]["restricted_to"]])
    if scenario and restriction != SCENARIOS[scenario]:
        raise ValueError(restriction)
    shown = next(w for w in witnesses() if w.local_map == LocalMap("Σ4", 2, "Σ2"))
    total = len(occurring(scenario))
    scope = f"for {scenario}, to which Section 3.1 restricts it" if scenario else "for every delta"
    return comparison(
        entry,
        f"table3.missing.{'restricted' if scenario else 'every'}",
        f"{scope}, {total} local maps occur, {len(missing)} more than Table 3 lists",
        f"{scope}, all local maps are {len(printed)}",
        (scenario, printed, missing),
        _missing,
        (scenario, printed, missing - {LocalMap("Σ3", 5, "Σ5")}),
        derived=f"{total}: also " + ", ".join(map(str, sorted(missing))),
        verdict="refuted",
        proof="each missing map is shown by a trajectory that is enclosed in exact rational "
        "arithmetic (table3 below); all others are excluded (table3.complete, table3.regime)",
        consequence="All pass a corner"
        + (". " if scenario else ", or L10, which exists for delta > f_b only. ")
        + "Those of F2 and F5, and of F6 into Σ1, need one coincidence only: a family of orbits "
        "meets them at isolated parameters. A misread row of the scan would show as a map that "
        "does not occur, and none does.",
        formula=r",\ ".join(one.formula for one in sorted(missing)),
        witness=lambda: {"local map": str(shown.local_map), **described_witness(shown)},
    )


def _absent_count(claim: tuple[str, tuple[LocalMap, ...], int]) -> bool:
    scenario, printed, count = claim
    return len(set(printed) - allowed_maps([SCENARIOS[scenario], _DAMPED])) == count


def _wide_gap_maps(paper: Paper) -> Iterator[Item]:
    entry, printed = paper["table.3"], printed_maps(paper)
    for scenario, count in (("δ < f_b", 0), ("δ = f_b", 9), ("δ > f_b", 9)):
        found = f"for {scenario} and ζ > 0, {count} of the printed maps cannot occur"
        if count:
            found += ": stick or backward drift into Σ5 (no L6), and F4 from Σ7 to rest"
        yield comparison(
            entry,
            f"table3.scenario.{scenario.replace(' ', '')}",
            found,
            f"Table 3 lists {len(printed)} maps, without a condition on δ",
            (scenario, printed, count),
            _absent_count,
            (scenario, printed, count + 1),
            derived=found,
            verdict="conditional",
            proof="for δ ≥ f_b L6 is empty, and table3.never_rests excludes the maps of F4 from "
            "Σ7 to rest; all others occur by their witnesses",
            consequence="The search for orbits at δ ≥ f_b has fewer maps to consider.",
        )


def items(paper: Paper) -> Iterator[Item]:
    """Tables 1, 2 and 3."""
    yield from _table_1(paper)
    yield from _table_2(paper)
    yield from _table_3(paper)
