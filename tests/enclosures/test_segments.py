"""States carried from switch to switch: exact facts, each term of a step, and roundings."""

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import pytest
from flint import arb_mat

from capsule_sym import Parameters, simulate
from capsule_sym._enclosures.numbers.balls import (
    Unproved,
    arb,
    ball,
    floats,
    precision,
    symmetric,
    thin,
)
from capsule_sym._enclosures.numbers.fields import SIZE, Field
from capsule_sym._enclosures.passage import exchanges, segments
from capsule_sym._enclosures.passage.runs import enclose_run
from capsule_sym._enclosures.passage.segments import Leg, Passage
from capsule_sym._enclosures.passage.switches import Known, after, guard_row, saltation
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import guard_between
from capsule_sym.generated.capsule.facts import FIELDS
from tests.enclosures.case import EXACT, precise

VALUES = EXACT | {"gamma": "3.3"}

NAMES = [name for name in PARAMETERS if name != "alpha"]

bits = precise(80)


def field(index: int) -> Field:
    return Field(index, {name: ball(VALUES[name]) for name in NAMES})


def passage(alpha: float = 1.2) -> Passage:
    given = {name: ball(VALUES[name]) for name in NAMES}
    return Passage(given | {"alpha": arb(alpha)})


def column(*values: Any) -> arb_mat:
    return arb_mat([[arb(value)] for value in values])


def states(*values: str) -> arb_mat:
    """One state."""
    return arb_mat([[arb(value)] for value in values])


def held(outer: arb_mat, exact: arb_mat) -> bool:
    rows = range(exact.nrows())
    return all(outer[i, 0].contains(exact[i, 0]) for i in rows)


# Exact facts at a switch


@pytest.mark.parametrize("known", [*(after(guard) for guard in Guard), Known(), Known(gap=2)])
def test_guards_vanish_as_often_as_the_facts_say(known: Known) -> None:
    check(known)


@pytest.mark.parametrize(("side", "level"), [(1, False), (-1, False), (1, True), (-1, True)])
def test_guards_vanish_as_often_at_a_segment_of_no_duration(side: int, level: bool) -> None:
    check(Known(rest=True, side=side, level=level))


def check(known: Known) -> None:
    """Derivatives of guards at a state with these facts: exactly the stated ones are 0."""
    for index in FIELDS:
        contact, moving = FIELDS[index]
        stick = Field(
            next(k for k in FIELDS if FIELDS[k] == (contact, 0)),
            {name: ball(VALUES[name]) for name in NAMES},
        )
        A, own = floats(stick.A), floats(field(index).A)
        rows: list[np.ndarray] = []
        if known.gap:
            rows.append(np.eye(SIZE)[0] - float(VALUES["delta"]) * np.eye(SIZE)[5])
        if known.gap > 1:
            rows.append(np.eye(SIZE)[1])
        if known.rest or not moving:
            rows.append(np.eye(SIZE)[2])
        if known.side:
            force = floats(guard_row(stick, Guard.UPPER if known.side > 0 else Guard.LOWER))[0]
            rows += [force, force @ A] if known.level else [force]
        state = np.random.default_rng(5).uniform(-1, 1, SIZE)
        state[5] = 1.0
        if rows:
            facts = np.array(rows)
            state[:5] -= np.linalg.pinv(facts[:, :5]) @ (facts @ state)
        assert np.allclose(np.array(rows) @ state if rows else 0.0, 0.0)
        for guard, order in zip(floats(field(index).guards), known.orders(index), strict=True):
            derivatives = [guard @ np.linalg.matrix_power(own, k) @ state for k in range(order + 1)]
            assert np.allclose(derivatives[:-1], 0.0)
            assert abs(derivatives[-1]) > 1e-6


def test_facts_after_a_guard_are_that_it_vanishes() -> None:
    """Nothing is known of v_c at an impact, nor of the force at the end of a drift."""
    assert after(Guard.GAP) == Known(gap=1)
    assert after(Guard.DRIFT) == Known(rest=True)
    assert after(Guard.UPPER) == Known(rest=True, side=1)
    assert after(Guard.LOWER) == Known(rest=True, side=-1)
    assert after(None) == Known()


