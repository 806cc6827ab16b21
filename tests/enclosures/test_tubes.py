"""Tubes of solutions: an equation with known roots, derivatives beside differences, multipliers."""

from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flint import arb_mat

from capsule_sym import Parameters, orbits, solve_orbit
from capsule_sym._enclosures.numbers.balls import Unproved, arb, ball, precision
from capsule_sym._enclosures.orbits import krawczyk
from capsule_sym._enclosures.orbits.krawczyk import Tube, enclose
from capsule_sym._enclosures.orbits.proof import affine_states, guess_of, shooting_of
from capsule_sym._enclosures.orbits.stability import characteristic
from capsule_sym._orbits.shooting.equations import PARAMETERS
from tests.enclosures.case import EXACT, precise

PLACES = (-1.0, -0.5, 0.0, 0.75, 1.0)

bits = precise(128)


class Root:
    """x^2 = p + noise, for the columns x and p, instead of an orbit's equations."""

    columns = 2

    def __init__(self, noise: Any = 0) -> None:
        self.noise = noise

    def fields(self, values: Any) -> None:
        return None

    def evaluate(self, values: Any, fields: Any) -> Any:
        x, p = values
        return SimpleNamespace(
            residual=arb_mat([[x * x - p - self.noise]]), by=arb_mat([[2 * x, -1]])
        )


def root(p: float, radius: float = 0.0, noise: Any = 0) -> Tube:
    tube = enclose(Root(noise), [arb(p).sqrt(), arb(p)], {1: radius})
    # The image is inside the box over which the equations were evaluated.
    assert tube.radii[0] < tube.unique[0]
    return tube


@pytest.mark.parametrize(("p", "radius"), [(2.0, 0.3), (2.0, 1e-3), (0.5, 0.1), (9.0, 2.5)])
def test_a_tube_holds_the_solutions_of_all_its_parameters(p: float, radius: float) -> None:
    tube = root(p, radius)
    for s in PLACES:
        x = (arb(p) + arb(radius) * s).sqrt()
        away = x - tube.centre[0] - tube.slopes[0, 0] * s
        assert abs(away) <= tube.radii[0]
        assert tube.hull()[0].contains(x.mid())
        assert tube.holds([x, arb(p) + arb(radius) * s])
        assert not tube.holds([-x, arb(p) + arb(radius) * s])
    beyond = arb(p) + arb(radius) * 1.01
    assert not tube.holds([beyond.sqrt(), beyond])


@pytest.mark.parametrize("radius", [0.0, 0.1])
@pytest.mark.parametrize("noise", [0.2, 0.05, 1e-6])
def test_a_tube_holds_the_solutions_of_all_equations(noise: float, radius: float) -> None:
    """The equations themselves are balls; a share of a parameter may be one."""
    tube = root(2.0, radius, ball(0, noise))
    for s, share in ((s, share) for s in (-1.0, 1.0) for share in (-1.0, 1.0)):
        x = (arb(2) + arb(radius) * s + arb(noise) * share).sqrt()
        ahead = tube.slopes[0, 0] * s if radius else 0
        assert abs(x - tube.centre[0] - ahead) <= tube.radii[0]
        assert tube.hull()[0].contains(x.mid())


@pytest.mark.parametrize(("p", "radius"), [(1.0, 1.5), (1.0, 0.99), (1.0, 1.0)])
def test_where_two_solutions_meet_there_is_no_tube(p: float, radius: float) -> None:
    with pytest.raises(Unproved, match="existence"):
        root(p, radius)


def test_radii_that_are_too_small_prove_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    root(2.0, 0.3)
    monkeypatch.setattr(krawczyk, "_SLACK", 0.9)
    with pytest.raises(Unproved, match="does not map the box into itself"):
        root(2.0, 0.3)


