"""Bifurcations and branches in balls: each condition of a proof taken away or made to fail."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from capsule_sym._enclosures.numbers.balls import Unproved, ball, matrix, precision
from capsule_sym._enclosures.orbits import events
from capsule_sym._enclosures.orbits.events import Proved, growth_coefficient, place, prove_event
from capsule_sym._enclosures.orbits.krawczyk import Tube
from capsule_sym._enclosures.passage.guards import Signs
from tests.enclosures.case import EXACT, bifurcations, precise, threshold

VALUES = EXACT | {"gamma": "3.3"}

bits = precise(128)


@pytest.fixture(scope="module")
def found() -> Any:
    """Forward drift begins at alpha = 0.3687..., a contact before it at 0.5245..."""
    return bifurcations(0.3, 0.6)


@pytest.fixture(scope="module")
def event(found: Any) -> Proved:
    return threshold(found[0], VALUES)


def fails(*_: object, **__: object) -> None:
    raise Unproved("told", "so")


# Events


def test_an_event_is_proved_with_all_guards(found: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Signs, "segment", fails)
    with pytest.raises(Unproved, match="told: so"):
        threshold(found[0], VALUES)


def test_every_segment_of_an_event_but_the_still_one_is_watched(found, monkeypatch) -> None:
    seen: list[str] = []
    monkeypatch.setattr(Signs, "segment", lambda self, *given: seen.append(given[-1]))
    threshold(found[0], VALUES)
    fields = found[0].orbit.itinerary.fields
    expected = [f"segment {k}, F{one}" for k, one in enumerate(fields, 1)]
    del expected[found[0].segment]
    assert seen == expected


def test_an_orbit_of_the_other_side_is_the_event_s_own(found, monkeypatch) -> None:
    monkeypatch.setattr(Tube, "holds", lambda self, columns: False)
    with pytest.raises(Unproved, match="not seen to be that of the other side"):
        threshold(found[0], VALUES)


@pytest.mark.parametrize("held", [(False, True), (True, False)])
def test_a_short_segment_is_that_of_the_event(held, event, monkeypatch) -> None:
    """The tube up to the short duration has to hold both of its ends."""
    answers = iter(held)
    monkeypatch.setattr(Tube, "holds", lambda self, columns: next(answers))
    with precision(320), pytest.raises(Unproved, match="not seen to be the event's"):
        growth_coefficient(event.tube, event.segments[0], 2, "alpha")


def test_a_coefficient_that_may_be_0_has_no_side(event, monkeypatch) -> None:
    still = SimpleNamespace(hull=event.tube.hull, holds=lambda columns: True)
    monkeypatch.setattr(events, "enclose", lambda *_: still)
    with pytest.raises(Unproved, match="on which side the segment is inserted is open"):
        growth_coefficient(event.tube, event.segments[0], 2, "alpha")


@pytest.mark.parametrize(("x", "part"), [("-40", 3), ("40", 1)])
def test_the_part_of_a_line_is_that_of_the_force_s_rate(event: Proved, x: str, part: int) -> None:
    """Far to one side x_r decides the rate of the force, with (1 + beta) 2 zeta in its slope."""
    (segment,) = event.segments
    assert place(event.tube, segment)[1] == "L3^(2)"
    assert place(moved_by(event.tube, segment, ball(x)), segment)[1] == f"L3^({part})"


def test_a_part_that_is_open_is_not_named(event: Proved) -> None:
    (segment,) = event.segments
    with pytest.raises(Unproved, match=r"the part of L3 is open"):
        place(moved_by(event.tube, segment, ball(0, 40)), segment)


def moved_by(tube: Tube, segment: int, x: Any) -> Tube:
    """A tube with x_r moved at the start of a segment."""
    nodes = list(tube.wide.nodes)
    nodes[segment] = replace(nodes[segment], state=nodes[segment].state + matrix(6, 1, [(0, 0, x)]))
    return replace(tube, wide=replace(tube.wide, nodes=tuple(nodes)))


def test_a_segment_with_a_duration_is_not_still(found: Any) -> None:
    with pytest.raises(Unproved):
        prove_event(found[0].orbit, (0,), ("alpha",), VALUES)
