"""Inequalities of a word: all minima are found, and they say whether the map follows the word."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize_scalar

from capsule_sym.map import simulate
from capsule_sym.map.backend import backend
from capsule_sym.map.expansion import Guard
from capsule_sym.map.location import Start
from capsule_sym.orbits.admissibility import (
    LANDING,
    MINIMUM,
    Inequality,
    inequalities,
    realised,
    tightest,
)
from capsule_sym.orbits.extrema import minima
from capsule_sym.orbits.orbit import Orbit, close
from capsule_sym.parameters import Parameters
from tests.orbits.branches import settled


def held(orbit: Orbit) -> list[Inequality]:
    with backend(orbit.backend) as numbers:
        return inequalities(numbers, orbit.word, orbit.shot)


def guards(c, closed, h: np.ndarray) -> dict[Guard, np.ndarray]:
    """Every guard of a leg at durations h, from the closed form by the guards' definition."""
    with backend("numpy") as numbers:
        position, v_r, *drifted = numbers.kernels.flow(c, closed, h)
    x_r, gap = closed.x_r + position, closed.gap + position
    force = x_r + c.kappa * gap + 2 * c.zeta * v_r
    values = {Guard.GAP: gap if c.contact else -gap}
    if c.drift:
        return values | {Guard.DRIFT: c.drift * (closed.v_c + drifted[0])}
    return values | {Guard.UPPER: c.f_b - force, Guard.LOWER: c.f_b + force}


def random_legs(count: int):
    """Long legs from random starts, with several minima each."""
    random = np.random.default_rng(3)
    for _ in range(count):
        parameters = Parameters(
            alpha=random.uniform(0.2, 3),
            omega=random.uniform(0.3, 4),
            delta=random.uniform(0, 0.5),
            zeta=random.uniform(0, 0.3),
            beta=random.uniform(0, 10),
        )
        field = int(random.integers(1, 7))
        x_r, v_r, v_c, angle = random.uniform(-1, 1, 4) * (1, 2, 1, 3) + (0, 0, 0, 3)
        with backend("numpy") as numbers:
            c = numbers.constants(field, parameters)
            gap = x_r - parameters.delta
            margin = x_r + c.kappa * gap + 2 * c.zeta * v_r - c.friction
            closed = numbers.kernels.Start(x_r, gap, v_r, v_c, margin, np.cos(angle), np.sin(angle))
        yield field, c, closed, float(angle)


def test_every_minimum_of_a_dense_sample_is_found_and_no_other() -> None:
    seen = 0
    for field, c, closed, angle in random_legs(40):
        h = np.linspace(0, 12, 24_001)
        with backend("numpy") as numbers:
            start = Start(*map(float, closed[:5]), angle, {})
            found = list(minima(numbers, c, field, start, 12.0))
        for guard, values in guards(c, closed, h[1:]).items():
            inside = np.flatnonzero((values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:]))
            times = [one.time for one in found if one.guard is guard]
            assert times == sorted(times)
            assert times == pytest.approx(h[inside + 2], abs=6e-4)
            least = [one.value for one in found if one.guard is guard]
            assert least == pytest.approx(values[inside + 1], abs=1e-5)
            seen += len(times)
    assert seen > 200


def test_a_pair_of_extrema_that_sampling_would_miss() -> None:
    # x_r = V sin h + (cos h - cos 3 h)/8: its velocity has a maximum near h = 2.7, and V is such
    # that this is 1e-9 above zero, so that x_r has a minimum and a maximum 5e-5 apart.
    parameters = Parameters(alpha=1.0, omega=3.0, zeta=0.0, delta=5.0, f_b=100.0)

    def top(V: float) -> float:
        found = minimize_scalar(
            lambda h: math.sin(h) / 8 - V * math.cos(h) - 3 * math.sin(3 * h) / 8,
            bounds=(2.2, 3.1),
            method="bounded",
            options={"xatol": 1e-12},
        )
        assert 2.3 < found.x < 3.0
        return -float(found.fun)

    with backend("numpy") as numbers:
        c = numbers.constants(2, parameters)
        for above, count in ((1e-9, 1), (-1e-9, 0)):
            V = float(brentq(lambda V, above=above: top(V) - above, 0.2, 0.5, xtol=1e-15))
            start = Start(0.0, -5.0, V, 0.0, 0.0, 0.0, {})
            found = [m for m in minima(numbers, c, 2, start, 3.1) if m.guard is Guard.LOWER]
            assert len(found) == count, (V, found)


def test_the_landing_is_the_distance_to_the_edge_of_stick() -> None:
    orbit = settled(alpha=1.2)  # F5 F4 F1 F2 F3 F2
    landings = [one for one in held(orbit) if one.kind == LANDING]
    assert [orbit.word.fields[one.leg] for one in landings] == [1, 3]
    for one in landings:
        x_r, v_r, v_c = orbit.motion.segments[one.leg].end_state
        assert v_c == 0
        force = x_r + 2 * 0.05 * v_r
        edge = -1.0 if orbit.word.fields[one.leg] == 1 else 1.0
        assert one.value == pytest.approx(abs(force - edge), abs=1e-12)


@pytest.mark.parametrize("alpha", [0.9, 0.935, 0.94, 0.942, 0.95, 1.0])
def test_the_map_follows_a_word_just_where_its_inequalities_hold(alpha: float) -> None:
    # At 0.9409980 the force in F2 reaches the edge of stick.
    start = settled(alpha=0.9)
    orbit = close(Parameters(alpha=alpha), start.word, start.z)
    assert isinstance(orbit, Orbit)
    least = tightest(orbit)
    assert (least.kind, least.guard) == (MINIMUM, Guard.LOWER)
    assert (least.value > 0) == (alpha < 0.9409980) == realised(orbit)


def test_legs_and_guards_are_named_from_where_the_paper_begins() -> None:
    orbit = settled(alpha=0.9)
    turned = close(orbit.parameters, orbit.word.rotated(2), _turned(orbit, 2))
    assert isinstance(turned, Orbit)
    names = {one.named(turned.word) for one in held(turned)}
    assert names == {one.named(orbit.word) for one in held(orbit)}
    assert "minimum of lower in leg 4, F2" in names


def _turned(orbit: Orbit, leg: int) -> list[float]:
    span = orbit.shot.spans[leg]
    return [*span.start, span.angle, *orbit.z[4 + leg :], *orbit.z[4 : 4 + leg]]


def test_a_run_from_inside_stays_on_the_orbit() -> None:
    orbit = settled(alpha=1.5)
    x_r, v_r, v_c = (float(value) for value in orbit.motion.segments[0].start_state)
    phase = float(orbit.motion.segments[0].start.phase)
    run = simulate(orbit.parameters, (x_r, v_r, v_c), phase, 3)
    assert tuple(s.field for s in run.segments[:6]) == orbit.word.fields
