"""All attractors that a box of starts leads to, and what fraction of the starts leads to each."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._attractors.neighbourhoods import NONE, Vector, stroboscopic
from capsule_sym._attractors.settling import Arrivals, Cycle, Settling
from capsule_sym._errors import InvalidInput, Status
from capsule_sym._map.checks import check_count, checked_seconds, is_real
from capsule_sym._map.itinerary import begun
from capsule_sym._map.labelled import Labelled, package
from capsule_sym._map.many import spread
from capsule_sym._map.result import Result, record
from capsule_sym._map.steady import shown_progression
from capsule_sym._native import Watch
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import orbit_at, solve_orbit
from capsule_sym._orbits.shooting.symmetry import symmetric
from capsule_sym._parameters import Scene, SceneParameters

_MOST_STARTS = 10**6
_MIRRORED = 1e-6  # distance of an orbit from the mirror image of another within which it is that
_SHARE = 0.95  # of the intervals of fractions
Starts = Mapping[str, float | tuple[float, float]] | ArrayLike


@dataclass(frozen=True, eq=False)
class Attractor:
    """A stable closed orbit, and how many of the starts lead to it; dimensionless.

    `interval` holds the fraction of the box that leads there with a probability of 95 % or more, by
    Clopper and Pearson, for starts that are as good as independent. `mirror` is the number of its
    mirror image among the attractors, its own where it is its own image, None where the system has
    no symmetry or no start leads to the image.
    """

    orbit: Orbit
    count: int
    fraction: float
    interval: tuple[float, float]
    mirror: int | None = None

    @cached_property
    def states(self) -> Vector:
        """States at phase 0, shape (period_number, 3), dimensionless."""
        return stroboscopic(self.orbit)

    @cached_property
    def itinerary(self) -> str:
        """Its fields, such as "F5 F2", begun as the paper does."""
        return shown_itinerary(self.orbit)

    @property
    def period_number(self) -> int:
        """Excitation periods of one period of the orbit."""
        return self.orbit.itinerary.period_number

    @cached_property
    def progression(self) -> float:
        """Advance of x_c per excitation period, 0 where it does not drift; dimensionless."""
        return shown_progression(self.orbit.motion)

    @property
    def multiplier(self) -> float:
        """Largest modulus of the Floquet multipliers."""
        return float(abs(self.orbit.multipliers[0]))

    def to_dict(self) -> dict[str, Any]:
        """The attractor as plain values."""
        return (
            record(self, "itinerary period_number progression")
            | record(self.orbit, "multipliers")
            | record(self, "count fraction interval mirror states")
        )


@dataclass(frozen=True, eq=False, repr=False)
class Attractors(Result, Labelled):
    """Attractors of one parameter set, that of the most starts first; dimensionless.

    `numbers` says of each start to which of the `attractors` it leads, -1 where it has not settled
    on a closed orbit within the periods that were run: chaos, an orbit of more than 16 periods, or
    a slow approach. `unsettled` counts these.
    """

    parameters: SceneParameters
    attractors: tuple[Attractor, ...]
    states: Vector
    """The starts, (x_r, v_r, v_c), shape (n, 3)."""
    phases: Vector
    """Times in the excitation period at which they start, shape (n,)."""
    numbers: NDArray[np.int16]
    """Number of each start's attractor, shape (n,)."""
    periods: int
    """Excitation periods after which a run counts as not settled."""
    status: Status
    dimension = "attractor"
    _recorded = "parameters starts unsettled periods attractors"

    @property
    def starts(self) -> int:
        """Number of starts."""
        return len(self.numbers)

    @property
    def unsettled(self) -> int:
        """Number of starts whose runs did not settle."""
        return int((self.numbers == NONE).sum())

    @property
    def message(self) -> str:
        """What was found, in words."""
        found = len(self.attractors)
        text = f"{self.starts} starts lead to {found} attractor{'s' * (found != 1)}"
        if self.status is not Status.FINISHED:
            why = "the time was over, or the work was interrupted"
            return f"{text}; {why}, before {self.unsettled} of them had settled"
        late = f"{self.unsettled} have not settled within {self.periods} excitation periods"
        return f"{text}; {late}" if self.unsettled else text

    @property
    def scene(self) -> Scene:
        """The scene of the parameters."""
        return self.parameters.scene

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """The attractors as columns, shape (k,)."""
        low, high = np.array([one.interval for one in self.attractors]).reshape(-1, 2).T
        mirrors = [NONE if one.mirror is None else one.mirror for one in self.attractors]
        return {
            "itinerary": np.array([one.itinerary for one in self.attractors], dtype=np.str_),
            "period_number": np.array([one.period_number for one in self.attractors], dtype=int),
            "progression": np.array([one.progression for one in self.attractors]),
            "largest_multiplier": np.array([one.multiplier for one in self.attractors]),
            "count": np.array([one.count for one in self.attractors], dtype=int),
            "fraction": np.array([one.fraction for one in self.attractors]),
            "fraction_low": low,
            "fraction_high": high,
            "mirror": np.array(mirrors, dtype=int),
        }

    def attributes(self) -> dict[str, Any]:
        """Parameters, number of starts, and how many did not settle."""
        return self.parameters.to_dict() | record(self, "starts unsettled status")


