"""Attractors reached from starts, given or in a box, and the fraction of the starts for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from capsule_sym._arrays import Vector
from capsule_sym._attractors.attractor import Attractors, closed_orbit, collected
from capsule_sym._attractors.destinations import Arrivals, KnownOrbits
from capsule_sym._errors import InvalidInput, Status, check_one_of
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds, is_real, real
from capsule_sym._map.labelled import package
from capsule_sym._map.many import spread
from capsule_sym._native import Watch
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import SceneParameters
from capsule_sym._processes import deferred

Starts = Mapping[str, float | tuple[float, float]] | ArrayLike


def attractors(
    parameters: SceneParameters,
    starts: Starts,
    *,
    count: int = 400,
    phases: ArrayLike = 0.0,
    periods: int = 4096,
    threads: int = 1,
    max_seconds: float = SEARCH_SECONDS,
    progress: Callable[[int, int], object] | None = None,
) -> Attractors:
    """Attractors of a set of starts, each as a closed orbit, with the fraction of the starts.

    Each start is run for at most `periods` excitation periods. The run ends before if it lies in a
    neighbourhood of an orbit that the map carries into itself, or if it repeats itself. Unknown
    orbits are solved by Newton's method from the ends of runs that nearly repeat.

    A start that settles on no attractor has the number -1. Its motion is chaotic, an orbit of more
    than 16 periods, a slow approach, or one that repeats but does not attract, or its run cannot be
    decided. After `max_seconds` the result has the attractors found so far; the other starts have
    the number -1 too.

    Parameters
    ----------
    parameters : Parameters or SceneParameters
        Parameters of the capsule or of a scene, dimensionless.
    starts : array_like of shape (n, 3), or mapping of str to float or (low, high)
        Start states (x_r, v_r, v_c), dimensionless, each from -1e20 to 1e20. Or a box: bounds of
        x_r, v_r, v_c and phase by name, such as `{"x_r": (-2, 2), "v_r": (-2, 2)}`. A single number
        is a fixed value, and a missing name is 0. A box has an extent in at least one of the names.
    count : int, default 400, 1 to 1,000,000
        Number of points of a box. It has no effect on given states.
    phases : float or array_like of shape (n,), default 0, from 0 to below 2 pi/omega
        Phases of given states: times in the excitation period, dimensionless. A box has its own.
    periods : int, default 4096, 2 to 10^12
        Length after which a run counts as unsettled, in excitation periods.
    threads : int, default 1, 1 to 10^12
        Number of threads.
    max_seconds : float, default 600, above 0
        Time limit, in seconds of wall time.
    progress : callable, optional
        Function that is called with the number of starts whose runs are over, and that of all
        starts. The last call may have fewer than all.

    Returns
    -------
    Attractors
        `attractors` has that of the most starts first, each with `orbit`, `count`, `fraction` and
        `interval`. An orbit that was found, but that no start has reached, has the count 0.
        `numbers` has the attractor number of each start, `unsettled` the number of starts without
        one. `status` is "finished" or "time-limit".

    Raises
    ------
    InvalidInput
        For a value outside its range, for a box without extent, and for `phases` with a box.

    Notes
    -----
    The points of a box are Halton's low-discrepancy sequence, without its first point. The 95 %
    intervals of the fractions are those of Clopper and Pearson. The points are not independent; the
    intervals hold for practically independent starts.

    See Also
    --------
    continue_attractors : attractors along a parameter.
    run_basin : attractors over a grid of starts, on disk.
    minimal_shock : smallest shock that loses a motion.

    Examples
    --------
    Two attractors, fast forward and slowly backward:

    >>> import capsule_sym as cs
    >>> system = cs.Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    >>> found = cs.attractors(system, {"x_r": (-2, 2), "v_r": (-2, 2)}, count=20)
    >>> print(found.message)
    20 starts lead to 2 attractors
    >>> for one in found.attractors:
    ...     print(f"{one.fraction:.2f} of the starts: {one.progression:.4f} per period")
    0.60 of the starts: 4.2081 per period
    0.40 of the starts: -0.3257 per period
    """
    states, times = checked_starts(starts, count, phases, parameters)
    check_count("periods", periods, 2)
    check_count("threads", threads)
    row = np.array([[*parameters.to_dict().values()]])
    known = KnownOrbits(row, parameters.scene, threads)
    total, orbits, status = len(states), list[Orbit | None](), Status.TIME_LIMIT
    found = Arrivals.begun(states)

    def report(done: int) -> None:
        # After the time limit no orbit is solved any more.
        new = known.cycles[0][len(orbits) :]
        orbits.extend(closed_orbit(parameters, cycle) for cycle in new)
        if progress is not None:
            progress(done, total)

    with Watch(checked_seconds(max_seconds)):
        known.destination(np.zeros(total, np.intp), found, times, periods, report=report)
        status = Status.FINISHED
    orbits += [None] * (len(known.cycles[0]) - len(orbits))  # not solved within the time
    reached, numbers = collected(found.numbers, orbits)
    return Attractors(parameters, reached, states, times, numbers, periods, status)


def checked_starts(
    starts: Starts, count: int, phases: ArrayLike, parameters: SceneParameters
) -> tuple[Vector, Vector]:
    """States (n, 3) and phases (n,) of starts.

    Raises InvalidInput for a wrong shape or a wrong box; ranges are checked by the runs.
    """
    if not isinstance(starts, Mapping):
        states = np.atleast_2d(np.array(starts, dtype=float))
        if states.ndim != 2 or states.shape[1] != 3 or not len(states):
            raise InvalidInput("starts", starts, "a box, or states of shape (n, 3)")
        return states, spread("phases", phases, (len(states),))
    if np.any(phases):
        raise InvalidInput("phases", phases, "0 for a box of starts, which may have a 'phase'")
    check_count("count", count, 1, 10**6)
    names = (*parameters.scene.facts.STATE, "phase")
    low, high = np.zeros(4), np.zeros(4)
    for name, ends in starts.items():
        check_one_of("starts", name, names)
        pair: Any = [ends, ends] if is_real(ends) else ends
        if np.shape(pair) != (2,) or not all(map(real, pair)) or pair[0] > pair[1]:
            raise InvalidInput(name, ends, "a finite number, or a pair (low, high)")
        low[names.index(name)], high[names.index(name)] = pair
    wide = np.flatnonzero(high > low)
    if not wide.size:
        allowed = f"a box with an extent in one or more of {', '.join(names)}"
        raise InvalidInput("starts", dict(starts), allowed)
    points = np.tile(low, (count, 1))
    with deferred():  # compiled code of SciPy may drop an interrupt
        sampler = package("scipy.stats.qmc").Halton(len(wide), scramble=False)
        sampler.fast_forward(1)  # the first point is a corner of the box
        points[:, wide] += sampler.random(count) * (high - low)[wide]
    return points[:, :3], points[:, 3]
