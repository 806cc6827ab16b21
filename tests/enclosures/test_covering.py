"""Where every motion goes: bounds against samples, sets of starts against exact motions."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.linalg import expm

from capsule_sym import Parameters, simulate, solve_orbit
from capsule_sym._enclosures.case import EXACT
from capsule_sym._enclosures.numbers.balls import Unproved, ball, precision
from capsule_sym._enclosures.regions import covering, trapping
from capsule_sym._enclosures.regions.trapping import trap

AT_3_3 = EXACT | {"gamma": "3.3"}


def exact(**given: str) -> dict:
    with precision(80):
        return {name: ball(value) for name, value in (AT_3_3 | given).items()}


def height(p: Parameters, x, v, c) -> np.ndarray:
    """W, as the derivation has it."""
    u, beyond = v + c, np.maximum(x - p.delta, 0)
    springs = x**2 / 2 + p.beta * beyond**2 / 2
    return u**2 / 2 + p.gamma * c**2 / 2 + springs + p.zeta * x * u + (p.zeta * x) ** 2


@pytest.mark.parametrize(
    ("left", "gamma", "slack"),
    [(1e6, 3.3, 1.0002), (0.5, 3.3, 1.03), (0.01, 3.3, 1.7), (0.01, 50.0, 1.7)],
)
def test_the_trap_is_as_high_as_w_may_still_grow(
    left: float, gamma: float, slack: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By samples, where the fastest motion leaves friction much, and where it leaves it little."""
    p, rng = Parameters(alpha=0.02, gamma=gamma), np.random.default_rng(1)
    monkeypatch.setattr(trapping, "_ARCS", 8192)
    fastest = ball((p.f_b - p.alpha - left) / p.zeta)
    monkeypatch.setattr(trapping, "_fastest", lambda _: fastest)
    monkeypatch.setattr(trapping, "_within", lambda level, _: float(level))
    with precision(80):
        level = trap(exact(alpha="0.02", gamma=str(gamma)))
    slowest = p.alpha**2 * (1 / p.zeta + p.zeta) / 4 / left  # |v_c| at which W falls anyway
    x, v, c = rng.uniform(-1, 1, (3, 600_000)) * [[0.25], [0.42], [slowest]]
    c[::2] = 0.0
    turn, radius = np.linspace(0, np.pi / 2, 20_001), p.alpha * np.sqrt(1 / p.zeta**2 + 1) / 2
    x[:20_001] = p.alpha / 2 + (1 - 1e-9) * radius * np.sin(turn)  # where it begins to fall
    v[:20_001] = p.alpha / (2 * p.zeta) + (1 - 1e-9) * radius * np.cos(turn)
    c[:20_001] = 0.0
    rate = p.alpha * (abs(v) + p.zeta * abs(x)) - p.zeta * (v**2 + x**2) - left * abs(c)
    highest = np.max(height(p, x, v, c)[rate >= 0])
    assert highest < level < slack * highest


def test_no_motion_is_faster_in_the_end_than_b_allows(monkeypatch: pytest.MonkeyPatch) -> None:
    """B along the ellipse outside which it falls."""
    monkeypatch.setattr(trapping, "_ARCS", 8192)
    p = Parameters(alpha=0.02)
    m, push = 1 + 1 / p.gamma, p.alpha + p.f_b / p.gamma
    damping, turn = m * p.zeta, np.linspace(0, np.pi / 2, 20_001)
    left = push**2 / (2 * damping) + push**2 * p.zeta / 2
    v = push / (2 * damping) + np.sqrt(left / (2 * damping)) * np.cos(turn)
    x = push / (2 * m) + np.sqrt(left / (2 * m * damping)) * np.sin(turn)
    rate = -2 * damping * v**2 - 2 * m * damping * x**2 + 2 * push * (v + damping * x)
    assert np.max(abs(rate)) < 1e-12
    springs = x**2 / 2 + p.beta * np.maximum(x - p.delta, 0) ** 2 / 2
    bound = v**2 / 2 + (v + 2 * damping * x) ** 2 / 2 + 2 * m * springs
    fastest = np.sqrt(2 * np.max(bound))
    with precision(80):
        assert fastest < float(trapping._fastest(exact(alpha="0.02"))) < 1.0002 * fastest


