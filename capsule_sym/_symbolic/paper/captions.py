"""Captions of Figs. 7, 8 and 9, and the references to figures, at the printed mass ratio."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import sympy as sp

from capsule_sym._paper import Entry, Event, Paper, events
from capsule_sym._symbolic.model.geometry import PIECES, empty
from capsule_sym._symbolic.model.symbols import delta, f_b, v_r, zeta
from capsule_sym._symbolic.paper.bifurcations import number_of
from capsule_sym._symbolic.paper.case_study import BRACKETS, Point, maps, point, steady_orbit
from capsule_sym._symbolic.paper.compare import comparison, listed
from capsule_sym._symbolic.paper.formula import relations
from capsule_sym._symbolic.paper.motions import shown
from capsule_sym._symbolic.proofs.appendices import PARTS
from capsule_sym._symbolic.proofs.items import AS_PRINTED, Item

_CAPTIONS = ("figure.8.a", "figure.8.c", "figure.9.a", "figure.9.b", "figure.9.c", "figure.9.d")


def _told(claim: tuple[str, str, str, tuple[Event, ...]]) -> bool:
    """Whether a caption names an event of Section 4: its value, type and line."""
    alpha, kind, line, printed = claim
    return any((e.alpha, e.type, e.line[:2]) == (alpha, kind, line[:2]) for e in printed)


def _same_event(entry: Entry, paper: Paper) -> Item:
    printed = events(paper)
    text = f"{entry['event']} on {entry['meets']} at α = {entry['alpha']}"
    return comparison(
        entry,
        f"{entry.id}.event",
        f"the caption names a bifurcation of Section 4: {text}",
        text,
        (entry["alpha"], entry["event"], entry["meets"], printed),
        _told,
        ("1", entry["event"], entry["meets"], printed),
        proof="the printed numbers are compared; for the bifurcation itself see section.4.event",
    )


def _coloured(claim: tuple[str, int, tuple[str, ...]]) -> bool:
    colour, field, colours = claim
    return len(set(colours)) == 6 and colours[field - 1] == colour


def _colour(entry: Entry, paper: Paper) -> Item:
    colours = tuple(paper["figure.7.colours"]["fields"])
    colour, field = entry["colour"], entry["field"]
    return comparison(
        entry,
        f"{entry.id}.colour",
        f"the {colour} segment is F{field}, as in the caption of Fig. 7",
        f"the {colour} segment of F{field}",
        (colour, field, colours),
        _coloured,
        (colour, field % 6 + 1, colours),
        proof="the printed names are compared",
    )


def _does(claim: tuple[Point, int, str]) -> bool:
    """Whether the motion at a point has a field, has it not, or ends it on a surface."""
    at, field, told = claim
    local_maps = maps(steady_orbit(at).fields)
    if told.startswith("S"):
        return [m.target for m in local_maps if m.field == field] == [f"Σ{told[1:]}"]
    has = any(m.field == int(told[-1]) for m in local_maps)
    return has == told.startswith("F")


def _does_not(claim: tuple[Point, int, str, str]) -> bool:
    at, field, told, instead = claim
    return _does((at, field, instead)) and not _does((at, field, told))


_INSTEAD = {
    ("figure.9.c", 0): ("S3", "F1 leads to S3 already: switching-sliding is at 1.5218... there"),
    ("figure.9.d", 0): ("no F2", "the stick in F2 is gone already: the graze is at 1.5513..."),
}
_SURE = "section.4.panel: another mass ratio, 3.0, gives the printed motion."


def _beside(entry: Entry, paper: Paper) -> Iterator[Item]:
    for number, (alpha, told) in enumerate(entry["beside"]):
        at, field = point(paper, alpha), entry["field"]
        text = f"F{field} ends on {told}" if told.startswith("S") else f"there is {told}"
        other = told[3:] if told.startswith("no") else f"no {told}" if told[0] == "F" else "S1"
        name = f"{entry.id}.beside.{number + 1}"
        if (entry.id, number) in _INSTEAD:
            instead, why = _INSTEAD[entry.id, number]
            yield comparison(
                entry,
                name,
                f"at {at}: {why}",
                f"{at}: {text}",
                (at, field, told, instead),
                _does_not,
                (at, field, instead, instead),
                derived=f"{at}: {why}",
                verdict="refuted",
                proof="the periodic motion there is enclosed (section.4.panel)",
                consequence=_SURE,
                witness=partial(shown, at),
            )
            continue
        yield comparison(
            entry,
            name,
            f"at {at}: {text}",
            f"{at}: {text}",
            (at, field, told),
            _does,
            (at, field, other),
            proof="the periodic motion there is enclosed (section.4.panel)",
            witness=partial(shown, at),
        )


Place = tuple[Point, str, int, int]
"""A point, a line, and the fields of the segment before and of the segment that begins there."""


def _places(segments: Place) -> list[int]:
    at, _, before, after = segments
    fields = steady_orbit(at).fields
    return [i for i, field in enumerate(fields) if (fields[i - 1], field) == (before, after)]


def _on_part(claim: tuple[tuple[Place, ...], str]) -> bool:
    """Whether the segments begin on the named part of a line, as derived."""
    chosen, part = claim
    numbers = {
        number_of(segments[1], steady_orbit(segments[0]), place, segments[0])
        for segments in chosen
        for place in (_places(segments) or [0])
    }
    return all(map(_places, chosen)) and {f"{chosen[0][1]}^({n})" for n in numbers} == {part}


def _on_other(claim: tuple[tuple[Place, ...], str, str]) -> bool:
    chosen, printed, derived = claim
    return printed != derived and _on_part((chosen, derived))


def _speeds(chosen: tuple[Place, ...]) -> dict[str, str]:
    found = {}
    for segments in chosen:
        for place in _places(segments):
            low, high = steady_orbit(segments[0]).speeds[place]
            found[f"v_r at {segments[0]}"] = f"{float((low + high) / 2):.4f}"
    return found


def _parts(paper: Paper) -> Iterator[Item]:
    gamma = paper["section.4.parameters"]["gamma"]

    def at(alpha: str) -> Point:
        return point(paper, alpha)

    def beside(number: int, above: bool) -> Point:
        bracket = BRACKETS[gamma][number]
        return point(paper, bracket.above if above else bracket.below)

    a, c = paper["figure.8.a"], paper["figure.8.c"]
    near_a = [a["alpha"], *(alpha for alpha, _ in a["beside"])]
    near_c = [c["alpha"], *(alpha for alpha, _ in c["beside"])]
    told: tuple[tuple[str, str, tuple[Place, ...], str], ...] = (
        ("figure.8.a", "leaves", tuple((at(x), "L3", 5, 4) for x in near_a), "L3^(3)"),
        (
            "figure.8.c",
            "leaves",
            tuple((one, "L2", 2, 3) for one in (*map(at, near_c), beside(4, False))),
            "L2^(2)",
        ),
        ("figure.9.a", "meets", ((beside(3, True), "L2", 2, 3),), "L2^(2)"),
        ("figure.9.b", "meets", ((beside(5, False), "L3", 5, 4),), "L3^(3)"),
        ("figure.9.c", "meets", ((beside(6, True), "L2", 1, 3),), "L2^(3)"),
        ("figure.9.d", "meets", ((beside(7, False), "L2", 2, 3),), "L2^(2)"),
    )
    for name, key, chosen, derived in told:
        entry = paper[name]
        printed = entry[key]
        verb = "begins" if key == "leaves" else "meets the line"
        where = ", ".join(str(segments[0]) for segments in chosen)
        wrong = name in ("figure.8.c", "figure.9.c")
        text = f"F{entry['field']} {verb} on {printed}"
        yield comparison(
            entry,
            f"{name}.part",
            f"at {where}: F{entry['field']} {verb} on the derived {derived}",
            text,
            (chosen, printed, derived) if wrong else (chosen, printed),
            _on_other if wrong else _on_part,
            (chosen, derived, derived) if wrong else (chosen, f"{derived[:4]}1)"),
            derived=f"on the derived {derived}" if wrong else AS_PRINTED,
            verdict="refuted" if wrong else "proved",
            proof="v_r where the segment begins, in the enclosed motion"
            + ("" if key == "leaves" else " beside the bifurcation")
            + ", against the bounds of Appendix B as derived",
            consequence="It follows from the printed Eq. (23): by its intervals, too high by "
            "4 zeta f_b, the caption would be right."
            if wrong
            else "",
            witness=partial(_speeds, chosen),
        )
    yield _against_23(paper, told[2][2])


def _outside(claim: tuple[tuple[Place, ...], tuple[str, ...]]) -> bool:
    """Whether the segments begin on the derived L2^(2), at no v_r of a printed interval."""
    chosen, texts = claim
    for segments in chosen:
        for place in _places(segments):
            for speed in steady_orbit(segments[0]).speeds[place]:
                where = {v_r: sp.Rational(speed), **segments[0].values}
                if all(bool(r.subs(where)) for r in relations(texts)):
                    return False
    return _on_part((chosen, "L2^(2)"))


def _against_23(paper: Paper, chosen: tuple[Place, ...]) -> Item:
    entry = paper["appendix.B.L2"]
    texts = tuple(entry["L2^(2)"])
    derived = tuple(str(r) for one in PARTS if one.name == "L2^(2)" for r in one.within)
    return comparison(
        entry,
        "figure.9.a.interval",
        "beside the adding-sliding of Fig. 9(a) stick meets L2 where the printed Eq. (23) does not "
        "vanish for any time, and the derived one does",
        f"the stick of Fig. 9(a) is tangent to L2^(2): {' and '.join(texts)}",
        (chosen, texts),
        _outside,
        (chosen, derived),
        derived=f"v_r there is outside this interval, and within {' and '.join(derived)}",
        verdict="refuted",
        proof="v_r where backward drift begins, in the enclosed motion beside the bifurcation",
        consequence="The figure confirms the erratum on Eq. (23), apart from its derivation.",
        witness=partial(_speeds, chosen),
    )


def _refers(claim: tuple[str, str, dict[str, str]]) -> bool:
    figure, alpha, panels = claim
    return panels.get(figure) == alpha


def _refers_elsewhere(claim: tuple[str, str, dict[str, str], str]) -> bool:
    figure, alpha, panels, meant = claim
    return figure not in panels and panels.get(meant) == alpha


_MEANT = {"6(c)": "7(c)", "6(o)": "7(o)"}


def _panel(figure: str, panels: dict[str, str]) -> dict[str, str]:
    return {f"Fig. {figure}": f"alpha = {panels[figure]}"}


def _references(paper: Paper) -> Iterator[Item]:
    entry = paper["section.4.references"]
    letters = paper["figure.7"].printed
    panels = {
        **{f"6({name})": "" for name in paper["figure.6"]["panels"]},
        **{f"7({name})": alpha for name, alpha in letters.items()},
        **{f"{n[7]}({n[9]})": paper[n]["alpha"] for n in _CAPTIONS},
    }
    for number, (figure, alpha) in enumerate(entry["rows"], start=1):
        text = f"Fig. {figure} shows α = {alpha}"
        name = f"section.4.reference.{number}"
        if not figure.startswith("6"):
            yield comparison(
                entry,
                name,
                text,
                text,
                (figure, alpha, panels),
                _refers,
                ("7(b)", alpha, panels),
                proof="the captions",
            )
            continue
        meant = _MEANT.get(figure, "7(c)")
        more = "" if figure in _MEANT else ", or 7(d), α = 0.4, where forward drift is seen"
        yield comparison(
            entry,
            name,
            f"Fig. {figure} is Fig. {meant}{more}: Fig. 6 has no panels",
            text,
            (figure, alpha, panels, meant),
            _refers_elsewhere,
            (meant, alpha, panels, meant),
            derived=f"Fig. {meant}{more}; Fig. 6 is one picture",
            verdict="refuted",
            proof="the captions",
            consequence="Fig. 7 has a panel of that letter.",
            witness=partial(_panel, meant, panels),
        )


def _border(claim: tuple[str, ...]) -> bool:
    """Whether these are the lines on P1 = 0, P2 = delta for delta < f_b."""
    here = {sp.Eq(PIECES["L5"].relations[1].lhs, delta)}
    narrow = [sp.Gt(zeta, 0), sp.Lt(delta, f_b)]
    lines = {
        name
        for name, piece in PIECES.items()
        if name[0] == "L"
        and name != "L9"
        and here <= set(piece.relations)
        and not empty(piece, narrow)
    }
    return len(claim) == len(set(claim)) and set(claim) == lines


def _boundaries(paper: Paper) -> Item:
    entry = paper["figure.7.boundaries"]
    lines = tuple(entry["lines"])
    return comparison(
        entry,
        "figure.7.boundaries",
        f"the lines on P1 = 0, P2 = delta are {listed(lines)}",
        f"the non-smooth boundaries {listed(lines)}",
        lines,
        _border,
        lines[1:],
        proof="those with P1 = 0 and P2 = delta that exist for delta < f_b",
    )


def items(paper: Paper) -> Iterator[Item]:
    """The captions of Figs. 7 to 9, and what refers to figures."""
    for name in _CAPTIONS:
        entry = paper[name]
        yield _same_event(entry, paper)
        yield _colour(entry, paper)
        yield from _beside(entry, paper)
    yield from _parts(paper)
    yield from _references(paper)
    yield _boundaries(paper)
