"""The orbit equations: their derivatives, their limits, and the number systems they run in."""

from random import Random
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

from capsule_sym import InvalidInput, Parameters, results, scenes
from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._map.precision import workspace
from capsule_sym._orbits.shooting import closed
from capsule_sym._orbits.shooting.equations import PARAMETERS, ShootingSystem, shooting, solve
from capsule_sym._orbits.shooting.itinerary import ItinerarySegment
from tests.sampling import sampled, some

STEP = mpf("1e-20")
# Every field and guard, with roots divided out once and twice.
WORDS = ("52", "5452", "541236", "541256", "4136", "2123", "2")
VALUES = tuple(Parameters(alpha=1.3, delta=0.1).to_dict().values())


def unknowns(itinerary: results.Itinerary) -> list[float]:
    """A point with nothing special about it: no equation holds there."""
    durations = [0.3 + 0.17 * ((5 * i) % 7) for i in range(len(itinerary))]
    return [0.13, 0.7, 0.21, 1.1, *durations]


def derivative_error(itinerary: results.Itinerary, z: list[Any]) -> Any:
    """Difference between the derivatives and a central difference, along a random direction.

    The direction has a part along every unknown and every parameter.
    """
    values = [mpf(value) for value in VALUES]
    random = Random(str(itinerary))
    along = np.array([mpf(random.uniform(0.5, 1)) for _ in range(len(z) + 7)])
    system = shoot_exactly(itinerary, z, values)
    columns = np.vstack([np.concatenate([system.by_z, system.by_p], axis=1), system.advance_by])
    ends = [
        everything(shoot_exactly(itinerary, list(at[: len(z)]), list(at[len(z) :])))
        for at in (np.array([*z, *values]) + side * STEP * along for side in (1, -1))
    ]
    return max(abs((ends[0] - ends[1]) / (2 * STEP) - columns @ along))


def everything(system: ShootingSystem) -> Any:
    return np.array([*system.residual, system.advance])


def shoot_exactly(itinerary: results.Itinerary, z: list[Any], values: list[Any]) -> ShootingSystem:
    with backend("mpmath") as numbers:
        number = numbers.number
        return shooting(
            numbers, [number(v) for v in values], itinerary, np.array([number(v) for v in z])
        )


@sampled
@pytest.mark.parametrize("text", some(WORDS, 3))
def test_derivatives_are_the_slopes_of_the_residual(text: str) -> None:
    itinerary = results.Itinerary.parse(text)
    with mp.workdps(60):
        assert derivative_error(itinerary, unknowns(itinerary)) < mpf("1e-30")


@pytest.mark.long
@pytest.mark.parametrize(
    ("text", "segment"), [("5452", 1), ("5452", 3), ("541236", 3), ("4136", 2)]
)
def test_derivatives_hold_for_short_and_for_negative_durations(text: str, segment: int) -> None:
    itinerary = results.Itinerary.parse(text)
    for duration in (0.01, -0.01):
        z = unknowns(itinerary)
        z[4 + segment] = duration
        with mp.workdps(60):
            assert derivative_error(itinerary, z) < mpf("1e-28")


def test_a_wrong_derivative_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    run = closed.ClosedForms.run

    def wrong(*arguments: Any) -> Any:
        values, matrix = run(*arguments)
        matrix = matrix.copy()
        matrix[1, 8] = -matrix[1, 8]  # v_r by zeta
        return values, matrix

    monkeypatch.setattr(closed.ClosedForms, "run", wrong)
    itinerary = results.Itinerary.parse("52")
    with mp.workdps(60):
        assert derivative_error(itinerary, unknowns(itinerary)) > mpf("1e-6")


def test_gap_over_the_duration_tends_to_the_velocity() -> None:
    itinerary = results.Itinerary.parse("52")
    z = np.array([VALUES[2], 0.4, 0.0, 1.0, 0.0, 5.0])
    with backend("numpy") as numbers:
        system = shooting(numbers, VALUES, itinerary, z)
    assert system.residual[0] == pytest.approx(0.4, rel=1e-15)


def test_slip_velocity_over_the_duration_squared_tends_to_half_the_rate_of_the_force() -> None:
    """v_c = P' h^2 / (2 gamma) + ... where a slip begins."""
    alpha, _, delta, zeta, beta, gamma, f_b = VALUES
    itinerary, x_r, theta = results.Itinerary.parse("4525"), 0.2, 0.6
    v_r = (f_b - x_r - beta * (x_r - delta)) / (2 * zeta)  # the force is at its bound
    acceleration = alpha * np.cos(theta) - f_b  # of F5 and of F4 there: Eq. (10), (11)
    rate = (1 + beta) * v_r + 2 * zeta * acceleration
    with backend("numpy") as numbers:
        system = shooting(
            numbers, VALUES, itinerary, np.array([x_r, v_r, 0.0, theta, 0.0, 1.0, 1.0, 1.0])
        )
    assert itinerary.zeros(0) == 2
    assert system.residual[0] == pytest.approx(rate / (2 * gamma), rel=1e-13)


