"""Runs of the map, one or many at once, and their kept data."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._map.backend import backend as backend_of
from capsule_sym._map.backend import default_backend
from capsule_sym._map.checks import check_count, check_start, checked_seconds
from capsule_sym._map.keep import STATE, check_memory, checked, most_segments, reduced
from capsule_sym._map.native import NativeRun, end_of_run
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._native import Watch, check_time, present
from capsule_sym._parameters import SceneParameters


def simulate(
    parameters: SceneParameters,
    state: Sequence[float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    periods: int = 100,
    *,
    keep: str | ArrayLike = "segments",
    backend: str | None = None,
    escalate: bool = True,
    max_segments: int | None = None,
    max_seconds: float = math.inf,
    progress: Callable[[int], object] | None = None,
) -> Trajectory:
    """Return the exact trajectory over whole excitation periods from a state and phase.

    The state is (x_r, v_r, v_c), the phase a time in [0, 2 pi/omega); all quantities are
    dimensionless. The run ends at phase 0 after `periods` periods. The backend is "c" (the compiled
    core; the default if it is there), "numpy" (double precision, the readable reference) or
    "mpmath" (50 digits). With `escalate`, 50 digits decide the switches that double precision
    cannot; `statistics` of the trajectory count them. A switch that remains undecided has its type
    in the segment's outcome, and is treated as the exact tangency or corner within the error bound.

    `keep` is one of "segments" (all segments, from which the trajectory can be evaluated at any
    time, and the states at the ends of periods), "stroboscopic" (only these states), "switches" and
    "final" (only the final state), or an array of absolute times at which states are kept. In the
    core, memory does not grow with data that are not kept.

    The run stops early after `max_segments` segments (10^6 by default if data of each are kept),
    after `max_seconds` of wall time, if kept data reach 4 GiB, or at a point where no successor
    field is certain. The trajectory then has the results up to that time; its `status` and
    `message` give the reason. `progress` is called now and then with the number of periods passed.
    Raises InvalidInput for a value that is not allowed.
    """
    values = check_start(parameters, state, phase, periods)
    kept = checked(keep, phase, int(periods) * parameters.period)
    if not isinstance(kept, str):
        check_memory("keep", kept, STATE * kept.size)
    if max_segments is not None:
        check_count("max_segments", max_segments)
    watch = watch_of(max_seconds)
    chosen = backend or default_backend(parameters.scene)
    start = values, phase, int(periods)
    unlimited = max_segments is None and progress is None and watch.deadline == math.inf
    if unlimited and chosen == "c" and isinstance(kept, str) and kept == "final":
        end = end_of_run(parameters, *start, escalate)
        if end is not None:
            return end
    found = run(parameters, start, kept, max_segments, watch, chosen, escalate, progress)
    check_time()  # of the work that contains this run
    return found


def watch_of(max_seconds: float) -> Watch:
    """Watch of a call with this limit, within the limit of the work that contains it."""
    watch = Watch(checked_seconds(max_seconds))
    watch.deadline = min(watch.deadline, present().deadline)
    return watch


def run(
    parameters: SceneParameters,
    start: tuple[tuple[float, float, float], float, int],
    kept: str | NDArray[np.float64],
    max_segments: int | None,
    watch: Watch,
    chosen: str,
    escalate: bool = True,
    progress: Callable[[int], object] | None = None,
    share: int = 1,
) -> Trajectory:
    """Trajectory from a state, phase and number of periods, all of them checked.

    The run may use one part in `share` of the memory limit of a call.
    """
    most = most_segments(kept, max_segments, chosen)
    if chosen == "c":
        return NativeRun(parameters, escalate, watch, progress).go(*start, most, kept, share)
    from capsule_sym._map.reference import Run

    with backend_of(chosen, parameters.scene) as numbers:
        found = Run(numbers, parameters, escalate, watch, progress).go(*start, most)
    if isinstance(kept, str) and kept == "segments":
        return found
    return replace(found, kept=reduced(found, kept))
