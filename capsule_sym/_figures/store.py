"""Results that figures draw: computed once, then kept as files in the user's cache.

A file is named by a digest of what it was computed from: inputs, package version, and code.
"""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import capsule_sym
from capsule_sym._errors import InvalidInput, NotInstalled
from capsule_sym._figures.arcs import UNSETTLED
from capsule_sym._files import read_json, write_whole
from capsule_sym._map import SteadyMotion, Trajectory, simulate
from capsule_sym._parameters import SceneParameters
from capsule_sym._records import dumps
from capsule_sym.generated.capsule import DIGEST

if TYPE_CHECKING:
    from capsule_sym._orbits.continuation.branches.branch import Branch
    from capsule_sym._orbits.shooting.orbit import Orbit

_BRANCH_POINTS = 200
_BLOCK = 64  # excitation periods between two tests for a steady motion
MOST_PERIODS = 4096
_DRAWN = 3  # least number of excitation periods of a motion that are drawn
_CLOSING = 256  # excitation periods of the run that starts Newton's method

Track = Callable[[Iterable[Any], str | Callable[[Any], str], float | None], Iterable[Any]]
"""Passes items on and shows how many of a total are done (None if unknown). The text describes the
work, or is a function that describes each item."""


class Store:
    """Results by name and inputs, read from the cache or computed and stored there."""

    def __init__(self, track: Track, directory: Path | None = None) -> None:
        self.track, self.directory = track, directory or cache_directory()

    def get(self, name: str, inputs: Any, compute: Callable[[], Any]) -> Any:
        """Result of `compute`, plain data for JSON, cached under `name` and `inputs`."""
        source = _provenance(inspect.getsourcefile(compute) or "")
        text = json.dumps([name, source, inputs], sort_keys=True)
        digest = hashlib.sha256(text.encode()).hexdigest()[:16]
        path = self.directory / f"{name}-{digest}.json"
        # A damaged file is computed again.
        with suppress(OSError, ValueError, LookupError, TypeError):
            return read_json(path, "JSON")["result"]
        kept = dumps({**source, "inputs": inputs, "result": compute()})
        with suppress(InvalidInput):  # a figure needs no cache
            write_whole(path, kept)
        return json.loads(kept)["result"]

    def motions(self, wanted: Sequence[SceneParameters]) -> list[Trajectory]:
        """Steady motion from rest at each parameter set, as a run of a few periods.

        If the motion is not periodic, a run of `arcs.UNSETTLED` + 1 periods.
        """
        inputs = [known(parameters) for parameters in wanted]

        def compute() -> list[dict[str, Any]]:
            return [settled(p) for p in self.track(wanted, "Settling motions", len(wanted))]

        found = self.get("motions", inputs, compute)
        return [run_settled(p, record) for p, record in zip(wanted, found, strict=True)]

    def branch(self, parameters: SceneParameters, parameter: str, begin: float, to: float) -> Any:
        """`branch_record` of the motion from rest at `begin`, continued in a parameter.

        If no run from rest becomes periodic there, of the motion at `to`, continued backward.
        """
        inputs = [known(parameters), parameter, begin, to]

        def compute() -> dict[str, Any]:
            # One step, which begins when its progress is shown.
            step = (followed(parameters, parameter, ends, _BRANCH_POINTS) for ends in [(begin, to)])
            (branch,) = self.track(step, "Following the branch", None)
            return branch_record(branch)

        return self.get("branch", inputs, compute)


def cache_directory() -> Path:
    """User's cache directory of this package; it is not created here."""
    try:
        from platformdirs import user_cache_path
    except ModuleNotFoundError as missing:
        raise NotInstalled(missing) from missing
    return user_cache_path("capsule-sym", appauthor=False)


@cache
def _provenance(computing: str) -> dict[str, str]:
    """Version, generated code, and a digest of the code by which a file computes what is kept."""
    root = Path(capsule_sym.__file__).parent
    digest = hashlib.sha256()
    for file in (computing, __file__, root / "_parameters.py", root / "_figures" / "arcs.py"):
        digest.update(Path(file).read_bytes())
    for package in ("_map", "_native", "_orbits"):
        for source in sorted((root / package).rglob("*")):
            if source.suffix in (".py", ".pyx", ".c", ".h"):
                digest.update(source.read_bytes())
    code = digest.hexdigest()[:16]
    return {"version": capsule_sym.__version__, "generated": DIGEST, "code": code}


def known(parameters: SceneParameters) -> dict[str, Any]:
    """Parameters as inputs of a `Store`; with the scene and its digest unless it is the paper's."""
    of = parameters.scene
    return ({**of.entry, "generated": of.digest} if of.entry else {}) | parameters.to_dict()


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


def settled(parameters: SceneParameters) -> dict[str, Any]:
    """State at phase 0 and period number of the steady motion from rest.

    Newton's method is used if the motion settles slowly. The number is None if the motion is not
    periodic. Raises InvalidInput if the run fails.
    """
    from capsule_sym._orbits.shooting.search import solve_orbit

    _, last, motion = from_rest(parameters)
    if not last.success:
        raise InvalidInput(
            "parameters", parameters.to_dict(), f"those of a motion ({last.message})"
        )
    state = list(last.final[1])
    if motion:
        return {"state": state, "period_number": motion.period_number}
    orbit = solve_orbit(parameters, state, periods=_CLOSING)
    if orbit.success:
        return {"state": strobe(orbit)[-1], "period_number": orbit.itinerary.period_number}
    return {"state": state, "period_number": None}


def run_settled(parameters: SceneParameters, record: dict[str, Any]) -> Trajectory:
    """Run of a few periods from a state that `settled` gives."""
    number = record["period_number"]
    # One period more than twice the motion's, to detect its repetition.
    periods = max(_DRAWN, 2 * number if number else UNSETTLED) + 1
    return simulate(parameters, record["state"], periods=periods)
