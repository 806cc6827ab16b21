"""Branches of the case study that several tests look at, each followed once."""

from functools import lru_cache

from capsule_sym import Parameters, continue_orbit, results, solve_orbit

LOW, HIGH = 0.005, 2.0


def settled(**parameters: float) -> results.Orbit:
    orbit = solve_orbit(Parameters(**parameters))
    assert orbit.success, orbit.message
    return orbit


@lru_cache
def upwards(gamma: float) -> results.Branch:
    return continue_orbit(settled(alpha=LOW, gamma=gamma), "alpha", HIGH)


@lru_cache
def downwards(gamma: float) -> results.Branch:
    return continue_orbit(settled(alpha=HIGH, gamma=gamma), "alpha", LOW)


@lru_cache
def hysteretic() -> results.Branch:
    """A branch in omega with folds and period doublings."""
    return continue_orbit(settled(alpha=1.2, beta=10.0), "omega", 1.2, points=40)
