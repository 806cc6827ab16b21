"""Velocities of the motions from rest over parts of the drives, against single motions."""

from __future__ import annotations

import json
import math
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from flint import arb_mat
from scipy.integrate import quad_vec
from scipy.linalg import expm

from capsule_sym import InvalidInput, Parameters, simulate
from capsule_sym._enclosures.numbers.balls import (
    Unproved,
    arb,
    ball,
    floats,
    matrix,
    precision,
    thin,
)
from capsule_sym._enclosures.numbers.fields import SIZE, C, Field
from capsule_sym._enclosures.passage import exchanges
from capsule_sym._orbits.shooting.equations import PARAMETERS
from paper.proofs import optimum
from paper.proofs.attraction import PERIODS, Motions
from paper.proofs.case import DRIVES, EXACT
from paper.proofs.frequencies import Driven
from paper.proofs.guesses import steps_of
from paper.proofs.parts import DrivePart
from paper.proofs.segments import Interval, Passage
from paper.proofs.subdivision import DRIVES as TASK
from paper.proofs.subdivision import begun, prove

VALUES = {name: ball(EXACT[name]) for name in EXACT} | {"gamma": ball("3.3")}
ALPHAS, OMEGAS = Interval(1.95, 2e-4), Interval(0.768, 4e-5)
CORNERS = [*product((-1.0, 0.0, 0.6, 1.0), repeat=2)]


def driven(index: int, middle: float, radius: float) -> Driven:
    values = VALUES | {"alpha": arb("2.8"), "omega": arb(middle, radius)}
    return Driven(index, values, arb(middle), arb(radius))


def rates(index: int, omega: float) -> np.ndarray:
    return floats(Field(index, VALUES | {"alpha": arb(2), "omega": arb(omega)}).A)


@pytest.mark.parametrize("index", range(1, 7))
@pytest.mark.parametrize("h", [0.07, 0.9, 2.6])
def test_a_flow_of_many_frequencies_holds_that_of_each(index: int, h: float) -> None:
    with precision(80):
        found = driven(index, 0.8, 0.03).flow(arb(h))
    for omega in (0.77, 0.79, 0.83):
        exact = expm(rates(index, omega) * h)
        for i, j in product(range(SIZE), repeat=2):
            if index not in (2, 5) or i != C:  # v_c is no state of stick
                assert found[i, j].overlaps(arb(exact[i, j], 1e-13)), (i, j)
    widths = np.array([[float(x.rad()) for x in row] for row in found.tolist()])
    assert np.all(widths[:, [0, 1, 2, 5]] < 1e-13)


@pytest.mark.parametrize("h", [-0.8, -3.0])
def test_a_flow_backwards_holds_that_of_each_frequency(h: float) -> None:
    """With strong damping, before a unit of v_r the states were larger than they are after it."""
    damped = VALUES | {"alpha": arb(2), "zeta": ball("0.5"), "gamma": ball("0.5")}
    middle, radius, index = 0.2, 0.02, 3
    driven = Driven(index, damped | {"omega": arb(middle, radius)}, arb(middle), arb(radius))
    with precision(80):
        found = driven.flow(arb(h))
    for omega in (0.18, 0.21, 0.22):
        exact = expm(floats(Field(index, damped | {"omega": arb(omega)}).A) * h)
        for i, j in product(range(SIZE), repeat=2):
            assert found[i, j].overlaps(arb(exact[i, j], 1e-10)), (i, j)


def test_a_duration_that_is_hardly_known_takes_no_time() -> None:
    field = driven(1, 0.8, 0.03)
    found = field.flow(arb(0, 2e3))
    assert not found[0, 3].is_finite()
    assert field._ahead._bounds == [[arb(0)] * 3]


@pytest.mark.parametrize("index", [1, 3, 6])
def test_a_bundle_of_many_frequencies_holds_each_after_a_time(index: int) -> None:
    middle, radius, h = 0.8, 0.02, 2.3
    bundle = np.zeros((SIZE + 2, 4))
    bundle[:SIZE, 0] = 0.3, -0.2, 0.1, 2 * math.cos(0.4), 2 * math.sin(0.4), 1.0
    bundle[:3, 1:] = np.random.default_rng(2).uniform(-0.02, 0.02, (3, 3))
    bundle[3:5, 1] = 0.4 * bundle[3:5, 0]  # alpha from 1.2 to 2.8
    whole = bundle[:, :1] * 1.0
    hull = arb_mat(
        [[arb(x, float(np.sum(abs(row[1:]))))] for (x, *_), row in zip(bundle, bundle, strict=True)]
    )
    with precision(80):
        moved = driven(index, middle, radius).moved(arb(h), thin(bundle), hull, thin(whole))
    found = floats(moved)
    rest = np.sum(abs(found[:, 4:]), axis=1) + 1e-12
    used = 0.0
    for s_a, s_w, e in product((-1.0, 0.4, 1.0), repeat=3):
        state = bundle[:SIZE] @ (1.0, s_a, s_w, e)
        A = rates(index, middle + radius * s_w)
        there = expm(A * h) @ state
        travelled, _ = quad_vec(lambda t, A=A, state=state: (expm(A * t) @ state)[C], 0, h)
        away = abs(np.array([*there, h, travelled]) - found[:, :4] @ (1.0, s_a, s_w, e))
        assert np.all(away <= rest)
        used = max(used, float(np.max(away[[0, 1, 2, 7]] / rest[[0, 1, 2, 7]])))
    assert used > 0.05  # the bound is not wider than twenty times what it holds


