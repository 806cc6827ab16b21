"""Proved motions: against the run-time map, and with what a proof rests on taken away."""

from __future__ import annotations

from fractions import Fraction

import pytest

from capsule_sym import Parameters, simulate
from capsule_sym._enclosures.numbers.balls import (
    Matrix,
    Unproved,
    arb,
    ball,
    matrix,
    symmetric,
)
from capsule_sym._enclosures.numbers.fields import Field
from capsule_sym._enclosures.passage.exchanges import hull
from capsule_sym._enclosures.passage.guards import Signs
from capsule_sym._enclosures.passage.segments import Leg, Passage
from capsule_sym._symbolic.model.elimination import Undecided
from capsule_sym._symbolic.proofs.statement import Statement, settle
from paper.claims import captions, section_4
from paper.claims.case_study import (
    BRACKETS,
    OTHER,
    Point,
    first_fields,
    from_rest,
    global_map,
    maps,
    point,
    steady_orbit,
)
from paper.printed import events, read, row_at
from paper.proofs import attraction
from paper.proofs.attraction import tendency
from paper.proofs.guesses import steps_of
from paper.proofs.segments import carried
from tests.enclosures.case import precise

POINT = point(read(), "1.64")

bits = precise(256)


def turn(at: Point) -> tuple[Passage, Matrix, list[Leg], object]:
    """The map of one period near the orbit at a point: fields, state on it, segments and period."""
    run = simulate(Parameters(**{k: float(v) for k, v in at.numbers}), periods=200)
    state = matrix(3, 1, ((i, 0, ball(x)) for i, x in enumerate(run.stroboscopic[-2])))
    values = {name: ball(text) for name, text in at.numbers}
    passage = Passage(values)
    return passage, state, steps_of(run, 199, 200), 2 * arb.pi() / values["omega"]


def test_derivative_of_a_period_against_differences() -> None:
    passage, state, steps, period = turn(POINT)
    step = arb("1e-30")

    def after(start: Matrix) -> tuple[Matrix, Matrix]:
        ended, by = carried(passage, passage.start(start, arb(0)), steps, period)
        return hull(ended), by

    here, by = after(state)
    for k in range(3):
        ahead, _ = after(state + matrix(3, 1, ((k, 0, step),)))
        for i in range(3):
            slope = (ahead[i, 0] - here[i, 0]) / step
            assert float(slope) == pytest.approx(float(by[i, k]), abs=1e-20)


def test_guards_are_kept_for_one_field_only() -> None:
    """F2 moves alike whatever the gap is; its guards do not."""
    values = {name: ball(text) for name, text in POINT.numbers}
    watch, here = Signs(), Field(2, values)
    line = watch.line(here, 1)
    assert watch.line(here, 1) is line
    assert watch.line(Field(2, values | {"delta": ball("0.5")}), 1) is not line


def test_box_across_a_change_of_the_order_of_switches_is_not_proved() -> None:
    """At 1.588 the stick in F5 is short; a box of 1/50 also holds states that do without it."""
    passage, state, steps, period = turn(point(read(), "1.588"))
    carried(passage, passage.start(state, arb(0)), steps, period)
    wide = state + matrix(3, 1, ((i, 0, symmetric(0.02)) for i in range(3)))
    with pytest.raises(Unproved):
        carried(passage, passage.start(wide, arb(0)), steps, period)


def test_a_motion_that_has_not_come_near_enough_proves_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With the box tried early, the motion from rest is not seen to be in it."""
    assert sorted(tendency(dict(POINT.numbers)).itinerary) == [1, 3, 4, 6]
    monkeypatch.setattr(attraction, "_repeated", lambda *_: [3])
    with pytest.raises(Unproved):
        tendency(dict(POINT.numbers))


def test_maps_of_a_word() -> None:
    assert global_map(maps((4, 1, 3, 6))) == row_at(read(), 1.9).map
    assert global_map(maps((2,))) == "Id_{Σ2,F2,Σ2}"


@pytest.mark.parametrize("alpha", ["0.005", "0.3", "1.64"])
def test_settled_motion_is_that_of_the_map(alpha: str) -> None:
    at = point(read(), alpha)
    motion = steady_orbit(at)
    trajectory = simulate(Parameters(alpha=float(alpha), gamma=3.3), periods=1500)
    _, state = trajectory.final
    assert list(motion.state) == pytest.approx(list(state), abs=1e-9)
    steady = trajectory.steady()
    assert global_map(maps(motion.fields)).split(" ∘ ") == steady.global_map.split(" ∘ ")
    for (low, high), segment in zip(motion.speeds, steady.segments, strict=True):
        assert low < high
        assert high - low < Fraction(1, 10**20)
        if len(motion.fields) > 1:  # one field has no begin
            assert float(low) == pytest.approx(float(segment.start_state[1]), abs=1e-9)


def test_first_period_is_that_of_the_map() -> None:
    assert first_fields(POINT) == tuple(
        segment.field for segment in simulate(Parameters(alpha=1.64), periods=1).segments
    )


def test_what_does_not_settle_on_one_period_is_undecided() -> None:
    doubled = Point(
        (*((n, v) for n, v in point(read(), "0.045").numbers if n != "zeta"), ("zeta", "0.005"))
    )
    with pytest.raises(Undecided, match="one period"):
        steady_orbit(doubled)
    with pytest.raises(Undecided, match="the factor of the line is 1"):
        from_rest(doubled)


ITEMS = tuple(
    item for part in (section_4, captions) for claims in part.STATEMENTS for item in claims(read())
)
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


def _quick(item: Statement) -> bool:
    return item.name.startswith(_QUICK) and item.name not in _SLOW


@pytest.mark.parametrize(
    "item",
    [
        pytest.param(item, id=item.name, marks=() if _quick(item) else pytest.mark.long)
        for item in ITEMS
    ],
)
def test_statement_is_settled_and_its_mutant_is_not(item: Statement) -> None:
    result = settle(item)
    assert result.settled
    assert bool(result.witness) == bool(item.witness)
    assert not item.mutant.holds()


def test_every_printed_event_has_a_bracket_at_both_mass_ratios() -> None:
    gamma = read()["section.4.parameters"]["gamma"]
    assert set(BRACKETS) == {gamma, OTHER}
    for brackets in BRACKETS.values():
        assert len(brackets) == len(events(read()))
        for bracket in brackets:
            assert Fraction(bracket.below) < Fraction(bracket.above)
