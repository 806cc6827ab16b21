"""Section 4: the global maps, the panels of Fig. 7, and the eight bifurcations."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import partial

from capsule_sym._paper import Paper, Row, panels, section_4
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.switching import LocalMap
from capsule_sym._symbolic.paper.case_study import (
    OTHER,
    Itinerary,
    Maps,
    Point,
    cycle,
    from_rest,
    global_map,
    maps,
    point,
    steady_orbit,
)
from capsule_sym._symbolic.paper.compare import comparison, listed
from capsule_sym._symbolic.paper.tables import printed_maps
from capsule_sym._symbolic.proofs.items import AS_PRINTED, Item, Verdict
from capsule_sym._symbolic.proofs.reachability import ENTRY_PLANE

_LOCAL = re.compile(r"P_\{(Σ\d+),F(\d),(Σ\d+)\}")

Claim = tuple[tuple[Point, Maps], ...]


def maps_of(text: str) -> Maps:
    """The local maps of a printed global map in order of time; none for the identity of stick.

    Raises ValueError for what is no map.
    """
    if text == "Id_{Σ2,F2,Σ2}":
        return ()

    def read(part: str) -> LocalMap:
        match = _LOCAL.fullmatch(part)
        if not match:
            raise ValueError(f"{part} is no local map")
        return LocalMap(match[1], int(match[2]), match[3])

    return tuple(map(read, text.split(" ∘ ")[::-1]))


def row_at(paper: Paper, alpha: str) -> Row:
    """The printed row of an amplitude: the one for that value alone, if there is one."""
    rows = section_4(paper)
    value = Fraction(alpha)
    for row in rows:
        if value < Fraction(row.high) or (row.closed and value == Fraction(row.high)):
            return row
    raise ValueError(alpha)


def moves(claim: Claim) -> bool:
    """Whether at each point an attracting periodic motion has the given global map."""
    return all(cycle(maps(steady_orbit(at).fields)) == cycle(expected) for at, expected in claim)


def moves_unlike(claim: tuple[Point, Maps, Maps]) -> bool:
    """Whether an attracting periodic motion has the first global map, and not the second."""
    at, exact, printed = claim
    return moves(((at, exact),)) and cycle(exact) != cycle(printed)


PROOF = (
    "the orbit is enclosed by Krawczyk's method in ball arithmetic, every guard proved positive "
    "along every segment, and its multipliers inside the unit circle"
)


def shown(at: Point) -> dict[str, str]:
    """The numbers of the proof at a point."""
    state = ", ".join(f"{float(x):.6f}" for x in steady_orbit(at).state)
    return {
        **dict(at.numbers),
        "attracting periodic motion": f"through (x_r, v_r, v_c) = ({state}) at omega tau = 0",
    }


_PANELS: dict[str, Itinerary] = {
    **{"a": (2, 5), "b": (5, 2), "c": (5, 2), "d": (5, 4, 5, 2), "e": (5, 4, 5, 2)},
    **{"f": (5, 4, 1, 2), "g": (5, 4, 1, 2), "h": (5, 4, 1, 2, 3, 2)},
    **{"i": (5, 4, 1, 2, 3, 6), "j": (5, 4, 1, 2, 3, 6), "k": (4, 1, 3, 6), "l": (4, 1, 3, 6)},
    **{"m": (4, 1, 3, 6), "n": (4, 1, 3, 6), "o": (4, 1, 3, 6), "p": (4, 1, 3, 6)},
}
"""The motions of Fig. 7 at the printed mass ratio."""
_AS_PRINTED = "bcdfghjp"
_OTHER_PANELS: dict[str, Itinerary] = {"l": (4, 1, 2, 3, 6), "n": (4, 1, 3, 2, 3, 6)}
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
            moves if same else moves_unlike,
            ((at, maps((2,))),) if same else (at, exact, exact),
            derived=AS_PRINTED if same else f"P = {global_map(exact)}",
            verdict=verdict,
            proof=PROOF,
            consequence="" if same else _WHY.get(name, _AT_VALUE),
            witness=partial(shown, at),
        )
    for name, itinerary in _OTHER_PANELS.items():
        at = point(paper, entry[name], OTHER)
        row = maps_of(row_at(paper, entry[name]).map)
        yield comparison(
            entry,
            f"section.4.panel.{name}.other",
            f"at {at} the attracting motion has the map {global_map(maps(itinerary))}",
            f"Fig. 7({name}), α = {entry[name]}: P = {global_map(row)}",
            ((at, row),),
            moves,
            ((at, maps(_PANELS[name])),),
            derived=f"so it is at γ = {OTHER}",
            verdict="conditional",
            proof=PROOF,
            witness=partial(shown, at),
        )
    yield from _rest_items(paper)


def _tends(claim: tuple[tuple[str, ...], Point, Maps]) -> bool:
    """Whether the motion from a start, which is rest, tends to one with the global map."""
    start, at, expected = claim
    return set(map(Fraction, start)) == {0} and cycle(maps(from_rest(at))) == cycle(expected)


def _rest_items(paper: Paper) -> Iterator[Item]:
    start = tuple(paper["section.4.parameters"]["start"])
    chosen = [(name, None, _PANELS[name]) for name in _FROM_REST]
    for name, gamma, itinerary in [*chosen, *((n, OTHER, w) for n, w in _OTHER_PANELS.items())]:
        at = point(paper, paper["figure.7"][name], gamma)
        yield comparison(
            paper["section.4.parameters"],
            f"section.4.rest.{name}" + (".other" if gamma else ""),
            f"at {at} the motion from rest tends to one with the map {global_map(maps(itinerary))}",
            f"Fig. 7({name}) shows the motion that is reached from ({listed(start)})",
            (start, at, maps(itinerary)),
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


def _field_after(plane: str) -> int:
    entered = {entry: field for field, entry in ENTRY_PLANE.items()}
    return entered.get(plane) or int(plane[1:])


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


def items(paper: Paper) -> Iterator[Item]:
    """The rows of Section 4 and the panels of Fig. 7."""
    yield from _rows(paper)
    yield from _panel_items(paper)
