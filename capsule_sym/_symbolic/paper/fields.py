"""The auxiliary functions, Eq. (6) against all six fields, and Eqs. (7)-(12) with their domains."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache

import sympy as sp

from capsule_sym._paper import Entry, Paper
from capsule_sym._symbolic.model.elimination import Relation
from capsule_sym._symbolic.model.geometry import PIECES
from capsule_sym._symbolic.model.model import P1, P2, P3, P4, SEGMENTS, Segment
from capsule_sym._symbolic.model.proof import implies
from capsule_sym._symbolic.model.symbols import delta, f_b, v_c, v_r, x_r
from capsule_sym._symbolic.paper.compare import comparison
from capsule_sym._symbolic.paper.erratum import erratum_item
from capsule_sym._symbolic.paper.formula import NAMES, formula, relations, same
from capsule_sym._symbolic.proofs.items import Item

Texts = Mapping[str, str]
_SWITCHES = {name: sp.Symbol(name) for name in ("H1", "H2", "H3")}


def _auxiliary(paper: Paper) -> Iterator[Item]:
    entry = paper["auxiliary"]
    for name, function in (("P1", P1), ("P2", P2), ("P3", P3), ("P4", P4)):
        yield comparison(
            entry,
            f"auxiliary.{name}",
            f"{name} = {entry[name]}, as the model has it",
            f"{name} = {entry[name]}",
            (entry[name], function),
            lambda claim: same(formula(claim[0]), claim[1]),
            (entry[name], function + f_b),
            proof="P3 and P4 are the forces of the inner mass on the capsule",
        )


def _step(argument: sp.Expr, region: tuple[Relation, ...]) -> sp.Expr | None:
    """The Heaviside step of a function in a region; None where the region does not decide it."""
    magnitudes = argument.atoms(sp.Abs)
    branches = [argument]
    for magnitude in magnitudes:
        (inner,) = magnitude.args
        branches = [b.xreplace({magnitude: s * inner}) for b in branches for s in (1, -1)]
    if any(implies(region, sp.Gt(branch, 0)) for branch in branches):
        return sp.S.One  # |P| is the greater of P and -P
    if all(implies(region, sp.Lt(branch, 0)) for branch in branches):
        return sp.S.Zero
    return None


def literal(texts: Texts, region: tuple[Relation, ...], drift: int) -> tuple[sp.Expr, ...]:
    """Eq. (6) in a region as rates of (x_r, v_r, v_c), `drift` standing for sign(v_c)."""
    place = {sp.sign(v_c): sp.Integer(drift)}
    for name, symbol in _SWITCHES.items():
        step = _step(formula(texts[name]), region)
        if step is not None:
            place[symbol] = step
    velocities = {"v_m": v_r + v_c, "v_c": v_c}
    rates = {
        **{name: formula(texts[name], velocities).xreplace(place) for name in ("x_m", "x_c")},
        **{
            name: formula(texts[name], NAMES | _SWITCHES).xreplace(place) for name in ("v_m", "v_c")
        },
    }
    return rates["x_m"] - rates["x_c"], rates["v_m"] - rates["v_c"], rates["v_c"]


def _agrees(claim: tuple[Segment, Texts, tuple[tuple[Relation, ...], ...]]) -> bool:
    """Whether Eq. (6), read literally, is a field in each of the regions."""
    segment, texts, regions = claim
    return all(
        all(map(same, literal(texts, region, segment.drift), segment.field)) for region in regions
    )


def _regions(segment: Segment) -> tuple[tuple[Relation, ...], ...]:
    """Where the field acts and the force exceeds the bound (drift), or is within it (stick)."""
    side = sp.Gt(x_r, delta) if segment.contact else sp.Lt(x_r, delta)
    force = segment.interaction
    if segment.stick:
        return ((sp.Eq(v_c, 0), side, sp.Lt(force, f_b), sp.Gt(force, -f_b)),)
    moving = sp.Gt(v_c, 0) if segment.drift > 0 else sp.Lt(v_c, 0)
    return (moving, side, sp.Gt(force, f_b)), (moving, side, sp.Lt(force, -f_b))


_MOVING = (sp.Gt(v_c, 0), sp.Lt(x_r, delta), sp.Lt(P3, f_b), sp.Gt(P3, -f_b))


def _equation_6(paper: Paper) -> Iterator[Item]:
    entry = paper["equation.6"]
    texts = dict(entry.printed)
    shown = "; ".join(f"{key}' = {texts[key]}" for key in ("x_m", "v_m", "x_c", "v_c"))
    steps = ", ".join(f"{key} = H({texts[key]})" for key in _SWITCHES)
    for segment in SEGMENTS:
        where = "|P| < f_b" if segment.stick else "|P| > f_b"
        regions = _regions(segment)
        yield comparison(
            entry,
            f"equation.6.{segment.name}",
            f"where {where} Eq. (6) is {segment.name}, P being P{4 if segment.contact else 3}",
            f"{shown}; {steps}",
            (segment, texts, regions),
            _agrees,
            (segment, texts | {"H2": texts["H1"], "H1": texts["H2"]}, regions)
            if segment.stick
            else (segment, texts, (_MOVING, *regions)),
            verdict="conditional",
            proof="the steps H1, H2, H3 are decided by elimination, then the rates compared",
        )
    resting = tuple(r for r in _regions(SEGMENTS[0])[0] if not r.has(v_c))
    yield comparison(
        entry,
        "equation.6.rest",
        "on S1 Eq. (6) is F1 if sign(v_c) is read as that of the drift to come, not with sign(0)=0",
        texts["v_c"],
        (texts, (sp.Eq(v_c, 0), *resting), 1),
        lambda claim: all(map(same, literal(*claim), SEGMENTS[0].field)),
        (texts, (sp.Eq(v_c, 0), *resting), 0),
        verdict="conditional",
        derived="so it is on S3, S4 and S6; Eqs. (7)-(12) say it without a sign of 0",
        proof="the rates compared",
    )
    force = literal(texts, _MOVING, 1)[2]
    speed = SEGMENTS[0].field[2]
    yield erratum_item(
        entry,
        "equation.6",
        f"v_c' = {force} for v_c > 0 and |P3| < f_b without contact",
        derived="a moving capsule has v_c' = (P3 - f_b)/gamma, or (P3 + f_b)/gamma backwards",
        proof="by Eqs. (7) and (9) F1 and F3 act wherever P1 ≠ 0 without contact; with P3 < "
        "f_b the first gives v_c' = (P3 - f_b)/gamma < 0",
        consequence="Taken literally Eq. (6) lets the capsule coast without friction; Eqs. "
        "(7)-(12), which the paper uses, are the model.",
        scope=_MOVING,
        printed_relation=sp.Eq(speed, force),
        derived_scope=_MOVING[:3],
        derived_relation=sp.Lt(speed, 0),
    )


def _is_field(claim: tuple[tuple[str, ...], str, Segment]) -> bool:
    texts, mode, segment = claim
    return mode == segment.mode and all(map(same, map(formula, texts), segment.field))


def domain(segment: Segment) -> tuple[tuple[Relation, ...], ...]:
    """Where a field acts: its cell with P2 = delta counted to contact, and P1 = 0 where it moves.

    At rest a drift acts where it accelerates the capsule in its own sense, stick where not.
    """
    side = sp.Ge(x_r, delta) if segment.contact else sp.Lt(x_r, delta)
    rest, force = sp.Eq(v_c, 0), segment.interaction
    if segment.stick:
        return ((rest, side, sp.Le(force, f_b), sp.Ge(force, -f_b)),)
    drift = segment.drift
    return (sp.Gt(drift * v_c, 0), side), (rest, side, sp.Gt(drift * segment.field[2], 0))


@cache
def _within(inner: tuple[Relation, ...], outer: tuple[Relation, ...]) -> bool:
    return all(implies(inner, relation) for relation in outer)


def equal(first: Iterable[Relation], second: Iterable[Relation]) -> bool:
    """Whether two sets of states given by relations are the same."""
    first, second = tuple(first), tuple(second)
    return _within(first, second) and _within(second, first)


def follow(claim: tuple[tuple[Relation, ...], tuple[str, ...]]) -> bool:
    """Whether printed relations follow from hypotheses."""
    hypotheses, texts = claim
    return all(implies(hypotheses, r) for r in relations(texts))


def _is_domain(claim: tuple[tuple[tuple[str, ...], ...], Segment]) -> bool:
    texts, segment = claim
    derived = domain(segment)
    return len(texts) == len(derived) and all(
        equal(relations(part), one) for part, one in zip(texts, derived, strict=True)
    )


def _parts(entry: Entry) -> tuple[tuple[str, ...], ...]:
    return tuple(map(tuple, entry["domain"]))


def _union(parts: Iterable[Iterable[str]]) -> str:
    return " or ".join("{" + ", ".join(part) + "}" for part in parts)


def _segments(paper: Paper) -> Iterator[Item]:
    for number, segment in enumerate(SEGMENTS, start=7):
        entry = paper[f"equation.{number}"]
        texts = tuple(entry["field"])
        other = SEGMENTS[segment.index % 6]
        yield comparison(
            entry,
            f"equation.{number}.field",
            f"{segment.name}, {entry['mode']}, is as printed",
            f"{entry['mode']}: ({', '.join(texts)})",
            (texts, entry["mode"], segment),
            _is_field,
            (texts, entry["mode"], other),
            proof="Newton's equations of both bodies",
            formula=sp.latex(sp.Matrix(segment.field)),
        )
        if number == 11:
            yield from _equation_11(entry)
            continue
        yield comparison(
            entry,
            f"equation.{number}.domain",
            f"{segment.name} acts where printed: {_union(_parts(entry))}",
            _union(_parts(entry)),
            (_parts(entry), segment),
            _is_domain,
            (_parts(entry), other),
            proof="at rest a drift acts where its v_c' has its own sense; the sets include each "
            "other",
        )


def _equation_11(entry: Entry) -> Iterator[Item]:
    ((*place, bound),) = _parts(entry)
    scope = relations([*place, bound])
    ((*derived, _, _),) = domain(SEGMENTS[4])
    yield comparison(
        entry,
        "equation.11.domain",
        f"but for its bound, F5 acts where printed: {', '.join(place)}",
        ", ".join(place),
        (tuple(place), tuple(derived)),
        lambda claim: equal(relations(claim[0]), claim[1]),
        (tuple(place[1:]), tuple(derived)),
        proof="each of the two sets includes the other",
    )
    yield erratum_item(
        entry,
        "equation.11",
        f"Omega5 = {_union(_parts(entry))}",
        derived="Omega5 = {P1 == 0, P2 >= delta, |P4| <= f_b}, as S5 in Eq. (13) has it",
        proof="on S5 |P4| < f_b by Eq. (13), and P4 = P3 + beta (P2 - delta) can exceed f_b "
        "where |P3| <= f_b",
        consequence="In contact the second spring presses on the capsule too, so P4 decides. A "
        "misread index would make the equation right; the condition before Eq. (5), which is "
        "clear, has the same fault.",
        scope=scope,
        printed_relation=sp.Le(P4, f_b),
        derived_scope=PIECES["S5"].relations,
        derived_relation=sp.Lt(P4, f_b),
    )


def items(paper: Paper) -> Iterator[Item]:
    """The auxiliary functions, Eq. (6) and Eqs. (7)-(12)."""
    yield from _auxiliary(paper)
    yield from _equation_6(paper)
    yield from _segments(paper)
