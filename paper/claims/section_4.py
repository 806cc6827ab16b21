"""Claims of Sections 4 and 5: the global maps, the panels of Fig. 7, and the bifurcations."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial
from typing import Any

from capsule_sym._symbolic.theory import Statement
from paper.claims.beside import beside
from paper.claims.case_study import OTHER, Itinerary, global_map, maps, point
from paper.claims.errata import equal
from paper.claims.motions import (
    Sides,
    adjoins,
    bifurcates,
    chain,
    crossing_map,
    drift_begins,
    maps_of,
    moves,
    near,
    off,
    ordered,
    printed_gamma,
    rests,
    rounds,
    shown,
    sides_at,
    stick_vanishes,
    tends,
    types,
)
from paper.claims.relations import listed, same_sets
from paper.claims.segments import (
    does_beyond,
    drift_of,
    drifts,
    impact_of,
    indicates,
    modes,
    segment_does,
)
from paper.claims.space import crossing_lines
from paper.claims.tables import printed_maps
from paper.printed import Paper, events, panels, row_at, section_4

_KRAWCZYK = (
    "the orbit is enclosed by Krawczyk's method in ball arithmetic, every guard proved positive "
    "along every segment, and its multipliers inside the unit circle"
)
_ON_EACH_SIDE = f"{_KRAWCZYK}, on each side"
_ON_BOTH_SIDES = f"{_KRAWCZYK}, on both sides of each change"


def rows_of_maps(paper: Paper) -> Iterator[Statement]:
    """The rows of Section 4: each a global map and its range of amplitudes."""
    rows = section_4(paper)
    for number, row in enumerate(rows[1:], start=2):  # the first is the identity
        cycle_of = maps_of(row.map)
        yield beside(
            paper[f"section.4.{number}"],
            f"section.4.row.{number}.cycle",
            chain,
            {
                "printed": cycle_of,
                "table": printed_maps(paper),
                "corner": row.low is None,
            },
            {"printed": cycle_of[1:]},
            says=f"{row.map} is a cycle of local maps of Table 3",
            printed=row.map,
            proof="each map begins where the one before it ends, with the field of that plane",
        )
    figure = paper["figure.6"]
    low, high = figure["range"]
    before = low
    for number, row in enumerate(rows, start=1):
        to = f"{row.high}{'' if row.closed else ', open'}"
        yield beside(
            paper[f"section.4.{number}"],
            f"section.4.row.{number}.range",
            adjoins,
            {"row": row, "before": before, "panel": panels(paper)[row.panel]},
            {"panel": "-1"},
            says=f"the row follows the one before it, and Fig. 7({row.panel}) is within it",
            printed=f"α from {row.low or row.high} to {to}: Fig. 7({row.panel})",
            proof="the printed numbers are compared",
        )
        before = row.high
    yield beside(
        figure,
        "figure.6.range",
        equal,
        {"printed": Fraction(paper["section.4.11"]["high"]), "expected": Fraction(high)},
        {"printed": Fraction(paper["section.4.1"]["high"])},
        says=f"Section 4 ends where Fig. 6 does, at α = {high}",
        printed=f"α from {low} to {high}",
        proof="the printed numbers are compared",
    )


_MOTIONS: dict[str, Itinerary] = {
    **{"a": (2, 5), "b": (5, 2), "c": (5, 2), "d": (5, 4, 5, 2), "e": (5, 4, 5, 2)},
    **{"f": (5, 4, 1, 2), "g": (5, 4, 1, 2), "h": (5, 4, 1, 2, 3, 2)},
    **{"i": (5, 4, 1, 2, 3, 6), "j": (5, 4, 1, 2, 3, 6)},
    **dict.fromkeys("klmnop", (4, 1, 3, 6)),
}
"""Fields of the attracting motion at the amplitude of each panel of Fig. 7."""
_AT_OTHER: dict[str, Itinerary] = {"l": (4, 1, 2, 3, 6), "n": (4, 1, 3, 2, 3, 6)}
"""Those at the other mass ratio where they differ."""
_NO_STICK = (
    "At the printed γ the stick in F2 is gone already: F1 leads to F3. At γ = 3.0 the printed map "
    "is right."
)
_DIFFERING = {
    "a": "The graze is at 0.0073756..., which rounds to the printed value; at the rounded value "
    "itself impacts have begun.",
    **dict.fromkeys(
        "eikmo",
        "The printed bifurcation value is not that of the printed γ (section.4.event).",
    ),
    **dict.fromkeys("ln", _NO_STICK),
}
"""Panels whose printed map is not that of the motion, with the reason."""


def panel_motions(paper: Paper) -> Iterator[Statement]:
    """The panels of Fig. 7: the attracting motion at each, and the one reached from rest."""
    figure = paper["figure.7"]

    def motion(panel: str, itinerary: Itinerary, gamma: str = "", **texts: Any) -> Statement:
        """The motion at a panel's amplitude, at the printed mass ratio or another one."""
        alpha = figure[panel]
        at, printed = point(paper, alpha, gamma), maps_of(row_at(paper, alpha).map)
        here, named = (f"α = {alpha}", "") if gamma else (str(at), f" (Fig. 7({panel}))")
        return beside(
            figure,
            f"section.4.panel.{panel}{'.other' if gamma else ''}",
            moves,
            {"at": at, "expected": printed},
            {"expected": maps(itinerary[1:]) if gamma else ()},
            says=f"at {at}{named} the attracting motion has the map {global_map(maps(itinerary))}",
            printed=f"Fig. 7({panel}), {here}: P = {global_map(printed)}",
            proof=_KRAWCZYK,
            witness=partial(shown, at),
            **texts,
        )

    for panel, itinerary in _MOTIONS.items():
        if panel not in _DIFFERING:
            yield motion(panel, itinerary)
    for panel in sorted(_DIFFERING):
        itinerary = _MOTIONS[panel]
        yield motion(
            panel,
            itinerary,
            correction={"expected": maps(itinerary)},
            derived=f"P = {global_map(maps(itinerary))}",
            verdict="conditional" if panel == "a" else "refuted",
            consequence=_DIFFERING[panel],
        )
    for panel, itinerary in _AT_OTHER.items():
        yield motion(
            panel, itinerary, OTHER, derived=f"so it is at γ = {OTHER}", verdict="conditional"
        )
    entry = paper["section.4.parameters"]
    start = tuple(entry["start"])
    from_rest = [(panel, _MOTIONS[panel], "") for panel in "fhjlnp"]
    for panel, itinerary, gamma in (
        *from_rest,
        *((panel, itinerary, OTHER) for panel, itinerary in _AT_OTHER.items()),
    ):
        at = point(paper, figure[panel], gamma)
        yield beside(
            entry,
            f"section.4.rest.{panel}{'.other' if gamma else ''}",
            tends,
            {"start": start, "at": at, "expected": maps(itinerary)},
            {"expected": ()},
            says=f"at {at} the motion from rest tends to one with the map "
            f"{global_map(maps(itinerary))}",
            printed=f"Fig. 7({panel}) shows the motion that is reached from ({listed(start)})",
            verdict="conditional" if gamma else "proved",
            proof="the motion from rest is enclosed until it enters a box that is contracted",
        )


