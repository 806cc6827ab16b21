"""Claims of Tables 1, 2 and 3, with their checks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cache, partial
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import PIECES, SEGMENTS, SURFACES, Statement, derivatives, v_c
from paper.claims.beside import beside, next_field
from paper.claims.errata import at_crest, misprint
from paper.claims.relations import derived, listed, same_sets, scope
from paper.derived.local_maps import SCENARIOS, LocalMap, allowed_maps, local_maps
from paper.derived.reachability import witness_text, witnesses
from paper.derived.tables import Pairs, on
from paper.printed import Paper

Rows = Sequence[Sequence[Any]]

_DAMPED = scope(["zeta > 0"])


def _written(source: int, target: int) -> tuple[str, str, str]:
    return f"F{source}", f"F{target}", f"{SEGMENTS[source - 1].mode} → {SEGMENTS[target - 1].mode}"


def pairs_of(rows: Rows) -> Pairs:
    """Sources and targets of rows of Table 1 or 2."""
    return frozenset((source, target) for _, source, target, *_ in rows)


def table_rows(place: str, printed: Rows, pairs: Sequence[tuple[int, int]] = ()) -> bool:
    """Check that rows are exactly the passages of a place, and each is right in every column.

    With `pairs`, check that these are the passages, and the rows are others, right in each column.
    """
    shown = [(source, target) for _, source, target, *_ in printed]
    right = all(_written(source, target) == tuple(rest) for _, source, target, *rest in printed)
    occurs = on(place) == set(pairs) != set(shown) if pairs else on(place) == set(shown)
    return occurs and right and len(set(shown)) == len(shown)


@cache
def occurring(scenario: str) -> frozenset[LocalMap]:
    """Local maps with a witness in a position of the gap with damping; empty for any."""
    return frozenset(
        w.local_map for w in witnesses() if not scenario or w.regime == (scenario, True)
    )


def maps_by_number(rows: Iterable[Sequence[int]]) -> list[LocalMap]:
    """Local maps from the numbers of target, field and source, sorted."""
    return sorted(LocalMap(f"Σ{target}", field, f"Σ{source}") for target, field, source in rows)


def occurs(local_map: LocalMap, mode: str) -> bool:
    """Check that a local map occurs, and its field has the printed mode."""
    return local_map in occurring("") and SEGMENTS[local_map.field - 1].mode == mode


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


def restricted(scenario: str, printed: Sequence[LocalMap], missing: Rows, to: str) -> bool:
    """The same in the position of the gap to which the paper restricts itself."""
    return same_sets([[to]], [[scenario]]) and lacks(scenario, printed, missing)


def excluded(scenario: str, printed: Sequence[LocalMap], count: int) -> bool:
    """Check that so many of the printed maps cannot occur in a position of the gap."""
    return len(set(printed) - allowed_maps([SCENARIOS[scenario], *_DAMPED])) == count


def printed_maps(paper: Paper) -> tuple[LocalMap, ...]:
    """Local maps of Table 3, in its order."""
    return tuple(LocalMap(t, field, s) for t, field, s, _ in paper["table.3"]["rows"])


def _shown_map() -> dict[str, str]:
    """First stored witness of a map that Table 3 lacks."""
    (wanted,) = maps_by_number([(4, 2, 2)])
    shown = next(w for w in witnesses() if w.local_map == wanted)
    return {"local map": str(wanted), **witness_text(shown)}


def rows_of(paper: Paper, table: str, place: str) -> tuple[tuple[Any, ...], ...]:
    """Rows of Table 1 or 2 for one surface or line."""
    return tuple(tuple(row) for row in paper[table]["rows"] if row[0] == place)


def spaces(pairs: Iterable[tuple[int, int]]) -> str:
    """Sources and targets of passages as text."""
    sources, targets = (sorted(set(ends)) for ends in zip(*pairs, strict=True))
    return f"{listed(f'Ω{s}' for s in sources)} → {listed(f'Ω{t}' for t in targets)}"


_SIGNS = "the signs of the derivatives of the functions that bound each field's cell"


def _row_texts(rows: Rows) -> str:
    return "; ".join(f"Ω{s} → Ω{t} ({vs}, {vt}, {mode})" for _, s, t, vs, vt, mode in rows)


def table_1_and_2(paper: Paper) -> Iterator[Statement]:
    """Tables 1 and 2, row by row."""
    for table, number, places in (
        ("table.1", 1, SURFACES),
        ("table.2", 2, ("L5", "L6", "L7", "L8")),
    ):
        entry, off = paper[table], " (corners apart)" if number == 2 else ""
        lines = {"L1", "L2", "L3", "L4"}
        for key in dict.fromkeys([*places, *(row[0] for row in entry["rows"])]):
            rows = rows_of(paper, table, key)
            if key not in lines:
                yield beside(
                    entry,
                    f"table{number}.{key}",
                    table_rows,
                    {"place": key, "printed": rows},
                    {"printed": tuple((on, t, s, vt, vs, m) for on, s, t, vs, vt, m in rows)},
                    says=f"on {key}{off}: {_row_texts(rows)}",
                    printed=f"{key}: {_row_texts(rows)}",
                    proof=_SIGNS,
                    formula=PIECES[key].latex,
                )
    entry = paper["table.2"]
    for key, where in (
        ("L1", "within Appendix A's bound on alpha"),
        ("L2", "for some state and time each"),
        ("L3", "for some state and time each"),
    ):
        rows = rows_of(paper, "table.2", key)
        yield beside(
            entry,
            f"table2.{key}",
            table_rows,
            {"place": key, "printed": rows},
            {"printed": rows[1:]},
            says=f"on {key} (corners apart), {where}: {_row_texts(rows)}",
            printed=f"{key}: {_row_texts(rows)}",
            verdict="conditional",
            proof=_SIGNS,
            formula=PIECES[key].latex,
        )
    rows = rows_of(paper, "table.2", "L4")
    yield beside(
        entry,
        "table2.L4",
        table_rows,
        {"place": "L4", "printed": rows, "pairs": ((4, 6), (5, 6), (6, 6))},
        {"pairs": ((4, 4), (5, 4), (6, 4))},
        says="on L4, within Appendix A's bound on alpha: Ω4, Ω5, Ω6 → Ω6",
        printed=f"L4: {_row_texts(rows)}",
        derived="L4: Ω4, Ω5, Ω6 → Ω6 (F6, C-BD), as Appendix A says",
        verdict="refuted",
        proof="P4 = -f_b on L4, so F4 gives v_c' = (P4 - f_b)/gamma = -2 f_b/gamma < 0",
        consequence="On L4 F4 decelerates the capsule by 2 f_b/gamma: it cannot go forwards from "
        "rest. The columns of vectors and modes repeat Ω4, so that it is not a misread index.",
        formula=sp.latex(derived("F4_v_c == -2*f_b/gamma")),
        witness=partial(at_crest, ["L4"]),
    )
    # On L2 and L3 a row requires a source that cannot arrive where stick begins.
    for key, part_of, drift, stick, sign, curvature in (
        ("L2", "L2^(3)", 3, 2, 1, "P3' = -n, positive where n < 0"),
        ("L3", "L3^(1)", 4, 5, -1, "P4' = n, negative there"),
    ):
        listed = (drift, stick) in pairs_of(rows_of(paper, "table.2", key))
        curve = sign * derivatives(v_c, drift, 2)[2]
        yield misprint(
            entry,
            f"table2.{key}.source",
            [part_of],
            f"{curve} < 0",
            f"{curve} > 0",
            place="Table 2, Section 3.3",
            printed=f"{key}: {f'Ω{drift} → Ω{stick}' if listed else 'no such row'}, also on "
            f"{part_of}",
            derived=f"where stick begins on {key} (n < 0), none arrives from Ω{drift}",
            proof=f"on {key} v_c = v_c' = 0 along F{drift}, and gamma v_c'' = {curvature}",
            consequence=f"In F{drift} the capsule's velocity has an extremum 0 there: before, it "
            f"had the other sign. The rows Ω{drift} → Ω{stick} and Ω{stick} → Ω{stick} need n = 0 "
            f"(see table2.{key}).",
        )


_CORNERS = ((4, 1, 1), (4, 1, 8), (4, 2, 2), (3, 5, 5), (3, 6, 6), (3, 6, 9))
"""Target, field and source of the maps that pass a corner, which Table 3 lacks."""
_ACROSS_L10 = ((1, 4, 4), (1, 5, 5), (1, 6, 6), (1, 6, 9))
"""Those that pass L10, which exists for delta > f_b."""
_NEEDED = (
    "Those of F2 and F5, and of F6 into Σ1, need one coincidence only: a family of orbits meets "
    "them at isolated parameters. A misread row of the scan would show as a map that does not "
    "occur, and none does."
)


def table_3(paper: Paper) -> Iterator[Statement]:
    """Table 3: the local maps."""
    entry, printed = paper["table.3"], printed_maps(paper)
    for one, (*_, mode) in zip(printed, entry["rows"], strict=True):
        other = LocalMap("Σ7" if one.target != "Σ7" else "Σ6", one.field, "Σ2")
        yield beside(
            entry,
            f"table3.{one.target}.F{one.field}.{one.source}",
            occurs,
            {"local_map": one, "mode": mode},
            {"local_map": other},
            says=f"{one} ({mode}) is printed, and occurs",
            printed=f"{one}, {mode}",
            proof="a witness in exact rational arithmetic (table3 below)",
            formula=one.formula,
        )
    gap = paper["section.3.1.start"]["restricted_to"]
    for name, check, scenario, missing, more, where, passed in (
        (
            "restricted",
            restricted,
            "δ < f_b",
            _CORNERS,
            {"to": gap},
            "for δ < f_b, to which Section 3.1 restricts it,",
            "All pass a corner.",
        ),
        (
            "every",
            lacks,
            "",
            (*_CORNERS, *_ACROSS_L10),
            {},
            "for every delta,",
            "All pass a corner, or L10, which exists for delta > f_b only.",
        ),
    ):
        total, maps = len(occurring(scenario)), maps_by_number(missing)
        yield beside(
            entry,
            f"table3.missing.{name}",
            check,
            {"scenario": scenario, "printed": printed, "missing": missing, **more},
            {"missing": missing[1:]},
            says=f"{where} {total} local maps occur, {len(missing)} more than Table 3 lists",
            printed=f"{where} all local maps are {len(printed)}",
            derived=f"{total}: also {', '.join(map(str, maps))}",
            verdict="refuted",
            proof="each missing map is shown by a trajectory that is enclosed in exact rational "
            "arithmetic (table3 below); all others are excluded (table3.complete, table3.regime)",
            consequence=f"{passed} {_NEEDED}",
            formula=r",\ ".join(one.formula for one in maps),
            witness=_shown_map,
        )
    none = ": stick or backward drift into Σ5 (no L6), and F4 from Σ7 to rest"
    for scenario, count, which in (("δ < f_b", 0, ""), ("δ = f_b", 9, none), ("δ > f_b", 9, none)):
        text = f"for {scenario} and ζ > 0, {count} of the printed maps cannot occur{which}"
        yield beside(
            entry,
            f"table3.scenario.{scenario.replace(' ', '')}",
            excluded,
            {"scenario": scenario, "printed": printed, "count": count},
            {"count": next_field(count)},
            says=text,
            printed=f"Table 3 lists {len(printed)} maps, without a condition on δ",
            derived=text,
            verdict="conditional",
            proof="for δ ≥ f_b L6 is empty, and table3.never_rests excludes the maps of F4 from Σ7 "
            "to rest; all others occur by their witnesses",
            consequence="The search for orbits at δ ≥ f_b has fewer maps to consider.",
        )


STATEMENTS = (table_1_and_2, table_3)