def test_the_second_order_of_a_drive_is_that_of_the_greatest_amplitude() -> None:
    """At its greatest value a drive changes by a (d h)^2/2, and not at first order."""
    middle, radius, h = 0.8, 0.02, 2.0
    alpha, omega = arb(2, 0.75), arb(middle, radius)
    bundle = np.zeros((SIZE + 2, 3))
    bundle[SIZE - 1, 0] = 1.0
    bundle[3:5, 0] = 2.75 * math.cos(-middle * h), 2.75 * math.sin(-middle * h)
    with precision(80):
        field = Driven(1, VALUES | {"alpha": alpha, "omega": omega}, arb(middle), arb(radius))
        moved = floats(field.moved(arb(h), thin(bundle), *[thin(bundle[:, :1])] * 2))
    for s in (-1.0, 1.0):
        drive = 2.75 * math.cos(radius * s * h)
        assert abs(drive - moved[3, 0]) <= np.sum(abs(moved[3, 3:])) + 1e-12


def test_a_displacement_is_held_at_another_instant() -> None:
    index, reach = 1, 0.3
    moved, late = np.zeros((SIZE + 2, 2)), np.array([[0.0, reach]])
    moved[:SIZE, 0] = 0.3, -0.2, 0.1, 1.8, 0.7, 1.0
    moved[C, 1] = 0.05
    with precision(80):
        field = driven(index, 0.8, 0.0)
        found = exchanges.shifted(field, thin(moved), thin(late), arb(0), arb(0, reach))
    held = floats(found)
    rest = np.sum(abs(held[:, 2:]), axis=1)
    for s in (-1.0, -0.5, 1.0):
        state, A = moved[:SIZE] @ (1.0, s), rates(index, 0.8)
        exact, _ = quad_vec(lambda t, A=A, state=state: (expm(A * t) @ state)[C], 0, s * reach)
        assert abs(exact - held[-1, :2] @ (1.0, s)) <= rest[-1]


def motions(alphas: Interval, omegas: Interval) -> Motions:
    values = VALUES | {"omega": omegas.hull}
    middles = {name: float(VALUES[name].mid()) for name in PARAMETERS if name in VALUES}
    start = Parameters(**middles | {"alpha": alphas.middle, "omega": omegas.middle})
    return Motions(Passage(values, alphas, omegas=omegas), simulate(start, periods=PERIODS))


def test_a_bundle_holds_the_motions_of_its_drives() -> None:
    with precision(80):
        given = motions(ALPHAS, OMEGAS)
        found = given.passage.section(matrix(3, 3), arb(0))
        ahead = given.passage.turn(arb(given.offset))
        found = given.passage.moved(found, steps_of(given.run, 0, given.offset), ahead, given.angle)
        for section in range(3):
            found = given.passage.moved(found, given.steps(section), given.turn, given.angle)
        _, displaced = given.displaced(found, 3)
    rest = np.sum(abs(found[:3, 3:]), axis=1)
    assert np.max(rest) < 4e3 * (OMEGAS.radius**2 + ALPHAS.radius**2)  # of second order
    columns = floats(arb_mat([displaced]))[0]
    beside = sum(float(x.abs_upper()) for x in displaced[3:]) + float(displaced[0].rad())
    for s_a, s_w in CORNERS:
        alpha, omega = ALPHAS.middle + s_a * ALPHAS.radius, OMEGAS.middle + s_w * OMEGAS.radius
        run = simulate(Parameters(alpha=alpha, omega=omega), periods=8)
        times = [math.tau / omega * (k + given.offset) for k in (3, 4)]
        state = run([times[0]])[0]
        assert np.all(abs(state - found[:3, :3] @ (1.0, s_a, s_w)) <= rest + 1e-11)
        moved = np.diff(run.position(times))[0]
        assert abs(moved - columns[:3] @ (1.0, s_a, s_w)) <= beside + 1e-11


@pytest.mark.long
def test_velocities_of_a_part_are_within_its_enclosure() -> None:
    found = optimum.velocity(ALPHAS, OMEGAS)
    for s_a, s_w in CORNERS:
        alpha, omega = ALPHAS.middle + s_a * ALPHAS.radius, OMEGAS.middle + s_w * OMEGAS.radius
        assert found.contains(arb(average(alpha, omega)))
    assert float(found.rad()) < 1e-4