def _between(sides: Sides) -> str:
    return f"between α = {sides[0]['alpha']} and {sides[1]['alpha']}"


def eight_bifurcations(paper: Paper) -> Iterator[Statement]:
    """The eight bifurcations: type, value at both mass ratios, and the map at a crossing."""
    gamma = printed_gamma(paper)
    entries = [e for e in paper.begun_with("section.4.") if "event" in e.printed]
    cases = [
        (number, *case, f"{case[1].type} on {case[1].line}")
        for number, case in enumerate(
            zip(
                entries,
                events(paper),
                sides_at(paper, gamma),
                sides_at(paper, OTHER),
                strict=True,
            ),
            start=1,
        )
    ]
    for number, entry, event, sides, _, kind in cases:
        below_, above = (global_map(maps(one)) for one in (sides[2].first, sides[2].second))
        grazing = event.type == "grazing-sliding"
        yield beside(
            entry,
            f"section.4.event.{number}.type",
            bifurcates,
            {"sides": sides, "kind": event.type, "line": event.line},
            {"kind": "grazing" if grazing else "grazing-sliding"},
            says=f"at γ = {gamma}, {_between(sides)}: {kind}; {below_} below, {above} above",
            printed=kind,
            proof=f"{_ON_EACH_SIDE}; what is inserted, removed or replaced names the type",
            witness=partial(shown, sides[1]),
        )
    for number, entry, event, sides, other, kind in cases:
        first = number == 1
        yield beside(
            entry,
            f"section.4.event.{number}.value",
            rounds if first else off,
            {"sides": sides, "printed": event.alpha},
            {"printed": "0.0084" if first else sides[0]["alpha"]},
            says=f"at γ = {gamma}, {_between(sides)}: {kind} (printed: {event.alpha})",
            printed=f"γ = {gamma}: {kind} at α = {event.alpha}",
            derived="as printed, to the printed digits" if first else _between(sides),
            verdict="proved" if first else "refuted",
            proof=_ON_EACH_SIDE,
            consequence=""
            if first
            else f"At γ = 3.0 it is {_between(other)} (printed.section.4.event.{number}.other).",
            witness=partial(shown, sides[0]),
        )
    for number, entry, event, _, other, kind in cases:
        yield beside(
            entry,
            f"section.4.event.{number}.other",
            near,
            {"sides": other, "kind": event.type, "line": event.line, "alpha": event.alpha},
            {"alpha": "1"},
            says=f"at γ = 3.0, {_between(other)}: {kind} (printed: {event.alpha})",
            printed=f"{kind} at α = {event.alpha}",
            derived=f"at γ = 3.0 {_between(other)}: within 1 % of the printed value",
            verdict="conditional",
            proof=_ON_EACH_SIDE,
            witness=partial(shown, other[1]),
        )
    for number, entry, _, sides, *_ in cases:
        if number in (3, 5):
            yield beside(
                entry,
                f"section.4.event.{number}.map",
                crossing_map,
                {"sides": sides, "printed": maps_of(entry["map"])},
                {"printed": maps(sides[2].second)},
                says=f"at the crossing itself P = {entry['map']}",
                printed=f"P = {entry['map']} at the crossing",
                proof="the motions on both sides, without the segment that is replaced and has no "
                "duration there",
            )


