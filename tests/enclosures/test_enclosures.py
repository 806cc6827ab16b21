"""Proofs in balls: against independent values, and with what a proof rests on taken away."""

import random
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from scipy.linalg import expm

import capsule_sym as cs
from capsule_sym._enclosures.numbers import fields
from capsule_sym._enclosures.numbers.balls import (
    Unproved,
    arb,
    arb_mat,
    ball,
    floats,
    matrix,
    precision,
    symmetric,
)
from capsule_sym._enclosures.numbers.fields import Field, _tail
from capsule_sym._enclosures.orbits.events import Proved, growth_coefficient
from capsule_sym._enclosures.orbits.events import _corner as place_of_corner
from capsule_sym._enclosures.orbits.krawczyk import enclose
from capsule_sym._enclosures.orbits.proof import guess_of, prove_admissible, shooting_of
from capsule_sym._enclosures.orbits.stability import characteristic, monodromy
from capsule_sym._enclosures.passage import guards, switches
from capsule_sym._enclosures.passage.guards import Line
from capsule_sym._map.expansion import Guard
from capsule_sym._symbolic.model.extended import EXTENDED
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.symbols import alpha, omega, tau
from capsule_sym.codegen._derived import matrices
from tests.enclosures.case import EXACT, bifurcations, precise, threshold

with precision(256):
    VALUES = {name: ball(text) for name, text in EXACT.items()} | {"gamma": ball("3.3")}

bits = precise(128)


def orbit_at(amplitude: float, gamma: float = 3.3) -> cs.results.Orbit:
    found = cs.solve_orbit(cs.Parameters(alpha=amplitude, gamma=gamma))
    assert found.success, found.message
    return found


def tube_at(orbit: cs.results.Orbit, radius: float = 0.0):
    shooting = shooting_of(orbit.itinerary, orbit.values, ("alpha",), EXACT)
    return enclose(shooting, guess_of(shooting, orbit), {shooting.parameter("alpha"): radius})


# The flow


@pytest.mark.parametrize("segment", SEGMENTS, ids=lambda segment: segment.name)
def test_printed_matrices_give_back_the_fields(segment) -> None:
    """Rows times (x_r, v_r, v_c, force, quadrature, 1) are the rates of Eqs. (7)-(12)."""
    rows = matrices(segment)["rates"]
    state = (*EXTENDED, sp.Integer(1))
    force = alpha * sp.cos(omega * tau)
    for row, rate in zip(rows[:3], segment.field, strict=True):
        given = sum(a * y for a, y in zip(row, state, strict=True))
        assert sp.simplify(given.subs(EXTENDED[3], force) - rate) == 0


@pytest.mark.parametrize("index", range(1, 7))
def test_flow_against_an_independent_exponential(index: int) -> None:
    field = Field(index, VALUES)
    for h in (0.01, 0.3, 2.5):
        exact = expm(floats(field.A) * h)
        assert floats(field.flow(ball(h))) == pytest.approx(exact, abs=1e-12)
        wide = field.flow(ball(h, 0.01))
        for near in (h - 0.01, h + 0.01):
            assert wide.contains(field.flow(ball(near)).mid())


def test_a_flow_is_of_its_own_duration_and_digits() -> None:
    """The last exponential is kept: not for another duration, nor for more digits."""
    with precision(512):
        field, h = Field(4, VALUES), ball(2.6)
    first = field.flow(ball(2.5))
    assert not field.flow(h).overlaps(first)
    with precision(512):
        assert field.flow(h)[0, 0].rad() < arb("1e-60")


@pytest.mark.parametrize("h", [0.05, 1.7])
def test_derivative_by_a_parameter_against_differences(h: float) -> None:
    step = arb("1e-15")
    field, ahead = (Field(4, VALUES | {"gamma": VALUES["gamma"] + s}) for s in (0, step))
    slope = field.flow_by(ball(h), "gamma")
    difference = (ahead.flow(ball(h)) - field.flow(ball(h))) / step
    assert floats(difference) == pytest.approx(floats(slope), abs=1e-13)
    wide = Field(4, VALUES | {"gamma": ball("3.3") + symmetric(1e-3)})
    assert wide.flow(ball(h)).contains(field.flow(ball(h)).mid())
    assert wide.flow_by(ball(h), "gamma").contains(slope.mid())


