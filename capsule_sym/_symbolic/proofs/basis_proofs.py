"""Proofs of the response functions: their derivatives, relations, closed forms and additions.

A response function is defined by its Laplace image, so a statement that is linear in response
functions is a rational identity between images. Closed forms are substituted into the defining
differential equation and initial values. The addition theorem and its consequences are proved as
solutions of the same linear differential equations with the same initial values.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache, partial
from math import prod

import sympy as sp
from sympy.codegen.cfunctions import expm1
from sympy.polys.rings import PolyElement

from capsule_sym._symbolic.model import basis
from capsule_sym._symbolic.model.basis import (
    B2,
    BW,
    G2,
    IMAGES,
    INITIAL,
    RULES,
    B,
    B2d,
    Bd,
    Bdd,
    BWd,
    G,
    G2d,
    Gd,
    K,
    cosine,
    nu,
    s,
    sigma,
    sine,
    slow,
)
from capsule_sym._symbolic.model.symbols import PULSED, h, omega
from capsule_sym._symbolic.proofs.statement import Residuals, Statement, proof


def image(expression: sp.Expr) -> sp.Expr:
    """Laplace image of an expression linear in response functions, with powers of h as factors.

    Raises ValueError for a product of response functions.
    """
    total = sp.S.Zero
    for (power, *degrees), coefficient in sp.Poly(expression, h, *IMAGES).terms():
        if sum(degrees) > 1:
            raise ValueError(f"not linear in the response functions: {expression}")
        original = next((IMAGES[name] for name, d in zip(IMAGES, degrees, strict=True) if d), 1 / s)
        # A factor h is minus a derivative in s.
        total += coefficient * (-1) ** power * sp.diff(original, s, power)
    return total


_NORMS = {
    basis.q: K - sigma**2,
    basis.Z2: (K - omega**2) ** 2 + 4 * sigma**2 * omega**2,  # |Q(i omega)|^2
}


_DETUNING = K - omega**2
FORCED = {
    Gd: cosine - 2 * sigma * (G - omega**2 * B) - _DETUNING * Bd,
    G: sine - 2 * sigma * Bd - _DETUNING * B,
    G2d: Bd - 2 * sigma * (G2 - omega**2 * B2) - _DETUNING * B2d,
    G2: B - 2 * sigma * B2d - _DETUNING * B2,
    Bd: h * sine / 2 - 2 * sigma * (B - omega**2 * BW) - _DETUNING * BWd,
    B: (sine - h * cosine) / (2 * omega**2) - 2 * sigma * BWd - _DETUNING * BW,
}
"""Q(d/dh) of forced responses, read as free responses; a line may use those below it."""


class Reduction:
    """Exact reduction of expressions to polynomials in independent symbols.

    `independents` are the symbols that remain, `definitions` gives others in terms of them, and
    `divisors` are the denominators that may occur. Anything else raises ValueError.
    """

    def __init__(
        self,
        independents: Iterable[sp.Symbol],
        definitions: Mapping[sp.Symbol, sp.Expr],
        divisors: Iterable[sp.Expr],
    ) -> None:
        reciprocals = {divisor: sp.Symbol(f"1/({divisor})") for divisor in divisors}
        self._ring, *generators = sp.ring([*independents, *reciprocals.values()], sp.QQ)
        self._definitions = definitions
        self._known = dict(zip(self._ring.symbols, generators, strict=True))
        self._reciprocals = {
            divisor: self._known[symbol] for divisor, symbol in reciprocals.items()
        }

    def numerator(self, expression: sp.Expr) -> sp.Expr:
        """Expression times powers of the divisors: 0 if and only if the expression is 0."""
        element = self._value(sp.sympify(expression))
        for divisor, reciprocal in self._reciprocals.items():
            position = self._ring.gens.index(reciprocal)
            parts: dict[int, PolyElement] = {}
            for powers, coefficient in element.terms():
                rest = (*powers[:position], 0, *powers[position + 1 :])
                part = parts.setdefault(powers[position], self._ring.zero)
                parts[powers[position]] = part + self._ring.term_new(rest, coefficient)
            highest, scale = max(parts, default=0), self._value(divisor)
            element = sum(
                (part * scale ** (highest - power) for power, part in parts.items()),
                self._ring.zero,
            )
        return element.as_expr()

    def _value(self, expression: sp.Expr) -> PolyElement:
        if expression not in self._known:
            self._known[expression] = self._evaluated(expression)
        return self._known[expression]

    def _evaluated(self, expression: sp.Expr) -> PolyElement:
        if expression in self._definitions:
            return self._value(sp.sympify(self._definitions[expression]))
        if expression.is_Rational:
            return self._ring.ground_new(expression)
        if expression.is_Add:
            return sum(map(self._value, expression.args), self._ring.zero)
        if expression.is_Mul:
            return prod(map(self._value, expression.args), start=self._ring.one)
        base, exponent = expression.as_base_exp()
        if exponent.is_Integer and exponent > 0 and base != expression:
            return self._value(base) ** int(exponent)
        if exponent.is_Integer and base in self._reciprocals:
            return self._reciprocals[base] ** -int(exponent)
        raise ValueError(f"not a polynomial in the given symbols: {expression}")


def _equal(expected: sp.Expr, claim: sp.Expr) -> Residuals:
    return (sp.cancel(sp.together(claim - expected)),)


def _image_residual(expected: sp.Expr, claim: sp.Expr) -> Residuals:
    return _equal(expected, image(claim).subs(_NORMS))


def _definitions() -> Iterator[Statement]:
    """Initial values, derivatives, relations, forms away from the confluences, and `FORCED`."""
    z = sp.Symbol("z")
    for name, value in INITIAL.items():
        at_infinity = sp.cancel((s * IMAGES[name]).subs(s, 1 / z)).subs(z, 0)
        yield proof(
            f"basis.initial.{name}",
            "initial value theorem",
            f"{name}(0) = {value}",
            value,
            partial(_equal, at_infinity),
        )
    for variable, rules in RULES.items():
        for name, rule in rules.items():
            if variable is h:
                expected = s * IMAGES[name] - INITIAL[name]
            else:
                expected = sp.diff(IMAGES[name], variable)
            yield proof(
                f"basis.derivative.{variable}.{name}",
                "Laplace images",
                f"d {name}/d {variable} = {rule}",
                rule,
                partial(_image_residual, expected),
            )
    for kind, table in (
        ("relation", basis.RELATIONS),
        ("detached", basis.detached()),
        ("sensitivity", basis.sensitivities()),
        ("forced", FORCED),
    ):
        for name, form in table.items():
            yield proof(
                f"basis.{kind}.{name}",
                "Laplace images",
                f"{name} = {form}",
                form,
                partial(_image_residual, IMAGES[name]),
            )


def _in_functions(expression: sp.Expr, table: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr:
    """Expression with the closed forms of a table, whose lines use those above them."""
    for name in reversed(list(table)):
        expression = expression.subs(name, table[name])
    return expression.replace(expm1, lambda x: sp.exp(x) - 1)


def _closed_residuals(
    name: sp.Symbol,
    table: Mapping[sp.Symbol, sp.Expr],
    constants: Mapping[sp.Symbol, sp.Expr],
    claim: sp.Expr,
) -> Residuals:
    f = _in_functions(claim, table).subs(constants)
    if name is G:
        rate, stiffness = sigma, K.subs(constants)
        left = [sp.diff(f, h, 2) + 2 * rate * sp.diff(f, h) + stiffness * f]
        left += [f.subs(h, 0), sp.diff(f, h).subs(h, 0) - 1]
    elif name is Gd:
        left = [f - sp.diff(_in_functions(G, table).subs(constants), h)]
    else:
        left = [sp.diff(f, h) - _in_functions(G, table).subs(constants), f.subs(h, 0)]
    return tuple(sp.cancel(sp.expand(residual)) for residual in left)


def _limit_residuals(
    table: Mapping[sp.Symbol, sp.Expr], constants: Mapping[sp.Symbol, sp.Expr], claim: sp.Expr
) -> Residuals:
    closed = _in_functions(G, table).subs(constants)
    return (sp.simplify(sp.limit(closed, nu, 0) - claim),)


def _closed_forms() -> Iterator[Statement]:
    """Closed forms of G, Gd and H in each case of damping, and the common limit of G."""
    cases = {
        "oscillating": (basis.OSCILLATING, {K: sigma**2 + nu**2}),
        "overdamped": (basis.OVERDAMPED, {K: sigma**2 - nu**2, slow: nu - sigma}),
    }
    for kind, (table, constants) in cases.items():
        for name, form in table.items():
            yield proof(
                f"basis.{kind}.{name}",
                "G'' + 2 sigma G' + K G = 0, G(0) = 0, G'(0) = 1, H' = G, H(0) = 0",
                f"{name} = {form} where K = {constants[K]}",
                form,
                partial(_closed_residuals, name, table, constants),
            )
        yield proof(
            f"basis.critical.{kind}",
            "limit at K = sigma^2",
            "G = h exp(-sigma h) as nu -> 0",
            h * sp.exp(-sigma * h),
            partial(_limit_residuals, table, constants),
        )
    yield proof(
        "basis.overdamped.slow",
        "Q(slow) = 0",
        "slow = -K/(sigma + nu), for K = sigma^2 - nu^2",
        -K / (sigma + nu),
        lambda claim: _equal(nu - sigma, claim.subs(K, sigma**2 - nu**2)),
    )


_HIGHEST = (Gd, Bd, G2d, B2d, BWd)  # the rest are derivatives or integrals of one another
_PLAIN = {name: name for name in IMAGES}
_FIRST = {name: sp.Symbol(f"{name}_1", real=True) for name in (*IMAGES, h)}
DEPENDENT = basis.RELATIONS if PULSED else {**basis.RELATIONS, **FORCED}
INDEPENDENT = (*(name for name in IMAGES if name not in DEPENDENT), h)


@cache
def _reduction() -> Reduction:
    """Reduction of products of response functions of two durations."""
    first = {_FIRST[name]: sp.sympify(form).xreplace(_FIRST) for name, form in DEPENDENT.items()}
    symbols = (*INDEPENDENT, *(_FIRST[name] for name in INDEPENDENT), sigma, K, omega)
    return Reduction(symbols, {**DEPENDENT, **first}, (K, omega))


def _sum_residuals(name: sp.Symbol, claim: sp.Expr) -> Residuals:
    """Residuals of a sum's response function in h2, in its differential equation and at h2 = 0.

    The response functions of h1 bear a mark; those of h2 have their plain names.
    """
    total = basis.add(_FIRST, _PLAIN)
    total[Bdd] = total[G] - omega**2 * total[B]
    slope = basis.derivative(claim, h) - basis.reduce(RULES[h][name]).xreplace(total)
    start = claim.xreplace(INITIAL) - _FIRST[name]
    return _reduction().numerator(slope), _reduction().numerator(start)


def _twice_residuals(name: sp.Symbol, claim: sp.Expr) -> Residuals:
    """Residuals of a response function of 2 h, as a function of h."""
    twice = {**basis.double(), **basis.double_sensitivities(), h: 2 * h}
    rule = basis.reduce(RULES[h][name]) if name in _HIGHEST else RULES[h][name]
    slope = basis.derivative(claim, h) - 2 * rule.xreplace(twice)
    start = claim.xreplace({**INITIAL, h: sp.S.Zero}) - INITIAL[name]
    return _reduction().numerator(slope), _reduction().numerator(start)


def _additions() -> Iterator[Statement]:
    """Addition theorem, and its consequences for doubled durations."""
    for name, form in basis.add(_FIRST, _PLAIN).items():
        yield proof(
            f"basis.add.{name}",
            "the differential equation in h2, and its initial value",
            f"{name}(h1 + h2) = {form}",
            form,
            partial(_sum_residuals, name),
        )
    for name, form in (*basis.double().items(), *basis.double_sensitivities().items()):
        yield proof(
            f"basis.double.{name}",
            "the differential equation in h, and its initial value",
            f"{name}(2 h) = {form}",
            form,
            partial(_twice_residuals, name),
        )


@cache
def proofs() -> tuple[Statement, ...]:
    """Every statement about the response functions on which the derivation rests.

    A drive that is constant in a segment has no forced responses.
    """
    found = (*_definitions(), *_closed_forms(), *_additions())
    return tuple(one for one in found if not (PULSED and _forced(one)))


def _forced(item: Statement) -> bool:
    """True if a statement is about a response to the forcing, or its frequency."""
    name = item.name.rpartition(".")[2]
    names = {*map(str, basis.FORCED)}
    return name in names or item.name.startswith(("basis.forced", f"basis.derivative.{omega}"))
