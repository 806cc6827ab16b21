"""Section 2: Eqs. (1)-(5) and the scaling beside the six fields, Eq. (6) read literally."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import sympy as sp

from capsule_sym._paper import Entry, Paper
from capsule_sym._symbolic.model.model import P3, P4, SEGMENTS, Segment
from capsule_sym._symbolic.model.proof import example
from capsule_sym._symbolic.model.symbols import PARAMETERS, delta, f_b, tau, v_c, x_r
from capsule_sym._symbolic.paper.compare import comparison
from capsule_sym._symbolic.paper.erratum import CASE_STUDY, CREST, described
from capsule_sym._symbolic.paper.formula import NotAFormula, formula, same
from capsule_sym._symbolic.proofs.items import Item

Texts = Mapping[str, str]

_POSITIVE = ("k_1", "k_2", "c", "G", "P_d", "P_f", "Omega", "M_c", "mu", "g")
_REAL = ("X_m", "X_c", "V_m", "V_c", "A_m", "A_c", "F_f", "t")
_W = sp.Symbol("W", positive=True)  # the natural frequency: M_m = k_1/W^2 keeps all rational
_PHYSICAL: dict[str, sp.Expr] = {
    **{name: sp.Symbol(name, positive=True) for name in _POSITIVE},
    **{name: sp.Symbol(name, real=True) for name in _REAL},
}
_PHYSICAL["M_m"] = _PHYSICAL["k_1"] / _W**2
_BOUND = _PHYSICAL["P_f"]
_FRICTION, _SPEED = _PHYSICAL["F_f"], _PHYSICAL["V_c"]


def _scaling(texts: Texts) -> dict[str, sp.Expr]:
    """The printed dimensionless quantities in physical ones, for dry friction."""
    names = _PHYSICAL | {"F_max": _BOUND}
    names["Omega_0"] = formula(texts["Omega_0"], names)
    scaled = {str(s): formula(texts[str(s)], names) for s in (*PARAMETERS, tau)}
    for kind, letter in (("x", "X"), ("v", "V"), ("a", "A")):
        for body in "mc":
            place = names | {letter: _PHYSICAL[f"{letter}_{body}"]}
            scaled[f"{kind}_{body}"] = formula(texts[kind], place)
    return scaled | {name: formula(texts[name], scaled) for name in ("x_r", "v_r")}


def _in_physical(expression: sp.Expr, scaled: Mapping[str, sp.Expr]) -> sp.Expr:
    """A dimensionless expression in physical quantities."""
    return expression.xreplace({s: scaled[str(s)] for s in expression.free_symbols})


def _side(text: str, unknown: str) -> sp.Expr:
    """The value that a printed equation gives an unknown."""
    equation, symbol = formula(text, _PHYSICAL), _PHYSICAL[unknown]
    if not isinstance(equation, sp.Eq):
        raise NotAFormula(text)
    zero = sp.expand(equation.lhs - equation.rhs)
    slope = zero.coeff(symbol)
    return sp.expand(symbol - zero / slope)


def _friction(texts: Texts, segment: Segment) -> sp.Expr:
    if segment.stick:
        return _side(texts["reaction"], "F_f")
    return _side(texts["slip"], "F_f").xreplace({sp.sign(_SPEED): sp.Integer(segment.drift)})


def _is_field(claim: tuple[Segment, Texts]) -> bool:
    """Whether the printed equations of motion, scaled as printed, are a field at f_b = 1."""
    segment, texts = claim
    scaled = _scaling(texts)
    mass = _side(texts["mass"], "A_m")
    capsule = _side(texts["capsule"], "A_c").xreplace({_FRICTION: _friction(texts, segment)})
    place = {_PHYSICAL["A_m"]: mass, _PHYSICAL["A_c"]: capsule}
    accelerations = {name: scaled[name].xreplace(place) for name in ("a_m", "a_c")}
    found = (scaled["v_r"], accelerations["a_m"] - accelerations["a_c"], accelerations["a_c"])
    return scaled["f_b"] == 1 and all(
        same(value, _in_physical(rate, scaled))
        for value, rate in zip(found, segment.field, strict=True)
    )


def _texts(paper: Paper, contact: bool) -> dict[str, str]:
    motion, frame = ("equation.4", "equation.5") if contact else ("equation.2", "equation.3")
    return {
        **paper["scaling.parameters"].printed,
        **paper["scaling.state"].printed,
        "slip": paper["equation.1"]["slip"],
        "reaction": paper[f"{frame}.stick"]["reaction"],
        "mass": paper[motion]["motion"],
        "capsule": paper[frame]["motion"],
    }


def _fields(paper: Paper) -> Iterator[Item]:
    for segment in SEGMENTS:
        texts = _texts(paper, segment.contact)
        frame = paper["equation.5" if segment.contact else "equation.3"]
        yield comparison(
            frame,
            f"equation.1-5.{segment.name}",
            f"Eqs. (1)-(5), scaled as printed and at f_b = 1, are {segment.name}",
            f"{texts['mass']}; {texts['capsule']}; friction "
            + texts["reaction" if segment.stick else "slip"],
            (segment, texts),
            _is_field,
            (segment, texts | {"gamma": "M_m/M_c", "alpha": "P_f/P_d"}),
            proof="the field in the printed dimensionless quantities, less the scaled equations",
        )


def _derivatives_match(claim: Texts) -> bool:
    """Whether v is the rate of x, and a that of v, in the printed time."""
    names = _PHYSICAL | {"X": sp.Symbol("X"), "V": sp.Symbol("V"), "A": sp.Symbol("A")}
    names["Omega_0"] = formula(claim["Omega_0"], names)
    rate = sp.diff(formula(claim["tau"], names), _PHYSICAL["t"])
    x, v, a = (formula(claim[kind], names) for kind in ("x", "v", "a"))
    return same(x.subs(names["X"], names["V"]) / rate, v) and same(
        v.subs(names["V"], names["A"]) / rate, a
    )


def _scaling_items(paper: Paper) -> Iterator[Item]:
    parameters, state = paper["scaling.parameters"], paper["scaling.state"]
    texts = {**parameters.printed, **state.printed}
    yield comparison(
        state,
        "scaling.rates",
        "velocities and accelerations are scaled as the derivatives of the displacements in tau",
        f"x = {state['x']}, v = {state['v']}, a = {state['a']}, tau = {parameters['tau']}",
        texts,
        _derivatives_match,
        texts | {"v": "k_1*V*Omega_0/P_f"},
        proof="d/dtau = (1/Omega_0) d/dt",
    )
    definitions = {name: texts[name] for name in (*map(str, PARAMETERS), "Omega_0")}
    yield comparison(
        parameters,
        "scaling.positive",
        "the parameters of the model are positive where the physical quantities are",
        ", ".join(f"{name} = {text}" for name, text in definitions.items()),
        texts,
        lambda claim: all(_scaling(claim)[str(symbol)].is_positive for symbol in PARAMETERS),
        texts | {"omega": f"-{texts['omega']}"},
        proof="their signs, for positive masses, springs, damper, gap and friction",
    )
    dry = paper["scaling.dry"]
    yield comparison(
        dry,
        "scaling.dry",
        "f_b is 1 for dry friction",
        f"f_b = {parameters['f_b']} = {dry['f_b']}",
        (parameters["f_b"], dry["f_b"]),
        lambda claim: formula(claim[0], _PHYSICAL | {"F_max": _BOUND}) == formula(claim[1]),
        (parameters["f_b"], "2"),
        proof="the greatest friction of Eq. (1) is P_f",
    )
    bound = paper["equation.1"]
    names = {name: sp.Symbol(name) for name in ("P_f", "mu", "M_m", "M_c", "g")}
    weight = names["mu"] * (names["M_m"] + names["M_c"]) * names["g"]
    yield comparison(
        bound,
        "equation.1.bound",
        "the friction bound is mu times the weight of both bodies",
        bound["bound"],
        bound["bound"],
        lambda claim: _solves(formula(claim, names), names["P_f"], weight),
        "P_f == mu*M_c*g",
        proof="the capsule carries the inner mass",
    )


def _solves(equation: Any, symbol: sp.Symbol, value: sp.Expr) -> bool:
    return isinstance(equation, sp.Eq) and equation.lhs == symbol and same(equation.rhs, value)


_KINDS = {"<": sp.StrictLessThan, "<=": sp.LessThan, ">": sp.StrictGreaterThan}


def _scaled_condition(claim: tuple[str, str, sp.Expr, Texts]) -> bool:
    """Whether a printed condition, scaled, is |value| kind f_b, or value kind 0 without a bound."""
    text, kind, value, texts = claim
    scaled = _scaling(texts)
    reaction = {_FRICTION: _side(texts["reaction"], "F_f")} if "F_f" in text else {}
    relation = formula(text, _PHYSICAL)
    if not isinstance(relation, _KINDS[kind]) or not isinstance(relation.lhs, sp.Abs):
        return False
    inner = relation.lhs.args[0].xreplace(reaction) / relation.rhs
    wanted = _in_physical(value, scaled) / scaled["f_b"]
    return same(inner, wanted) or same(inner, -wanted)


def _conditions(paper: Paper) -> Iterator[Item]:
    law = paper["equation.1"]
    for contact in (False, True):
        force, name = (P4, "P4") if contact else (P3, "P3")
        entry = paper["equation.5.stick" if contact else "equation.3.stick"]
        texts = _texts(paper, contact)
        told = [("slips", entry, entry["slips"], ">"), ("stick", law, law["stick"], "<=")]
        if not contact:
            told.append(("held", entry, entry["held"], "<"))
        for key, place, text, kind in told:
            yield comparison(
                place,
                f"equation.{'5' if contact else '3'}.{key}",
                f"{'with' if contact else 'without'} contact, {text} is |{name}| {kind} f_b",
                text,
                (text, kind, force, texts),
                _scaled_condition,
                (text, kind, force + f_b, texts),
                proof="scaled as printed; in stick the friction is the printed reaction",
            )
    for name, kind in (("equation.2", sp.StrictLessThan), ("equation.4", sp.GreaterThan)):
        entry = paper[name]
        texts = _texts(paper, contact=False)
        yield comparison(
            entry,
            f"{name}.where",
            f"{entry['where']} is x_r {'<' if kind is sp.StrictLessThan else '>='} delta",
            entry["where"],
            (entry["where"], kind, texts),
            _is_gap,
            (entry["where"], sp.Eq, texts),
            proof="scaled as printed",
        )
    yield _omitted_spring(paper, paper["equation.5.stick"])


def _is_gap(claim: tuple[str, Any, Texts]) -> bool:
    text, kind, texts = claim
    relation = formula(text, _PHYSICAL)
    scale = _PHYSICAL["k_1"] / _BOUND
    found = scale * (relation.lhs - relation.rhs)
    return isinstance(relation, kind) and same(found, _in_physical(x_r - delta, _scaling(texts)))


_HELD_NOT = (
    *(sp.Eq(v_c, 0), sp.Gt(x_r, delta), sp.Lt(P3, f_b), sp.Gt(P3, -f_b)),
    *(sp.Gt(P4, f_b), CREST),
)


def _omitted(claim: tuple[str, Texts]) -> bool:
    """Whether a printed condition of stick in contact is |P3| < f_b, where |P4| can exceed f_b."""
    text, texts = claim
    point = example(_HELD_NOT, CASE_STUDY)
    return _scaled_condition((text, "<", P3, texts)) and point[x_r] > point[delta]


def _omitted_spring(paper: Paper, entry: Entry) -> Item:
    texts = _texts(paper, contact=True)
    return comparison(
        entry,
        "equation.5.held",
        "in contact the printed condition of stick leaves the second spring out",
        f"in contact the capsule is held when {entry['held']}",
        (entry["held"], texts),
        _omitted,
        (entry["slips"].replace(">", "<"), texts),
        derived="it is held when the second spring's force is counted too: |P4| < f_b, as the "
        "printed condition of slip beside it and S5 have it",
        verdict="refuted",
        proof="scaled, the printed condition is |P3| < f_b; at the witness it holds in contact and "
        "P4 > f_b",
        consequence="It is the condition that Eq. (11) repeats with |P3|, as the scan reads; if "
        "that index is misread, this condition still omits the spring.",
        witness=lambda: described(example(_HELD_NOT, CASE_STUDY)),
    )


def items(paper: Paper) -> Iterator[Item]:
    """Eqs. (1)-(5), the scaling, and the conditions of stick and contact."""
    yield from _fields(paper)
    yield from _scaling_items(paper)
    yield from _conditions(paper)