@pytest.mark.parametrize("zeros", [1, 2])
def test_divided_functional_is_one_on_both_sides_of_the_series(zeros, monkeypatch) -> None:
    field = Field(4, VALUES)
    row = matrix(1, 6, ((0, 2, 1),))
    h = ball(0.15)
    short = field.divided(row, zeros, h)
    monkeypatch.setattr(fields, "_SHORT", 0.0)
    long = field.divided(row, zeros, h)
    for one, other in zip(short, long, strict=True):
        assert one.overlaps(other)
        assert floats(one) == pytest.approx(floats(other), abs=1e-20)


@pytest.mark.parametrize("h", [0.15, 1.7])
@pytest.mark.parametrize("zeros", [1, 2])
def test_derivatives_of_a_divided_functional_against_differences(zeros: int, h: float) -> None:
    step, row = arb("1e-15"), matrix(1, 6, ((0, 2, 1),))
    field, other = (Field(4, VALUES | {"gamma": VALUES["gamma"] + s}) for s in (0, step))
    value, slope = field.divided(row, zeros, ball(h))
    later, _ = field.divided(row, zeros, ball(h) + step)
    moved, _ = other.divided(row, zeros, ball(h))
    assert floats((later - value) / step) == pytest.approx(floats(slope), abs=1e-13)
    by = row * field.flow_by(ball(h), "gamma", zeros)
    assert floats((moved - value) / step) == pytest.approx(floats(by), abs=1e-13)


def test_the_tail_of_a_short_series_is_what_makes_it_an_enclosure(monkeypatch) -> None:
    field = Field(4, VALUES)
    exact = (field.A * ball(0.15)).exp()
    monkeypatch.setattr(fields, "_order", lambda bits: 5)
    assert field.flow(ball(0.15)).contains(exact.mid())
    monkeypatch.setattr(fields, "_tail", lambda *given: 0.0)
    assert not field.flow(ball(0.15)).contains(exact.mid())


# Krawczyk's method


def test_tube_holds_the_orbits_found_at_other_amplitudes() -> None:
    orbit = orbit_at(0.7)
    tube = tube_at(orbit, 2e-3)
    at = tube.shooting.parameter("alpha")
    for share in (-0.9, 0.4, 0.99):
        values = [0.7 + share * 2e-3, *orbit.values[1:]]
        guess = guess_of(
            tube.shooting, cs.orbits.solve_itinerary(values, orbit.itinerary, list(orbit.z))
        )
        assert tube.holds(guess)
        shifted = list(guess)
        shifted[0] += 0.05
        assert not tube.holds(shifted)
    assert tube.hull()[at].contains(arb("0.7015"))


def test_box_that_is_too_wide_is_not_proved() -> None:
    with pytest.raises(Unproved, match="existence"):
        tube_at(orbit_at(0.7), 0.02)


def test_multipliers_are_those_of_double_precision() -> None:
    for amplitude in (0.3, 1.2, 1.9):
        orbit = orbit_at(amplitude)
        values = cs.orbits.floquet_multipliers(orbit)
        found = characteristic(monodromy(tube_at(orbit).wide))
        assert float(found.trace) == pytest.approx(float(np.sum(values).real), abs=1e-9)
        assert float(found.determinant) == pytest.approx(float(np.prod(values).real), abs=1e-9)


def test_jury_decides_as_the_eigenvalues_do() -> None:
    rng = np.random.default_rng(5)
    seen = set()
    for _ in range(300):
        M = rng.normal(size=(3, 3)) * rng.uniform(0.2, 0.9)
        inside = max(abs(np.linalg.eigvals(M))) < 1
        jury = characteristic(arb_mat(M.tolist())).jury
        assert all(value > 0 for value in jury) == inside
        failing = tuple(k for k, value in enumerate(jury) if not value > 0)
        seen.add(failing[:1] if len(failing) == 1 else ())
    assert {(0,), (1,)} <= seen


