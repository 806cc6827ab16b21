"""Appendices A and B: the bounds on alpha, and the parts of L2 and L3 with their signs."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import sympy as sp

from capsule_sym._paper import Entry, Paper
from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import PIECES
from capsule_sym._symbolic.model.model import P3, SEGMENTS
from capsule_sym._symbolic.model.proof import consistent, example, sign_under
from capsule_sym._symbolic.model.symbols import alpha, delta, f_b, v_r, x_r, zeta
from capsule_sym._symbolic.paper.compare import comparison
from capsule_sym._symbolic.paper.erratum import CASE_STUDY, CREST, at_crest, erratum_item
from capsule_sym._symbolic.paper.fields import equal, follow
from capsule_sym._symbolic.paper.formula import formula, relations, same
from capsule_sym._symbolic.paper.products import points
from capsule_sym._symbolic.proofs.appendices import BOUNDS, Part, part, unsettled
from capsule_sym._symbolic.proofs.inner_products import along, outward
from capsule_sym._symbolic.proofs.items import Item

_DAMPED = sp.Gt(zeta, 0)
_OUT = along(-P3, SEGMENTS[1])  # Eq. (23): out of S2 on L2
_ON_L2 = PIECES["L2"].relations
BY_LINE = {bound.line: bound for bound in BOUNDS}


def _appendix_a(paper: Paper) -> Iterator[Item]:
    bounds, ways = paper["section.3.3.bounds"], paper["appendix.A.ways"]
    for line, text in bounds.printed.items():
        yield comparison(
            bounds,
            f"appendix.A.{line}.bound",
            f"alpha < {text} is sufficient for stick to end everywhere and always on {line}",
            f"the sign on {line} is positive for 0 < alpha < {text}",
            (text, BY_LINE[line].alpha_bound),
            lambda claim: same(formula(claim[0]), claim[1]),
            (text, -BY_LINE[line].alpha_bound),
            derived="as printed; necessary too, and the end point may be added "
            f"(appendix.A.{line}.sharp)",
            verdict="conditional",
            proof="the infimum of n over the line is at its corner, where v_r ends its range, and "
            "over time at alpha cos(omega tau) = -alpha (L1) or alpha (L4)",
        )
    for line, pair in ways.printed.items():
        yield comparison(
            ways,
            f"appendix.A.{line}.way",
            f"within the bound {line} leads from {pair[0]} to {pair[1]} only",
            f"the mechanism on {line} is uni-directional, from {pair[0]} to {pair[1]}",
            (line, tuple(pair)),
            points,
            (line, tuple(reversed(pair))),
            derived="as printed, within the bound",
            verdict="conditional",
            proof="the normal out of stick points that way, and n > 0 (appendix.A)",
        )
    yield from _steps(paper["appendix.A"], paper["appendix.A.extremes"])


def _relation_is(claim: tuple[str, sp.Expr]) -> bool:
    """Whether a printed relation says that an expression is positive, multiplied by 2 zeta or 1."""
    text, value = claim
    relation = formula(text)
    gap = relation.lhs - relation.rhs
    return isinstance(relation, sp.StrictGreaterThan) and (
        same(gap, value) or same(2 * zeta * gap, value)
    )


def _steps(entry: Entry, extremes: Entry) -> Iterator[Item]:
    product = outward("L1")
    for key in ("A.1", "A.2"):
        yield comparison(
            entry,
            f"appendix.{key}",
            f"Eq. ({key}) says that (22) is positive: {entry[key]}",
            entry[key],
            (entry[key], product),
            _relation_is,
            (entry[key], -product),
            proof="the two sides subtracted" + (", times 2 zeta" if key == "A.2" else ""),
        )
    low = 2 * zeta * v_r - (f_b - delta)
    yield comparison(
        entry,
        "appendix.A.range",
        f"on L1 {entry['L1']}, and every such v_r occurs (appendix.B.L1.range)",
        entry["L1"],
        (entry["L1"], low),
        _relation_is,
        (entry["L1"], -low),
        proof="P3 = f_b and P2 < delta",
    )
    least, greatest = extremes["least"], extremes["greatest"]
    shown = f"min({least}) > max({greatest})"
    yield comparison(
        extremes,
        "appendix.A.3",
        f"{shown} is Eq. (A.2) at its worst",
        shown,
        (f"{least} > {greatest}", product),
        _relation_is,
        (f"{greatest} > {least}", product),
        proof="the sides of Eq. (A.2)",
    )
    yield comparison(
        entry,
        "appendix.A.4",
        f"{entry['A.4']} is Eq. (A.3) with its extremes, -alpha and the end of L1's range",
        entry["A.4"],
        (entry["A.4"], greatest, entry["L1"]),
        _worst,
        (entry["A.4"].replace("-alpha", "alpha"), greatest, entry["L1"]),
        proof="alpha cos(omega tau) >= -alpha, and v_r > (f_b - delta)/(2 zeta) on L1",
    )


def _worst(claim: tuple[str, str, str]) -> bool:
    text, greatest, bound = map(formula, claim)
    return (
        isinstance(text, sp.StrictGreaterThan)
        and same(text.lhs, -alpha)
        and same(text.rhs, greatest.subs(v_r, bound.rhs))
    )


def _appendix_b(paper: Paper) -> Iterator[Item]:
    entry = paper["appendix.B"]
    zero = sp.Eq(_OUT, 0)
    yield erratum_item(
        entry,
        "appendix.B.1",
        f"on L2, ⟨∇P3-, F2⟩ = {entry['B.1']}",
        place="Eq. (B.1)",
        derived="as Eq. (23) has to read: -v_r - 2*zeta*f_b - 2*zeta*alpha*cos(omega*tau)",
        proof="see the erratum on Eq. (23)",
        consequence="Appendix B repeats Eq. (23), so that it is no misprint of the equation.",
        scope=_ON_L2,
        printed_relation=sp.Eq(_OUT, formula(entry["B.1"])),
        derived_relation=sp.Eq(_OUT, outward("L2")),
    )
    first, second = entry["B.2"]
    here = (*_ON_L2, zero)
    yield comparison(
        entry,
        "appendix.B.2.upper",
        f"where (23) vanishes, {first}",
        first,
        (here, (first,)),
        follow,
        (here, (second,)),
        proof="v_r = -2 zeta (f_b + alpha cos omega tau) there",
    )
    yield erratum_item(
        entry,
        "appendix.B.2",
        f"where (23) vanishes, {second}",
        place="Eq. (B.2)",
        derived="where (23) vanishes, -2 zeta (f_b + alpha) <= v_r <= -2 zeta (f_b - alpha)",
        proof="v_r = -2 zeta (f_b + alpha cos omega tau) there",
        consequence="The interval is that of the printed Eq. (23).",
        scope=here,
        printed_relation=relations([second])[0],
        derived_relation=sp.Le(v_r, -2 * zeta * (f_b - alpha)),
    )
    yield from _intervals(paper)


def _derived(one: Part) -> tuple[Relation, ...]:
    """The range of v_r on a part; that of L3^(3) with the end of L3's range, as it is printed."""
    end = (sp.Le(2 * zeta * v_r, f_b - delta),) if one.name == "L3^(3)" else ()
    return (*one.within, *end, _DAMPED)


