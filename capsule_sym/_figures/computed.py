"""Motions and branches that figures draw, computed for them; a process computes each once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map import Trajectory, simulate
from capsule_sym._parameters import SceneParameters

if TYPE_CHECKING:
    from capsule_sym._orbits.continuation.branches.branch import Branch
    from capsule_sym._orbits.shooting.orbit import Orbit

_DRAWN = 3  # least number of excitation periods of a motion that are drawn
_LONG = 1024  # excitation periods of a motion that is not periodic


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
    nodes: list[Any] = [*branch.points, *branch.bifurcations]
    for node, plain in zip(nodes, record["points"] + record["bifurcations"], strict=True):
        velocity = float(node.orbit.average_velocity)
        plain |= {"stroboscopic": strobe(node.orbit), "average_velocity": velocity}
        plain["energy"] = _energies(node.orbit)
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


@cache
def steady_run(parameters: SceneParameters) -> Trajectory:
    """Steady motion from rest, as a run of a few periods from phase 0.

    A motion that is not periodic is a run from rest of 1024 periods. Raises InvalidInput if the run
    fails.
    """
    from capsule_sym._orbits.shooting.search import solve_orbit

    orbit, periods = solve_orbit(parameters), _LONG
    state: Sequence[float] = (0.0, 0.0, 0.0)
    if orbit.success:
        state = strobe(orbit)[-1]
        # One period more than twice the motion's, to detect its repetition.
        periods = max(_DRAWN, 2 * orbit.itinerary.period_number) + 1
    run = simulate(parameters, state, periods=periods)
    if not run.success:
        raise InvalidInput("parameters", parameters.to_dict(), f"those of a motion ({run.message})")
    return run
