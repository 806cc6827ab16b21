"""Proved motions: against an independent integrator, and with what a proof rests on taken away."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from capsule_sym import Parameters, simulate
from capsule_sym.casestudy import printed_map
from capsule_sym.paper import events, read
from capsule_sym.symbolic.attractors import contraction
from capsule_sym.symbolic.case_study import (
    BRACKETS,
    OTHER,
    from_rest,
    global_map,
    maps,
    point,
    settled,
)
from capsule_sym.symbolic.comparisons import bifurcations, captions, motions
from capsule_sym.symbolic.elimination import Undecided
from capsule_sym.symbolic.intervals import ONE, ZERO, Motion, dot, exact, hull, middle
from capsule_sym.symbolic.items import Item, settle
from capsule_sym.symbolic.model import SEGMENTS, Segment
from capsule_sym.symbolic.orbits import System
from capsule_sym.symbolic.periodic import periodic
from capsule_sym.symbolic.symbols import zeta

POINT = point(read(), "1.64")
START = (Fraction(3, 10), Fraction(1), Fraction(1, 2), Fraction(41, 25), Fraction(-1, 3))


def _rates(field: Segment, values: dict[str, float]) -> Callable[[float, np.ndarray], list[float]]:
    """The field with its forcing, written anew."""
    zeta, beta, delta = values["zeta"], values["beta"], values["delta"]

    def rates(t: float, y: np.ndarray) -> list[float]:
        x, v, _, u, w = y
        force = x + 2 * zeta * v + field.contact * beta * (x - delta)
        capsule = (force - field.drift) / values["gamma"] if field.drift else 0.0
        return [v, u - force - capsule, capsule, -values["omega"] * w, values["omega"] * u]

    return rates


@pytest.mark.parametrize("field", SEGMENTS, ids=lambda field: field.name)
def test_enclosed_flow_follows_an_independent_integrator(field: Segment) -> None:
    motion = Motion(field, POINT.values)
    start = list(START)
    if field.stick:
        start[2] = Fraction(0)
    values = {str(symbol): float(value) for symbol, value in POINT.values.items()}
    expected = solve_ivp(
        _rates(field, values),
        (0, 2.5),
        np.array(start, dtype=float),
        method="DOP853",
        rtol=1e-12,
        atol=1e-13,
    ).y[:, -1]
    vector = [*map(exact, start), ONE]
    reached = motion.after(vector, exact(Fraction(5, 2)))
    assert [float(middle(x)) for x in reached[:-1]] == pytest.approx(expected, abs=1e-9)
    assert all(x.delta < 1e-200 for x in reached)
    for place, guard in enumerate(motion.guards):
        by_time = motion.guard_in_time(place, vector, 1)
        weights = motion.weights(exact(Fraction(5, 2)))
        value = sum((a * reached[k] for k, a in guard), ZERO)
        slope = sum((a * x for (k, a) in guard if k < 5 for x in [motion.rate(reached)[k]]), ZERO)
        assert 0 in dot(by_time[0], weights) - value
        assert 0 in dot(by_time[1], weights) - slope


def test_a_box_encloses_the_states_in_it() -> None:
    motion = Motion(SEGMENTS[3], POINT.values)
    near = exact(Fraction(1, 100))
    box = [hull(x - near, x + near) for x in map(exact, START)]
    shifts = map(exact, map(Fraction, ("0.01", "-0.01", "0.005", "0", "-0.01")))
    inside = [x + shift for x, shift in zip(map(exact, START), shifts, strict=True)]
    ends = [motion.after([*start, ONE], exact(2)) for start in (inside, box)]
    assert all(x in y for x, y in zip(*ends, strict=True))


def test_first_period_from_rest_against_the_map() -> None:
    passage = System(POINT.values).passage([ZERO] * 3)
    trajectory = simulate(Parameters(alpha=1.64, gamma=3.3), periods=1, backend="mpmath")
    _, state = trajectory.final
    assert [float(middle(x)) for x in passage.end] == pytest.approx(list(map(float, state)))
    fields = [segment.field for segment in trajectory.segments]
    assert [leg.field for leg in passage.legs] == fields


def test_derivative_of_a_period_against_differences() -> None:
    system = System(POINT.values)
    state = [exact(Fraction(x)) for x in ("1.4741", "0.7275", "0.3570")]
    step = exact(Fraction(1, 10**30))
    for k in range(3):
        way = [exact(k == j) for j in range(3)]
        (slope,) = system.passage(state, [way]).slopes
        ahead = system.passage([x + step * y for x, y in zip(state, way, strict=True)]).end
        here = system.passage(state).end
        for x, y, z in zip(ahead, here, slope, strict=True):
            assert float(middle((x - y) / step)) == pytest.approx(float(middle(z)), abs=1e-20)


def test_box_that_is_too_large_or_elsewhere_proves_nothing() -> None:
    system = System(POINT.values)
    state = [exact(x) for x in from_rest(POINT).state]
    passage, _, factor = contraction(system, state, Fraction(1, 10**6))
    assert passage.legs == from_rest(POINT).legs
    assert factor < 1
    with pytest.raises(Undecided):
        contraction(system, state, Fraction(1, 100))
    elsewhere = [state[0] + exact(Fraction(1, 10**4)), *state[1:]]
    with pytest.raises(Undecided):
        contraction(system, elsewhere, Fraction(1, 10**6))


def test_box_across_a_change_of_the_order_of_switches_is_undecided() -> None:
    """At 1.588 the stick in F5 is short; a box of 1/100 also holds states that do without it."""
    system = System(point(read(), "1.588").values)
    state = [exact(Fraction(x)) for x in ("1.4448", "0.7006", "0.3494")]
    wide = [hull(x - exact(Fraction(1, 50)), x + exact(Fraction(1, 50))) for x in state]
    system.passage(state)
    with pytest.raises(Undecided):
        system.passage(wide)


def test_overdamped_field_is_refused() -> None:
    values = {**POINT.values, zeta: sp.Integer(2)}
    with pytest.raises(ValueError, match="overdamped"):
        System(values)


def test_maps_of_a_word() -> None:
    assert global_map(maps((4, 1, 3, 6))) == printed_map(1.9)
    assert global_map(maps((2,))) == "Id_{Σ2,F2,Σ2}"


def test_settled_motion_is_that_of_the_map() -> None:
    motion = settled(POINT)
    trajectory = simulate(Parameters(alpha=1.64, gamma=3.3), periods=200)
    _, state = trajectory.final
    assert [float(x) for x in motion.state] == pytest.approx(list(state), abs=1e-9)
    assert {str(one) for one in motion.maps} == set(trajectory.steady().global_map.split(" ∘ "))
    low, high = motion.speed(1)
    assert low < high
    assert float(high - low) < 1e-5


def test_a_poor_hint_finds_the_same_motion() -> None:
    near = periodic(POINT.values, [x + Fraction(1, 100) for x in settled(POINT).state])
    assert [float(x) for x in near.state] == pytest.approx(
        [float(x) for x in settled(POINT).state], abs=1e-12
    )


_PARTS = (motions, bifurcations, captions)
ITEMS = tuple(item for part in _PARTS for item in part.items(read()))
_QUICK = (
    *("printed.section.4.row", "printed.figure.6", "printed.section.4.reference"),
    *("erratum.section.4.reference", "printed.figure.7", "erratum.section.4.panel.l"),
    *(
        "printed.section.4.event.1.type",
        "printed.section.4.event.3",
        "printed.section.5.stationary",
    ),
    *("printed.figure.9.b", "erratum.figure.9.c.beside"),
)
_SLOW = ("printed.section.4.event.3.other",)


def _quick(item: Item) -> bool:
    return item.id.startswith(_QUICK) and item.id not in _SLOW


@pytest.mark.parametrize(
    "item",
    [
        pytest.param(item, id=item.id, marks=() if _quick(item) else pytest.mark.long)
        for item in ITEMS
    ],
)
def test_statement_is_settled_and_its_mutant_is_not(item: Item) -> None:
    result = settle(item)
    assert result.settled
    assert bool(result.witness) == bool(item.witness)
    assert not item.check(item.mutant)


def test_every_printed_event_has_a_bracket_at_both_mass_ratios() -> None:
    gamma = read()["section.4.parameters"]["gamma"]
    assert set(BRACKETS) == {gamma, OTHER}
    for brackets in BRACKETS.values():
        assert len(brackets) == len(events(read()))
        for bracket in brackets:
            assert Fraction(bracket.below) < Fraction(bracket.above)
