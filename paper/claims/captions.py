"""Checks of the captions of Figs. 7 to 9, and of references to figures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import sympy as sp

from capsule_sym._symbolic.model.geometry import PIECES, empty
from capsule_sym._symbolic.model.symbols import delta, v_r
from capsule_sym._symbolic.proofs.relations import Texts, scope
from capsule_sym._symbolic.proofs.rows import EACH, FACTS, FILTERS, WITNESSES, Context, checker
from paper.claims.case_study import Point, maps, point, steady_orbit
from paper.claims.motions import number_of, printed_gamma, sides_at
from paper.printed import Event, panels

Place = tuple[Point, str, int, int]
"""A point, a line, and the fields of the segment before and of the segment that begins there."""


@checker
def names_event(alpha: str, kind: str, line: str, printed: Sequence[Event]) -> bool:
    """Check that a caption names an event of Section 4 by its value, type and line."""
    return any((e.alpha, e.type, e.line[:2]) == (alpha, kind, line[:2]) for e in printed)


@checker
def coloured(printed: str, field: int, colours: Sequence[str]) -> bool:
    """Check that a colour is that of a field, with one colour for each field."""
    return len(set(colours)) == 6 and colours[field - 1] == printed


@checker
def does(at: Point, field: int, printed: str) -> bool:
    """Check that the motion at a point has a field, lacks it, or ends it on a surface."""
    local_maps = maps(steady_orbit(at).fields)
    if printed.startswith("S"):
        return [m.target for m in local_maps if m.field == field] == [f"Σ{printed[1:]}"]
    has = any(m.field == int(printed[-1]) for m in local_maps)
    return has == printed.startswith("F")


def _begins(segments: Place) -> list[int]:
    """Segments of the motion that begin on a line between two given fields."""
    at, _, before, after = segments
    fields = steady_orbit(at).fields
    return [i for i, field in enumerate(fields) if (fields[i - 1], field) == (before, after)]


@checker
def begins_on(places: Sequence[Place], printed: str) -> bool:
    """Check that the segments begin on the named part of a line, as derived."""
    numbers = {
        number_of(one[1], steady_orbit(one[0]), place, one[0])
        for one in places
        for place in (_begins(one) or [0])
    }
    return all(map(_begins, places)) and {f"{places[0][1]}^({n})" for n in numbers} == {printed}


@checker
def outside(places: Sequence[Place], printed: Texts, part: str) -> bool:
    """Check that the segments begin on a derived part, at no v_r of the printed interval."""
    for one in places:
        for place in _begins(one):
            for speed in steady_orbit(one[0]).speeds[place]:
                where = {v_r: sp.Rational(speed), **one[0].values}
                if all(bool(r.subs(where)) for r in scope(printed)):
                    return False
    return begins_on(places, part)


@checker
def refers(figure: str, alpha: str, captions: Mapping[str, str]) -> bool:
    """Check that a figure has a panel, and its caption the amplitude if there is one."""
    return captions.get(figure) in ("", alpha)


@checker
def borders(printed: Sequence[str]) -> bool:
    """Check that these are the lines on P1 = 0, P2 = delta for delta < f_b."""
    plane, narrow = sp.Eq(PIECES["L5"].relations[1].lhs, delta), scope(["zeta > 0", "δ < f_b"])
    lines = {
        name
        for name, piece in PIECES.items()
        if name[0] == "L" and name != "L9" and plane in piece.relations
        if not empty(piece, narrow)
    }
    return len(printed) == len(set(printed)) and set(printed) == lines


def _speeds(places: Sequence[Place]) -> dict[str, str]:
    found = {}
    for one in places:
        for place in _begins(one):
            low, high = steady_orbit(one[0]).speeds[place]
            found[f"v_r at {one[0]}"] = f"{float((low + high) / 2):.4f}"
    return found


def _places(context: Context) -> tuple[Place, ...]:
    """Places where a caption's segment begins: at its amplitudes, beside a bifurcation, or both."""
    paper, entry = context["paper"], context["e"]
    found = []
    if context["near"]:
        alphas = [entry["alpha"], *(alpha for alpha, _ in entry["beside"])]
        found = [point(paper, alpha) for alpha in alphas]
    if "event" in context:
        sides = sides_at(paper, printed_gamma(paper))[context["event"] - 1]
        found.append(sides[context["above"]])
    before, after = context["turns"]
    return tuple((at, context["line"], before, after) for at in found)


def _captions(context: Context) -> dict[str, str]:
    """Amplitude of each panel by figure; empty for a figure without panels."""
    paper = context["paper"]
    own = [paper[f"figure.{name}"] for name in ("8.a", "8.c", "9.a", "9.b", "9.c", "9.d")]
    return {
        **{f"6({name})": "" for name in paper["figure.6"]["panels"]},
        **{f"7({name})": alpha for name, alpha in panels(paper).items()},
        **{f"{e.id[7]}({e.id[9]})": e["alpha"] for e in own},
    }


def _each_beside(context: Context) -> Iterator[dict[str, Any]]:
    for number, (alpha, told) in enumerate(context["e"]["beside"], start=1):
        yield {"key": f"{context['e'].id}.{number}", "number": number, "alpha": alpha, "told": told}


def _told(context: Context) -> str:
    told = context["told"]
    field = context["e"]["field"]
    return f"F{field} ends on {told}" if told.startswith("S") else f"there is {told}"


EACH["beside"] = _each_beside
FACTS |= {
    "at_first": lambda context: point(context["paper"], context["e"]["beside"][0][0]),
    "first_told": lambda context: _told(Context(e=context["e"], told=context["e"]["beside"][0][1])),
    "reference": lambda context: context["e"]["rows"][context["row"]],
    "captions": _captions,
    "colours": lambda context: tuple(context["paper"]["figure.7.colours"]["fields"]),
    "is_told": _told,
    "places": _places,
}
FILTERS |= {
    "other_told": lambda told: (
        told[3:] if told.startswith("no") else f"no {told}" if told[0] == "F" else "S1"
    ),
    "points": lambda places: ", ".join(str(one[0]) for one in places),
    "first_part": lambda name: f"{name[:4]}1)",
}
WITNESSES |= {
    "speeds": _speeds,
    "panel": lambda row: {f"Fig. {row['figure']}": f"alpha = {row['captions'][row['figure']]}"},
}
