"""Attractors reached from a box of starts, and the fraction of starts for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arrays import Vector
from capsule_sym._attractors.destinations import Arrivals, Cycle, KnownOrbits
from capsule_sym._attractors.neighbourhoods import NONE, stroboscopic
from capsule_sym._errors import InvalidInput, Status, check_one_of, counted
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds, is_real, real
from capsule_sym._map.itinerary import begun
from capsule_sym._map.labelled import Labelled, package
from capsule_sym._map.many import spread
from capsule_sym._map.result import Result, brief, record
from capsule_sym._map.steady import shown_progression
from capsule_sym._native import Watch
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import orbit_at, solve_orbit
from capsule_sym._orbits.shooting.symmetry import symmetric
from capsule_sym._parameters import Scene, SceneParameters
from capsule_sym._processes import deferred

_MOST_STARTS = 10**6  # starts of a box, whose states are held in memory
Starts = Mapping[str, float | tuple[float, float]] | ArrayLike


@dataclass(frozen=True, eq=False)
class Attractor:
    """Stable closed orbit, and the number of starts that lead to it; dimensionless.

    `interval` is the 95 % confidence interval of the fraction of the box, by Clopper and Pearson,
    for practically independent starts. `mirror` is the number of its mirror image among the
    attractors, its own if it is its own image. It is None if the system has no symmetry, or if no
    start leads to the image.
    """

    orbit: Orbit
    count: int
    fraction: float
    interval: tuple[float, float]
    mirror: int | None = None

    def __repr__(self) -> str:
        return brief(self, self.orbit.summary, f"of {self.fraction:.3g}")

    @cached_property
    def states(self) -> Vector:
        """States at phase 0, shape (period_number, 3), dimensionless."""
        return stroboscopic(self.orbit)

    @cached_property
    def itinerary(self) -> str:
        """Fields of the orbit, such as "F5 F2", from its standard first field."""
        return shown_itinerary(self.orbit)

    @property
    def period_number(self) -> int:
        """Excitation periods of one period of the orbit."""
        return self.orbit.itinerary.period_number

    @cached_property
    def progression(self) -> float:
        """Advance of x_c per excitation period, 0 without drift; dimensionless."""
        return shown_progression(self.orbit.motion)

    @property
    def multiplier(self) -> float:
        """Largest modulus of the Floquet multipliers."""
        return float(abs(self.orbit.multipliers[0]))

    def to_dict(self) -> dict[str, Any]:
        """Attractor as plain values."""
        return (
            record(self, "itinerary period_number progression")
            | record(self.orbit, "multipliers")
            | record(self, "count fraction interval mirror states")
        )


@dataclass(frozen=True, eq=False, repr=False)
class Attractors(Result, Labelled):
    """Attractors of one parameter set, that of the most starts first; dimensionless.

    `numbers` has for each start the number of its attractor among `attractors`, or -1 if it has not
    settled on a closed orbit within the run: chaos, an orbit of more than 16 periods, a slow
    approach, or a run that was ended by a time limit or Ctrl-C. `unsettled` is the number of these.
    """

    parameters: SceneParameters
    attractors: tuple[Attractor, ...]
    states: Vector
    """Start states (x_r, v_r, v_c), shape (n, 3)."""
    phases: Vector
    """Phases of the starts (times in the excitation period), shape (n,)."""
    numbers: NDArray[np.int16]
    """Attractor number of each start, shape (n,)."""
    periods: int
    """Excitation periods after which a run counts as unsettled."""
    status: Status
    _recorded = "parameters starts unsettled periods attractors"

    @property
    def starts(self) -> int:
        """Number of starts."""
        return len(self.numbers)

    @property
    def unsettled(self) -> int:
        """Number of starts that did not settle."""
        return int((self.numbers == NONE).sum())

    @property
    def message(self) -> str:
        """Number of attractors and of unsettled starts, as a sentence."""
        found = len(self.attractors)
        lead = "leads" if self.starts == 1 else "lead"
        text = f"{counted(self.starts, 'start')} {lead} to {counted(found, 'attractor')}"
        if self.status is not Status.FINISHED:
            why = "time limit reached, or interrupted"
            return f"{text}; {why}, before {self.unsettled} of them had settled"
        periods = counted(self.periods, "excitation period")
        late = f"{counted(self.unsettled, 'has', 'have')} not settled within {periods}"
        return f"{text}; {late}" if self.unsettled else text

    @property
    def scene(self) -> Scene:
        """Scene of the parameters."""
        return self.parameters.scene

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Attractors as columns, shape (k,)."""
        mirrors = [NONE if one.mirror is None else one.mirror for one in self.attractors]
        ends = np.reshape([one.interval for one in self.attractors], (-1, 2))

        def column(name: str, kind: type) -> NDArray[Any]:
            return np.array([getattr(one, name) for one in self.attractors], dtype=kind)

        return {
            "itinerary": column("itinerary", np.str_),
            "period_number": column("period_number", int),
            "progression": column("progression", float),
            "largest_multiplier": column("multiplier", float),
            "count": column("count", int),
            "fraction": column("fraction", float),
            "fraction_low": ends[:, 0],
            "fraction_high": ends[:, 1],
            "mirror": np.array(mirrors, dtype=int),
        }


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

    A start that does not settle within `periods` has the number -1. Its motion is chaotic, an orbit
    of more than 16 periods, or a slow approach. After `max_seconds` the result has the attractors
    found so far.

    Parameters
    ----------
    parameters : Parameters or SceneParameters
        Parameters of the capsule or of a scene, dimensionless.
    starts : array_like of shape (n, 3), or mapping of str to float or (low, high)
        Start states (x_r, v_r, v_c), dimensionless. Or a box: bounds of x_r, v_r, v_c and phase by
        name, such as `{"x_r": (-2, 2), "v_r": (-2, 2)}`. A single number is a fixed value, and a
        missing name is 0. A box has an extent in at least one of the names.
    count : int, default 400, 1 to 1,000,000
        Number of points of a box. It has no effect on given states.
    phases : float or array_like of shape (n,), default 0, from 0 to below 2 pi/omega
        Phases of given states: times in the excitation period, dimensionless. A box has its own.
    periods : int, default 4096, 2 or more
        Length after which a run counts as unsettled, in excitation periods.
    threads : int, default 1, 1 or more
        Number of threads.
    max_seconds : float, default 600, above 0
        Time limit, in seconds of wall time.
    progress : callable, optional
        Function that is called with the number of settled starts and that of all starts.

    Returns
    -------
    Attractors
        `attractors` has that of the most starts first, each with `orbit`, `count`, `fraction` and
        `interval`. `numbers` has the attractor number of each start, `unsettled` the number of
        starts without one. `status` is "finished" or "time-limit".

    Raises
    ------
    InvalidInput
        For a value outside its range, and for a box without extent.

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
    reached, numbers = collected(found.numbers, orbits)
    return Attractors(parameters, reached, states, times, numbers, periods, status)