def order(paper: Paper) -> Iterator[Statement]:
    """The order of the bifurcations as the amplitude grows."""
    entry, printed_events = paper["section.4.events"], events(paper)
    printed = "; ".join(f"{event.type} at {event.alpha}" for event in printed_events)
    other = sides_at(paper, OTHER)
    cases: tuple[tuple[str, str, tuple[Sides, ...], dict[str, Any]], ...] = (
        (
            printed_gamma(paper),
            "section.4.order",
            sides_at(paper, printed_gamma(paper)),
            {"verdict": "refuted", "consequence": "The printed order is that of γ = 3.0."},
        ),
        (OTHER, "section.4.order.other", other, {"verdict": "conditional"}),
    )
    for gamma, name, sides, texts in cases:
        pairs = sorted(
            zip(sides, printed_events, strict=True), key=lambda pair: Fraction(pair[0][0]["alpha"])
        )
        found = "; ".join(f"{event.type} ({one[0]['alpha']})" for one, event in pairs)
        yield beside(
            entry,
            name,
            ordered,
            {"sides": sides, "order": gamma == OTHER},
            {"order": gamma != OTHER},
            says=f"at γ = {gamma}, with growing α: {found}",
            printed=f"with growing α: {printed}",
            derived=f"at γ = {gamma}: {found}",
            proof=_ON_BOTH_SIDES,
            witness=partial(shown, sides[7][0]),
            **texts,
        )
    kinds = tuple(entry["types"])
    yield beside(
        entry,
        "section.4.types",
        types,
        {"sides": other, "printed": kinds},
        {"printed": kinds[::-1]},
        says=f"as α grows, the types of bifurcation are, at γ = 3.0: {listed(kinds)}",
        printed=f"as α grows: {listed(kinds)}",
        derived="in this order at γ = 3.0; at the printed γ all of them, the last three in another "
        "order",
        verdict="conditional",
        proof=_ON_BOTH_SIDES,
    )


