"""Attractors along a parameter, with the fractions of starts that lead to each.

The starts run at all values at once. Attractors at neighbouring values are the same if the closed
orbit continues from one value to the other and back, through changes of its itinerary. Otherwise
the branch is continued between the two values. If it reaches an attractor at the other value, both
are the same; else it leads to the bifurcation at which the attractor is born or dies. An attractor
that continues has the fraction 0 where no start leads to it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from capsule_sym._attractors.attractors import Starts, checked_starts
from capsule_sym._attractors.branches import ContinuedAttractors, row_at
from capsule_sym._attractors.destinations import Arrivals, KnownOrbits
from capsule_sym._attractors.links import Links
from capsule_sym._attractors.neighbourhoods import NONE
from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds
from capsule_sym._map.evaluation import real
from capsule_sym._native import Watch
from capsule_sym._orbits.continuation.parameter_paths import Function, parameter_path
from capsule_sym._parameters import SceneParameters

_MOST_RUNS = 10**7  # runs whose states are held in memory


def continue_attractors(
    parameters: SceneParameters,
    name: str,
    values: ArrayLike,
    starts: Starts,
    *,
    count: int = 400,
    phases: ArrayLike = 0.0,
    ties: Mapping[str, Function | str] | None = None,
    periods: int = 1024,
    threads: int = 1,
    max_seconds: float = SEARCH_SECONDS,
    progress: Callable[[int, int], object] | None = None,
) -> ContinuedAttractors:
    """Attractors at several values of a parameter, continued from value to value.

    The starts run at all values at once. Attractors at neighbouring values are the same if the
    closed orbit continues from one value to the other and back, through changes of its itinerary.
    Where this fails, the branch is continued exactly between the two values. If it does not reach
    the other one, the attractor is born or dies there: `birth` and `death` have the bifurcation at
    which it becomes stable, loses stability or ends. An attractor that no start reaches at some
    value is continued there too, with the fraction 0.

    After `max_seconds` the result has what was found so far.

    Parameters
    ----------
    parameters : Parameters or SceneParameters
        Parameters of the capsule or of a scene, dimensionless.
    name : str
        Name of the parameter that varies. With `ties` it may be a new name.
    values : array_like of shape (m,), two or more, ascending
        Values of this parameter. Dimensionless; a new name has the units of its ties. Starts times
        values are at most 10^7.
    starts : array_like of shape (n, 3), or mapping of str to float or (low, high)
        Start states (x_r, v_r, v_c), dimensionless, or a box, as in `attractors`. They are the same
        at all values.
    count : int, default 400, 1 to 1,000,000
        Number of points of a box. It has no effect on given states.
    phases : float or array_like of shape (n,), default 0, from 0 to below 2 pi/omega
        Phases of given states: times in the excitation period, dimensionless. A box has its own.
        If omega varies, they are below 2 pi/omega at its largest value.
    ties : mapping of str to callable or str, optional
        Other parameters that vary with this one, as in `continue_orbit`: for each a function, or a
        text such as "0.5*omega**2".
    periods : int, default 1024, 2 to 10^12
        Length after which a run counts as unsettled, in excitation periods.
    threads : int, default 1, 1 to 10^12
        Number of threads.
    max_seconds : float, default 600, above 0
        Time limit, in seconds of wall time.
    progress : callable, optional
        Function that is called with the number of runs that are over and that of all runs. The
        last call may have fewer than all; branches are continued after it.

    Returns
    -------
    ContinuedAttractors
        `branches` has one attractor each, with its `values`, `fractions`, `birth` and `death`.
        These two are None at the ends of the range; their `value` is nan if none is located.
        `unsettled` has the number of unsettled starts at each value. `status` is "finished" or
        "time-limit". All quantities are dimensionless; a new name has the units of its ties.

    Raises
    ------
    InvalidInput
        For a value outside its range, an unknown parameter, and values that do not ascend. Also for
        starts as `attractors`, and for ties as `continue_orbit`.

    See Also
    --------
    attractors : attractors at one set of parameters.
    plot : figure of the result.

    Examples
    --------
    An attractor of period 2 loses its second period between two values:

    >>> import capsule_sym as cs
    >>> system = cs.Parameters(omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    >>> box = {"x_r": (-2, 2), "v_r": (-2, 2)}
    >>> along = cs.continue_attractors(system, "alpha", [1.7, 1.75], box, count=20)
    >>> for one in along.branches:
    ...     ends = [f"{at.type} at {at.value:.6f}" if at else "-" for at in (one.birth, one.death)]
    ...     print(one.number, one.fractions, *ends)
    0 [0.75 0.8 ] - -
    1 [0.25] - period doubling at 1.716473
    2 [0.2] period doubling at 1.716473 -
    """
    path = parameter_path(name, ties, parameters.scene)
    grid = real("values", values, "two or more numbers, ascending")
    if grid.ndim != 1 or len(grid) < 2 or np.isinf(grid).any() or not np.all(np.diff(grid) > 0):
        raise InvalidInput("values", values, "two or more numbers, ascending")
    path.check(parameters, grid[0], grid[-1])
    check_count("periods", periods, 2)
    check_count("threads", threads)
    states, times = checked_starts(starts, count, phases, parameters)
    if len(states) * len(grid) > _MOST_RUNS:
        allowed = f"at most {counted(_MOST_RUNS // len(states), 'value')}"
        raise InvalidInput("values", len(grid), allowed)
    rows, count = np.array([row_at(path, parameters, value) for value in grid]), len(states)
    known = KnownOrbits(rows, parameters.scene, threads)
    links, groups = Links(parameters, path, grid, known), np.repeat(np.arange(len(grid)), count)
    runs, total = Arrivals.begun(np.tile(states, (len(grid), 1))), len(groups)
    report = None if progress is None else lambda done: progress(done, total)
    status = Status.TIME_LIMIT
    with Watch(checked_seconds(max_seconds)):
        known.destination(groups, runs, np.tile(times, len(grid)), periods, report=report)
        links.link()
        left = np.flatnonzero(runs.numbers == NONE)
        runs.numbers[left] = known.inside(groups[left], runs.states[left])
        status = Status.FINISHED
    numbers = runs.numbers.reshape(len(grid), -1)
    late = (numbers == NONE).sum(axis=1)
    found = links.branches(numbers)
    return ContinuedAttractors(name, grid, count, found, late, periods, status, parameters)
