"""All extrema inside a leg: against theory, dense samples and 50 digits."""

from __future__ import annotations

import math
from random import Random

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.typing import NDArray

from capsule_sym import Parameters
from capsule_sym.map.backend import backend
from capsule_sym.orbits.closed import ClosedForms
from capsule_sym.orbits.equations import Span, shoot
from capsule_sym.orbits.turning import Quantity, turns
from capsule_sym.orbits.word import Word

WORDS = {1: "14", 2: "21", 3: "36", 4: "41", 5: "54", 6: "63"}


def leg(
    values: tuple[float, ...], field: int, start: list[float], h: float, name: str = "numpy"
) -> tuple[ClosedForms, Span]:
    """The first leg of a word that begins with a field, and the forms it was run by."""
    with backend(name) as numbers:
        z = np.array([numbers.number(value) for value in (*start, h, 1.0)])
        word = Word.parse(WORDS[field])
        exact = tuple(numbers.number(value) for value in values)
        return ClosedForms(numbers, exact), shoot(numbers, exact, word, z).spans[0]


def random_leg(seed: int) -> tuple[tuple[float, ...], int, list[float], float]:
    random = Random(seed)
    field = random.randint(1, 6)
    values = Parameters(
        alpha=random.uniform(0, 3),
        omega=random.uniform(0.2, 4),
        delta=random.uniform(0, 1),
        zeta=random.choice([0.0, 0.05, 0.5, 2.0]),
        beta=random.uniform(0, 30),
        gamma=random.uniform(0.3, 8),
    )
    start = [random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), 0.7]
    return tuple(values.to_dict().values()), field, start, random.uniform(0.05, 12)


def samples(forms: ClosedForms, span: Span, quantity: Quantity, count: int) -> NDArray[np.float64]:
    """A quantity at equally spaced times over the leg."""
    c, closed = span.c, span.closed
    times = np.linspace(0, span.h, count)[1:]
    rows = np.array([forms.run(span.leg.field, c, closed, time)[0] for time in times])
    gap = closed.gap + rows[:, 0]
    if quantity is Quantity.GAP:
        return gap
    return closed.x_r + rows[:, 0] + c.kappa * gap + 2 * c.zeta * rows[:, 1]


@pytest.mark.parametrize("seed", range(16))
def test_extrema_are_those_of_dense_samples(seed: int) -> None:
    forms, span = leg(*random_leg(seed))
    for quantity in Quantity:
        # Within two samples of an end the samples show nothing.
        edge = span.h / 1999
        every = turns(forms, span, quantity)
        found = [turn for turn in every if edge < turn.time < span.h - edge]
        values = samples(forms, span, quantity, 4000)
        rises = np.sign(np.diff(values))
        times = np.arange(2, 3999) * span.h / 3999
        inner = (edge < times) & (times < span.h - edge)
        seen = np.flatnonzero((rises[1:] != rises[:-1]) & inner)
        assert len(found) == len(seen)
        for turn, index in zip(found, seen, strict=True):
            assert turn.kind == rises[index + 1]
            assert turn.time == pytest.approx(times[index], abs=edge)
            assert turn.value == pytest.approx(values[index + 1], abs=1e-3)
            assert turn.kind * (values[index + 1] - turn.value) >= -1e-13


def test_extrema_of_free_oscillation_are_half_periods_apart() -> None:
    """x_r = 0.3 cos t without damping and drive: maxima and minima in turn."""
    values = (0.0, 1.0, 5.0, 0.0, 0.0, 1.0, 1.0)
    forms, span = leg(values, 2, [0.3 * math.cos(1), -0.3 * math.sin(1), 0.0, 0.0], 40.0)
    found = turns(forms, span, Quantity.GAP)
    assert [turn.kind for turn in found] == [(-1) ** n for n in range(len(found))]
    expected = [math.pi * n - 1 for n in range(1, 14)]
    assert [turn.time for turn in found] == pytest.approx(expected, abs=1e-12)
    assert [abs(turn.value + 5.0) for turn in found] == pytest.approx([0.3] * 13, abs=1e-13)


@pytest.mark.parametrize("seed", [2, 5])
def test_extrema_in_fifty_digits_are_stationary(seed: int) -> None:
    forms, span = leg(*random_leg(seed))
    exact_forms, exact = leg(*random_leg(seed), name="mpmath")
    with mp.workdps(60):
        for quantity in Quantity:
            coarse, fine = turns(forms, span, quantity), turns(exact_forms, exact, quantity)
            assert [turn.kind for turn in coarse] == [turn.kind for turn in fine]
            for one, two in zip(coarse, fine, strict=True):
                assert abs(one.time - two.time) < 1e-10
                assert abs(one.value - two.value) < 1e-13
                step = mpf("1e-15")
                beside = [
                    value_at(exact_forms, exact, quantity, two.time + side * step)
                    for side in (1, -1)
                ]
                assert abs(beside[0] - beside[1]) < mpf("1e-40")


def value_at(forms: ClosedForms, span: Span, quantity: Quantity, time: mpf) -> mpf:
    c, closed = span.c, span.closed
    position, v_r, *_ = forms.run(span.leg.field, c, closed, time)[0]
    gap = closed.gap + position
    force = closed.x_r + position + c.kappa * gap + 2 * c.zeta * v_r
    return gap if quantity is Quantity.GAP else force
