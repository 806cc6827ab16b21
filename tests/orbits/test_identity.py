"""Orbits that are one, and that repeat themselves."""

from __future__ import annotations

import numpy as np
import pytest

from capsule_sym._orbits.shooting.identity import primitive, same
from capsule_sym._orbits.shooting.orbit import Orbit, close
from capsule_sym._orbits.shooting.word import Word
from tests.orbits.branches import settled


def twice(orbit: Orbit) -> Orbit:
    """The same orbit gone round two times."""
    word = Word(2 * orbit.word.legs, 2 * orbit.word.multiple)
    found = close(orbit.values, word, [*orbit.z, *orbit.durations])
    assert isinstance(found, Orbit)
    return found


def turned(orbit: Orbit, leg: int) -> Orbit:
    """The same orbit begun at another leg."""
    span, h = orbit.shot.spans[leg], orbit.durations
    guess = [*span.start, span.angle, *h[leg:], *h[:leg]]
    found = close(orbit.values, orbit.word.rotated(leg), guess)
    assert isinstance(found, Orbit)
    return found


def test_an_orbit_is_the_same_wherever_it_begins() -> None:
    orbit, other = settled(alpha=1.2), settled(alpha=1.2 + 1e-5)
    assert all(same(orbit, turned(orbit, leg)) for leg in range(len(orbit.word)))
    assert not same(orbit, other)
    assert not same(orbit, twice(orbit))


def test_an_orbit_gone_round_twice_is_traversed_once() -> None:
    orbit = settled(alpha=1.2)
    once = primitive(twice(orbit))
    assert once.word == orbit.word
    assert once.z == pytest.approx(orbit.z, abs=1e-12)
    assert primitive(orbit) is orbit


def test_a_period_doubled_orbit_is_no_shorter_one() -> None:
    # Between the doublings at alpha = 0.0429 and 0.0488 two turns differ.
    orbit = settled(alpha=0.045, zeta=0.005)
    assert orbit.word.multiple == 2
    half = len(orbit.word) // 2
    assert orbit.word.fields[:half] == orbit.word.fields[half:]
    assert abs(np.diff(orbit.durations[::half])) > 1e-3
    assert primitive(orbit) is orbit
