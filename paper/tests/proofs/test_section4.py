"""Intervals between bifurcations, and the motion from rest."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import pytest
import sympy as sp

from capsule_sym import Parameters, solve_orbit
from capsule_sym._enclosures.numbers.balls import (
    Unproved,
    arb,
    ball,
    precision,
)
from capsule_sym._enclosures.orbits.events import Proved
from capsule_sym._enclosures.orbits.proof import guess_of, shooting_of
from capsule_sym._enclosures.passage.guards import Signs
from capsule_sym._symbolic.model.symbols import omega
from capsule_sym.results import Bifurcation, Orbit
from paper.claims.resting import GRAZE, resting_orbit
from paper.proofs.attraction import tendency
from paper.proofs.branches import glue, march
from paper.proofs.case import EXACT
from paper.proofs.intervals import approximate, prove_intervals, threshold
from tests.enclosures.case import precise

with precision(256):
    VALUES = {name: ball(text) for name, text in EXACT.items()} | {"gamma": ball("3.3")}

bits = precise(128)


def orbit_at(amplitude: float, gamma: float = 3.3) -> Orbit:
    found = solve_orbit(Parameters(alpha=amplitude, gamma=gamma))
    assert found.success, found.message
    return found


def test_neighbouring_boxes_are_one_orbit_and_a_shifted_one_is_not() -> None:
    orbit = orbit_at(0.7)
    shooting = shooting_of(orbit.itinerary, orbit.values, ("alpha",), EXACT)
    at = shooting.parameter("alpha")
    guess = guess_of(shooting, orbit)
    boxes = list(march(shooting, guess, at, 0.7, 0.703, step=1e-3, watch=Signs()))
    assert boxes[-1].end == 0.703
    glue(boxes[0], boxes[1])
    tube = boxes[1].tube
    moved = tuple(x + (1e-2 if k == 0 else 0) for k, x in enumerate(tube.centre))
    with pytest.raises(Unproved, match="gluing"):
        glue(boxes[0], replace(boxes[1], tube=replace(tube, centre=moved)))


@pytest.fixture(scope="module")
def found() -> tuple[tuple[Bifurcation, ...], Orbit]:
    return approximate(Parameters(), 0.001, 2.0)


@pytest.fixture(scope="module")
def events(found: tuple[tuple[Bifurcation, ...], Orbit]) -> list[Proved]:
    return [threshold(one, EXACT | {"gamma": "3.3"}) for one in found[0]]


@pytest.mark.long
def test_first_threshold_is_the_graze_in_closed_form(events: list[Proved]) -> None:
    values = {symbol: sp.Rational(EXACT[str(symbol)]) for symbol in GRAZE.free_symbols}
    with precision(320):
        square = ball(Fraction(str((GRAZE**2).subs(values))))
        assert abs(events[0].values["alpha"] - square.sqrt()) < arb("1e-80")


@pytest.mark.long
def test_the_force_of_the_graze_is_checked_too() -> None:
    (closed,) = resting_orbit()
    force = closed.claim["force_squared"]
    assert closed.holds()
    assert not closed.check(**{**closed.claim, "force_squared": 2 * force})
    assert not closed.check(**{**closed.claim, "force_squared": force.subs(omega, 1)})


def test_first_interval_is_proved_up_to_its_threshold(found, events: list[Proved]) -> None:
    _, start = found
    first = ball(Fraction(1, 1000))
    one = next(prove_intervals(events, start, EXACT | {"gamma": "3.3"}, first, ball(2)))
    assert one.itinerary.fields == (2,)
    assert one.low <= first
    assert events[0].values["alpha"] - one.high < arb("1.1e-12")


# From rest


def test_motion_from_rest_enters_a_contracted_box() -> None:
    given = EXACT | {"gamma": "3.3", "alpha": "0.7"}
    proved = tendency(given)
    assert proved.itinerary == (2, 5, 4, 1)
    assert proved.factor < 1
