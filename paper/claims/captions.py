"""Claims of the captions of Figs. 7 to 9, and of references to figures, with their checks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import sympy as sp

from capsule_sym._symbolic.theory import PIECES, Statement, delta, empty, v_r
from paper.claims.beside import beside, next_field
from paper.claims.case_study import Point, maps, point, steady_orbit
from paper.claims.motions import number_of, printed_gamma, shown, sides_at
from paper.claims.relations import Texts, listed, scope
from paper.derived.parts import part
from paper.printed import Event, Paper, events, panels

Place = tuple[Point, str, int, int]
"""A point, a line, and the fields of the segment before and of the segment that begins there."""


def names_event(alpha: str, kind: str, line: str, printed: Sequence[Event]) -> bool:
    """Check that a caption names an event of Section 4 by its value, type and line."""
    return any((e.alpha, e.type, e.line[:2]) == (alpha, kind, line[:2]) for e in printed)


def coloured(printed: str, field: int, colours: Sequence[str]) -> bool:
    """Check that a colour is that of a field, with one colour for each field."""
    return len(set(colours)) == 6 and colours[field - 1] == printed


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


def begins_on(places: Sequence[Place], printed: str) -> bool:
    """Check that the segments begin on the named part of a line, as derived."""
    numbers = {
        number_of(one[1], steady_orbit(one[0]), place, one[0])
        for one in places
        for place in (_begins(one) or [0])
    }
    return all(map(_begins, places)) and {f"{places[0][1]}^({n})" for n in numbers} == {printed}


def outside(places: Sequence[Place], printed: Texts, part: str) -> bool:
    """Check that the segments begin on a derived part, at no v_r of the printed interval."""
    for one in places:
        for place in _begins(one):
            for speed in steady_orbit(one[0]).speeds[place]:
                where = {v_r: sp.Rational(speed), **one[0].values}
                if all(bool(r.subs(where)) for r in scope(printed)):
                    return False
    return begins_on(places, part)


def refers(figure: str, alpha: str, captions: Mapping[str, str]) -> bool:
    """Check that a figure has a panel, and its caption the amplitude if there is one."""
    return captions.get(figure) in ("", alpha)


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


def amplitudes(paper: Paper) -> dict[str, str]:
    """Amplitude of each panel by figure; empty for a figure without panels."""
    own = [paper[name] for name in _CAPTIONS]
    return {
        **{f"6({name})": "" for name in paper["figure.6"]["panels"]},
        **{f"7({name})": alpha for name, alpha in panels(paper).items()},
        **{f"{e.id[7]}({e.id[9]})": e["alpha"] for e in own},
    }


_CAPTIONS = ("figure.8.a", "figure.8.c", "figure.9.a", "figure.9.b", "figure.9.c", "figure.9.d")
_OTHERWISE = {
    "figure.9.c": (
        "S3",
        "F1 leads to S3 already: switching-sliding is at 1.5218... there",
    ),
    "figure.9.d": ("no F2", "the stick in F2 is gone already: the graze is at 1.5513..."),
}
"""Motion at the first amplitude beside the event, where it is not the printed one."""


def captions(paper: Paper) -> Iterator[Statement]:
    """The captions of Figs. 8 and 9: the event, the colour, and the motions beside the event."""
    for name in _CAPTIONS:
        entry = paper[name]
        alpha, kind, line = (entry[key] for key in ("alpha", "event", "meets"))
        yield beside(
            entry,
            f"{name}.event",
            names_event,
            {"alpha": alpha, "kind": kind, "line": line, "printed": events(paper)},
            {"alpha": "1"},
            says=f"the caption names a bifurcation of Section 4: {kind} on {line} at α = {alpha}",
            printed=f"{kind} on {line} at α = {alpha}",
            proof="the printed numbers are compared; for the bifurcation itself see "
            "section.4.event",
        )
    colours = tuple(paper["figure.7.colours"]["fields"])
    for name in _CAPTIONS:
        entry = paper[name]
        colour, field = entry["colour"], entry["field"]
        yield beside(
            entry,
            f"{name}.colour",
            coloured,
            {"printed": colour, "field": field, "colours": colours},
            {"field": next_field(field)},
            says=f"the {colour} segment is F{field}, as in the caption of Fig. 7",
            printed=f"the {colour} segment of F{field}",
            proof="the printed names are compared",
        )
    for name in _CAPTIONS:
        for number, (alpha, feature) in enumerate(paper[name]["beside"], start=1):
            if number > 1 or name not in _OTHERWISE:
                yield _does(paper, name, number, alpha, feature)
    for name, (instead, why) in _OTHERWISE.items():
        alpha, feature = paper[name]["beside"][0]
        at = point(paper, alpha)
        yield _does(
            paper,
            name,
            1,
            alpha,
            feature,
            says=f"at {at}: {why}",
            derived=f"{at}: {why}",
            verdict="refuted",
            correction={"printed": instead},
            consequence="section.4.panel: another mass ratio, 3.0, gives the printed motion.",
        )


def _does(
    paper: Paper, name: str, number: int, alpha: str, feature: str, says: str = "", **texts: Any
) -> Statement:
    """Statement about the motion at an amplitude beside the event of a caption."""
    entry, at = paper[name], point(paper, alpha)
    field = entry["field"]
    text = f"F{field} ends on {feature}" if feature.startswith("S") else f"there is {feature}"
    instead = texts.get("correction", {"printed": feature})["printed"]
    if instead.startswith("no"):
        other = instead[3:]
    else:
        other = f"no {instead}" if instead[0] == "F" else "S1"
    return beside(
        entry,
        f"{name}.beside.{number}",
        does,
        {"at": at, "field": field, "printed": feature},
        {"printed": other},
        says=says or f"at {at}: {text}",
        printed=f"{at}: {text}",
        proof="the periodic motion there is enclosed (section.4.panel)",
        witness=partial(shown, at),
        **texts,
    )


def parts_of_lines(paper: Paper) -> Iterator[Statement]:
    """The captions of Figs. 8 and 9: the part of a line on which the segment begins."""
    sides = sides_at(paper, printed_gamma(paper))

    def near(name: str) -> list[Point]:
        """The amplitudes of a caption."""
        entry = paper[name]
        return [point(paper, a) for a in (entry["alpha"], *(a for a, _ in entry["beside"]))]

    for name, key, line, turn, points, instead in (
        ("figure.8.a", "leaves", "L3", (5, 4), near("figure.8.a"), ""),
        ("figure.9.a", "meets", "L2", (2, 3), [sides[3][1]], ""),
        ("figure.9.b", "meets", "L3", (5, 4), [sides[5][0]], ""),
        ("figure.9.d", "meets", "L2", (2, 3), [sides[7][0]], ""),
        ("figure.8.c", "leaves", "L2", (2, 3), [*near("figure.8.c"), sides[4][0]], "L2^(2)"),
        ("figure.9.c", "meets", "L2", (1, 3), [sides[6][1]], "L2^(3)"),
    ):
        entry = paper[name]
        text, field = entry[key], entry["field"]
        places = tuple((one, line, *turn) for one in points)
        at, verb = ", ".join(map(str, points)), "begins" if key == "leaves" else "meets the line"
        where = "" if key == "leaves" else " beside the bifurcation"
        texts: dict[str, Any] = {}
        if instead:
            texts = {
                "correction": {"printed": instead},
                "derived": f"on the derived {instead}",
                "verdict": "refuted",
                "consequence": "It follows from the printed Eq. (23): by its intervals, too high "
                "by 4 zeta f_b, the caption would be right.",
            }
        yield beside(
            entry,
            f"{name}.part",
            begins_on,
            {"places": places, "printed": text},
            {"printed": f"{(instead or text)[:4]}1)"},
            says=f"at {at}: F{field} {verb} on the derived {instead or text}",
            printed=f"F{field} {verb} on {text}",
            proof=f"v_r where the segment begins, in the enclosed motion{where}, against the "
            "bounds of Appendix B as derived",
            witness=partial(_speeds, places),
            **texts,
        )
    entry = paper["appendix.B.L2"]
    places = ((sides[3][1], "L2", 2, 3),)
    within = part("L2^(2)").within
    yield beside(
        entry,
        "figure.9.a.interval",
        outside,
        {"places": places, "printed": entry["L2^(2)"], "part": "L2^(2)"},
        {"printed": within},
        says="beside the adding-sliding of Fig. 9(a) stick meets L2 where the printed Eq. (23) "
        "does not vanish for any time, and the derived one does",
        printed=f"the stick of Fig. 9(a) is tangent to L2^(2): {' and '.join(entry['L2^(2)'])}",
        derived=f"v_r there is outside this interval, and within {' and '.join(map(str, within))}",
        verdict="refuted",
        proof="v_r where backward drift begins, in the enclosed motion beside the bifurcation",
        consequence="The figure confirms the erratum on Eq. (23), apart from its derivation.",
        witness=partial(_speeds, places),
    )


_MEANT = {
    1: ("7(c)", ""),
    2: ("7(c)", ", or 7(d), α = 0.4, where forward drift is seen"),
    3: ("7(o)", ""),
}
"""Panels that are meant by references to panels of Fig. 6."""


def references(paper: Paper) -> Iterator[Statement]:
    """References to figures in Section 4, and the lines of Fig. 7."""
    entry, shown_at = paper["section.4.references"], amplitudes(paper)
    rows = list(enumerate(entry["rows"], start=1))
    for number, (figure, alpha) in rows[len(_MEANT) :]:
        yield beside(
            entry,
            f"section.4.reference.{number}",
            refers,
            {"figure": figure, "alpha": alpha, "captions": shown_at},
            {"figure": "7(b)"},
            says=f"Fig. {figure} shows α = {alpha}",
            proof="the captions",
        )
    for number, (figure, alpha) in rows[: len(_MEANT)]:
        meant, more = _MEANT[number]
        yield beside(
            entry,
            f"section.4.reference.{number}",
            refers,
            {"figure": figure, "alpha": alpha, "captions": shown_at},
            {"figure": "7(b)"},
            correction={"figure": meant},
            says=f"Fig. {figure} is Fig. {meant}{more}: Fig. 6 has no panels",
            printed=f"Fig. {figure} shows α = {alpha}",
            derived=f"Fig. {meant}{more}; Fig. 6 is one picture",
            verdict="refuted",
            proof="the captions",
            consequence="Fig. 7 has a panel of that letter.",
            witness=lambda meant=meant: {f"Fig. {meant}": f"alpha = {shown_at[meant]}"},
        )
    lines = paper["figure.7.boundaries"]["lines"]
    yield beside(
        paper["figure.7.boundaries"],
        "figure.7.boundaries",
        borders,
        {"printed": lines},
        {"printed": lines[1:]},
        says=f"the lines on P1 = 0, P2 = delta are {listed(lines)}",
        printed=f"the non-smooth boundaries {listed(lines)}",
        proof="those with P1 = 0 and P2 = delta that exist for delta < f_b",
    )


STATEMENTS = (captions, parts_of_lines, references)