@pytest.mark.parametrize("duration", [0.0, 1e-12, 1e-9, 1e-7, 1e-5, 1e-3, -1e-9, -1e-5, -1e-3])
@pytest.mark.parametrize(("text", "gradient"), [("52", 1e-9), ("4136", 1e-9), ("4525", 3e-7)])
def test_tiny_legs_lose_no_digits(text: str, gradient: float, duration: float) -> None:
    """The first segment begins where its guard vanishes; the gradient there is extrapolated."""
    _, _, delta, zeta, beta, _, f_b = VALUES
    itinerary, x_r = results.Itinerary.parse(text), delta if text == "52" else 0.2
    v_r = (f_b - x_r - beta * (x_r - delta)) / (2 * zeta)
    z = np.array([x_r, v_r, 0.0, 0.6, duration, *unknowns(itinerary)[5:]])
    with backend("numpy") as numbers:
        system = shooting(numbers, VALUES, itinerary, z)
    exact = shoot_exactly(itinerary, list(z), [mpf(v) for v in VALUES])
    scale = 1 + max(abs(exact.residual))
    with mp.workdps(60):
        assert max(abs(system.residual - exact.residual)) < 1e-14 * scale
        assert np.max(abs(system.by_z - exact.by_z)) < gradient * np.max(abs(exact.by_z))


@pytest.mark.parametrize("text", WORDS)
def test_core_and_kernels_give_the_same(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    itinerary = results.Itinerary.parse(text)
    with backend("numpy") as numbers:
        compiled = shooting(numbers, VALUES, itinerary, np.array(unknowns(itinerary)))
        monkeypatch.setattr(closed, "core_of", lambda scene: None)
        closed._constants.cache_clear()
        plain = shooting(numbers, VALUES, itinerary, np.array(unknowns(itinerary)))
    for name in ("residual", "by_z", "by_p", "advance_by"):
        one, two = getattr(compiled, name), getattr(plain, name)
        assert np.max(abs(one - two)) < 1e-12 * max(1.0, np.max(abs(two)))


def test_singular_systems_are_refused_in_both_number_systems() -> None:
    for name in ("numpy", "mpmath"):
        with backend(name) as numbers:
            matrix = np.array([[numbers.number(1), numbers.number(2)]] * 2)
            with pytest.raises(np.linalg.LinAlgError):
                solve(numbers, matrix, matrix[0])


def test_several_right_sides_take_one_factorisation(monkeypatch: pytest.MonkeyPatch) -> None:
    factored: list[Any] = []
    context = type(workspace())
    decompose = context.LU_decomp
    monkeypatch.setattr(
        context, "LU_decomp", lambda *given: factored.append(given) or decompose(*given)
    )
    with backend("mpmath") as numbers:
        matrix, right = (
            np.array([[numbers.number(abs(i - k) + i) for k in range(size)] for i in range(4)])
            for size in (4, 7)
        )
        solved = solve(numbers, matrix, right)
        assert len(factored) == 1
        assert np.max(abs(matrix @ solved - right)) < mpf("1e-47")


def test_word_knows_its_guards() -> None:
    itinerary = results.Itinerary.parse("F5 F4,F1 F2 F3 F6")
    guards = (Guard.UPPER, Guard.GAP, Guard.DRIFT, Guard.LOWER, Guard.GAP, Guard.DRIFT)
    assert itinerary.segments == tuple(map(ItinerarySegment, (5, 4, 1, 2, 3, 6), guards))
    assert str(itinerary) == "F5 F4 F1 F2 F3 F6"
    assert results.Itinerary.parse("236541").first == 3
    assert results.Itinerary.parse("236541").rotated(3).fields == (5, 4, 1, 2, 3, 6)
    assert [itinerary.zeros(i) for i in range(6)] == [0, 0, 0, 0, 0, 0]
    assert [results.Itinerary.parse("5452").zeros(i) for i in range(4)] == [0, 2, 0, 1]
    assert [results.Itinerary.parse("4136").zeros(i) for i in range(4)] == [0, 0, 0, 0]
    assert [results.Itinerary.parse("5252", 2).zeros(i) for i in range(4)] == [1, 1, 1, 1]


@pytest.mark.parametrize("text", ["", "57", "5 x", "1", "51", "5421"])
def test_impossible_words_are_refused(text: str) -> None:
    with pytest.raises(InvalidInput, match=r"itinerary = "):
        results.Itinerary.parse(text)


@pytest.mark.parametrize("fields", [(), (5,), (5, 2, 1)])
def test_impossible_halves_are_refused(fields: tuple[int, ...]) -> None:
    with pytest.raises(InvalidInput) as caught:
        results.Itinerary.of(fields, mirrored=True)
    assert (caught.value.field, caught.value.value) == ("itinerary", fields)
    # The image of a touch is at the other stop, if there is one; here at the low level of pulses.
    half = results.Itinerary.of((2, 5, 2), mirrored=True, scene=scenes.prototype)
    assert half.whole.fields == (2, 5, 2, 11, 17, 11)


def test_parameters_are_in_the_order_of_the_dataclass() -> None:
    assert tuple(Parameters().to_dict()) == PARAMETERS