def test_a_saltation_is_the_change_of_states_at_one_time() -> None:
    """From drift to drift beyond v_c = 0, against runs a little before and after the switch."""
    before, behind = field(1), field(3)
    state = np.array([-0.5, 1.3, 0.0, -0.8, 0.4, 1.0])
    found = floats(saltation(before, behind, Guard.DRIFT, thin(state[:, None])))
    rates = [(floats(one.A) @ state)[:3] for one in (before, behind)]
    guard = np.array([0.0, 0.0, 1.0])
    expected = np.eye(3) + np.outer(rates[1] - rates[0], guard) / rates[0][2]
    assert found == pytest.approx(expected, abs=1e-12)
    stopped = floats(saltation(before, field(2), Guard.DRIFT, thin(state[:, None])))
    rest = (floats(field(2).A) @ state)[:3]
    assert stopped == pytest.approx(
        np.eye(3) + np.outer(rest - rates[0], guard) / rates[0][2], abs=1e-12
    )


# A step


@pytest.mark.parametrize("late", [0.3, -0.2, 0.01])
@pytest.mark.parametrize("index", [1, 4, 5])
def test_states_are_shifted_with_their_remainder(index: int, late: float) -> None:
    """At a state with v_r' = 0: there x_r changes in third order beside its first."""
    one = field(index)
    row = one.A.tolist()[1]
    state = [ball("0.3"), ball("0.7"), ball("0.2"), arb(0), ball("0.4"), arb(1)]
    state[3] = -sum((row[k] * state[k] for k in (0, 1, 2, 4, 5)), arb(0)) / row[3]
    moved = column(*state, "1.5")
    found = exchanges.shifted(one, moved, arb_mat([[late]]), arb(0), arb(late))
    with precision(200):
        exact = (one.A.mid() * arb(late)).exp() * column(*state)
        assert all(segments.hull(found)[i, 0].overlaps(exact[i, 0]) for i in range(SIZE))
    assert segments.hull(found)[SIZE, 0].contains(arb(1.5) + arb(late))


@pytest.mark.parametrize("off", [0.1, -0.1, 1e-3, 0.0])
@pytest.mark.parametrize("digits", [53.0, 4.0])
def test_a_switch_is_enclosed_from_a_guess_nearby(off, digits, monkeypatch) -> None:
    """With four bits Newton's method stops early, so that the mean value theorem has to do it."""
    one, fields = field(1), passage()
    start = fields.start(states("-1", "1", "0.5"), arb(0.5))
    row = guard_row(one, Guard.GAP)

    def gap(h: float) -> Any:
        return (row * (one.flow(arb(h)) * start_states))[0, 0]

    start_states = arb_mat(start.tolist()[:SIZE])
    low, high = 0.5, 2.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if gap(middle) > 0 else (low, middle)
    monkeypatch.setattr(fields, "_near", lambda given: (given, digits))
    at = fields._switch(one, start, Leg(1, low + off, Guard.GAP), "F1")
    h, ended = at.h + at.d, exchanges.shifted(one, *at[1:])
    assert (h + ball(0, 1e-14)).contains(arb(low))
    assert float(h.rad()) < 0.3
    exact = one.flow(arb(low)) * start_states
    assert held(segments.hull(ended) + column(*[ball(0, 1e-13)] * 7), exact)


EXCHANGES = {
    "impact": (1, 4, Guard.GAP),
    "slip": (2, 3, Guard.LOWER),
    "reversal": (1, 3, Guard.DRIFT),
    "stop": (4, 5, Guard.DRIFT),
}

"""Fields before and after a switch, and its guard."""


def switching(name: str, count: int) -> Iterator[tuple[Field, Field, Guard, arb_mat]]:
    """States at a switch, chosen at random, with its fields and its guard."""
    before, following, guard = EXCHANGES[name]
    rng = np.random.default_rng(7)
    for _ in range(count):
        values = [arb(float(x)) for x in rng.uniform(-1, 1, 5)] + [arb(1)]
        if guard is not Guard.GAP:
            values[2] = arb(0)
        if guard is not Guard.DRIFT:
            slope, constant = segments.pin(field(before), guard)
            values[0] = slope * values[1] + constant
        yield field(before), field(following), guard, column(*values)


