"""Guards proved positive in doubles: against exponentials, and each term of the bound alone."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest
from scipy.linalg import expm

from capsule_sym._enclosures.numbers.balls import ball, floats, precision, symmetric, thin
from capsule_sym._enclosures.numbers.fields import SIZE, Field
from capsule_sym._enclosures.passage.guards import Line, Signs
from paper.proofs import margins
from paper.proofs.case import EXACT
from paper.proofs.margins import QuickWatch

VALUES = EXACT | {"gamma": "3.3"}


def field(index: int) -> Field:
    return Field(index, {name: ball(value) for name, value in VALUES.items()})


@pytest.mark.parametrize("index", range(1, 7))
@pytest.mark.parametrize(("length", "bits"), [(0.25, 80), (1.5, 80), (0.25, 12)])
def test_guards_are_within_their_bounds(
    index: int, length: float, bits: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On long pieces what is left of the series is large, with few bits what doubles miss."""
    monkeypatch.setattr(margins, "_LENGTH", length)
    rng = np.random.default_rng(index)
    exact = field(index)
    guards, rates = floats(exact.guards), floats(exact.A)
    with precision(bits):
        table = margins._Table(Line(field(index), 1), len(guards))
        table._grow(3)
    for guard, row in enumerate(guards):
        middle, absolute, error, rest = table._bounds[guard]
        assert np.array_equal(absolute, abs(middle))
        n = middle.shape[1] - 1
        for piece in range(3):
            state, t = rng.uniform(-1, 1, SIZE), rng.uniform(0, 1)
            shape = np.array([comb(n, k) * t**k * (1 - t) ** (n - k) for k in range(n + 1)])
            true = row @ expm(rates * length * (piece + t)) @ state
            off = shape @ (error[piece] @ abs(state)) + rest[piece] * np.max(abs(state))
            assert abs(shape @ middle[piece] @ state - true) <= off + 1e-12
            assert off < 1e-10 or (length, bits) != (0.25, 80)


def test_a_sum_of_products_loses_less_than_what_is_put_down_for_it() -> None:
    rng = np.random.default_rng(3)
    row, state = rng.normal(size=(2, 10_000, SIZE)).astype(np.longdouble)
    lost = abs(np.sum(row * state, axis=1) - np.sum((row * state).astype(float), axis=1))
    assert np.all(lost < margins._ROUNDING * np.sum(abs(row * state), axis=1))


@pytest.mark.parametrize("part", ["around", "error", "rest", "all"])
@pytest.mark.parametrize(("size", "held"), [(0.99, True), (1.01, False)])
def test_a_guard_is_positive_only_beyond_each_of_its_bounds(
    part: str, size: float, held: bool
) -> None:
    """The place 2, a coefficient 1/2: the value 1 less what may be missing."""
    table = margins._Table(Line(field(1), 1), 1)
    table._found = [[]] * 2
    middle = np.zeros((2, 1, SIZE))
    middle[:, 0, 0] = 0.5
    error, rest = np.zeros_like(middle), np.zeros(2)
    place, around = np.zeros(SIZE), np.zeros(SIZE)
    place[0] = 2.0
    share = size / 3 if part == "all" else size
    if part in ("around", "all"):
        around[0] = 2 * share
    if part in ("error", "all"):
        error[1, 0, 0] = share / (2.0 + around[0])
    if part in ("rest", "all"):
        rest[1] = share / (2.0 + around[0])
    table._bounds = [(middle, abs(middle), error, rest)]
    assert table.positive(0, margins._Start(place, around), 0, 2) is held
    assert table.positive(0, margins._Start(place, around), 0, 1) is (held or part != "around")


