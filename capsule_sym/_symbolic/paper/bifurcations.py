"""Section 4: the eight bifurcations, by type, line, value and order; what Section 5 concludes."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from functools import partial

import sympy as sp

from capsule_sym._paper import Entry, Event, Paper, events
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.symbols import v_r
from capsule_sym._symbolic.paper.case_study import (
    BRACKETS,
    OTHER,
    Bracket,
    Maps,
    Point,
    SteadyOrbit,
    cycle,
    global_map,
    maps,
    point,
    steady_orbit,
)
from capsule_sym._symbolic.paper.changes import Change, change, common
from capsule_sym._symbolic.paper.compare import comparison, listed
from capsule_sym._symbolic.paper.motions import PROOF, maps_of, moves, shown
from capsule_sym._symbolic.proofs.appendices import PARTS
from capsule_sym._symbolic.proofs.inner_products import FIELDS
from capsule_sym._symbolic.proofs.items import Item


def number_of(line: str, motion: SteadyOrbit, place: int, at: Point) -> int:
    """The part of a line on which a segment begins, by its relative velocity."""
    speeds = motion.speeds[place]
    for part in PARTS:
        if part.line == line and all(
            bool(r.subs({v_r: sp.Rational(speed), **at.values}))
            for r in part.within
            for speed in speeds
        ):
            return part.number
    raise ValueError((line, speeds))


def line_parts(line: str, at: Point) -> set[str]:
    """The parts of a line on which the segments that begin there begin."""
    motion = steady_orbit(at)
    drift, stick, _ = FIELDS[line]
    fields = motion.fields
    return {
        f"{line}^({number_of(line, motion, i, at)})"
        for i, field in enumerate(fields)
        if field == drift and fields[i - 1] == stick
    }


def _bracket(paper: Paper, gamma: str, number: int) -> tuple[Point, Point, Bracket]:
    bracket = BRACKETS[gamma][number]
    return point(paper, bracket.below, gamma), point(paper, bracket.above, gamma), bracket


Sides = tuple[Point, Point, Bracket]


def _changes(sides: Sides) -> Change | None:
    """The bifurcation between two points whose motions are proved to be those claimed."""
    below, above, bracket = sides
    if not moves(((below, maps(bracket.first)), (above, maps(bracket.second)))):
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
            proof=PROOF + ", on each side; what is inserted, removed or replaced names the type",
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
            proof=PROOF + ", on each side",
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
            proof=PROOF + ", on each side",
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
    itinerary = common(bracket.first, bracket.second)
    return _changes(sides) is not None and cycle(maps(itinerary)) == cycle(printed)


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
        proof="the motions on both sides, without the segment that is replaced and has no duration "
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
            proof=PROOF + ", on both sides of each change",
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
        proof=PROOF + ", on both sides of each change",
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
        proof=PROOF + "; just below it the motion has stick fields only",
    )
    yield _vanishes(paper, entry, gamma)
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


def _vanishing(claim: tuple[tuple[Sides, ...], tuple[str, ...], str]) -> bool:
    """Whether stick vanishes at these types of bifurcation but for one, which adds a drift."""
    chosen, types, other = claim
    found = {one.type: SEGMENTS[one.field - 1].stick for one in map(_changes, chosen) if one}
    return all(found.get(kind) == (kind != other) for kind in types) and other in types


def _vanishes(paper: Paper, entry: Entry, gamma: str) -> Item:
    chosen = tuple(_bracket(paper, gamma, number) for number in (5, 6, 7))
    types = tuple(entry["stick_vanishes"])
    return comparison(
        entry,
        "section.5.vanishes",
        "stick vanishes at crossing- and grazing-sliding; at switching-sliding a drift is added "
        "before it",
        f"{listed(types)} determine the disappearance of sticking segments",
        (chosen, types, "switching-sliding"),
        _vanishing,
        (chosen, types, "grazing-sliding"),
        derived="so it is for crossing- and grazing-sliding; at switching-sliding F3 comes between "
        "F1 and the stick, which stays",
        verdict="refuted",
        proof=PROOF + ", on both sides of each change",
        consequence="Section 4 itself has the stick in F2 on both sides of the switching-sliding.",
        witness=partial(shown, chosen[1][1]),
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
    """The bifurcations of Section 4, and Section 5."""
    yield from _event_items(paper)
    yield from _conclusions(paper)