@pytest.mark.long
def test_velocities_are_those_of_the_whole_box(monkeypatch: pytest.MonkeyPatch) -> None:
    """The periodic motions are in the box, and not on its line."""
    begun = list[np.ndarray]()
    tendency, displaced = Motions.tendency, Motions.displaced
    found = []
    monkeypatch.setattr(Motions, "tendency", lambda self: found.append(tendency(self)) or found[0])
    monkeypatch.setattr(
        Motions, "displaced", lambda self, *given: begun.append(given[0]) or displaced(self, *given)
    )
    optimum.velocity(ALPHAS, OMEGAS)
    box, first = found[0].box, begun[0][:3]
    assert np.all(abs(first[:, :3] - box[:, :3]) == 0)
    assert np.all(np.sum(abs(first[:, 3:]), axis=1) >= np.sum(abs(box[:, 3:]), axis=1))
    assert np.any(box[:, 3:])


def average(alpha: float, omega: float) -> float:
    """Average velocity of the motion that is reached from rest."""
    run = simulate(Parameters(alpha=alpha, omega=omega), periods=400)
    return float(run.steady(1e-9).progression / (math.tau / omega))


def test_a_turn_holds_that_of_each_frequency() -> None:
    given = Passage(VALUES, ALPHAS, omegas=Interval(0.8, 0.05))
    first, _, slope = given.turn(arb(1.5))
    for s in (-1.0, -0.3, 1.0):
        assert (first + slope * arb(s)).contains(arb(1.5 * math.tau / (0.8 + 0.05 * s), 1e-14))
    assert float(first.rad()) < 0.06


def test_a_speed_holds_that_of_each_frequency() -> None:
    omegas = Interval(0.8, 0.05)
    row = [arb(2.0), arb(0.1), arb(0.3), arb(0, 0.02)]
    found = optimum._speed(row, Passage(VALUES, ALPHAS, omegas=omegas))
    for s_a, s_w, e in product((-1, 1), repeat=3):
        displaced = 2.0 + 0.1 * s_a + 0.3 * s_w + 0.02 * e
        assert found.contains(arb(displaced * (0.8 + 0.05 * s_w) / math.tau, 1e-14))


@pytest.mark.long
def test_the_best_is_the_best_of_a_grid() -> None:
    best = float(optimum.best().mid())
    assert best == pytest.approx(average(2.0, float(optimum.BEST["omega"])), abs=1e-11)
    assert float(optimum.best().rad()) < 1e-12
    grid = product(np.linspace(*DRIVES[0], 12), np.linspace(*DRIVES[1], 12))
    assert all(average(alpha, omega) < best for alpha, omega in grid)


@pytest.mark.long
def test_a_part_is_proved_only_below_the_best(monkeypatch: pytest.MonkeyPatch) -> None:
    far, near = DrivePart(6, 3, 8, 11), DrivePart(11, 2047, 11, 937)
    assert optimum.attempt(far).itinerary is not None
    assert optimum.attempt(near).itinerary is not None
    monkeypatch.setattr(optimum, "ROOM", -1e-5)
    assert optimum.attempt(near).itinerary is None
    monkeypatch.setattr(optimum, "ROOM", -0.02)
    assert optimum.attempt(far).itinerary is None


def test_the_best_is_no_faster_than_the_least_of_its_enclosure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    part = DrivePart(6, 3, 8, 11)
    monkeypatch.setattr(optimum, "best", lambda: arb(1, 1e-3))
    monkeypatch.setattr(optimum, "velocity", lambda *given: arb(1 - 1e-3 + 2e-6))
    assert optimum.attempt(part).itinerary is None
    monkeypatch.setattr(optimum, "velocity", lambda *given: arb(1 - 1e-3 + 5e-7))
    assert optimum.attempt(part).itinerary is not None


def test_a_part_with_a_bifurcation_is_not_proved() -> None:
    with pytest.raises(Unproved):
        optimum.velocity(Interval(1.95, 0.05), Interval(0.77, 0.02))


def test_drives_cover_their_box() -> None:
    first = TASK.first()
    assert sum(one.area for one in first) == 1
    for one in (first[0], first[-1]):
        halves = one.halved((0,)) + one.halved((1,))
        assert [half.area for half in halves] == [one.area / 2] * 4
    least = min(one.alphas.middle - one.alphas.radius for one in first)
    most = max(one.omegas.middle + one.omegas.radius for one in first)
    assert least <= DRIVES[0][0]
    assert most >= DRIVES[1][1]


def test_work_on_drives_resumes(tmp_path: Path) -> None:
    path = tmp_path / "drives.jsonl"
    prove(path, 1e-9, workers=1, task=TASK)
    part = DrivePart(6, 3, 7, 11)
    with path.open("a") as file:
        line = {"part": list(part), "seconds": 1.0, "work": 0.5}
        file.write(json.dumps(line | {"along": [1]}) + "\n")
        half = part.halved((1,))[0]
        file.write(json.dumps(line | {"part": list(half), "itinerary": "not above 1"}) + "\n")
    plane = begun(path, TASK)
    assert (plane.patches, plane.share, len(plane.open)) == (1, 2.0**-14, 2**13)
    with pytest.raises(InvalidInput, match="enclose --region"):
        begun(path)
