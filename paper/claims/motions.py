"""Checks of Sections 4 and 5: proved motions and bifurcations compared with the printed ones."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fractions import Fraction

import sympy as sp

from capsule_sym._symbolic.theory import SEGMENTS, alpha, v_r
from paper.claims.case_study import (
    BRACKETS,
    Bracket,
    Maps,
    Point,
    cycle,
    first_fields,
    from_rest,
    maps,
    point,
    steady_orbit,
)
from paper.claims.changes import Change, change, common
from paper.claims.formula import formula
from paper.derived.inner_products import FIELDS
from paper.derived.local_maps import LocalMap
from paper.derived.parts import PARTS
from paper.derived.reachability import ENTRY_PLANE
from paper.printed import Event, Paper, Row
from paper.proofs.steady import SteadyOrbit

Sides = tuple[Point, Point, Bracket]
"""Two points with different motions that enclose a bifurcation."""

_LOCAL = re.compile(r"P_\{(Σ\d+),F(\d),(Σ\d+)\}")
_DRIFT = {"forward": 1, "backward": -1}


def maps_of(text: str) -> Maps:
    """Local maps of a printed global map in order of time; none for the identity of stick.

    Raises ValueError for a text that is not a map.
    """
    if text == "Id_{Σ2,F2,Σ2}":
        return ()

    def read(part: str) -> LocalMap:
        match = _LOCAL.fullmatch(part)
        if not match:
            raise ValueError(f"{part} is no local map")
        return LocalMap(match[1], int(match[2]), match[3])

    return tuple(map(read, text.split(" ∘ ")[::-1]))


def below(at: Point, bound: str) -> bool:
    """Check that the amplitude of a point is below a printed bound there."""
    return bool(formula(bound).subs(at.values) > at.values[alpha])


def chain(printed: Maps, table: Sequence[LocalMap], corner: bool) -> bool:
    """Check that a global map is a cycle of local maps, all printed (or at a corner, not)."""
    entered = {entry: field for field, entry in ENTRY_PLANE.items()}
    chained = all(
        one.target == printed[(i + 1) % len(printed)].source for i, one in enumerate(printed)
    )
    begun = all(one.field == (entered.get(one.source) or int(one.source[1:])) for one in printed)
    return chained and begun and (corner or set(printed) <= set(table))


def adjoins(row: Row, before: str, panel: str) -> bool:
    """Check that a row begins where the last one ends, and contains a panel's amplitude."""
    low, high = Fraction(row.low or before), Fraction(row.high)
    value = Fraction(panel)
    here = low < value <= high if low < high else value == high
    return Fraction(before) == low and here and (row.closed or value < high)


def moves(at: Point, expected: Maps) -> bool:
    """Check that at a point an attracting periodic motion has the given global map."""
    return cycle(maps(steady_orbit(at).fields)) == cycle(expected)


def tends(start: Sequence[str], at: Point, expected: Maps) -> bool:
    """Check that the motion from a start, which is rest, tends to one with the global map."""
    return set(map(Fraction, start)) == {0} and cycle(maps(from_rest(at))) == cycle(expected)


def impact_without(at: Mapping[str, str], drift: str) -> bool:
    """Check that from rest the first impact precedes any drift of a kind."""
    fields = first_fields(Point(tuple(at.items())))
    impact = next(i for i, field in enumerate(fields) if SEGMENTS[field - 1].contact)
    return not any(SEGMENTS[field - 1].drift == _DRIFT[drift] for field in fields[:impact])


def changed(sides: Sides) -> Change | None:
    """Bifurcation between two points, after a proof that their motions are the claimed ones."""
    below, above, bracket = sides
    if moves(below, maps(bracket.first)) and moves(above, maps(bracket.second)):
        return change(bracket.first, bracket.second)
    return None


def number_of(line: str, motion: SteadyOrbit, place: int, at: Point) -> int:
    """Number of the part of a line on which a segment begins, from its relative velocity."""
    speeds = motion.speeds[place]
    for part in PARTS:
        if part.line == line and all(
            bool(r.subs({v_r: sp.Rational(speed), **at.values}))
            for r in part.within
            for speed in speeds
        ):
            return part.number
    raise ValueError((line, speeds))


def _line_parts(line: str, at: Point) -> set[str]:
    """Parts of a line on which segments begin."""
    motion = steady_orbit(at)
    drift, stick, _ = FIELDS[line]
    return {
        f"{line}^({number_of(line, motion, i, at)})"
        for i, field in enumerate(motion.fields)
        if field == drift and motion.fields[i - 1] == stick
    }


