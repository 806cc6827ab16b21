"""One run of the map, by the core or the reference map."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from capsule_sym._errors import check_one_of
from capsule_sym._map.backend import backend as backend_of
from capsule_sym._map.backend import default_backend
from capsule_sym._map.checks import check_count, check_start, checked_seconds
from capsule_sym._map.keep import CHOICES, most_segments
from capsule_sym._map.native import NativeRun, short_run
from capsule_sym._map.trajectory import Kept, Trajectory
from capsule_sym._native import Watch, check_time, present
from capsule_sym._parameters import SceneParameters


def simulate(
    parameters: SceneParameters,
    state: Sequence[float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    periods: int = 100,
    *,
    keep: str = "segments",
    backend: str | None = None,
    escalate: bool = True,
    max_segments: int | None = None,
    max_seconds: float = math.inf,
    progress: Callable[[int], object] | None = None,
) -> Trajectory:
    """Exact trajectory from a state and a phase to the end of an excitation period.

    The run passes from segment to segment by closed forms, and each switch is proved to be the
    first event. It ends at phase 0 after `periods` excitation periods. All quantities are
    dimensionless.

    The run stops early after `max_segments` segments, after `max_seconds`, in the core if kept data
    reach 4 GiB, or where rounding leaves the next switch or field open. The trajectory then has the
    results up to that time. Its `status` and `message` give the reason.

    Parameters
    ----------
    parameters : Parameters
        Parameters of the capsule or of another scene, dimensionless; of a device those that its
        `dimensionless()` gives.
    state : sequence of 3 floats, default (0, 0, 0), each from -1e20 to 1e20
        Start state (x_r, v_r, v_c), dimensionless.
    phase : float, default 0, from 0 to below 2 pi/omega
        Phase at the start, a dimensionless time in the excitation period.
    periods : int, default 100, 1 to 10^12
        Length of the run, in excitation periods from phase 0 on; from another phase it is shorter
        by this phase.
    keep : {"segments", "stroboscopic", "final"}, default "segments"
        Kept data. In the core, memory does not grow with data that are not kept.

        - "segments": all segments, from which the trajectory can be evaluated at any time, and the
          stroboscopic states.
        - "stroboscopic": the states at the ends of periods only.
        - "final": the final state only.
    backend : {"c", "numpy", "mpmath"} or None, default None
        Number system of the run: "c" is the compiled core, "numpy" the readable reference in double
        precision, "mpmath" has 50 digits. None is "c" if the core is compiled, else "numpy", with
        a RuntimeWarning.
    escalate : bool, default True
        True to decide in 106 bits or 50 digits what double precision cannot decide. The
        `statistics` of the trajectory count these decisions. A switch that remains undecided has
        its type in the segment's outcome. It is treated as the exact tangency or corner within the
        error bound.
    max_segments : int or None, default None, 1 to 10^12
        Largest number of segments. None is 10^6 if segments are kept, as by the backends "numpy"
        and "mpmath" with every `keep`. For other runs it is 10^12.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time.
    progress : callable or None, default None
        Function that is called now and then with the number of periods passed.

    Returns
    -------
    Trajectory
        The run: segments, final time and state, `status`, `message` and `statistics`. Its `success`
        is False if the run stopped early.

    Raises
    ------
    InvalidInput
        For a value that is not allowed, and for parameters outside the ranges of a run, such as an
        omega above 10^6.

    See Also
    --------
    simulate_many : many runs in one call.
    solve_orbit : periodic orbit on which a run settles.

    Notes
    -----
    The vector fields are those of Eqs. (7)-(12) of Guo and Liu, Physica D, 2019, doi
    10.1016/j.physd.2019.04.008. Their solutions in a segment are closed forms, so that a run has no
    time step.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> run = cs.simulate(cs.Parameters(alpha=0.7), periods=100)
    >>> run.success, run.steady().itinerary
    (True, ('F5', 'F4', 'F1', 'F2'))
    >>> run(700.0).round(6).tolist()  # (x_r, v_r, v_c) at one time
    [0.334048, -0.881049, 0.28404]

    Only the final state is kept, from another start:

    >>> run = cs.simulate(cs.Parameters(alpha=0.7), (0.1, 0.0, 0.5), phase=2.0, keep="final")
    >>> print(run.final[0].period, run.final[0].phase)
    100 0.0
    """
    values = check_start(parameters, state, phase, periods)
    check_one_of("keep", keep, CHOICES)
    if max_segments is not None:
        check_count("max_segments", max_segments)
    chosen = backend or default_backend(parameters.scene)
    start = values, phase, int(periods)
    unlimited = max_seconds == present().deadline == math.inf
    unlimited = unlimited and max_segments is None and progress is None
    if unlimited and chosen == "c" and keep != "stroboscopic":
        short = short_run(parameters, *start, escalate, keep == "segments")
        if short is not None:
            check_time()  # of the work that contains this run
            return short
    watch = watch_of(max_seconds)
    found = run(parameters, start, keep, max_segments, watch, chosen, escalate, progress)
    check_time()  # of the work that contains this run
    return found


def watch_of(max_seconds: float) -> Watch:
    """Watch of a call with this limit, within the limit of the work that contains it.

    Raises InvalidInput unless the limit is a number > 0.
    """
    watch = Watch(checked_seconds(max_seconds))
    watch.deadline = min(watch.deadline, present().deadline)
    return watch


def run(
    parameters: SceneParameters,
    start: tuple[tuple[float, float, float], float, int],
    keep: str,
    max_segments: int | None,
    watch: Watch,
    chosen: str,
    escalate: bool = True,
    progress: Callable[[int], object] | None = None,
) -> Trajectory:
    """Trajectory from a state, phase and number of periods, which the caller has checked.

    `chosen` is the name of the backend. Raises InvalidInput for another name.
    """
    most = most_segments(keep, max_segments, chosen)
    if chosen == "c":
        return NativeRun(parameters, escalate, watch, progress).go(*start, most, keep)
    from capsule_sym._map.reference import Run

    with backend_of(chosen, parameters.scene) as numbers:
        found = Run(numbers, parameters, escalate, watch, progress).go(*start, most)
    if keep == "final":
        return replace(found, kept=Kept("final"))
    whole = keep == "segments"
    return found if whole else replace(found, kept=replace(found.kept, what=keep, segments=None))
