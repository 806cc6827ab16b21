"""Branches of the case study that several tests look at, each followed once."""

from functools import lru_cache

from capsule_sym._orbits.continuation.continuation import Branch, follow
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import find_orbit
from capsule_sym._parameters import Parameters

LOW, HIGH = 0.005, 2.0


def settled(**parameters: float) -> Orbit:
    orbit = find_orbit(Parameters(**parameters))
    assert isinstance(orbit, Orbit), orbit
    return orbit


@lru_cache
def upwards(gamma: float) -> Branch:
    return follow(settled(alpha=LOW, gamma=gamma), "alpha", HIGH)


@lru_cache
def downwards(gamma: float) -> Branch:
    return follow(settled(alpha=HIGH, gamma=gamma), "alpha", LOW)


@lru_cache
def hysteretic() -> Branch:
    """A branch in omega with folds and period doublings."""
    return follow(settled(alpha=1.2, beta=10.0), "omega", 1.2, points=40)
