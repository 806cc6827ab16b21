"""Guards proved positive: polynomials with their bounds, and sines of which the zeros are known."""

import math
from itertools import product
from math import comb, factorial, pi

import pytest
from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import Unproved, arb, ball, largest, precision
from capsule_sym._enclosures.numbers.fields import Exponential
from capsule_sym._enclosures.passage import guards
from capsule_sym._enclosures.passage.guards import Line, Signs
from tests.enclosures.case import precise


class Linear:
    """A field of any size: y' = A y, with linear guards of y."""

    stick = False

    def __init__(self, rates: list[list[float]], rows: list[list[float]]) -> None:
        self.index, self.A, self.guards = 1, arb_mat(rates), arb_mat(rows)
        self.norm, self._exponential = largest(self.A), Exponential(self.A)
        self.terms, self.flow = self._exponential.terms, self._exponential.rest


bits = precise(128)


def waves(guards: list[tuple[float, float]], rate: float = 1.0) -> Linear:
    """Guards sin(rate t) cos(phase) + cos(rate t) sin(phase) + constant, of their states."""
    rows = [[math.cos(phase), math.sin(phase), constant] for phase, constant in guards]
    return Linear([[0, rate, 0], [-rate, 0, 0], [0, 0, 0]], rows)


def wave(phase: float) -> arb_mat:
    """Sine, cosine and 1 at a phase."""
    sine, cosine = arb(phase).sin_cos()
    return arb_mat([[sine], [cosine], [1]])


# The remainder of a guard's polynomial


@pytest.mark.parametrize("rate", [1.0, -1.0, 2.0])
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("derivative", [False, True])
@pytest.mark.parametrize(("sense", "length"), [(1, 0.75), (-1, 0.75), (1, 0.125)])
def test_a_guard_is_held_by_few_terms_and_their_remainder(
    rate, order, derivative, sense, length, monkeypatch
) -> None:
    """The guard exp(rate t) of a line, without its terms below the order, over t^order."""
    monkeypatch.setattr(guards, "_ORDER", 3)
    line = Line(Linear([[rate]], [[1]]), sense)
    shaped, rest = line.polynomial(0, order, arb_mat([[1, 1]]), length, derivative)
    n = shaped.nrows() - 1
    for share, direction in product((0.25, 0.5, 1.0), (-1.0, 1.0)):
        t = arb(share * length)
        bases = [comb(n, k) * arb(share) ** k * arb(1 - share) ** (n - k) for k in range(n + 1)]
        told = sum(
            (b * (shaped[k, 0] + shaped[k, 1] * direction) for k, b in enumerate(bases)), arb(0)
        )
        powers = range(order, 60)
        terms = [arb(rate * sense) ** k / factorial(k) * t ** (k - order) for k in powers]
        if derivative:
            terms = [x * (k - order) / t for k, x in zip(powers, terms, strict=True)]
        true = sum(terms, arb(0)) * (1 + direction)
        assert abs(told - true) <= rest


def test_a_guard_is_positive_only_beyond_its_remainder(monkeypatch: pytest.MonkeyPatch) -> None:
    """1.25 - t^2/2 - ..., to first order: 1.25."""
    monkeypatch.setattr(guards, "_ORDER", 1)
    line = Line(waves([(pi / 2, 0.25)]), 1)
    assert line.positive(0, 0, wave(0), 0.5)
    assert not line.positive(0, 0, wave(0), 2.0)
    assert math.cos(2.0) + 0.25 < 0


def test_a_guard_is_positive_only_in_all_directions() -> None:
    line = Line(Linear([[0, 0], [0, 0]], [[1, 0]]), 1)
    for size, held in ((0.9, True), (1.1, None)):
        assert line.positive(0, 0, arb_mat([[1, size], [0, 0]]), 0.5) is held
    # A direction along the other coordinate comes in with time.
    line = Line(Linear([[0, 1], [0, 0]], [[1, 0]]), 1)
    for size, held in ((1.5, True), (2.5, False)):
        assert line.positive(0, 0, arb_mat([[1, 0], [0, size]]), 0.5) is held


def test_the_flow_over_a_piece_has_its_error() -> None:
    field = waves([(0, 0)])
    for sense, length in product((1, -1), (0.25, 0.75, 1.5)):
        with precision(1024):
            exact = (field.A * arb(sense * length)).exp()
        step = Line(field, sense).step(length)
        assert all(step[i, j].contains(exact[i, j]) for i, j in product(range(3), repeat=2))


# Segments


def proved(guard: tuple[float, float], h: arb, orders: tuple[int, int], rate: float = 1.0) -> bool:
    """True if the guard sin(rate t + phase) + constant is proved positive for a time h."""
    phase, constant = guard
    field = waves([(phase, constant), (0.0, 2.0)], rate)
    end = field.flow(h) * wave(0)
    try:
        Signs().segment(field, wave(0), end, h, ((orders[0], 0), (orders[1], 0)), "the segment")
    except Unproved as error:
        assert "is not proved positive along the segment" in str(error)  # noqa: PT017
        return False
    return True