def _is_interval(claim: tuple[Part, tuple[str, ...]]) -> bool:
    one, texts = claim
    return equal((*relations(texts), _DAMPED), _derived(one))


def _beyond(one: Part, texts: tuple[str, ...]) -> tuple[Relation, ...]:
    """Relations of states in the printed or the derived interval, not in the other one."""
    here = (*PIECES[one.line].relations, CREST)
    printed = relations(texts)
    for inside, outside in ((printed, one.within), (one.within, printed)):
        for relation in outside:
            other = (*here, *inside, sp.Not(relation))
            if consistent([*other, _DAMPED]):
                return other
    raise ValueError(one.name)


def _other_interval(claim: tuple[Part, tuple[str, ...]]) -> bool:
    """Whether a printed interval is not the derived one."""
    one, texts = claim
    try:
        return bool(example(_beyond(one, texts), CASE_STUDY))
    except ValueError:
        return False


def of(name: str) -> Part:
    """A part by its name, such as L2^(1)."""
    return part(name[:2], int(name[4]))


def _intervals(paper: Paper) -> Iterator[Item]:
    for entry in (paper["appendix.B.L2"], paper["appendix.B.L3"]):
        for name, texts in entry.printed.items():
            one, texts = of(name), tuple(texts)
            shown = " and ".join(texts)
            if one.line == "L3":
                yield comparison(
                    entry,
                    f"appendix.B.{name}",
                    f"{name} is {shown}",
                    f"{name}: {shown}",
                    (one, texts),
                    _is_interval,
                    (part("L3", one.number % 3 + 1), texts),
                    proof="the extremes of n over a period",
                    formula=one.interval,
                )
                continue
            yield comparison(
                entry,
                f"appendix.B.{name}",
                f"{name} is {' and '.join(map(str, one.within))}, not {shown}",
                f"{name}: {shown}",
                (one, texts),
                _other_interval,
                (one, tuple(map(str, one.within))),
                derived=f"{name}: {' and '.join(map(str, one.within))}",
                verdict="refuted",
                proof="the extremes of n = -v_r - 2 zeta (f_b + alpha cos omega tau) over a period",
                consequence="The printed intervals are those of the printed Eq. (23); all are too "
                "high by 4 zeta f_b.",
                formula=one.interval,
                witness=partial(_point, one, texts),
            )
    yield from _signs(paper)
    yield _end(paper["appendix.B.L3"])