# Guards


@pytest.mark.parametrize(
    ("amplitude", "beyond", "what"),
    [(0.005, 0.009, "the gap"), (0.3, 0.45, "the upper force margin"), (0.7, 1.0, "margin|drift")],
)
def test_zero_of_the_equations_that_is_no_motion_is_rejected(amplitude, beyond, what) -> None:
    """Beyond a bifurcation the itinerary's equations still have a solution; the guards tell."""
    orbit = orbit_at(amplitude)
    prove_admissible(tube_at_columns(orbit, orbit))
    for share in np.linspace(0, 1, 12)[1:]:
        values = list(orbit.values)
        values[0] = amplitude + share * (beyond - amplitude)
        moved = cs.orbits.solve_itinerary(values, orbit.itinerary, list(orbit.z))
        assert moved.success, moved.message
        orbit = moved
    tube = tube_at_columns(orbit, orbit)
    with pytest.raises(Unproved, match=f"guards: .*{what}"):
        prove_admissible(tube)


def tube_at_columns(orbit: cs.results.Orbit, guess: cs.results.Orbit):
    shooting = shooting_of(orbit.itinerary, orbit.values, ("alpha",), EXACT)
    given = {shooting.parameter("alpha"): 0.0}
    if orbit.itinerary.segments[0].guard is None:
        given[shooting.angle] = 0.0
    return enclose(shooting, guess_of(shooting, guess), given)