DIP = math.acos(0.99)
CASES = [
    ((0.5, 0.0), 2.5, (0, 0), 1.0, True),
    ((0.5, 0.0), 2.7, (0, 0), 1.0, False),
    ((0.0, 0.0), 3.0, (1, 0), 1.0, True),
    ((0.0, 0.0), 3.2, (1, 0), 1.0, False),
    ((0.0, 0.0), 0.3, (1, 0), 1.0, True),
    ((0.0, 0.0), 0.3, (1, 0), 12.0, False),
    ((-pi / 2, 1.0), 6.0, (2, 0), 1.0, True),
    ((-pi / 2, 1.0), 6.0, (2, 0), -1.0, True),
    ((pi - 3.0, 0.0), 3.0, (0, 1), 1.0, True),
    ((pi - 3.3, 0.0), 3.3, (0, 1), 1.0, False),
    ((pi - 0.5, 0.0), 0.5, (0, 1), 1.0, True),
    ((-0.5, 0.0), 0.5, (0, 1), 1.0, False),  # negative, and rising to 0
    ((pi - 0.75 * 6, 0.0), 0.75, (0, 1), 6.0, False),  # negative, then positive
    ((0.0, 0.0), pi, (1, 1), 1.0, True),
    ((0.0, 0.0), 2 * pi, (1, 1), 1.0, False),
    ((0.0, 0.0), 3 * pi, (1, 1), 1.0, False),
    ((0.0, 0.0), 0.5, (1, 1), 2 * pi, True),
    ((0.0, 0.0), 0.5, (1, 1), 6 * pi, False),
    ((pi / 2, 0.99), pi + DIP, (0, 1), 1.0, False),  # negative for a short time before the end
    ((pi / 2, 0.99), pi - DIP, (0, 1), 1.0, True),
    ((pi / 2, 0.99), 3.5, (0, 0), 1.0, False),
    ((pi / 2, 1.01), 6.5, (0, 0), 1.0, True),
]


@pytest.mark.parametrize("after", [1, 32])
@pytest.mark.parametrize(("guard", "h", "orders", "rate", "positive"), CASES)
def test_a_guard_is_proved_exactly_where_it_is_positive(
    guard, h, orders, rate, positive, after, monkeypatch
) -> None:
    """States are computed from the segment's end after each piece, or not at all."""
    monkeypatch.setattr(guards, "_ANEW", after)
    assert proved(guard, ball(h, 1e-20), orders, rate) is positive


@pytest.mark.parametrize("after", [1, 32])
@pytest.mark.parametrize(("reach", "held"), [(0.9, True), (1.6, False)])
def test_a_guard_is_watched_backwards_from_an_end(after, reach, held, monkeypatch) -> None:
    """sin(1 - t), of which the second piece has the zero."""
    monkeypatch.setattr(guards, "_ANEW", after)
    field = waves([(1.0, 0.0)])
    assert Signs().pieces(field, -1, 0, 0, wave(0), reach, 0.75) is held


@pytest.mark.parametrize(
    ("guard", "phase", "order", "sense", "reach", "held"),
    [
        ((0.0, 0.0), 0.0, 0, 1, 3.0, True),  # sin t
        ((0.0, 0.0), 0.0, 0, 1, 3.3, False),
        ((0.0, 0.0), 0.0, 0, -1, 0.5, False),
        ((0.0, 1.0), -pi / 2, 1, 1, 6.0, True),  # 1 - cos t, over t
        ((0.0, 1.0), -pi / 2, 1, -1, 6.0, True),
        ((0.0, -1.0), pi / 2, 1, 1, 0.5, False),  # cos t - 1
        ((0.0, 0.0), 0.0, 1, 1, 0.5, False),  # sin t over t falls
        ((0.0, 0.5), -pi / 2 - 0.01, 0, 1, 0.5, False),  # falls from its start
    ],
)
def test_a_guard_that_does_not_fall_at_an_end_is_proved_by_its_derivatives(
    guard, phase, order, sense, reach, held
) -> None:
    field = waves([guard])
    assert Signs().rising(field, sense, 0, order, wave(phase), reach) is held


def test_a_guard_is_watched_for_the_longest_duration() -> None:
    assert proved((0.5, 0.0), ball(2.0, 0.5), (0, 0))
    assert not proved((0.5, 0.0), ball(2.0, 0.75), (0, 0))


def test_every_guard_of_a_field_is_watched() -> None:
    for which in range(2):
        rows = [(0.0, 2.0), (0.0, 2.0)]
        rows[which] = (0.0, -0.5)
        with pytest.raises(Unproved, match=("the gap", "the drift")[which]):
            Signs().segment(waves(rows), wave(0), wave(1), arb(1), ((0, 0), (0, 0)), "the segment")


@pytest.mark.parametrize("radius", [0.01, 0.02, 1.0])
def test_a_duration_that_may_not_be_positive_is_no_segment(radius: float) -> None:
    field = waves([(0.0, 2.0), (0.0, 2.0)])
    with pytest.raises(Unproved, match="the duration of the segment is not proved positive"):
        Signs().segment(
            field, wave(0), wave(0), ball(0.01, radius), ((0, 0), (0, 0)), "the segment"
        )


def test_other_fields_have_other_lines() -> None:
    watch, one, other = Signs(), waves([(0.0, 2.0)]), waves([(0.0, -2.0)])
    kept = watch.line(one, 1)
    assert watch.line(one, 1) is kept
    assert watch.line(one, -1) is not kept
    assert watch.line(other, 1) is not kept


def test_a_length_with_few_digits_is_no_shorter() -> None:
    for length in (0.3, 0.7500001, 1e-5, 1 / 3):
        assert length <= guards._dyadic(length) < length * 1.04


def test_guards_are_those_of_all_states_of_a_form() -> None:
    """sin(0.5 + t) with a direction, along which the phase is less."""
    field = waves([(0.0, 0.0), (0.0, 2.0)])
    start = arb_mat([[x, y] for (x,), y in zip(wave(0.5).tolist(), (1.0, 0.0, 0.0), strict=True)])
    for size, held in ((0.1, True), (0.6, False)):
        form = start * arb_mat([[1, 0], [0, size]])
        watched = Signs()._guard(field, 0, 0, 0, form, form, 1.0)
        assert watched is held
