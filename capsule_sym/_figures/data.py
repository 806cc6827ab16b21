"""Results that figures draw: computed once, then kept as files in the user's cache.

A file is named by a digest of what it was computed from: inputs, package version, and code.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import capsule_sym
from capsule_sym._errors import InvalidInput, NotInstalled
from capsule_sym._figures.arcs import UNSETTLED
from capsule_sym._files import read_json, write_whole
from capsule_sym._map import Trajectory, simulate
from capsule_sym._parameters import Parameters, SceneParameters
from capsule_sym._records import dumps
from capsule_sym.generated.capsule.py import DIGEST
from paper.study import casestudy

if TYPE_CHECKING:
    from capsule_sym._figures.regions import Plane, Region
    from capsule_sym._orbits.continuation.branches.branch import Branch
    from capsule_sym._orbits.shooting.orbit import Orbit
    from paper.study.sections import Section

_BRANCH_POINTS = 200
_STEPS = 30  # steps along a branch that is continued for its bifurcations only
_ACROSS = 20  # grid points along each side of a chart at which motions are run
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
        path = self._path(name, inputs, ".json")
        # A damaged file is computed again.
        with suppress(OSError, ValueError, LookupError, TypeError):
            return read_json(path, "JSON")["result"]
        kept = dumps({**_provenance(), "inputs": inputs, "result": compute()})
        with suppress(InvalidInput):  # a figure needs no cache
            write_whole(path, kept)
        return json.loads(kept)["result"]

    def _path(self, name: str, inputs: Any, ending: str = "") -> Path:
        text = json.dumps([name, _provenance(), inputs], sort_keys=True)
        digest = hashlib.sha256(text.encode()).hexdigest()[:16]
        return self.directory / f"{name}-{digest}{ending}"

    def _at_once(self, text: str, compute: Callable[[], Any]) -> Any:
        """Result of one long step, with a progress bar."""

        def step() -> Iterator[Any]:
            yield compute()

        return next(iter(self.track(step(), text, None)))

    def motions(self, wanted: Sequence[SceneParameters]) -> list[Trajectory]:
        """Steady motion from rest at each parameter set, as a run of a few periods.

        If the motion is not periodic, a run of `arcs.UNSETTLED` + 1 periods.
        """
        inputs = [_known(parameters) for parameters in wanted]

        def compute() -> list[dict[str, Any]]:
            return [_settled(p) for p in self.track(wanted, "Settling motions", len(wanted))]

        found = self.get("motions", inputs, compute)
        return [_run(p, record) for p, record in zip(wanted, found, strict=True)]

    def branch(self, parameters: SceneParameters, parameter: str, begin: float, to: float) -> Any:
        """`branch_record` of the motion from rest at `begin`, continued in a parameter.

        If no run from rest becomes periodic there, of the motion at `to`, continued backward.
        """
        inputs = [_known(parameters), parameter, begin, to]

        def compute() -> dict[str, Any]:
            return branch_record(_followed(parameters, parameter, (begin, to), _BRANCH_POINTS))

        return self.get("branch", inputs, lambda: self._at_once("Following the branch", compute))

    def curves(self, parameters: SceneParameters, plane: Plane) -> Any:
        """Bifurcations of the branch in the plane's first parameter as curves in both.

        Plain data as of `capsule-sym curve --json`. The branch begins with the motion from rest at
        the low end of the first range, or at the high end if that motion does not become periodic.
        """
        from capsule_sym._orbits.continuation.curves.continuing import continue_bifurcation
        from capsule_sym._orbits.continuation.records import curve_record

        def compute() -> list[dict[str, Any]]:
            found = _followed(parameters, plane.first, plane.x, _STEPS).bifurcations
            tracked = self.track(found, "Following the curves", len(found))
            return [
                curve_record(continue_bifurcation(one, plane.second, (plane.x, plane.y)))
                for one in tracked
            ]

        return self.get("curves", [_known(parameters), plane], compute)

    def regions(self, parameters: SceneParameters, plane: Plane) -> list[Region]:
        """Regions between the `curves`.

        Their itineraries come from the steady motions from rest at one point of each region and at
        the points of a grid.
        """
        from capsule_sym._figures import regions

        cut = regions.patches(plane, self.curves(parameters, plane))
        places = regions.samples(plane, cut, _ACROSS)

        def compute() -> list[list[Any]]:
            tracked = self.track(places, "Settling motions", len(places))
            return [
                [number, _itinerary(parameters.replace(**{plane.first: x, plane.second: y}))]
                for number, x, y in tracked
            ]

        found = self.get("regions", [_known(parameters), plane], compute)
        return regions.by_samples(plane, cut, found)

    def bundle(self, section: Section, parameters: Parameters) -> list[Trajectory]:
        """Runs of one period from the rim of a section's window."""
        starts = section.starts(parameters).tolist()
        return [simulate(parameters, start, section.phase, periods=1) for start in starts]