_FEATURES = {"impact": "contact", "forward": "forward drift", "backward": "backward drift"}
_ROLES = {
    "meets": "meets the line",
    "inserted": "is inserted",
    "point": "is a point on the line",
}


def remarks(paper: Paper) -> Iterator[Statement]:
    """Remarks of Section 4 on its rows: drift, impacts, segments, features that begin or end."""
    printed_events, all_sides = events(paper), sides_at(paper, printed_gamma(paper))
    by_value = {
        e.alpha: (e, s) for e, s in reversed(list(zip(printed_events, all_sides, strict=True)))
    }
    entry = paper["section.4.stationary"]
    for number, (alpha, impacts) in enumerate(entry["rows"], start=1):
        event, sides = by_value[alpha]
        yield beside(
            entry,
            f"section.4.stationary.{number}",
            rests,
            {"sides": sides, "below": alpha, "event": event, "impacts": impacts},
            {"impacts": 2},
            says=f"just below the bifurcation printed at α = {alpha} the capsule is at rest; "
            f"impacts per period: {impacts}",
            printed=f"up to α = {alpha} the capsule is stationary; impacts per period: {impacts}",
            proof=f"{_KRAWCZYK}; just below it the motion has stick fields only",
        )
    entry = paper["section.4.forward"]
    text, way = entry["map"], entry["way"]
    yield beside(
        entry,
        "section.4.forward",
        drifts,
        {"maps": (maps_of(text)[0],), "way": way, "table": printed_maps(paper)},
        {"way": "backward"},
        says=f"{text}, of Table 3, is a {way} drift",
        printed=f"{text} indicates a {way} drift",
        proof="the sign of v_c in the cell of its field",
    )
    entry = paper["section.4.drifts"]
    fields, way, impact = tuple(entry["fields"]), entry["way"], tuple(entry["impact"])
    names = listed(f"F{field}" for field in fields)
    yield beside(
        entry,
        "section.4.drifts.way",
        drift_of,
        {"fields": fields, "way": way},
        {"way": "backward"},
        says=f"in the segments of {names} the capsule moves {way}",
        printed=f"for the segments of {names} the capsule moves {way}",
        proof="the sign of v_c in the cells of the fields",
    )
    yield beside(
        entry,
        "section.4.drifts",
        impact_of,
        {"fields": fields, "printed": impact},
        {"printed": ("with", "with")},
        correction={"printed": ("with", "without")},
        says="F4 is with contact, F1 without",
        printed=f"for the segments of {names} the capsule moves forward {' and '.join(impact)} "
        "impact",
        derived="with impact in F4, without in F1",
        verdict="refuted",
        proof="F4 acts where P2 >= delta, Eq. (10), and F1 where P2 < delta, Eq. (7)",
        consequence="Harmless: the two words are exchanged. Eqs. (7) and (10), and the names NC-FD "
        "and C-FD, have it right.",
        witness=partial(modes, fields),
    )
    entry = paper["section.4.beyond"]
    for number, (alpha, how, what) in enumerate(entry["rows"], start=1):
        feature = _FEATURES.get(what, f"passing {what}" if what[0] == "S" else what)
        yield beside(
            entry,
            f"section.4.beyond.{number}",
            does_beyond,
            {"sides": by_value[alpha][1], "how": how, "what": what},
            {"how": {"ends": "begins", "begins": "ends"}[how]},
            says=f"above the bifurcation printed at α = {alpha} {feature} {how}",
            printed=f"as α increases beyond {alpha}, {feature} {how}",
            proof=f"{_KRAWCZYK}, on both sides of the change",
        )
    entry = paper["section.4.segments"]
    colours = tuple(paper["figure.7.colours"]["fields"])
    for number, (alpha, colour, role) in enumerate(entry["rows"], start=1):
        event, sides = by_value[alpha]
        yield beside(
            entry,
            f"section.4.segments.{number}",
            segment_does,
            {"sides": sides, "colour": colour, "role": role, "colours": colours},
            {"colour": "none"},
            says=f"at the {event.type} on {event.line} printed at α = {alpha} the {colour} segment "
            f"{_ROLES[role]}",
            printed=f"α = {alpha}: the {colour} segment {_ROLES[role]}",
            proof="the itineraries on both sides, and the colours of Fig. 7",
        )
    entry = paper["section.4.intersections"]
    narrow = ("zeta > 0", "δ < f_b")
    for key, names in entry.printed.items():
        yield beside(
            entry,
            f"section.4.intersections.{key}",
            same_sets,
            {
                "printed": [[f"cl {names[0]}", f"cl {names[1]}", *narrow]],
                "expected": [[f"cl {key}", *narrow]],
            },
            {"expected": [["cl S7", *narrow]]},
            says=f"for δ < f_b, as in Section 4, {key} is where {' and '.join(names)} meet, with "
            "their borders",
            printed=f"{key} is the intersection line of {' and '.join(names)}",
            proof="the closed sets include each other",
        )
    entry = paper["section.4.indicates"]
    for text, line in entry["rows"]:
        (one,) = maps_of(text)
        pieces = tuple(paper["equation.24"]["planes"][int(one.target[1:]) - 1])
        yield beside(
            entry,
            f"section.4.indicates.{line}",
            indicates,
            {"local_map": one, "pieces": pieces, "line": line},
            {"line": "L9"},
            says=f"{text} ends on {line}: its field arrives nowhere else on the plane",
            printed=f"{text} indicates a boundary-intersection crossing on {line}",
            proof="the pieces of the plane, Eq. (24), that trajectories of the field can reach; "
            f"beside {line} they meet one of two surfaces first",
        )


