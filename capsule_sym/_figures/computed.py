"""Motions and branches that figures draw, computed for them; a process computes each once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.arcs import UNSETTLED
from capsule_sym._map import SteadyMotion, Trajectory, simulate
from capsule_sym._parameters import SceneParameters

if TYPE_CHECKING:
    from capsule_sym._orbits.continuation.branches.branch import Branch
    from capsule_sym._orbits.shooting.orbit import Orbit

_BLOCK = 64  # excitation periods between two tests for a steady motion
MOST_PERIODS = 4096
_DRAWN = 3  # least number of excitation periods of a motion that are drawn
_CLOSING = 256  # excitation periods of the run that starts Newton's method


@cache
def branch_from_rest(
    parameters: SceneParameters, parameter: str, ends: tuple[float, float], points: int = 200
) -> dict[str, Any]:
    """`branch_record` of the branch that `followed` gives."""
    return branch_record(followed(parameters, parameter, ends, points))


def followed(
    parameters: SceneParameters, parameter: str, ends: tuple[float, float], points: int
) -> Branch:
    """Branch from the first of these ends at which a run from rest becomes periodic."""
    from capsule_sym._orbits.continuation.branches.continuing import continue_orbit
    from capsule_sym._orbits.shooting.search import solve_orbit

    failed = []
    for begin, to in (ends, ends[::-1]):
        orbit = solve_orbit(parameters.replace(**{parameter: begin}))
        if orbit.success:
            return continue_orbit(orbit, parameter, to, points=points)
        failed.append(f"{parameter} = {begin:g}: {orbit.message}")
    allowed = f"those whose run from rest becomes periodic at either end ({'; '.join(failed)})"
    raise InvalidInput("parameters", parameters.to_dict(), allowed)


def branch_record(branch: Branch) -> dict[str, Any]:
    """Branch as from `capsule-sym branch --json`, with more to draw.

    Points and bifurcations have `stroboscopic`, the states at the beginning of each excitation
    period of the orbit, the average velocity, and `energy`: per excitation period `work`,
    `damper_loss` and `friction_loss`, and `lift` if progression lifts the bodies.
    """
    from capsule_sym._orbits.continuation import records

    record = records.branch_record(branch)
    for point, plain in zip(branch.points, record["points"], strict=True):
        plain |= {"stroboscopic": strobe(point.orbit), "energy": _energies(point.orbit)}
    for one, plain in zip(branch.bifurcations, record["bifurcations"], strict=True):
        velocity = float(one.orbit.average_velocity)
        plain |= {"stroboscopic": strobe(one.orbit), "average_velocity": velocity}
        plain["energy"] = _energies(one.orbit)
    return record


def strobe(orbit: Orbit) -> list[list[float]]:
    """States (x_r, v_r, v_c) of an orbit at the beginning of its excitation periods."""
    times = orbit.parameters.period * np.arange(1, orbit.itinerary.period_number + 1)
    trajectory = orbit.trajectory()
    at = trajectory(np.minimum(times, trajectory.span[1]))  # the trajectory's end is a rounded sum
    return [[float(value) for value in state] for state in at]


def _energies(orbit: Orbit) -> dict[str, float] | None:
    """Energies per excitation period; None at a fold, where `performance` has no gradient."""
    from capsule_sym._orbits.metrics.performance import performance

    try:
        figures = performance(orbit)
    except np.linalg.LinAlgError:
        return None
    names = ("work", "damper_loss", "friction_loss", *["lift"] * orbit.scene.facts.LIFTS)
    return {name: float(getattr(figures, name).value) for name in names}


def orbit_of(record: Mapping[str, Any]) -> Orbit:
    """Orbit at a point or a bifurcation of a branch's record."""
    from capsule_sym._orbits.continuation.branches import saved

    return saved.orbit_from_record(record.get("orbit", record))


def from_rest(parameters: SceneParameters) -> tuple[int, Trajectory, SteadyMotion | None]:
    """Run from rest until its motion is steady: number of periods, last part of the run, motion.

    The motion is None if it is not steady within 4096 periods, or if the run failed.
    """
    state, periods = (0.0, 0.0, 0.0), 0
    while True:
        trajectory = simulate(parameters, state, periods=_BLOCK)
        periods += _BLOCK
        motion = trajectory.steady() if trajectory.success else None
        if motion or not trajectory.success or periods >= MOST_PERIODS:
            return periods, trajectory, motion
        # A run ends at phase 0, where the next one begins.
        _, state = trajectory.final


@cache
def steady_run(parameters: SceneParameters) -> Trajectory:
    """Steady motion from rest, as a run of a few periods from phase 0.

    Newton's method is used if the motion settles slowly. A motion that is not periodic is a run of
    `arcs.UNSETTLED` + 1 periods. Raises InvalidInput if the run fails.
    """
    from capsule_sym._orbits.shooting.search import solve_orbit

    _, last, motion = from_rest(parameters)
    if not last.success:
        raise InvalidInput(
            "parameters", parameters.to_dict(), f"those of a motion ({last.message})"
        )
    state, number = last.final[1], motion and motion.period_number
    if number is None:
        orbit = solve_orbit(parameters, state, periods=_CLOSING)
        if orbit.success:
            number = orbit.itinerary.period_number
            state = tuple(strobe(orbit)[-1])
    # One period more than twice the motion's, to detect its repetition.
    periods = max(_DRAWN, 2 * number if number else UNSETTLED) + 1
    return simulate(parameters, state, periods=periods)
