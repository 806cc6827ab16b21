"""Orbits by the C library of a scene, and what they depend on, beside the integrator's."""

import math
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.scenes import Form, Integrator, Start
from tests.scenes.library import Library, printed

SOURCE = Path(__file__).with_name("orbits.c")


class Found(NamedTuple):
    """An orbit, by the C library or by differences of the integrator's, with what it depends on."""

    state: np.ndarray
    monodromy: np.ndarray
    by_parameter: np.ndarray
    progression: float
    gradient: np.ndarray


class Within(NamedTuple):
    """A step of differences, and what is left of them in slopes, at a start and along an orbit.

    Those along it are over 1 minus a multiplier.
    """

    step: float = 1e-4
    slopes: float = 1e-10
    solved: float = 1e-8


WITHIN = Within()


def by_differences(
    judge: Integrator,
    form: Form,
    names: tuple[str, ...],
    row: list[float],
    state: np.ndarray,
    periods: int = 1,
    step: float = WITHIN.step,
) -> Found | None:
    """The period's end from an orbit, and its slopes to fourth order in the step.

    None where the itinerary is not the same in all directions: there are no two-sided slopes.
    """
    at, m = np.array([*row[: len(names)], *state]), len(names)
    moves = [k * step * one for one in np.eye(len(at)) for k in (-2, -1, 1, 2)]
    places = [at + move for move in (0 * at, *moves)]
    if "D" in names and any(not 0 < z[names.index("D")] < 1 for z in places):
        return None
    begun = [Start(dict(zip(names, z, strict=False)), tuple(z[m:])) for z in places]
    runs = judge.runs(form, begun, periods, checked=False)
    if len({(run.status, run.fields) for run in runs}) > 1 or runs[0].status != "done":
        return None
    ends = np.array([run.state[:4] for run in runs])
    rows = ends[1:].reshape(len(at), 4, 4)
    slopes = ((rows[:, 0] - 8 * rows[:, 1] + 8 * rows[:, 2] - rows[:, 3]) / (12 * Fraction(step))).T
    slopes, end = slopes.astype(float), ends[0].astype(float)
    moved = np.linalg.solve(np.eye(3) - slopes[:3, m:], slopes[:3, :m])
    gradient = (slopes[3, :m] + slopes[3, m:] @ moved) / periods
    return Found(end[:3], slopes[:3, m:], moved, end[3] / periods, gradient)


def apart(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.max(np.abs(first - second)) / (1 + np.max(np.abs(second))))


def orbits(
    scene: Library, starts: Sequence[Start], periods: int = 1
) -> list[tuple[list[float], Found, np.ndarray]]:
    """Orbits that drift at angle 0, and residual, trace and determinant of their itineraries."""
    m, found = len(scene.parameters), []
    rows = [scene.row(start) for start in starts]
    for row, (fit, *texts) in zip(rows, printed(scene.linked(SOURCE), rows, periods), strict=True):
        if int(fit):
            places = np.cumsum([3, 9, 3 * m, 1, m])
            state, by, moved, (advance,), gradient, rest = np.split(np.array(texts, float), places)
            orbit = Found(state, by.reshape(3, 3), moved.reshape(3, m), advance, gradient)
            found.append((row, orbit, rest))
    return found


def compared(
    scene: Library,
    judge: Integrator,
    starts: Sequence[Start],
    periods: int = 1,
    *,
    long: bool = False,
    within: Within = WITHIN,
) -> int:
    """Number of orbits whose slopes are the integrator's, after all have been compared.

    State and progression to rounding; slopes to what differences leave. The itinerary's own
    equations come to the same multipliers, with a residual of rounding, for `long` durations in
    their own units.
    """
    count = 0
    for row, orbit, (residual, trace, determinant) in orbits(scene, starts, periods):
        omega = row[scene.parameters.index("omega")]
        assert residual < 1e-13 * (max(1, 2 * math.pi / omega) if long else 1)
        right = by_differences(
            judge, scene.form, scene.parameters, row, orbit.state, periods, within.step
        )
        if right is None:
            continue
        count += 1
        assert apart(orbit.state, right.state) < 1e-13
        assert abs(orbit.progression - right.progression) < 1e-12
        assert apart(orbit.monodromy, right.monodromy) < within.slopes
        assert apart(orbit.by_parameter, right.by_parameter) < within.solved
        assert apart(orbit.gradient, right.gradient) < within.solved
        assert abs(trace - np.trace(right.monodromy)) < within.slopes
        assert abs(determinant - np.linalg.det(right.monodromy)) < within.slopes
    return count