def test_an_image_in_doubles_is_rounded_up() -> None:
    rng = np.random.default_rng(2)
    for size in (1, 3, 40):
        for scale in (1.0, 1e-160):
            moved, radii = rng.uniform(size=(2, size)) * [[scale == 1.0], [scale]]
            shrink = rng.uniform(size=(size, size)) * scale
            found = krawczyk.image_of(moved, shrink, radii)
            for i in range(size):
                terms = (Fraction(x) * Fraction(r) for x, r in zip(shrink[i], radii, strict=True))
                assert Fraction(found[i]) > Fraction(moved[i]) + sum(terms)


# Equations of an orbit


def orbit_at(alpha: float, gamma: float = 3.3) -> Any:
    orbit = solve_orbit(Parameters(alpha=alpha, gamma=gamma))
    assert orbit.success, orbit.message
    return orbit


@pytest.mark.parametrize("divided", [None, (), (1,)])
@pytest.mark.parametrize("alpha", [0.3, 0.7, 1.2, 1.9])
def test_derivatives_of_the_equations_are_those_of_differences(alpha: float, divided: Any) -> None:
    """Along a direction with a share of every unknown and parameter; there is no solution there."""
    with precision(256):
        orbit = orbit_at(alpha)
        shooting = shooting_of(orbit.itinerary, orbit.values, PARAMETERS, EXACT)
        rng = np.random.default_rng(3)
        at = [x + float(rng.uniform(-0.01, 0.01)) for x in guess_of(shooting, orbit)]
        along = [arb(float(rng.uniform(-1, 1))) for _ in at]
        step = arb(2) ** -80

        def residual(share: Any) -> Any:
            there = [x + share * one for x, one in zip(at, along, strict=True)]
            return shooting.evaluate(there, shooting.fields(there), divided=divided).residual

        by = shooting.evaluate(at, shooting.fields(at), divided=divided).by
        expected = by * arb_mat([[one] for one in along])
        change = (residual(step) - residual(-step)) / (2 * step)
        assert max(abs(x) for (x,) in (expected - change).tolist()) < arb(2) ** -80


def test_affine_states_are_those_of_the_orbits_of_a_tube() -> None:
    orbit, radius = orbit_at(0.7), 2e-3
    shooting = shooting_of(orbit.itinerary, orbit.values, ("alpha",), EXACT)
    tube = enclose(shooting, guess_of(shooting, orbit), {shooting.parameter("alpha"): radius})
    forms = affine_states(tube)
    for s in PLACES:
        values = [0.7 + s * radius, *orbit.values[1:]]
        moved = orbits.solve_itinerary(values, orbit.itinerary, list(orbit.z))
        assert moved.success, moved.message
        for form, flow in zip(forms, moved.system.flows, strict=True):
            for row in range(3):
                found = form[row, 0] + form[row, 1] * s + form[row, 2] * ball(0, 1)
                assert (found + ball(0, 1e-12)).contains(arb(float(flow.start[row])))


# Multipliers


@pytest.mark.parametrize(
    ("multipliers", "failing"),
    [
        ((1.1, 0.0, 0.0), 0),
        ((-1.1, 0.0, 0.0), 1),
        ((2.0, 1.2, 0.6), 2),
        ((-2.0, -1.2, -0.6), 3),
        ((1.1j, -1.1j, 0.0), 4),
    ],
)
def test_each_of_the_conditions_alone_shows_an_unstable_orbit(multipliers, failing) -> None:
    if isinstance(multipliers[0], complex):
        matrix = arb_mat([[0, -1.1, 0], [1.1, 0, 0], [0, 0, 0]])
    else:
        matrix = arb_mat(
            [[m if i == j else 0 for j in range(3)] for i, m in enumerate(multipliers)]
        )
    jury = characteristic(matrix).jury
    assert [k for k, value in enumerate(jury) if not value > 0] == [failing]


def test_a_characteristic_polynomial_is_that_of_its_matrix() -> None:
    rng = np.random.default_rng(7)
    for _ in range(20):
        rows = rng.integers(-9, 10, size=(3, 3)).tolist()
        found = characteristic(arb_mat(rows))
        polynomial = np.poly(np.array(rows, dtype=float))
        told = [1.0, *map(float, (-found.trace, found.minors, -found.determinant))]
        assert told == pytest.approx(polynomial, abs=1e-8)
