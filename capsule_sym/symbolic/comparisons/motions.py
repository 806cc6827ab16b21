"""Section 4: the global maps, the panels of Fig. 7, and the eight bifurcations."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import partial

import sympy as sp

from capsule_sym.paper import Entry, Event, Paper, Row, events, panels, section_4
from capsule_sym.symbolic.appendices import PARTS
from capsule_sym.symbolic.case_study import (
    BRACKETS,
    OTHER,
    Bracket,
    Maps,
    Point,
    Word,
    cycle,
    from_rest,
    global_map,
    maps,
    point,
    settled,
)
from capsule_sym.symbolic.comparisons.changes import Change, change, common
from capsule_sym.symbolic.comparisons.compare import comparison, listed
from capsule_sym.symbolic.comparisons.tables import printed_maps
from capsule_sym.symbolic.items import Item, Verdict
from capsule_sym.symbolic.model import SEGMENTS
from capsule_sym.symbolic.periodic import Periodic
from capsule_sym.symbolic.switching import LocalMap
from capsule_sym.symbolic.symbols import v_r

_LOCAL = re.compile(r"P_\{(Σ\d+),F(\d),(Σ\d+)\}")

Claim = tuple[tuple[Point, Maps], ...]


def maps_of(text: str) -> Maps:
    """The local maps of a printed global map in order of time; none for an identity."""
    if text == "Id_{Σ2,F2,Σ2}":
        return ()
    found = [_LOCAL.fullmatch(part) for part in text.split(" ∘ ")[::-1]]
    return tuple(LocalMap(m[1], int(m[2]), m[3]) for m in found if m)


def row_at(paper: Paper, alpha: str) -> Row:
    """The printed row of an amplitude: the one for that value alone, if there is one."""
    rows = section_4(paper)
    value = Fraction(alpha)
    for row in rows:
        if value < Fraction(row.high) or (row.closed and value == Fraction(row.high)):
            return row
    raise ValueError(alpha)


def _moves(claim: Claim) -> bool:
    """Whether at each point an attracting periodic motion has the given global map."""
    return all(cycle(settled(at).maps) == cycle(expected) for at, expected in claim)


def moves_unlike(claim: tuple[Point, Maps, Maps]) -> bool:
    """Whether an attracting periodic motion has the first global map, and not the second."""
    at, exact, printed = claim
    return _moves(((at, exact),)) and cycle(exact) != cycle(printed)


_PROOF = (
    "Newton's method gives a state; the map of one period is enclosed in interval arithmetic, and "
    "proved to carry a box around it into itself and to contract it"
)


def shown(at: Point) -> dict[str, str]:
    """The numbers of the proof at a point."""
    state = ", ".join(f"{float(x):.6f}" for x in settled(at).state)
    return {
        **dict(at.numbers),
        "attracting periodic motion": f"through (x_r, v_r, v_c) = ({state}) at omega tau = 0",
    }


_PANELS: dict[str, Word] = {
    **{"a": (2, 5), "b": (5, 2), "c": (5, 2), "d": (5, 4, 5, 2), "e": (5, 4, 5, 2)},
    **{"f": (5, 4, 1, 2), "g": (5, 4, 1, 2), "h": (5, 4, 1, 2, 3, 2)},
    **{"i": (5, 4, 1, 2, 3, 6), "j": (5, 4, 1, 2, 3, 6), "k": (4, 1, 3, 6), "l": (4, 1, 3, 6)},
    **{"m": (4, 1, 3, 6), "n": (4, 1, 3, 6), "o": (4, 1, 3, 6), "p": (4, 1, 3, 6)},
}
"""The motions of Fig. 7 at the printed mass ratio."""
_AS_PRINTED = "bcdfghjp"
_OTHER_PANELS: dict[str, Word] = {"l": (4, 1, 2, 3, 6), "n": (4, 1, 3, 2, 3, 6)}
"""Those away from printed bifurcation values that are as printed at the other mass ratio only."""
_FROM_REST = "fhjlnp"

_WHY = {
    "a": "The graze is at 0.0073756..., which rounds to the printed value; at the rounded value "
    "itself impacts have begun.",
    "l": f"At the printed γ the stick in F2 is gone already: F1 leads to F3. At γ = {OTHER} the "
    "printed map is right.",
}
_WHY["n"] = _WHY["l"]
_AT_VALUE = "The printed bifurcation value is not that of the printed γ (section.4.event)."


def _panel_items(paper: Paper) -> Iterator[Item]:
    entry = paper["figure.7"]
    for name, alpha in panels(paper).items():
        at, exact = point(paper, alpha), maps(_PANELS[name])
        row = maps_of(row_at(paper, alpha).map)
        text = f"at {at} (Fig. 7({name})) the attracting motion has the map {global_map(exact)}"
        same = name in _AS_PRINTED
        verdict: Verdict = "proved" if same else "conditional" if name == "a" else "refuted"
        yield comparison(
            entry,
            f"section.4.panel.{name}",
            text,
            f"Fig. 7({name}), {at}: P = {global_map(row)}",
            ((at, row),) if same else (at, exact, row),
            _moves if same else moves_unlike,
            ((at, maps((2,))),) if same else (at, exact, exact),
            derived="as printed" if same else f"P = {global_map(exact)}",
            verdict=verdict,
            proof=_PROOF,
            consequence="" if same else _WHY.get(name, _AT_VALUE),
            witness=partial(shown, at),
        )
    for name, word in _OTHER_PANELS.items():
        at = point(paper, entry[name], OTHER)
        row = maps_of(row_at(paper, entry[name]).map)
        yield comparison(
            entry,
            f"section.4.panel.{name}.other",
            f"at {at} the attracting motion has the map {global_map(maps(word))}",
            f"Fig. 7({name}), α = {entry[name]}: P = {global_map(row)}",
            ((at, row),),
            _moves,
            ((at, maps(_PANELS[name])),),
            derived=f"so it is at γ = {OTHER}",
            verdict="conditional",
            proof=_PROOF,
            witness=partial(shown, at),
        )
    yield from _rest_items(paper)


def _tends(claim: tuple[tuple[str, ...], Point, Maps]) -> bool:
    """Whether the motion from a start, which is rest, tends to one with the global map."""
    start, at, expected = claim
    return set(map(Fraction, start)) == {0} and cycle(from_rest(at).maps) == cycle(expected)


def _rest_items(paper: Paper) -> Iterator[Item]:
    start = tuple(paper["section.4.parameters"]["start"])
    chosen = [(name, None, _PANELS[name]) for name in _FROM_REST]
    for name, gamma, word in [*chosen, *((n, OTHER, w) for n, w in _OTHER_PANELS.items())]:
        at = point(paper, paper["figure.7"][name], gamma)
        yield comparison(
            paper["section.4.parameters"],
            f"section.4.rest.{name}" + (".other" if gamma else ""),
            f"at {at} the motion from rest tends to one with the map {global_map(maps(word))}",
            f"Fig. 7({name}) shows the motion that is reached from ({listed(start)})",
            (start, at, maps(word)),
            _tends,
            (start, at, maps((2,))),
            verdict="conditional" if gamma else "proved",
            proof="the motion from rest is enclosed until it enters a box that is contracted",
        )


def _is_row(claim: tuple[Maps, tuple[LocalMap, ...], bool]) -> bool:
    """Whether a global map is a cycle of local maps, each a printed one (or at a corner, not)."""
    row, table, corner = claim
    chained = all(one.target == row[(i + 1) % len(row)].source for i, one in enumerate(row))
    begun = all(SEGMENTS[one.field - 1].index == _field_after(one.source) for one in row)
    return chained and begun and (corner or set(row) <= set(table))


_ENTERED = {"Σ7": 4, "Σ8": 1, "Σ9": 6, "Σ10": 3}


def _field_after(plane: str) -> int:
    return _ENTERED.get(plane) or int(plane[1:])


def _rows(paper: Paper) -> Iterator[Item]:
    rows, table = section_4(paper), printed_maps(paper)
    for number, row in enumerate(rows, start=1):
        entry = paper[f"section.4.{number}"]
        found = maps_of(row.map)
        if found:
            yield comparison(
                entry,
                f"section.4.row.{number}.cycle",
                f"{row.map} is a cycle of local maps of Table 3",
                row.map,
                (found, table, row.low is None),
                _is_row,
                (found[1:], table, row.low is None),
                proof="each map begins where the one before it ends, with the field of that plane",
            )
        low = rows[number - 2].high if number > 1 else paper["figure.6"]["range"][0]
        ends = (row.low or low, low, row.high, row.closed, row.panel)
        yield comparison(
            entry,
            f"section.4.row.{number}.range",
            f"the row follows the one before it, and Fig. 7({row.panel}) is within it",
            f"α from {row.low or row.high} to {row.high}{'' if row.closed else ', open'}: "
            f"Fig. 7({row.panel})",
            (ends, panels(paper)),
            _follows,
            ((row.low or low, "-1", row.high, row.closed, row.panel), panels(paper)),
            proof="the printed numbers are compared",
        )
    last = paper["figure.6"]
    yield comparison(
        last,
        "figure.6.range",
        f"Section 4 ends where Fig. 6 does, at α = {last['range'][1]}",
        f"α from {last['range'][0]} to {last['range'][1]}",
        (rows[-1].high, last["range"][1]),
        lambda claim: Fraction(claim[0]) == Fraction(claim[1]),
        (rows[0].high, last["range"][1]),
        proof="the printed numbers are compared",
    )


def _follows(claim: tuple[tuple[str, str, str, bool, str], Mapping[str, str]]) -> bool:
    (low, before, high, closed, panel), places = claim
    value, first, last = (Fraction(x) for x in (places[panel], low, high))
    here = first < value <= last if first < last else value == last
    inside = here and (closed or value < last)
    return Fraction(before) == first and inside


def number_of(line: str, motion: Periodic, place: int, at: Point) -> int:
    """The part of a line on which a leg begins, by its relative velocity."""
    speeds = motion.speed(place)
    for part in PARTS:
        if part.line == line and all(
            bool(r.subs({v_r: sp.Rational(speed), **at.values}))
            for r in part.within
            for speed in speeds
        ):
            return part.number
    raise ValueError((line, speeds))


def line_parts(line: str, at: Point) -> set[str]:
    """The parts of a line on which the legs that begin there begin."""
    motion = settled(at)
    stick, drift = {"L1": (2, 1), "L2": (2, 3), "L3": (5, 4), "L4": (5, 6)}[line]
    legs = motion.passage.legs
    return {
        f"{line}^({number_of(line, motion, i, at)})"
        for i, leg in enumerate(legs)
        if i and leg.field == drift and legs[i - 1].field == stick
    }


def _bracket(paper: Paper, gamma: str, number: int) -> tuple[Point, Point, Bracket]:
    bracket = BRACKETS[gamma][number]
    return point(paper, bracket.below, gamma), point(paper, bracket.above, gamma), bracket


Sides = tuple[Point, Point, Bracket]


def _changes(sides: Sides) -> Change | None:
    """The bifurcation between two points whose motions are proved to be those claimed."""
    below, above, bracket = sides
    if not _moves(((below, maps(bracket.first)), (above, maps(bracket.second)))):
        return None
    return change(bracket.first, bracket.second)


def _is_type(claim: tuple[Sides, str, str]) -> bool:
    """Whether between two points a bifurcation of the printed type is, on the printed line."""
    sides, kind, line = claim
    found = _changes(sides)
    if found is None or (found.type, found.line) != (kind, line[:2]):
        return False
    return "^" not in line or line_parts(line[:2], sides[1]) == {line}


def _rounding(alpha: str) -> tuple[Fraction, Fraction]:
    """The numbers that round to a printed decimal."""
    half = Fraction(1, 2 * 10 ** len(alpha.partition(".")[2]))
    return Fraction(alpha) - half, Fraction(alpha) + half


def _rounds(claim: tuple[Sides, str]) -> bool:
    """Whether a bifurcation between two points rounds to the printed value."""
    sides, alpha = claim
    low, high = _rounding(alpha)
    inside = low <= Fraction(sides[0]["alpha"]) and Fraction(sides[1]["alpha"]) <= high
    return inside and _changes(sides) is not None


def _off(claim: tuple[Sides, str]) -> bool:
    """Whether no number between two points with a bifurcation rounds to the printed value."""
    sides, alpha = claim
    low, high = _rounding(alpha)
    apart = Fraction(sides[1]["alpha"]) < low or high < Fraction(sides[0]["alpha"])
    return apart and _changes(sides) is not None


def _near(claim: tuple[Sides, Event]) -> bool:
    """Whether between two points a bifurcation is of the printed type, within 1 % in alpha."""
    sides, event = claim
    value = Fraction(event.alpha)
    near = all(abs(Fraction(at["alpha"]) - value) < value / 100 for at in sides[:2])
    found = _changes(sides)
    return near and found is not None and (found.type, found.line) == (event.type, event.line[:2])


def _between(sides: Sides) -> str:
    return f"between α = {sides[0]['alpha']} and {sides[1]['alpha']}"


def _event_items(paper: Paper) -> Iterator[Item]:
    printed_gamma = paper["section.4.parameters"]["gamma"]
    entries = [e for e in paper.begun_with("section.4.") if "event" in e.printed]
    for number, (entry, event) in enumerate(zip(entries, events(paper), strict=True)):
        sides = _bracket(paper, printed_gamma, number)
        other = _bracket(paper, OTHER, number)
        where = f"at γ = {printed_gamma}, {_between(sides)}"
        name = f"section.4.event.{number + 1}"
        first, second = (global_map(maps(w)) for w in (sides[2].first, sides[2].second))
        kind = f"{event.type} on {event.line}"
        yield comparison(
            entry,
            f"{name}.type",
            f"{where}: {kind}; {first} below, {second} above",
            kind,
            (sides, event.type, event.line),
            _is_type,
            (sides, "grazing-sliding" if number != 7 else "grazing", event.line),
            proof=_PROOF + ", on each side; what is inserted, removed or replaced names the type",
            witness=partial(shown, sides[1]),
        )
        rounded = number == 0
        yield comparison(
            entry,
            f"{name}.value",
            f"{where}: {kind} (printed: {event.alpha})",
            f"γ = {printed_gamma}: {kind} at α = {event.alpha}",
            (sides, event.alpha),
            _rounds if rounded else _off,
            (sides, "0.0084" if rounded else sides[0]["alpha"]),
            derived="as printed, to the printed digits" if rounded else _between(sides),
            verdict="proved" if rounded else "refuted",
            proof=_PROOF + ", on each side",
            consequence=""
            if rounded
            else f"At γ = {OTHER} it is {_between(other)} (printed.{name}.other).",
            witness=partial(shown, sides[0]),
        )
        yield comparison(
            entry,
            f"{name}.other",
            f"at γ = {OTHER}, {_between(other)}: {kind} (printed: {event.alpha})",
            f"{kind} at α = {event.alpha}",
            (other, event),
            _near,
            (other, Event(event.type, event.line, "1")),
            derived=f"at γ = {OTHER} {_between(other)}: within 1 % of the printed value",
            verdict="conditional",
            proof=_PROOF + ", on each side",
            witness=partial(shown, other[1]),
        )
        if "crossing" in event.type and "boundary" in event.type:
            yield _corner(entry, f"{name}.map", sides)
    yield from _orders(paper)
    yield _types(paper)


def _is_common(claim: tuple[Sides, Maps]) -> bool:
    """Whether the global map at a crossing is that of both sides without the replaced field."""
    sides, printed = claim
    bracket = sides[2]
    word = common(bracket.first, bracket.second)
    return _changes(sides) is not None and cycle(maps(word)) == cycle(printed)


def _corner(entry: Entry, name: str, sides: Sides) -> Item:
    printed = maps_of(entry["map"])
    return comparison(
        entry,
        name,
        f"at the crossing itself P = {entry['map']}",
        f"P = {entry['map']} at the crossing",
        (sides, printed),
        _is_common,
        (sides, maps(sides[2].second)),
        proof="the motions on both sides, without the leg that is replaced and has no duration "
        "there",
    )


def _in_order(claim: tuple[tuple[Sides, ...], bool]) -> bool:
    """Whether the bifurcations are in the printed order of alpha, or are not, as claimed."""
    chosen, ordered = claim
    values = [Fraction(sides[0]["alpha"]) for sides in chosen]
    return all(map(_changes, chosen)) and (values == sorted(values)) == ordered


def _orders(paper: Paper) -> Iterator[Item]:
    entry, printed_gamma = paper["section.4.events"], paper["section.4.parameters"]["gamma"]
    named = "; ".join(f"{event.type} at {event.alpha}" for event in events(paper))
    for gamma, ordered in ((printed_gamma, False), (OTHER, True)):
        chosen = tuple(_bracket(paper, gamma, number) for number in range(8))
        found = sorted(
            zip(chosen, events(paper), strict=True), key=lambda o: float(o[0][0]["alpha"])
        )
        text = "; ".join(f"{event.type} ({sides[0]['alpha']})" for sides, event in found)
        yield comparison(
            entry,
            "section.4.order" + (".other" if ordered else ""),
            f"at γ = {gamma}, with growing α: {text}",
            f"with growing α: {named}",
            (chosen, ordered),
            _in_order,
            (chosen, not ordered),
            derived=f"at γ = {gamma}: {text}",
            verdict="conditional" if ordered else "refuted",
            proof=_PROOF + ", on both sides of each change",
            consequence="" if ordered else f"The printed order is that of γ = {OTHER}.",
            witness=partial(shown, chosen[-1][0]),
        )


def _types(paper: Paper) -> Item:
    entry = paper["section.4.events"]
    sides = tuple(_bracket(paper, OTHER, number) for number in range(8))
    types = tuple(entry["types"])
    return comparison(
        entry,
        "section.4.types",
        f"as α grows, the types of bifurcation are, at γ = {OTHER}: {listed(types)}",
        f"as α grows: {listed(types)}",
        (sides, types),
        _meets_types,
        (sides, types[::-1]),
        derived=f"in this order at γ = {OTHER}; at the printed γ all of them, the last three in "
        "another order",
        verdict="conditional",
        proof=_PROOF + ", on both sides of each change",
    )


def _meets_types(claim: tuple[tuple[Sides, ...], tuple[str, ...]]) -> bool:
    sides, types = claim
    found = [one.type for one in map(_changes, sides) if one]
    return tuple(dict.fromkeys(found)) == types and len(found) == len(sides)


def _conclusions(paper: Paper) -> Iterator[Item]:
    entry, printed = paper["section.5"], events(paper)
    gamma = paper["section.4.parameters"]["gamma"]
    below = entry["stationary_below"]
    sides = _bracket(paper, gamma, 1)
    yield comparison(
        entry,
        "section.5.stationary",
        f"up to the bifurcation printed at α = {below} the capsule is at rest",
        f"the capsule is stationary for α < {below}",
        (sides, below, printed),
        _stationary,
        (_bracket(paper, gamma, 2), below, printed),
        proof=_PROOF + "; just below it the motion has stick fields only",
    )
    for number, (alpha, line, way) in enumerate(entry["adding"], start=1):
        index = {1: 1, 2: 3}[number]
        sides = _bracket(paper, gamma, index)
        yield comparison(
            entry,
            f"section.5.adding.{number}",
            f"at the bifurcation printed at α = {alpha}, on {line}, {way} motion begins",
            f"adding-sliding on {line} at α = {alpha}: {way} motion",
            (sides, printed[index], (alpha, line, way)),
            _begins,
            (sides, printed[index], (alpha, line, "forward" if way == "backward" else "backward")),
            proof="the field that is inserted into stick",
        )


def _stationary(claim: tuple[Sides, str, tuple[Event, ...]]) -> bool:
    sides, below, printed = claim
    stick = all(SEGMENTS[field - 1].stick for field in sides[2].first)
    return stick and _changes(sides) is not None and printed[1].alpha == below


def _begins(claim: tuple[Sides, Event, tuple[str, str, str]]) -> bool:
    sides, event, (alpha, line, way) = claim
    found = _changes(sides)
    drift = {"forward": 1, "backward": -1}[way]
    return (
        found is not None
        and SEGMENTS[found.field - 1].drift == drift
        and (event.alpha, event.line) == (alpha, line)
        and found.type == event.type == "adding-sliding"
    )


def items(paper: Paper) -> Iterator[Item]:
    """Section 4 but for the captions of Figs. 8 and 9, and Section 5."""
    yield from _rows(paper)
    yield from _panel_items(paper)
    yield from _event_items(paper)
    yield from _conclusions(paper)
