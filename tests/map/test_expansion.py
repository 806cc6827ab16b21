"""Expansions of the guards: their derivatives, error bounds and remainders hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import factorial
from random import Random
from typing import Any

import pytest
from mpmath import mp, mpf

from capsule_sym.map import quasistatic
from capsule_sym.map.backend import Backend, MpmathBackend, NumpyBackend
from capsule_sym.map.expansion import Expansion, Guard, expand, watched
from tests.map import DIGITS, FIELDS, REGIMES, Motion, random_motion

SEEDS = range(2)


@pytest.fixture(autouse=True)
def _digits() -> Iterator[None]:
    with mp.workdps(DIGITS + 10):
        yield


def cases() -> Iterator[tuple[Motion, Any]]:
    """A random motion in each field and regime, at its start and at a later time."""
    for name, parameters in REGIMES.items():
        for field in FIELDS:
            random = Random(f"{name} {field}")
            motion = random_motion(parameters, field, random)
            rate = NumpyBackend().constants(field, parameters).rate
            yield motion, 0.0
            yield motion, 10 ** random.uniform(-6, 2) / rate


CASES = list(cases())


def expansions(
    numbers: Backend, motion: Motion, h: float, forced: bool = False
) -> Mapping[Guard, Expansion]:
    flow = motion.flow(numbers)
    at = flow(numbers.number(h)) if h else flow.origin
    return (quasistatic.expand_forced if forced else expand)(numbers, flow.c, at)


def label(case: tuple[Motion, float]) -> str:
    motion, h = case
    return f"F{motion.field} {h:.0e} {motion.parameters}"


def test_every_guard_of_a_field_is_expanded() -> None:
    for motion, h in CASES[:12]:
        numbers = NumpyBackend()
        c = numbers.constants(motion.field, motion.parameters)
        assert set(expansions(numbers, motion, h)) == set(watched(c)) == set(motion.rows)


@pytest.mark.parametrize("numbers", [NumpyBackend(), MpmathBackend()], ids=lambda b: b.name)
def test_derivatives_are_those_of_the_motion_within_their_error_bounds(numbers: Backend) -> None:
    for motion, h in CASES:
        vector = motion.state_at(h)
        for guard, e in expansions(numbers, motion, h).items():
            truth = motion.derivatives(vector, len(e.values))[guard]
            for order, (value, error) in enumerate(zip(e.values, e.errors, strict=True)):
                # A double gap = x_r - delta is rounded once; the search allows for that.
                given = numbers.unit * abs(value) if (order, h) == (0, 0.0) else 0
                off = abs(value - truth[order])
                assert off <= error + given, (label((motion, h)), guard, order, off / error)
