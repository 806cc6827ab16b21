"""Derived tables: against the printed ones, and against exact Taylor series at random points."""

import random
from collections.abc import Callable
from fractions import Fraction
from functools import cache
from itertools import islice

import pytest
import sympy as sp

from capsule_sym._symbolic.model.geometry import PIECES
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.switching import leaves_of, surface_transitions
from capsule_sym._symbolic.model.symbols import (
    STATE,
    alpha,
    beta,
    delta,
    f_b,
    force,
    gamma,
    omega,
    tau,
    v_c,
    v_r,
    x_r,
    zeta,
)
from paper.derived.enclosure import RationalFlow, first_order
from tests.sampling import many, sampled, some

QUADRATURE = sp.Symbol("w", real=True)
GIVEN = (zeta, beta, gamma, f_b, omega, delta, v_c, x_r, v_r, force, QUADRATURE)
WAVE = {
    alpha * sp.cos(omega * tau): force,
    alpha * sp.sin(omega * tau): QUADRATURE,
    alpha * omega * sp.sin(omega * tau): omega * QUADRATURE,
}


def test_every_surface_is_passed() -> None:
    found = {(t.source, t.surface, t.target) for t in surface_transitions()}
    assert len(surface_transitions()) == len(found) == 12


def test_row_of_l4_is_the_mirror_of_l1() -> None:
    for line, targets in (("L1", {1, 2}), ("L4", {5, 6})):
        assert {t for leaf in leaves_of(line) if leaf.arrives for t in leaf.departs} == targets


def _random_point(name: str, generator: random.Random) -> dict[sp.Symbol, sp.Rational]:
    """Rational parameters (f_b = omega = 1), state, force and its quadrature on a piece."""

    def pick(bound: int) -> sp.Rational:
        return sp.Rational(generator.randint(-4 * bound, 4 * bound), 4)

    point = {zeta: sp.Rational(1, 4), beta: sp.S(2), gamma: sp.S(3), f_b: sp.S(1), omega: sp.S(1)}
    point[delta] = generator.choice((sp.Rational(1, 2), sp.S(1), sp.Rational(5, 4)))
    point |= {
        v_c: pick(2),
        x_r: pick(5),
        v_r: pick(generator.choice((1, 12))),
        force: pick(6),
        QUADRATURE: pick(4),
    }
    unknowns = [v_c, x_r, v_r]
    for relation in PIECES[name].relations:
        if isinstance(relation, sp.Eq):
            unknown = next(s for s in unknowns if s in relation.free_symbols)
            unknowns.remove(unknown)
            at_0, at_1 = (_value(relation, point | {unknown: sp.S(n)}) for n in (0, 1))
            point[unknown] = at_0 / (at_0 - at_1)  # the equations are linear
    return point


@cache
def _function(relation: sp.Basic) -> Callable[..., sp.Rational]:
    """Its left side less its right one, as a function of what a point gives."""
    return sp.lambdify(GIVEN, sp.expand(relation.lhs - relation.rhs).subs(WAVE), modules=[])


def _value(relation: sp.Basic, point: dict[sp.Symbol, sp.Rational]) -> sp.Rational:
    return _function(relation)(*(point[symbol] for symbol in GIVEN))


def _holds(relation: sp.Basic, point: dict[sp.Symbol, sp.Rational]) -> bool:
    return bool(type(relation)(_value(relation, point), 0))


def _passing(point: dict[sp.Symbol, sp.Rational]) -> tuple[set[int], set[int]]:
    """Fields that arrive at the point and that leave it, by Taylor series."""
    start = [Fraction(int(v.p), int(v.q)) for v in map(point.get, (*STATE, force, QUADRATURE))]
    arrives, departs = set(), set()
    for field in SEGMENTS:
        if field.stick and point[v_c]:
            continue
        flow = RationalFlow(field, point, start, sense=1, degree=6)
        series = [flow.series(guard) for guard in field.guards]
        leading = [(one[first_order(one)], first_order(one)) for one in series]
        if all(term > 0 for term, _ in leading):
            departs.add(field.index)
        if all(term * (-1) ** order > 0 for term, order in leading):
            arrives.add(field.index)
    return arrives, departs


@sampled
@pytest.mark.parametrize("name", some([n for n in PIECES if n != "L9"], 6))
def test_leaves_agree_with_taylor_series(name: str) -> None:
    """At random points of a piece the leaf that holds the point names what the series show."""
    generator = random.Random(11)
    points = (_random_point(name, generator) for _ in range(600))
    held = (p for p in points if all(_holds(r, p) for r in PIECES[name].relations))
    apart = (p for p in held if name != "O1" or p[v_r] != 0)  # there it is the point O3
    checked = 0
    for point in islice(apart, many(10, 4)):
        (leaf,) = (o for o in leaves_of(name) if all(_holds(r, point) for r in o.condition))
        arrives, departs = _passing(point)
        assert leaf.arrives <= arrives <= leaf.may_arrive
        assert leaf.departs <= departs <= leaf.may_depart
        checked += 1
    assert checked >= 3


def test_motion_goes_on_in_one_way() -> None:
    for name in PIECES:
        for leaf in leaves_of(name):
            assert len(leaf.departs) <= 1
            assert leaf.departs or leaf.may_depart
