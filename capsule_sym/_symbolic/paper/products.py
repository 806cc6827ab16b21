"""Sections 3.2 and 3.3: the normals, and Eqs. (16)-(23) with their values and signs as printed."""

from __future__ import annotations

from collections.abc import Iterator

import sympy as sp

from capsule_sym._paper import Entry, Paper
from capsule_sym._symbolic.model.geometry import CELLS, PIECES
from capsule_sym._symbolic.model.model import P1, P2, P3, P4, SEGMENTS
from capsule_sym._symbolic.model.proof import implies, sign_under
from capsule_sym._symbolic.model.symbols import STATE, alpha, f_b, omega, tau, v_r, x_r, zeta
from capsule_sym._symbolic.paper.compare import comparison
from capsule_sym._symbolic.paper.erratum import erratum_item
from capsule_sym._symbolic.paper.formula import formula, same
from capsule_sym._symbolic.proofs.inner_products import STICK_EDGE, along
from capsule_sym._symbolic.proofs.items import Item

_FUNCTIONS = {"P1": P1, "P2": P2, "P3": P3, "P4": P4}


def _is_normal(claim: tuple[str, tuple[str, ...]]) -> bool:
    """Whether a printed normal is the gradient of its function, with the sign of its side."""
    name, texts = claim
    function, side = _FUNCTIONS[name[:2]], 1 if name[2] == "+" else -1
    gradient = [side * sp.diff(function, symbol) for symbol in STATE]
    return all(map(same, map(formula, texts), gradient))


def points(claim: tuple[str, tuple[str, ...]]) -> bool:
    """Whether the normal out of stick on a line points from one surface to the other."""
    line, (inside, outside) = claim
    function, side = STICK_EDGE[line]
    beyond = side * function - f_b
    return (
        implies(PIECES[inside].relations, sp.Lt(beyond, 0))
        and implies(PIECES[outside].relations, sp.Gt(beyond, 0))
        and implies(PIECES[outside].relations, PIECES[line].relations[1])
    )


def _normals(paper: Paper) -> Iterator[Item]:
    entry, point = paper["normals"], paper["normals.point"]
    for name, texts in entry.printed.items():
        shown = f"({', '.join(texts)})"
        opposite = name[:2] + ("-" if name[2] == "+" else "+")
        yield comparison(
            entry,
            f"normal.{name}",
            f"the normal ∇{name} is {shown}",
            f"∇{name} = {shown}",
            (name, tuple(texts)),
            _is_normal,
            (opposite, tuple(texts)),
            proof="the gradient of the auxiliary function, with the sign of its side",
        )
    for line, (inside, outside) in point.printed.items():
        yield comparison(
            point,
            f"normal.{line}",
            f"the normal on {line} points from {inside} to {outside}",
            f"the normal of {line} points from {inside} to {outside}",
            (line, (inside, outside)),
            points,
            (line, (outside, inside)),
            proof="the bound is not reached on the one surface, and exceeded on the other",
        )


_SIGNS = {"<": -1, ">": 1}
Product = tuple[str, str, int, str]


def _value(claim: Product) -> bool:
    """Whether a printed value is the inner product of its normal and field on the place."""
    place, normal, index, text = claim
    function, side = _FUNCTIONS[normal[:2]], 1 if normal[2] == "+" else -1
    product = side * along(function, SEGMENTS[index - 1])
    if normal[:2] in ("P1", "P2"):
        return _beside(place, index) and same(product, formula(text))
    edge, sense = STICK_EDGE[place]
    root = sp.solve(sp.Eq(edge, sense * f_b), x_r)[0]
    found = [sp.expand(sp.together(e.subs(x_r, root))) for e in (product, formula(text))]
    return edge == function and sense == side and same(*found)


def _beside(place: str, index: int) -> bool:
    """Whether a surface is on the boundary of a field's cell."""
    cell = CELLS[index - 1].closure
    return all(implies(PIECES[place].relations, relation) for relation in cell.relations)


def _sign(claim: tuple[str, str, int, str]) -> bool:
    """Whether the inner product has the printed sign all over the place."""
    place, normal, index, sign = claim
    side = 1 if normal[2] == "+" else -1
    product = side * along(_FUNCTIONS[normal[:2]], SEGMENTS[index - 1])
    return sign_under(product, PIECES[place].relations) == _SIGNS[sign]


def _figure_3(paper: Paper) -> Item:
    entry = paper["figure.3"]
    shown = tuple(dict.fromkeys(paper[f"equation.{n}"]["on"] for n in range(16, 22)))
    word, surfaces = entry["positive"], tuple(entry["surfaces"])
    return comparison(
        entry,
        "figure.3",
        f"the examples are those of Eqs. (16)-(21), {', '.join(shown)}, and a positive inner "
        f"product is {word}",
        f"{', '.join(surfaces)}; a positive inner product is {word}",
        (surfaces, shown, word),
        lambda claim: claim[0] == claim[1] and claim[2] == "repelling",
        (surfaces, shown, "attracting"),
        proof="a normal points to the side of the field with which it is multiplied",
    )


def _equations(paper: Paper) -> Iterator[Item]:
    yield _figure_3(paper)
    for number in range(16, 24):
        entry = paper[f"equation.{number}"]
        if number == 23:
            yield _equation_23(entry)
            continue
        place, normal, index, value = (entry[k] for k in ("on", "normal", "field", "value"))
        symbol = f"⟨∇{normal}, F{index}⟩"
        yield comparison(
            entry,
            f"equation.{number}",
            f"on {place}, {symbol} = {value}",
            f"on {place}, {symbol} = {value}",
            (place, normal, index, value),
            _value,
            (place, normal, index, f"-({value})"),
            proof="the normal multiplied with the field, component by component",
        )
        if sign := entry.printed.get("sign"):
            word = "repelling" if sign == ">" else "attracting"
            yield comparison(
                entry,
                f"equation.{number}.sign",
                f"on {place}, {symbol} {sign} 0: {place} is {word} there",
                f"{symbol} {sign} 0",
                (place, normal, index, sign),
                _sign,
                (place, normal, index, "<" if sign == ">" else ">"),
                proof=f"the sign on all of {place}, by elimination",
            )


def _equation_23(entry: Entry) -> Item:
    out = along(-P3, SEGMENTS[1])
    pull = 2 * zeta * alpha * sp.cos(omega * tau)
    on = PIECES[entry["on"]].relations
    derived = sp.Eq(out, -v_r - 2 * zeta * f_b - pull)
    return erratum_item(
        entry,
        "equation.23",
        f"on {entry['on']}, ⟨∇{entry['normal']}, F{entry['field']}⟩ = {entry['value']}",
        derived="on L2, ⟨∇P3-, F2⟩ = -v_r - 2*zeta*f_b - 2*zeta*alpha*cos(omega*tau)",
        proof="P3 = -f_b on L2, so F2 = (v_r, f_b + alpha cos omega tau, 0) there; with ∇P3- = "
        "(-1, -2 zeta, 0) the product is -v_r - 2 zeta (f_b + alpha cos omega tau)",
        consequence="P3 = -f_b makes the elastic force in F2 +f_b, and the normal is -(1, 2 zeta, "
        "0): both terms change sign. Everything that Appendix B says about L2 shifts by "
        "4 zeta f_b.",
        scope=on,
        printed_relation=sp.Eq(out, formula(entry["value"])),
        derived_relation=derived,
    )


def items(paper: Paper) -> Iterator[Item]:
    """The normals, and Eqs. (16)-(23)."""
    yield from _normals(paper)
    yield from _equations(paper)