def _point(one: Part, texts: tuple[str, ...]) -> dict[str, str]:
    return at_crest(_beyond(one, texts))


_KIND = {"<": sp.Lt, ">": sp.Gt}


def _signs(paper: Paper) -> Iterator[Item]:
    signs, ways = paper["section.3.3.signs"], paper["section.3.3.stick"]
    intervals = paper["appendix.B.L2"]
    sense = {"<": "negative", ">": "positive"}
    for name, way in ways.printed.items():
        one = of(name)
        side = {"ends": 1, "begins": -1}[way]
        yield comparison(
            ways,
            f"section.3.3.{name}.stick",
            f"stick {way} on {name}, at all times (with the derived interval)",
            f"on {name} stick {way}",
            (one, side),
            lambda claim: sign_under(outward(claim[0].line), claim[0].relations) == claim[1],
            (one, -side),
            derived="as printed, with the derived interval",
            verdict="conditional",
            proof="the bounds of cos omega tau put in, and the variables eliminated",
        )
        here = one.relations
        printed = signs[name]
        yield erratum_item(
            signs,
            f"appendix.B.{name}.sign",
            f"on {name}, ⟨∇P3-, F2⟩ {printed} 0",
            derived=f"on {name} it is {'positive' if side > 0 else 'negative'}: the normal "
            "points from S2 to S3, so that out of stick is positive",
            proof="-v_r - 2 zeta (f_b + alpha cos omega tau) on the derived interval",
            consequence="The printed sign contradicts both Eq. (23) and the text beside it; "
            f"the role of {name} in the text (stick {way}) is right.",
            scope=here,
            printed_relation=_KIND[printed](_OUT, 0),
            derived_relation=sp.Gt(side * _OUT, 0),
        )
        interval = (*_ON_L2, *relations(intervals[name]), _DAMPED)
        if name == "L2^(1)":
            yield erratum_item(
                intervals,
                f"appendix.B.{name}.role",
                f"for {' and '.join(intervals[name])} stick {way}, at all times",
                derived="stick ends at all times for v_r < -2 zeta (f_b + alpha) only",
                proof="n >= -v_r - 2 zeta (f_b + alpha), positive on the derived interval",
                consequence="At v_r between -2 zeta (f_b + alpha) and 2 zeta (f_b - alpha) "
                "stick may begin on L2; with alpha = 0.7 of the case study the printed "
                "L2^(1) reaches to +0.03, the derived one to -0.17.",
                scope=interval,
                printed_relation=sp.Gt(side * _OUT, 0),
                derived_scope=here,
                derived_relation=sp.Gt(side * _OUT, 0),
            )
    one = part("L2", 2)
    yield comparison(
        signs,
        "section.3.3.L2^(2).sign",
        "on L2^(2) the sign of (23) depends on time (with the derived interval)",
        f"on L2^(2) the sign is {sense.get(signs['L2^(2)'], 'one or the other, by the time')}",
        (one, signs["L2^(2)"]),
        lambda claim: claim[1] == "?" and unsettled(claim[0]),
        (one, "<"),
        derived="as printed, with the derived interval",
        verdict="conditional",
        proof="inside it both signs are taken in every period",
    )


def _end(entry: Entry) -> Item:
    name = "L3^(3)"
    last = entry[name][-1]
    corner = (*PIECES["O1"].relations, *relations([last]), _DAMPED)
    return erratum_item(
        entry,
        "appendix.B.L3.end",
        f"{name} is closed, {last}: it holds the corner O1",
        derived="O1 has x_r = delta, so by Eq. (14) it is not on L3 (nor O2 on L2)",
        proof="Eq. (14) gives L3 with P2 > delta, and O1 has P2 = delta",
        consequence="Motion through a corner is a case of its own; see the errata on O1, O2. "
        "The scan tells the closed end by its bracket.",
        scope=corner,
        printed_relation=sp.Gt(x_r, delta),
        derived_scope=PIECES["O1"].relations,
        derived_relation=sp.Eq(x_r, delta),
    )


def items(paper: Paper) -> Iterator[Item]:
    """Appendices A and B."""
    yield from _appendix_a(paper)
    yield from _appendix_b(paper)