@pytest.mark.parametrize(
    ("row", "state"),
    [((1.0, -1 + 2.0**-50), (1.0, 1.0)), ((1e-200, 0.0), (1e-100, 0.0))],
    ids=["roundings", "underflow"],
)
def test_a_guard_is_not_positive_within_what_its_own_product_may_lose(
    row: tuple[float, float], state: tuple[float, float]
) -> None:
    table = margins._Table(Line(field(1), 1), 1)
    table._found = [[]]
    middle, place = np.zeros((1, 1, SIZE)), np.zeros(SIZE)
    middle[0, 0, :2], place[:2] = row, state
    assert (middle @ place).item() > 0
    table._bounds = [(middle, abs(middle), np.zeros_like(middle), np.zeros(1))]
    assert not table.positive(0, margins._Start(place, np.zeros(SIZE)), 0, 1)


def test_a_field_at_other_parameters_has_a_table_of_its_own() -> None:
    watch, one = QuickWatch(), field(2)
    other = Field(2, {name: ball(value) for name, value in (VALUES | {"zeta": "0.3"}).items()})
    kept = watch._table(one)
    assert watch._table(one) is kept
    assert watch._table(other) is not kept
    assert watch._table(other)._line is watch.line(other, 1)


@pytest.mark.parametrize("longest", [0.5, np.inf, np.nan])
def test_short_and_unbounded_segments_are_left_to_balls(
    longest: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Signs, "_guard", lambda *_: "balls")
    form = thin(np.ones((SIZE, 2)))
    assert QuickWatch()._guard(field(2), 1, 0, 0, form, form, longest) == "balls"


def test_starts_are_all_states_of_their_form() -> None:
    with precision(80):
        form = thin(np.array([[1.0, -0.5, 0.0]] + [[0.0] * 3] * 5))
        form[0, 0] += symmetric(0.25)
        form[0, 2] = symmetric(2)
        start = margins._Start.of(form)
    assert start.place[0] == 1.0
    assert 2.75 <= start.around[0] < 2.75 + 1e-8
    assert np.all(start.around[1:] < 1e-300)
    watch, other = QuickWatch(), thin(np.ones((SIZE, 3)))
    assert watch._begun(form).place[0] == watch._begun(form).place[0] == 1.0
    assert watch._begun(other).place[1] == 1.0


@pytest.mark.parametrize("longest", [1.01, 1.5, 2.0, 2.125, 6.9])
@pytest.mark.parametrize(("before", "after"), [(0, 0), (1, 0), (0, 1), (2, 1)])
def test_all_of_a_segment_is_watched(
    longest: float, before: int, after: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By balls where the guard vanishes, else by doubles; by balls if one of these fails."""
    seen: list[tuple[float, float]] = []
    answers = {"table": True, "ends": True}

    def positive(self, guard, begun, first, end):
        assert guard == 1
        assert begun.place[0] == 3.0
        seen.append((first * margins._LENGTH, end * margins._LENGTH))
        return answers["table"]

    def pieces(self, field, sense, guard, order, state, reach, part):
        assert guard == 1
        assert state is (start if sense == 1 else end)
        assert order == (before if sense == 1 else after)
        seen.append((0.0, reach) if sense == 1 else (longest - reach, longest))
        return answers["ends"]

    monkeypatch.setattr(margins._Table, "positive", positive)
    monkeypatch.setattr(QuickWatch, "pieces", pieces)
    monkeypatch.setattr(Signs, "_guard", lambda *_: "balls")
    start, end, one = thin(np.full((SIZE, 2), 3.0)), thin(np.full((SIZE, 2), 5.0)), field(2)

    def watched() -> object:
        return QuickWatch()._guard(one, 1, before, after, start, end, longest)

    assert watched() is True
    reached = 0.0
    for begin, end in sorted(seen):
        assert begin <= reached
        reached = max(reached, end)
    assert reached >= longest
    # The root of a guard that vanishes is divided out: doubles stay away from there.
    assert seen[0][0] > 0 or not before
    assert seen[0][1] < longest or not after
    answers["table"] = False
    assert watched() == "balls"
    answers["table"] = True
    if before or after:
        answers["ends"] = False
        assert watched() == "balls"