def attractors(
    parameters: SceneParameters,
    starts: Starts,
    *,
    count: int = 400,
    phases: ArrayLike = 0.0,
    periods: int = 4096,
    threads: int = 1,
    max_seconds: float = math.inf,
    progress: Callable[[int, int], object] | None = None,
) -> Attractors:
    """The attractors that starts lead to, each closed, with the fraction of the starts.

    `starts` are states (x_r, v_r, v_c), shape (n, 3), at `phases`, (n,) or one; or a box of them:
    bounds by name, such as {"x_r": (-2, 2), "v_r": (-2, 2)}, of x_r, v_r, v_c and phase, in which
    `count` low-discrepancy points are taken (Halton's). A name with a single number stands still,
    and what is not named is 0. Each start is followed until the map carries a neighbourhood of an
    orbit into itself with the run in it, or the run repeats itself, for at most so many excitation
    `periods`. All is dimensionless. `progress` is told how many of how many starts have settled.
    After `max_seconds` what is found so far is given. Raises InvalidInput for a value that is not
    allowed and a box without extent.
    """
    states, times = checked_starts(starts, count, phases, parameters)
    check_count("periods", periods, 2)
    check_count("threads", threads)
    row = np.array([[*parameters.to_dict().values()]])
    settling = Settling(row, parameters.scene, threads)
    total, orbits, status = len(states), list[Orbit | None](), Status.TIME_LIMIT
    found = Arrivals.begun(states)

    def report(done: int) -> None:
        # Where the time is over no orbit closes any more.
        new = settling.cycles[0][len(orbits) :]
        orbits.extend(closed_orbit(parameters, cycle) for cycle in new)
        if progress is not None:
            progress(done, total)

    with Watch(checked_seconds(max_seconds)):
        settling.follow(np.zeros(total, np.intp), found, times, periods, report=report)
        status = Status.FINISHED
    numbers, order = ranked(found.numbers, [orbit is not None for orbit in orbits])
    chosen = [orbit for i in order if (orbit := orbits[i]) is not None]
    return Attractors(
        parameters,
        listed(chosen, np.bincount(numbers[numbers >= 0], minlength=len(chosen)), total),
        states,
        times,
        numbers,
        periods,
        status,
    )