def cache_directory() -> Path:
    """User's cache directory of this package; it is not created here."""
    try:
        from platformdirs import user_cache_path
    except ModuleNotFoundError as missing:
        raise NotInstalled(missing) from missing
    return user_cache_path("capsule-sym", appauthor=False)


@cache
def _provenance() -> dict[str, str]:
    """Version, generated code, and a digest of the code that computes what is kept."""
    root = Path(capsule_sym.__file__).parent
    digest = hashlib.sha256((root / "_parameters.py").read_bytes())
    for package in ("_map", "_native", "_orbits", "_study", "_sweeps"):
        for source in sorted((root / package).rglob("*")):
            if source.suffix in (".py", ".pyx", ".c", ".h"):
                digest.update(source.read_bytes())
    code = digest.hexdigest()[:16]
    return {"version": capsule_sym.__version__, "generated": DIGEST, "code": code}


def _known(parameters: SceneParameters) -> dict[str, Any]:
    """Parameters, with their scene and its digest unless it is the paper's."""
    of = parameters.scene
    return ({**of.entry, "generated": of.digest} if of.entry else {}) | parameters.to_dict()


def _followed(
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
    period of the orbit, and the average velocity. Points have `energy`: per excitation period
    `work`, `damper_loss` and `friction_loss`, and `lift` if progression lifts the bodies.
    """
    from capsule_sym._orbits.continuation import records

    record = records.branch_record(branch)
    for point, plain in zip(branch.points, record["points"], strict=True):
        plain |= {"stroboscopic": strobe(point.orbit), "energy": _energies(point.orbit)}
    for one, plain in zip(branch.bifurcations, record["bifurcations"], strict=True):
        velocity = float(one.orbit.average_velocity)
        plain |= {"stroboscopic": strobe(one.orbit), "average_velocity": velocity}
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


def _itinerary(parameters: SceneParameters) -> str:
    """Itinerary of the steady motion from rest; empty if it does not become steady."""
    try:
        record = _settled(parameters)
    except InvalidInput:
        return ""
    steady = _run(parameters, record).steady()
    return " ".join(steady.itinerary) if steady else ""


def _settled(parameters: SceneParameters) -> dict[str, Any]:
    """State at phase 0 and period number of the steady motion from rest.

    Newton's method is used if the motion settles slowly. The number is None if the motion is not
    periodic. Raises InvalidInput if the run fails.
    """
    from capsule_sym._orbits.shooting.search import solve_orbit

    _, last, motion = casestudy.from_rest(parameters)
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


def _run(parameters: SceneParameters, record: dict[str, Any]) -> Trajectory:
    number = record["period_number"]
    # One period more than twice the motion's, to detect its repetition.
    periods = max(_DRAWN, 2 * number if number else UNSETTLED) + 1
    return simulate(parameters, record["state"], periods=periods)