def bifurcates(sides: Sides, kind: str, line: str) -> bool:
    """Check that between two points lies a bifurcation of the printed type, on the printed line."""
    found = changed(sides)
    if found is None or (found.type, found.line) != (kind, line[:2]):
        return False
    return "^" not in line or _line_parts(line[:2], sides[1]) == {line}


def rounds(sides: Sides, printed: str) -> bool:
    """Check that every number between two points with a bifurcation rounds to the printed value."""
    return _rounding(sides, printed) == 1 and changed(sides) is not None


def off(sides: Sides, printed: str) -> bool:
    """Check that no number between two points with a bifurcation rounds to the printed value."""
    return _rounding(sides, printed) == -1 and changed(sides) is not None


def _rounding(sides: Sides, printed: str) -> int:
    """1 if all numbers between two points round to a decimal, -1 if none does, 0 if some do."""
    half = Fraction(1, 2 * 10 ** len(printed.partition(".")[2]))
    low, high = Fraction(printed) - half, Fraction(printed) + half
    first, last = (Fraction(at["alpha"]) for at in sides[:2])
    return (low <= first and last <= high) - (last < low or high < first)


def near(sides: Sides, kind: str, line: str, alpha: str) -> bool:
    """Check that a bifurcation of the printed type lies within 1 % in alpha."""
    value, found = Fraction(alpha), changed(sides)
    close = all(abs(Fraction(at["alpha"]) - value) < value / 100 for at in sides[:2])
    return close and found is not None and (found.type, found.line) == (kind, line[:2])


def crossing_map(sides: Sides, printed: Maps) -> bool:
    """Check that the global map at a crossing is that of both sides without the replaced field."""
    itinerary = common(sides[2].first, sides[2].second)
    return changed(sides) is not None and cycle(maps(itinerary)) == cycle(printed)


def ordered(sides: Sequence[Sides], order: bool) -> bool:
    """Check that bifurcations are in the printed order of alpha, or are not, as claimed."""
    values = [Fraction(one[0]["alpha"]) for one in sides]
    return all(map(changed, sides)) and (values == sorted(values)) == order


def types(sides: Sequence[Sides], printed: Sequence[str]) -> bool:
    """Check the order of the types of bifurcation for growing alpha, each at its first place."""
    found = [one.type for one in map(changed, sides) if one]
    return tuple(dict.fromkeys(found)) == tuple(printed) and len(found) == len(sides)


def rests(sides: Sides, below: str, event: Event, impacts: int | None = None) -> bool:
    """Check that below a printed bifurcation value the motion has stick fields only.

    With `impacts`, check that contact begins so often in a period, which is the motion's own.
    """
    fields = [SEGMENTS[field - 1] for field in sides[2].first]
    begun = sum(one.contact > fields[i - 1].contact for i, one in enumerate(fields))
    stick = all(one.stick for one in fields) and impacts in (None, begun)
    return stick and changed(sides) is not None and event.alpha == below


def stick_vanishes(sides: Sequence[Sides], printed: Sequence[str], but: str) -> bool:
    """Check that stick vanishes at the printed types of bifurcation except for a printed one."""
    found = {one.type: SEGMENTS[one.field - 1].stick for one in map(changed, sides) if one}
    return all(found.get(kind) == (kind != but) for kind in printed) and but in printed


def drift_begins(sides: Sides, event: Event, printed: Sequence[str]) -> bool:
    """Check that at an adding-sliding of Section 4 drift in the printed direction is inserted."""
    alpha, line, way = printed
    found = changed(sides)
    return (
        found is not None
        and SEGMENTS[found.field - 1].drift == _DRIFT[way]
        and (event.alpha, event.line) == (alpha, line)
        and found.type == event.type == "adding-sliding"
    )


def shown(at: Point) -> dict[str, str]:
    """Numbers of the proof at a point."""
    state = ", ".join(f"{float(x):.6f}" for x in steady_orbit(at).state)
    return {
        **dict(at.numbers),
        "attracting periodic motion": f"through (x_r, v_r, v_c) = ({state}) at omega tau = 0",
    }


def printed_gamma(paper: Paper) -> str:
    """The mass ratio of Section 4."""
    return str(paper["section.4.parameters"]["gamma"])


def sides_at(paper: Paper, gamma: str) -> tuple[Sides, ...]:
    """Bifurcations of Section 4 at a mass ratio, each between two points."""
    return tuple(
        (point(paper, one.below, gamma), point(paper, one.above, gamma), one)
        for one in BRACKETS[gamma]
    )