def test_the_highest_on_an_ellipse_is_not_that_of_some_points(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A sum is largest between two of the points."""
    monkeypatch.setattr(trapping, "_ARCS", 3)
    found = trapping._highest(lambda x, y: x + y, (ball(1), ball(2)), (ball(1), ball(1)))
    assert 3 + np.sqrt(2) < float(found) < 4.8


def test_a_light_capsule_adds_to_the_force() -> None:
    p, level = Parameters(alpha=0.02, gamma=0.001), 0.01
    with precision(80):
        held = trapping._within(ball(level), exact(gamma="0.001"))
    x = np.linspace(p.delta, held.ahead, 4001)
    left = level - (1 + p.zeta**2) * x**2 / 2 - p.beta * (x - p.delta) ** 2 / 2
    fast = np.sqrt(np.maximum(2 * left * (1 + 1 / p.gamma), 0)) - p.zeta * x
    most = np.max(x + p.beta * (x - p.delta) + 2 * p.zeta * fast)
    assert most < held.force < 1.5 * most


def test_what_friction_has_left_is_what_force_and_spring_do_not_need() -> None:
    seen: list[float] = []
    p = Parameters(alpha=0.02)
    with precision(80), pytest.MonkeyPatch.context() as patch:
        fastest = (p.f_b - p.alpha) / p.zeta
        patch.setattr(trapping, "_within", lambda level, _: seen.append(float(level)))
        patch.setattr(trapping, "_fastest", lambda _: ball(fastest * (1 - 1e-3)))
        trap(exact(alpha="0.02"))
        patch.setattr(trapping, "_fastest", lambda _: ball(fastest * (1 + 1e-3)))
        with pytest.raises(Unproved, match="too fast"):
            trap(exact(alpha="0.02"))
    assert len(seen) == 1


def test_bounds_of_the_trap_are_those_of_its_states() -> None:
    p, rng = Parameters(alpha=0.02), np.random.default_rng(2)
    held = trap(exact(alpha="0.02"))
    x, v, c = rng.uniform(-1, 1, (3, 600_000)) * [[0.5], [0.7], [0.3]]
    inside = height(p, x, v, c) <= held.level
    x, v, c = x[inside], v[inside], c[inside]
    assert 0.95 * held.ahead < np.max(x) < held.ahead
    assert 0.95 * held.back < -np.min(x) < held.back
    # For each x_r the largest v_r = u - v_c that W allows.
    x = np.linspace(p.delta, held.ahead, 4001)
    left = held.level - (1 + p.zeta**2) * x**2 / 2 - p.beta * (x - p.delta) ** 2 / 2
    fast = np.sqrt(np.maximum(2 * left * (1 + 1 / p.gamma), 0)) - p.zeta * x
    force = x + p.beta * (x - p.delta) + 2 * p.zeta * fast
    assert 0.9 * held.force < np.max(force) < held.force < 1
    rng = np.random.default_rng(3)
    x, v = rng.uniform(-1, 1, (2, 500_000)) * [[0.5], [0.7]]
    speeds = abs(v[height(p, x, v, 0.0) <= held.level])
    assert 0.93 * held.speed < np.max(speeds) < held.speed


@pytest.mark.parametrize("start", [(2.0, -1.0, 1.5), (-1.0, 3.0, -2.0)])
def test_motions_end_in_the_trap(start: tuple[float, ...]) -> None:
    p = Parameters(alpha=0.02)
    held = trap(exact(alpha="0.02"))
    run = simulate(p, start, periods=60)
    x, v, c = run(np.linspace(50, 60, 2000) * p.period).T
    assert not np.any(c)
    assert np.max(height(p, x, v, c)) < held.level


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"alpha": "0.03"}, "the force is not below"),
        ({"alpha": "0.02", "zeta": "0"}, "zeta is not positive"),
        ({"alpha": "0.9"}, "too fast"),
    ],
)
def test_what_is_not_trapped_is_not_told(given: dict[str, str], why: str) -> None:
    with precision(80), pytest.raises(Unproved, match=why):
        trap(exact(**given))


def resting(alpha: str) -> covering._Resting:
    values = exact(alpha=alpha)
    return covering._Resting({name: float(values[name]) for name in values}, trap(values))


DIRECTIONS = np.array([(np.cos(t), np.sin(t)) for t in np.linspace(0, np.pi, 37)])


def outside(alpha: float, starts: np.ndarray, half: np.ndarray, found: tuple) -> float:
    """The most by which a motion from a rectangle leaves what it became after a period."""
    p, worst = Parameters(alpha=alpha), 0.0
    for start, middle, sides in zip(starts, *found, strict=True):
        reach = np.sum(abs(DIRECTIONS @ sides), axis=1)
        for side in product((-1.0, 0.3, 1.0), repeat=2):
            x, v = start + half * side
            end = simulate(p, (x, v, 0.0), periods=1)([p.period])[0]
            assert end[2] == 0.0
            worst = max(worst, float(np.max(abs(DIRECTIONS @ (end[:2] - middle)) - reach)))
    return worst


STARTS = np.array([(0.05, 0.1), (0.15, -0.1), (-0.1, 0.2), (0.0, 0.03), (0.02, 0.0)])


def after_a_period(half: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    sides = np.tile(np.diag(half), (len(STARTS), 1, 1))
    return resting("0.02")._period(STARTS, sides)


@pytest.mark.parametrize("size", [2e-2, 2e-3, 1e-9])
def test_a_period_takes_rectangles_to_where_their_motions_go(size: float) -> None:
    half = np.array([size, size])
    found = after_a_period(half)
    assert outside(0.02, STARTS, half, found) < 1e-12
    if size < 1e-2:  # and not much farther
        spread = np.sum(abs(found[1]), axis=2)
        assert np.max(spread) < 6 * size + 2e-4


@pytest.mark.parametrize("part", ["ball", "constant", "stiffness", "sweep"])
def test_each_part_of_the_springs_bound_is_needed(
    part: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    spring = covering._Resting._spring
    half = np.array([2e-2, 2e-2])

    def without(self, x, v, wide, high):
        if part == "sweep":  # the states at the step's begin alone
            v, high = 0 * v, 0 * high
        stiff, constant, ball = spring(self, x, v, wide, high)
        return {
            "ball": (stiff, constant, 0 * ball),
            "constant": (stiff, 0 * constant, ball),
            "stiffness": (0 * stiff + 1, constant, ball),
        }.get(part, (stiff, constant, ball))

    monkeypatch.setattr(covering._Resting, "_spring", without)
    if part == "sweep":
        half = np.array([1e-9, 1e-9])
    assert outside(0.02, STARTS, half, after_a_period(half)) > 1e-9


def test_the_springs_bound_holds_along_a_step() -> None:
    """Of any motion in the trap: its place along the step, and the springs' force there."""
    one = resting("0.02")
    p, rng = Parameters(alpha=0.02), np.random.default_rng(4)
    for _ in range(300):
        x, v = rng.uniform(-0.02, 0.06), rng.uniform(-0.2, 0.2)
        wide, high = 10 ** rng.uniform(-6, -1.5, 2)
        told = one._spring(*(np.array([value]) for value in (x, v, wide, high)))
        stiff, constant, ball = (float(value[0]) for value in told)
        k = rng.integers(0, covering._STEPS)
        for side in product((-1, 1), repeat=2):
            begin = k * one.step
            state = (x + side[0] * wide, v + side[1] * high, 0.0)
            run = simulate(p, state, phase=begin, periods=1)
            for t in np.linspace(0, one.step, 7):
                place = run([begin + t])[0][0]
                force = place + p.beta * max(place - p.delta, 0)
                assert abs(force - (stiff * place - constant)) <= ball + 1e-11


def test_fewer_sides_span_no_less() -> None:
    rng = np.random.default_rng(5)
    sides = rng.normal(size=(4, 2, 300))
    found = covering._fewer(sides)
    assert found.shape == (4, 2, 2 * covering._DIRECTIONS)
    for turn in np.linspace(0, np.pi, 101):
        direction = np.array([np.cos(turn), np.sin(turn)])
        reach, less = (np.sum(abs(direction @ one), axis=-1) for one in (found, sides))
        assert np.all(less <= reach)
        assert np.all(reach < 1.15 * less)


def test_w_is_not_lower_on_a_rectangle_than_its_bound() -> None:
    one, p, rng = resting("0.02"), Parameters(alpha=0.02), np.random.default_rng(6)
    starts, half = rng.uniform(-0.4, 0.4, (400, 2)), np.array([0.03, 0.02])
    least = one._lowest(starts, half)
    inner = [
        height(p, *(starts + half * side).T, 0.0)
        for side in product(np.linspace(-1, 1, 9), repeat=2)
    ]
    assert np.all(least <= np.min(inner, axis=0))
    assert np.all(least >= np.min(inner, axis=0) - 0.02)


def test_a_box_about_the_orbit_is_contracted() -> None:
    found = covering.target(exact(alpha="0.02"))
    p = Parameters(alpha=0.02)
    orbit = solve_orbit(p)
    assert sorted(found.itinerary) == sorted(orbit.itinerary.fields)
    sides = np.linalg.inv(found.inverse) * found.radius
    ends = []
    for side in product((-1.0, 1.0), repeat=2):
        start = found.middle + sides @ side
        run = simulate(p, (*start, 0.0), periods=covering._TURNS)
        ends.append(run([covering._TURNS * p.period])[0][:2])
    places = (np.array(ends) - found.middle) @ found.inverse.T / found.radius
    assert np.max(abs(places)) < 1
    assert np.max(abs(places)) < found.factor + 1e-9
    assert np.max(np.ptp(places, axis=0)) / 2 < found.factor < 0.9
    inside = found.middle + 0.999 * sides @ (1, 1), found.middle + 1.001 * sides @ (1, 1)
    none = np.zeros((2, 2, 2))
    assert found.holds(np.array(inside), none).tolist() == [True, False]
    wide = np.stack([0.999 * sides, 1.001 * sides])
    assert found.holds(np.array([found.middle] * 2), wide).tolist() == [True, False]


def test_a_box_that_is_not_contracted_is_no_target(monkeypatch: pytest.MonkeyPatch) -> None:
    """One period turns this box so that it is not within itself."""
    monkeypatch.setattr(covering, "_TURNS", 1)
    monkeypatch.setattr(covering, "_RADII", (1e-3,))
    with pytest.raises(Unproved, match="no box"):
        covering.target(exact(alpha="0.02"))


def test_a_box_that_is_left_is_no_target(monkeypatch: pytest.MonkeyPatch) -> None:
    """After two periods the motion is not yet near enough, though nearby ones approach it."""
    assert covering.target(exact(alpha="0.005")).radius == 5e-3
    monkeypatch.setattr(covering, "_SETTLED", 2)
    with pytest.raises(Unproved, match="no box"):
        covering.target(exact(alpha="0.005"))


def test_a_step_is_that_of_the_exponential_with_the_error_of_its_ball() -> None:
    one, wide = resting("0.02"), np.array([[0.02, 0.01]])
    middle, force = np.array([[0.021, 0.05]]), (0.015, 0.01)
    stiff, constant, push = one._spring(*middle.T, *wide.T)
    flow, there, error = one._moved(middle, wide, force)
    rates = np.zeros((5, 5))
    rates[0, 1], rates[1, :] = 1, [-stiff[0], -2 * 0.05, 1, 0, 1]
    rates[2, 3], rates[3, 2] = -0.8, 0.8
    after = expm(rates * one.step)
    assert np.max(abs(flow[0] - after[:2, :2])) < covering._LOST / 4
    start = np.array([*middle[0], *force, constant[0]])
    assert np.max(abs(there[0] - (after @ start)[:2])) < covering._LOST / 4
    worst = after[:2, 4] * push[0] + 0.99 * covering._LOST  # pushed one way all the time
    assert push[0] > 1e-3
    for bound, pushed in zip(error, worst, strict=True):
        assert pushed < bound[0] < 1.2 * pushed


def test_a_step_away_from_the_gap_still_loses_something() -> None:
    middle, wide = np.array([[0.2, 0.05]]), np.array([[0.001, 0.001]])
    _, _, error = resting("0.02")._moved(middle, wide, (0.015, 0.01))
    assert [bound[0] for bound in error] == [covering._LOST] * 2


def test_states_too_large_for_the_bound_on_roundings_are_not_carried() -> None:
    one, sides = resting("0.02"), np.tile(1e-3 * np.eye(2), (2, 1, 1))
    _, found = one._period(np.array([[0.1, 0.1], [5.0, 0.0]]), sides)
    assert np.all(np.isfinite(found[0]))
    assert np.all(np.isinf(found[1]))


def test_every_motion_tends_to_one_orbit() -> None:
    found = covering.covering(AT_3_3 | {"alpha": "0.001"})
    assert found.itinerary == (2,)
    assert found.cells > 100
    assert found.trap.force < 1


def test_starts_that_are_not_carried_in_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """One period is not enough, however often starts are divided."""
    monkeypatch.setattr(covering, "_PERIODS", 1)
    monkeypatch.setattr(covering, "_DEEPEST", 0)
    with pytest.raises(Unproved, match="motions from x_r"):
        covering.covering(AT_3_3 | {"alpha": "0.001"})
    told = covering.record(AT_3_3 | {"alpha": "0.03"})
    assert told["failed"].startswith("trapping")


def test_all_of_the_trap_is_covered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where starts are divided: all states of the trap are in rectangles carried in."""
    one, rng = resting("0.001"), np.random.default_rng(7)
    held: list[np.ndarray] = []

    def into(self, target, starts, half):
        kept = rng.uniform(size=len(starts)) < 0.85
        held.extend(np.array([start - half, start + half]) for start in starts[kept])
        return np.where(kept, 1, -1)

    monkeypatch.setattr(covering._Resting, "_into", into)
    monkeypatch.setattr(covering, "_DEEPEST", 60)
    cells, _ = one.carried(None)
    assert cells == len(held)
    x, v = rng.uniform(-1, 1, (2, 3000)) * [[one.trap.back], [one.trap.speed]]
    p = Parameters(alpha=0.001)
    states = np.column_stack([x, v])[height(p, x, v, 0.0) <= one.trap.level]
    boxes = np.array(held)
    for state in states:
        assert np.any(np.all((boxes[:, 0] <= state) & (state <= boxes[:, 1]), axis=1))


@pytest.mark.long
@pytest.mark.parametrize("gamma", ["3.3", "3.0"])
@pytest.mark.parametrize(("alpha", "fields"), [("0.005", (2,)), ("0.02", (5, 2))])
def test_every_motion_of_two_regimes(gamma: str, alpha: str, fields: tuple[int, ...]) -> None:
    told = covering.record(EXACT | {"gamma": gamma, "alpha": alpha})
    assert not told["failed"]
    assert sorted(told["itinerary"]) == sorted(f"F{field}" for field in fields)