def exactly_moved(one: Field, h: float) -> arb_mat:
    with precision(200):
        return (one.A * arb(h)).exp()


@pytest.mark.parametrize("late", [0.4, -0.4, 0.01])
@pytest.mark.parametrize("name", EXCHANGES)
def test_states_of_the_next_field_are_those_that_lead_to_the_switch(name: str, late: float) -> None:
    for before, following, guard, state in switching(name, 40):
        moved = exactly_moved(before, -late) * state
        start = arb_mat([*moved.mid().tolist(), [arb("1.5")]])
        given = start, arb_mat([[late]]), arb(0), arb(late)
        found = segments.hull(exchanges.exchanged(before, following, guard, *given))
        exact = exactly_moved(following, -late) * state
        assert all(found[i, 0].overlaps(exact[i, 0]) for i in range(SIZE))
        assert found[SIZE, 0].contains(start[SIZE, 0])
        assert following.stick == found[2, 0].is_zero()


@pytest.mark.parametrize("name", ["reversal", "stop"])
def test_an_exchange_is_of_all_states(name: str) -> None:
    """A motion far from the middle, which switches a little later."""
    late = 1e-4
    (before, following, guard, state), (*_, other) = switching(name, 2)
    moved = exactly_moved(before, -late) * other
    columns = [[x, y - x] for (x,), (y,) in zip(state.tolist(), moved.tolist(), strict=True)]
    start = arb_mat([*columns, [arb(0), arb(0)]]).mid()
    given = start, arb_mat([[0, late]]), arb(0), symmetric(late)
    found = exchanges.exchanged(before, following, guard, *given)
    place = arb_mat([[arb(1)], [arb(1)], *[[symmetric(1)]] * (found.ncols() - 2)])
    exact = exactly_moved(following, -late) * other
    there = found * place
    assert all(there[i, 0].overlaps(exact[i, 0]) for i in range(3))


def test_a_stick_begins_at_rest() -> None:
    fields = passage(0.005)
    steps = [Leg(2, 1.0, None)]
    for speed, rests in (("0", True), ("1e-9", False)):
        start = fields.start(states("0", "0.001", speed), arb(0.5))
        if rests:
            assert len([*fields.segments(start, steps, arb(1))]) == 1
        else:
            with pytest.raises(Unproved, match="segment 1, F2 does not begin at rest"):
                [*fields.segments(start, steps, arb(1))]


@pytest.mark.parametrize(
    "guards", [(Guard.GAP,), (None, None), (None, Guard.GAP), (None, None, None)]
)
def test_the_last_segment_alone_has_no_guard(guards: tuple[Guard | None, ...]) -> None:
    fields = passage(0.005)
    start = fields.start(states("0", "0.001", "0"), arb(0.5))
    steps = [Leg(2, 0.5, guard) for guard in guards]
    with pytest.raises(Unproved, match="it is not the last segment alone that has no guard"):
        [*fields.segments(start, steps, arb(1))]


@pytest.mark.parametrize(
    ("before", "guard", "following"), [(2, Guard.UPPER, 3), (1, Guard.DRIFT, 4)]
)
def test_a_guard_leads_to_its_own_field(before: int, guard: Guard, following: int) -> None:
    """Rates agree at the end of stick with those of one drift alone."""
    fields = passage(0.005)
    start = fields.start(states("0", "0.001", "0"), arb(0.5))
    steps = [Leg(before, 0.5, guard), Leg(following, 0.5, None)]
    with pytest.raises(Unproved, match="does not lead to the next field"):
        [*fields.segments(start, steps, arb(1))]


def test_a_segment_ends_at_the_time_of_the_section() -> None:
    fields = passage(0.005)
    start = fields.start(states("0", "0.001", "0"), arb(0.5))
    for total in ("1", "2.5"):
        ((_, h, ended, *_),) = fields.segments(start, [Leg(2, 0.1, None)], arb(total))
        assert h.overlaps(arb(total))
        exact = field(2).flow(arb(total)) * arb_mat(start.tolist()[:SIZE])
        assert held(segments.hull(ended), exact.mid())
        assert segments.hull(ended)[SIZE, 0].overlaps(arb(total))