def checked_starts(
    starts: Starts, count: int, phases: ArrayLike, parameters: SceneParameters
) -> tuple[Vector, Vector]:
    """States (n, 3) and phases (n,) of starts; raises InvalidInput where they are not allowed."""
    if not isinstance(starts, Mapping):
        try:
            states = np.atleast_2d(np.array(starts, dtype=float))
        except (TypeError, ValueError):
            states = np.zeros(0)
        if states.ndim != 2 or states.shape[1] != 3 or not len(states):
            raise InvalidInput("starts", starts, "a box, or states of shape (n, 3)")
        return states, spread("phases", phases, (len(states),))
    check_count("count", count, 1, _MOST_STARTS)
    names = (*parameters.scene.facts.STATE, "phase")
    low, high = np.zeros(4), np.zeros(4)
    for name, ends in starts.items():
        if name not in names:
            raise InvalidInput("starts", name, f"one of {', '.join(names)}")
        pair = (ends, ends) if is_real(ends) else ends
        if not (
            isinstance(pair, Sequence | np.ndarray)
            and len(pair) == 2
            and all(is_real(end) and math.isfinite(end) for end in pair)
            and pair[0] <= pair[1]
        ):
            raise InvalidInput(name, ends, "a finite number, or a pair (low, high)")
        low[names.index(name)], high[names.index(name)] = pair
    wide = np.flatnonzero(high > low)
    if not wide.size:
        allowed = f"a box with an extent in one or more of {', '.join(names)}"
        raise InvalidInput("starts", dict(starts), allowed)
    points = np.tile(low, (count, 1))
    sampler = package("scipy.stats.qmc", "design").Halton(len(wide), scramble=False)
    sampler.fast_forward(1)  # the first point is a corner
    points[:, wide] += sampler.random(count) * (high - low)[wide]
    return points[:, :3], points[:, 3]


def closed_orbit(parameters: SceneParameters, cycle: Cycle) -> Orbit | None:
    """The orbit of a cycle, as its itinerary's equations have it; None where they have none."""
    state = cycle.states[0].tolist()
    found = orbit_at(parameters, state, len(cycle.states))
    if found is None:
        settled = solve_orbit(parameters, state, 0.0, 2 * len(cycle.states) + 1)
        found = settled if settled.success else None
    return found


def ranked(numbers: NDArray[Any], kept: Sequence[bool]) -> tuple[NDArray[np.int16], list[int]]:
    """Numbers anew, that of the most starts first, and the old ones in that order.

    Those that are not kept have the number NONE.
    """
    counts = np.bincount(numbers[numbers >= 0], minlength=len(kept))
    order = [i for i in np.argsort(-counts, kind="stable").tolist() if kept[i]]
    rank = np.full(len(kept) + 1, NONE)  # NONE counts from the end
    rank[order] = np.arange(len(order))
    return rank[numbers].astype(np.int16), order


def listed(orbits: Sequence[Orbit], counts: ArrayLike, total: int) -> tuple[Attractor, ...]:
    """Attractors of orbits at one parameter set, each with the count of its starts."""
    images = mirrors(orbits)
    return tuple(
        Attractor(orbit, count, count / total, interval(count, total), image)
        for orbit, count, image in zip(orbits, np.asarray(counts).tolist(), images, strict=True)
    )


def interval(count: int, total: int) -> tuple[float, float]:
    """Clopper and Pearson's interval of a fraction, from how many of the starts lead there."""
    ends = package("scipy.stats", "design").binomtest(count, total).proportion_ci(_SHARE)
    return float(ends.low), float(ends.high)


def mirrors(orbits: Sequence[Orbit]) -> list[int | None]:
    """Number of each orbit's mirror image among these, None where it is not there."""
    if not orbits or not symmetric(orbits[0].parameters):
        return [None] * len(orbits)
    cycles = [Cycle(stroboscopic(orbit), 0.0) for orbit in orbits]
    found = list[int | None]()
    for orbit, own in zip(orbits, cycles, strict=True):
        half, length = orbit.parameters.period / 2, orbit.itinerary.period_number
        # The image is at phase 0 what the orbit is half a period later, reversed.
        image = -stroboscopic(orbit, half)
        near = _MIRRORED * (1 + abs(own.states).max())
        found.append(
            next(
                (
                    k
                    for k, other in enumerate(cycles)
                    if len(other.states) == length and other.distance(image).max() <= near
                ),
                None,
            )
        )
    return found


def shown_itinerary(orbit: Orbit) -> str:
    """The fields of an orbit, such as "F5 F2", begun as the paper does."""
    return " ".join(f"F{field}" for field in begun(orbit.itinerary.fields, orbit.scene))