@pytest.mark.parametrize("order", [1, 2, 16])
def test_positive_guards_are_positive(order: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """However short the Taylor polynomial, its remainder keeps the answer honest."""
    monkeypatch.setattr(guards, "_ORDER", order)
    line = Line(Field(1, VALUES), 1)
    rng = random.Random(3)
    told = 0
    for _ in range(40):
        x, v, c, u, w = (rng.uniform(-1.0, 1.0) for _ in range(5))
        state = matrix(6, 1, ((k, 0, ball(y)) for k, y in enumerate((x, v, c, u, w, 1.0))))
        if line.positive(1, 0, state, 0.5):
            told += 1
            A = floats(Field(1, VALUES).A)
            y = np.array([x, v, c, u, w, 1.0])
            assert all((expm(A * t) @ y)[2] > 0 for t in np.linspace(0, 0.5, 9))
    assert told > 3


def test_orders_of_contact() -> None:
    itinerary = orbit_at(1.2).itinerary  # F5 F4 F1 F2 F3 F2
    at = {field: switches.known(itinerary, k) for k, field in enumerate(itinerary.fields)}
    assert at[4].orders(4) == (0, 3 - 1)
    assert at[1].orders(1) == (1, 0)
    assert switches.known(itinerary, 3).orders(2) == (0, 0, 0)
    # F3 of duration 0 touches the lower bound of stick twice.
    assert switches.known(itinerary, 4, (4,)).orders(2) == (0, 0, 2)
    assert itinerary.segments[4].guard is Guard.DRIFT


# Bifurcations


@pytest.fixture(scope="module")
def found() -> tuple[cs.results.Bifurcation, ...]:
    return bifurcations()


@pytest.fixture(scope="module")
def events(found: tuple[cs.results.Bifurcation, ...]) -> list[Proved]:
    return [threshold(one, EXACT | {"gamma": "3.3"}) for one in found]


def test_thresholds_are_enclosed_with_type_and_line(found, events: list[Proved]) -> None:
    assert len(events) == 8
    for one, event in zip(found, events, strict=True):
        assert (event.type, event.line) == (one.type, one.line)
        value = event.values["alpha"]
        assert value.rad() < arb("1e-80")
        assert float(value) == pytest.approx(one.value, abs=1e-13)
        touch = "grazing" in event.type or "adding" in event.type
        assert event.order == (2 if touch else 1)
        assert event.other is not None


@pytest.mark.parametrize("number", [0, 1, 2, 6])
def test_the_segment_that_is_born_grows_as_its_coefficient_says(events, number: int) -> None:
    """Against the duration of that segment on orbits found in double precision beside the event."""
    event = events[number]
    assert event.coefficient is not None
    coefficient, alpha = float(event.coefficient), float(event.values["alpha"])
    (still,) = event.segments
    sign = 1.0 if coefficient > 0 else -1.0
    durations = []
    for away in (1e-7, 4e-7):
        orbit = cs.solve_orbit(cs.Parameters(alpha=alpha + sign * away))
        assert orbit.success, orbit.message
        assert str(orbit.itinerary) == str(event.tube.shooting.itinerary)
        fields = event.tube.shooting.itinerary.fields
        turn = next(k for k in range(len(fields)) if orbit.itinerary.rotated(k).fields == fields)
        durations.append(orbit.durations[(still + turn) % len(fields)])
        expected = (away / abs(coefficient)) ** (1 / event.order)
        assert durations[-1] == pytest.approx(expected, rel=2e-2)
    assert durations[1] / durations[0] == pytest.approx(4 ** (1 / event.order), rel=1e-2)


def test_multipliers_jump_where_drift_is_grazed_and_nowhere_else(events: list[Proved]) -> None:
    """The map is smooth to first order at every other border (di Bernardo et al.)."""
    for event in events:
        one, other = event.multipliers
        apart = not one.trace.overlaps(other.trace)
        assert apart == (event.type == "grazing-sliding")
        assert not (one.determinant.overlaps(other.determinant) and apart) or event.order == 2


def test_a_short_segment_of_another_orbit_gives_no_coefficient(events, monkeypatch) -> None:
    tube, (still,) = events[2].tube, events[2].segments
    with precision(320):
        assert growth_coefficient(tube, still, 1, "alpha").overlaps(events[2].coefficient)
        far = tuple(x + (1e-3 if k == 0 else 0) for k, x in enumerate(tube.centre))
        with pytest.raises(Unproved, match="unfolding"):
            growth_coefficient(replace(tube, centre=far), still, 1, "alpha")
        with pytest.raises(Unproved, match="unfolding"):
            growth_coefficient(replace(tube, radii=(1.0,) * len(tube.radii)), still, 1, "alpha")


@pytest.mark.parametrize(
    ("v", "line"), [(15.0, "L5"), (0.5, "L6"), (-0.5, "L7"), (-15.0, "L8"), (-0.5, "L10")]
)
def test_the_line_of_a_corner_is_that_of_its_force(v: float, line: str) -> None:
    """At the impact surface the force is delta + 2 zeta v_r, against a friction of 1."""
    delta = "0.02" if line != "L10" else "2.0"
    stick = Field(2, VALUES | {"delta": ball(delta)})
    state = matrix(6, 1, ((k, 0, ball(x)) for k, x in enumerate((delta, v, 0, 0.1, 0.2, 1))))
    assert place_of_corner({Guard.GAP, Guard.DRIFT}, stick, state) == line
    assert place_of_corner({Guard.GAP, Guard.UPPER}, stick, state) == "O1"
    assert place_of_corner({Guard.GAP, Guard.LOWER}, stick, state) == "O2"
    with pytest.raises(Unproved, match="is open"):
        place_of_corner({Guard.GAP}, stick, state + matrix(6, 1, [(1, 0, ball(0, 20))]))


def test_a_leg_that_is_not_still_makes_no_event(found) -> None:
    from capsule_sym._enclosures.orbits.events import prove_event

    orbit = found[3].orbit
    with pytest.raises(Unproved):
        prove_event(orbit, (1,), ("alpha",), EXACT)


def test_a_tail_is_bounded_however_small_it_is() -> None:
    """In doubles this one would be 0, and what is left of the series would count as nothing."""
    field = Field(1, {name: ball(text) for name, text in (EXACT | {"gamma": "3.3"}).items()})
    assert 1e-30**21 == 0.0
    assert _tail(field.norm, 1e-30, 21, 0) > 0
    with precision(64):
        short = field.flow(arb("1e-30"))
    with precision(4096):
        exact = (field.A * arb("1e-30")).exp()
    assert all(
        one.contains(other)
        for rows in zip(short.tolist(), exact.tolist(), strict=True)
        for one, other in zip(*rows, strict=True)
    )