@pytest.mark.parametrize("total", ["0", "-0.5", "1e-30"])
def test_the_time_may_not_be_over_before_a_segment(total: str) -> None:
    fields = passage(0.005)
    start = fields.start(states("0", "0.001", "0"), arb(0.5))
    if arb(total) > 0:
        assert len([*fields.segments(start, [Leg(2, 0.1, None)], arb(total))]) == 1
        return
    with pytest.raises(Unproved):
        [*fields.segments(start, [Leg(2, 0.1, None)], arb(total))]


def test_balls_hold_all_of_a_bundle() -> None:
    whole = arb_mat([[arb(1), arb(2) ** -8, symmetric(0.5)]] * 7)
    for found in (segments.hull(whole), segments.hull(passage().form(whole))):
        for share, rest in product((-1, 1), (-0.5, 0.5)):
            assert all(x.contains(1 + arb(2) ** -8 * share + rest) for (x,) in found.tolist())


@pytest.mark.parametrize("guard", [Guard.GAP, Guard.DRIFT, Guard.UPPER, Guard.LOWER])
@pytest.mark.parametrize("index", [2, 5])
def test_exact_facts_at_a_switch_are_true(guard: Guard, index: int) -> None:
    """Put in for a bundle that is on the guard's zero set, they change nothing."""
    one = field(index)
    slope, constant = segments.pin(one, guard) if guard is not Guard.DRIFT else (arb(0), arb("0.4"))
    rows = [[constant, 0, 0], [0, 0, 0], [0, 0, 0]]
    rows[1] = [arb("0.7"), arb("0.01"), arb("0.02")]
    rows[0] = [slope * rows[1][0] + constant, slope * rows[1][1], slope * rows[1][2]]
    rows[2] = [arb("0.3"), 0, arb("0.05")] if guard is Guard.GAP else [arb(0)] * 3
    ended = arb_mat([*rows, *[[arb(0)] * 3] * 4])
    kept = arb_mat(ended.tolist())
    segments._pin(one, guard, ended)
    assert all(ended[i, j].overlaps(kept[i, j]) for i, j in product(range(3), repeat=2))


def test_a_run_is_that_of_its_decimals() -> None:
    """From a phase and a state that are no doubles, in stick to the end of a period."""
    run = simulate(Parameters(alpha=0.005, gamma=3.3), (-0.0013, 0.0017, 0.0), phase=0.7, periods=1)
    assert [segment.field for segment in run.segments] == [2]
    found = enclose_run(run)
    with precision(200):
        sine, cosine = (arb("0.7") * arb("0.8")).sin_cos()
        force = [arb("0.005") * cosine, arb("0.005") * sine]
        begin = column("-0.0013", "0.0017", "0", *force, "1")
        h = 2 * arb.pi() / arb("0.8") - arb("0.7")
        for told, exact in zip(found.states, (begin, field(2).flow(h) * begin), strict=True):
            assert all(told[i, 0].overlaps(exact[i, 0]) for i in range(3))
            assert float(told[0, 0].rad()) < 1e-25


def test_all_states_of_a_box_are_carried() -> None:
    """Through two switches, beside motions from its corners."""
    run = simulate(Parameters(alpha=1.2, gamma=3.3), (0.01, 0.0, 1e-5), 0.3, periods=1)
    first, second, third, *_ = run.segments
    steps = [
        Leg(one.field, float(one.duration), guard_between(one.field, then.field))
        for one, then in ((first, second), (second, third))
    ]
    steps.append(Leg(third.field, 0.01, None))
    total = arb(sum(float(one.duration) for one in steps))
    fields = passage()

    def end(x: list[Any], v: list[Any]) -> Any:
        start = fields.start(arb_mat([x, v, [arb("1e-5"), *[0] * (len(x) - 1)]]), arb("0.24"))
        *_, last = fields.segments(start, steps, total)
        return segments.hull(last.ended)

    box = end([arb("0.01"), 1e-9, 0], [0, 0, 1e-9])
    for x, v in product((-1e-9, 1e-9), repeat=2):
        one = end([arb("0.01") + x], [v])
        assert all(box[i, 0].contains(one[i, 0].mid()) for i in range(3))