def conclusions(paper: Paper) -> Iterator[Statement]:
    """Section 5."""
    entry, printed_events = paper["section.5"], events(paper)
    sides = sides_at(paper, printed_gamma(paper))
    value = entry["stationary_below"]
    yield beside(
        entry,
        "section.5.stationary",
        rests,
        {"sides": sides[1], "below": value, "event": printed_events[1]},
        {"sides": sides[2]},
        says=f"up to the bifurcation printed at α = {value} the capsule is at rest",
        printed=f"the capsule is stationary for α < {value}",
        proof=f"{_KRAWCZYK}; just below it the motion has stick fields only",
    )
    lines = tuple(entry["crossing_lines"])
    yield beside(
        entry,
        "section.5.crossings",
        crossing_lines,
        {"printed": lines},
        {"printed": lines[1:]},
        says="the lines on which a boundary-intersection crossing can occur for δ < f_b are "
        f"{listed(lines)}",
        printed=f"boundary-intersection crossings occur on {listed(lines)}",
        proof="beside the line some trajectories meet one of two surfaces first, and have another "
        "field in between",
    )
    yield beside(
        entry,
        "section.5.vanishes",
        stick_vanishes,
        {
            "sides": sides[5:8],
            "printed": tuple(entry["stick_vanishes"]),
            "but": "switching-sliding",
        },
        {"but": "grazing-sliding"},
        says="stick vanishes at crossing- and grazing-sliding; at switching-sliding a drift is "
        "added before it",
        printed=f"{listed(entry['stick_vanishes'])} determine the disappearance of sticking "
        "segments",
        derived="so it is for crossing- and grazing-sliding; at switching-sliding F3 comes between "
        "F1 and the stick, which stays",
        verdict="refuted",
        proof=_ON_BOTH_SIDES,
        consequence="Section 4 itself has the stick in F2 on both sides of the switching-sliding.",
        witness=partial(shown, sides[6][1]),
    )
    turned = {"forward": "backward", "backward": "forward"}
    for number, at in ((1, 1), (2, 3)):
        alpha, line, way = entry["adding"][number - 1]
        yield beside(
            entry,
            f"section.5.adding.{number}",
            drift_begins,
            {"sides": sides[at], "event": printed_events[at], "printed": (alpha, line, way)},
            {"printed": (alpha, line, turned[way])},
            says=f"at the bifurcation printed at α = {alpha}, on {line}, {way} motion begins",
            printed=f"adding-sliding on {line} at α = {alpha}: {way} motion",
            proof="the field that is inserted into stick",
        )


STATEMENTS = (
    rows_of_maps,
    panel_motions,
    eight_bifurcations,
    order,
    remarks,
    conclusions,
)
