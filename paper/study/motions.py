"""Motions and branches that the figures of the paper draw; a process computes each once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from capsule_sym import InvalidInput, continue_orbit, simulate, solve_orbit
from capsule_sym._figures.interface import PAGE, stroboscopic
from capsule_sym.inputs import SceneDevice, SceneParameters
from capsule_sym.results import Branch, Trajectory

BEGIN, END = 0.005, 2.0
"""Excitation amplitudes between which figures over alpha are drawn."""
_STEPS = 200  # of the branch that is drawn
_DRAWN = 3  # least number of excitation periods of a motion that are drawn
_LONG = 1024  # excitation periods of a motion that is not periodic

Track = Callable[[Iterable[Any], str | Callable[[Any], str], float | None], Iterable[Any]]
"""Passes items on and shows how many of a total are done (None if unknown). The text describes the
work, or is a function that describes each item."""


@dataclass(frozen=True)
class Study:
    """Input of a figure: one system, whose motions and branch are computed with progress.

    `chosen` is true for a system of the user; otherwise the guards are those at a larger
    amplitude. `width` is in inches. Of a `device` the figures are in SI units.
    """

    track: Track
    system: SceneParameters
    width: float = PAGE
    chosen: bool = False
    device: SceneDevice | None = None

    @property
    def looks(self) -> dict[str, Any]:
        """Options of every figure."""
        return {"width": self.width}

    def at(self, alpha: float) -> SceneParameters:
        """The system at an excitation amplitude."""
        return self.system.replace(alpha=alpha)

    def motions(self, alphas: list[float]) -> list[Trajectory]:
        """The steady motions from rest at excitation amplitudes."""
        tracked = self.track(map(self.at, alphas), "Settling motions", len(alphas))
        return [steady_run(parameters) for parameters in tracked]

    @property
    def last(self) -> float:
        """The largest excitation amplitude: 2, or the system's own if it is larger."""
        return max(END, self.system.alpha)

    def branch(self) -> Branch:
        """The branch in alpha from 0.005 to the largest amplitude."""
        # One step, which begins when its progress is shown.
        ends = (BEGIN, self.last)
        step = (followed(self.at(BEGIN), "alpha", ends, _STEPS) for _ in range(1))
        (branch,) = self.track(step, "Following the branch", None)
        found: Branch = branch
        return found

    def evenly(self, count: int) -> list[float]:
        """Excitation amplitudes from the first to the last, evenly spaced."""
        return [BEGIN + (self.last - BEGIN) * i / (count - 1) for i in range(count)]


@cache
def followed(
    parameters: SceneParameters, parameter: str, ends: tuple[float, float], points: int
) -> Branch:
    """Branch from the first of these ends at which a run from rest becomes periodic."""
    failed = []
    for begin, to in (ends, ends[::-1]):
        orbit = solve_orbit(parameters.replace(**{parameter: begin}))
        if orbit.success:
            return continue_orbit(orbit, parameter, to, points=points)
        failed.append(f"{parameter} = {begin:g}: {orbit.message}")
    allowed = f"those whose run from rest becomes periodic at either end ({'; '.join(failed)})"
    raise InvalidInput("parameters", parameters.to_dict(), allowed)


@cache
def steady_run(parameters: SceneParameters) -> Trajectory:
    """Steady motion from rest, as a run of a few periods from phase 0.

    A motion that is not periodic is a run from rest of 1024 periods. Raises InvalidInput if the run
    fails.
    """
    orbit, periods = solve_orbit(parameters), _LONG
    state: Sequence[float] = (0.0, 0.0, 0.0)
    if orbit.success:
        state = stroboscopic(orbit)[0].tolist()
        # One period more than twice the motion's, to detect its repetition.
        periods = max(_DRAWN, 2 * orbit.itinerary.period_number) + 1
    run = simulate(parameters, state, periods=periods)
    if not run.success:
        raise InvalidInput("parameters", parameters.to_dict(), f"those of a motion ({run.message})")
    return run