def checked_starts(
    starts: Starts, count: int, phases: ArrayLike, parameters: SceneParameters
) -> tuple[Vector, Vector]:
    """States (n, 3) and phases (n,) of starts; raises InvalidInput if they are not allowed."""
    if not isinstance(starts, Mapping):
        states = np.atleast_2d(np.array(starts, dtype=float))
        if states.ndim != 2 or states.shape[1] != 3 or not len(states):
            raise InvalidInput("starts", starts, "a box, or states of shape (n, 3)")
        return states, spread("phases", phases, (len(states),))
    if np.any(phases):
        raise InvalidInput("phases", phases, "0 for a box of starts, which may have a 'phase'")
    check_count("count", count, 1, _MOST_STARTS)
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


def closed_orbit(parameters: SceneParameters, cycle: Cycle) -> Orbit | None:
    """Orbit of a cycle, solved in its itinerary; None if that fails."""
    state, number = cycle.states[0].tolist(), len(cycle.states)
    found = orbit_at(parameters, state, number)
    settled = found or solve_orbit(parameters, state, 0.0, 2 * number + 1)
    return settled if settled.success else None


def collected(
    numbers: NDArray[Any], orbits: Sequence[Orbit | None]
) -> tuple[tuple[Attractor, ...], NDArray[np.int16]]:
    """Attractors in the order of the most starts, and the starts' new numbers in that order.

    Starts whose orbit is None get the number NONE.
    """
    counts = np.bincount(numbers[numbers >= 0], minlength=len(orbits))
    order = [i for i in np.argsort(-counts, kind="stable").tolist() if orbits[i] is not None]
    rank, total = np.full(len(orbits) + 1, NONE), numbers.size  # NONE counts from the end
    rank[order] = np.arange(len(order))
    chosen = [orbit for i in order if (orbit := orbits[i]) is not None]
    found = tuple(
        Attractor(orbit, count, count / total, interval(count, total), image)
        for orbit, count, image in zip(chosen, counts[order].tolist(), mirrors(chosen), strict=True)
    )
    return found, rank[numbers].astype(np.int16)


def interval(count: int, total: int) -> tuple[float, float]:
    """95 % Clopper-Pearson interval of a fraction, from the count of its starts."""
    inverse = package("scipy.special").betaincinv
    low = inverse(count, total - count + 1, 0.025) if count else 0.0
    high = inverse(count + 1, total - count, 0.975) if count < total else 1.0
    return float(low), float(high)


def mirrors(orbits: Sequence[Orbit]) -> list[int | None]:
    """Number of each orbit's mirror image among the orbits; None if it is missing."""
    if not orbits or not symmetric(orbits[0].parameters):
        return [None] * len(orbits)
    cycles, half = [stroboscopic(orbit) for orbit in orbits], orbits[0].parameters.period / 2
    # At phase 0 the image is the reversed orbit of half a period later.
    images = [Cycle(-stroboscopic(orbit, half), 0.0) for orbit in orbits]
    return [
        next((k for k, states in enumerate(cycles) if image.same(Cycle(states, 0.0))), None)
        for image in images
    ]


def shown_itinerary(orbit: Orbit) -> str:
    """Fields of an orbit, such as "F5 F2", from its standard first field."""
    return " ".join(f"F{field}" for field in begun(orbit.itinerary.fields, orbit.scene))
