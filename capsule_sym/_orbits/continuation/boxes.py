"""All orbits that a box of starts leads to: attractors, unstable orbits, and isolas."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput, Status
from capsule_sym._map.batch import final_states, parameter_rows
from capsule_sym._map.checks import check_count, checked_seconds
from capsule_sym._native import Watch, check_time, present
from capsule_sym._orbits.continuation.continuation import Branch, check_points
from capsule_sym._orbits.continuation.isolas import checked_axis, follow_both_ways
from capsule_sym._orbits.continuation.states import Ending
from capsule_sym._orbits.metrics.many import performance_many
from capsule_sym._orbits.shooting.admissibility import rerun
from capsule_sym._orbits.shooting.identity import same
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import (
    checked_box,
    checked_periods,
    orbit_at,
    solve_orbit,
)
from capsule_sym._orbits.shooting.stability import floquet_multipliers
from capsule_sym._parameters import Parameters

_SEEDS = (0, 1, 2, 4, 8, 16)  # excitation periods after which a run is a guess for Newton's method
_SETTLED = 1e-6  # distance from an orbit, in units of its size, at which a run has settled on it
_ROUNDS = 3  # how often runs that have not settled go on, each time twice as long
_TRIED = 12  # runs, of those that settle on no known orbit, whose end is looked at in a round
_SAME = 1e-7  # states of one orbit, closed twice, differ by less
_MOST_STARTS, _MOST_PERIODS = 100_000, 16


@dataclass(frozen=True)
class BoxSearch:
    """Orbits found from a box of starts, and what was searched; dimensionless.

    `orbits` come in the order of their period numbers; `settled` says for each how many of the
    `starts` settle on it, and `open` how many settle on none within the periods that were run.
    `branches` are those that were followed, of which closed ones are `isolas`. `message` says what
    was searched, and what may be missing.
    """

    orbits: tuple[Orbit, ...]
    settled: tuple[int, ...]
    starts: int
    open: int
    branches: tuple[Branch, ...]
    message: str
    status: Status = Status.FINISHED

    @property
    def success(self) -> bool:
        """Whether the search was finished, and every start settles on one of the orbits."""
        return self.status is Status.FINISHED and self.open == 0

    @property
    def isolas(self) -> tuple[Branch, ...]:
        """The branches that are closed."""
        return tuple(one for one in self.branches if one.status is Ending.RETURNED)


def search_box(
    parameters: Parameters,
    box: Sequence[float],
    *,
    size: Sequence[int] = (12, 12, 3),
    period_numbers: Sequence[int] = (1, 2, 3, 4, 5, 6),
    periods: int = 256,
    along: str | None = None,
    ends: Sequence[float] | None = None,
    points: int = 50,
    report: Callable[[str], None] | None = None,
    max_seconds: float = math.inf,
) -> BoxSearch:
    """All orbits that a grid of starts in a box leads to, stable or not, and the branches of each.

    All is dimensionless. Starts are a grid of `size` (n_x, n_v, n_c) states with `|x_r|`, `|v_r|`,
    `|v_c|` up to the bounds `box`, at phase 0. All run until they have settled: these are the
    attractors. Newton's method on the map over each of `period_numbers` excitation periods goes
    from every start, and from where it is after 1, 2, 4, 8 and 16 periods: this finds unstable
    orbits too. With a parameter `along` the branch of each is followed both ways between `ends`,
    through folds, and orbits that it has at the same parameters are among those found; closed
    branches are isolas. `report` is told what is done. The search ends after `max_seconds`. Raises
    InvalidInput for a box, a size or numbers of periods that are not allowed, where there is no C
    core, and as `continue_both_ways` does.
    """
    bounds, counts, numbers = _checked(box, size, period_numbers)
    check_count("periods", periods)
    check_points(points)
    if (along is None) != (ends is None):
        raise InvalidInput("ends", ends, "given with along, and only then")
    if along is not None and ends is not None:
        checked_axis(parameters, [*parameters.to_dict().values()], along, ends)
    starts = _grid(bounds, counts)
    row = parameter_rows(parameters)
    say = report or (lambda text: None)
    say(f"running {len(starts)} starts")
    found, settled, branches = list[Orbit](), list[int](), list[Branch]()
    status = Status.TIME_LIMIT
    with Watch(checked_seconds(max_seconds)):
        _attractors(parameters, row, starts, periods, found, settled)
        say(f"{len(found)} attractors; Newton's method from {len(_SEEDS) * len(starts)} states")
        _closed(parameters, row, starts, numbers, found)
        if along is not None and ends is not None:
            on_branch: list[Orbit] = []
            for orbit in found:  # grows on the way
                if any(same(orbit, known) for known in on_branch):
                    continue
                say(f"following {orbit.itinerary} in {along}; {len(found)} orbits")
                new, passed = follow_both_ways(orbit, along, ends, points=points)
                branches += new
                check_time()
                on_branch += [orbit, *passed]
                _add_new(passed, found)
        status = Status.FINISHED
    order = sorted(range(len(found)), key=lambda k: found[k].itinerary.period_number)
    result = BoxSearch(
        tuple(found[k] for k in order),
        tuple(settled[k] if k < len(settled) else 0 for k in order),
        len(starts),
        len(starts) - sum(settled),
        tuple(branches),
        "",
        status,
    )
    return replace(result, message=_searched(result, bounds, counts, numbers, periods, along, ends))


def _checked(
    box: Sequence[float], size: Sequence[int], period_numbers: Sequence[int]
) -> tuple[NDArray[np.float64], tuple[int, ...], tuple[int, ...]]:
    bounds = checked_box(box)
    whole = all(isinstance(n, int) and not isinstance(n, bool) and n >= 1 for n in size)
    if not whole or len(size) != 3 or np.prod(size, dtype=float) > _MOST_STARTS:
        allowed = f"three whole numbers >= 1, of {_MOST_STARTS} states at most"
        raise InvalidInput("size", size, allowed)
    counts = tuple(n if bound > 0 else 1 for n, bound in zip(size, bounds, strict=True))
    return bounds, counts, checked_periods(period_numbers, _MOST_PERIODS)


def _grid(bounds: NDArray[np.float64], counts: Sequence[int]) -> NDArray[np.float64]:
    """States (n, 3) that fill a box, its middle where there is one in a direction."""
    lines = [
        np.linspace(-b, b, n) if n > 1 else np.zeros(1) for b, n in zip(bounds, counts, strict=True)
    ]
    return np.stack([one.ravel() for one in np.meshgrid(*lines, indexing="ij")], axis=1)


def _attractors(
    parameters: Parameters,
    row: NDArray[np.float64],
    starts: NDArray[np.float64],
    periods: int,
    orbits: list[Orbit],
    counts: list[int],
) -> None:
    """Adds the orbits on which starts settle, and how many do on each."""
    ends, length = starts, periods
    for _ in range(_ROUNDS):
        rows = np.repeat(row, len(ends), axis=0)
        ends = _states(rows, ends, length)
        left = np.ones(len(ends), dtype=bool)
        for k, orbit in enumerate(orbits):
            here = left & _near(orbit, ends)
            counts[k] += int(here.sum())
            left &= ~here
        for _ in range(_TRIED):
            if not left.any():
                break
            first = int(np.argmax(left))
            orbit = solve_orbit(parameters, ends[first].tolist(), periods=256)
            if not orbit.success or any(same(orbit, known) for known in orbits):
                # What has not settled yet, or never does, goes on with the others.
                ends = np.roll(ends, -first - 1, axis=0)
                left = np.roll(left, -first - 1)
                continue
            here = left & _near(orbit, ends)
            orbits.append(orbit)
            counts.append(int(here.sum()))
            left &= ~here
        ends, length = ends[left], 2 * length
        if not len(ends):
            break


def _states(
    rows: NDArray[np.float64], starts: NDArray[np.float64], periods: int
) -> NDArray[np.float64]:
    """States (n, 3) after so many periods."""
    found = final_states(rows, starts, 0.0, periods, watch=present()).states
    check_time()
    return found


def _near(orbit: Orbit, states: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which states are on an orbit at phase 0, shape (n,)."""
    marks = np.array(rerun(orbit).stroboscopic[-orbit.itinerary.period_number :], dtype=float)
    size = 1 + abs(np.array([flow.start for flow in orbit.system.flows], dtype=float)).max()
    apart = abs(states[:, None, :] - marks[None, :, :]).max(axis=2).min(axis=1)
    return np.asarray(apart < _SETTLED * size)


def _closed(
    parameters: Parameters,
    row: NDArray[np.float64],
    starts: NDArray[np.float64],
    period_numbers: Sequence[int],
    known: list[Orbit],
) -> None:
    """Adds other orbits to which Newton's method on the map leads from starts and their runs."""
    rows = np.repeat(row, len(starts), axis=0)
    seeds, before = [starts], 0
    for after in _SEEDS[1:]:
        seeds.append(_states(rows, seeds[-1], after - before))
        before = after
    states = np.concatenate(seeds)
    many = np.repeat(row, len(states), axis=0)
    for number in period_numbers:
        closed = performance_many(
            many, states, number, energies=False, forces=False, watch=present()
        )
        check_time()
        left = closed.states[closed.closed]
        for orbit in known:
            left = left[~_near(orbit, left)]
        while len(left):
            new = orbit_at(parameters, left[0].tolist(), number)
            others = abs(left - left[0]).max(axis=1) > _SAME * (1 + abs(left[0]).max())
            if new is not None and _add_new([new], known):
                others &= ~_near(new, left)
            left = left[others]


def _add_new(orbits: Sequence[Orbit], known: list[Orbit]) -> bool:
    """Adds orbits that are not known, and says whether there are any."""
    before = len(known)
    for orbit in orbits:
        if not any(same(orbit, one) for one in known):
            known.append(orbit)
    return len(known) > before


def _searched(
    found: BoxSearch,
    bounds: NDArray[np.float64],
    counts: Sequence[int],
    numbers: Sequence[int],
    periods: int,
    along: str | None,
    ends: Sequence[float] | None,
) -> str:
    """What was searched, what was found, and what may be missing."""
    stable = sum(abs(floquet_multipliers(one)[0]) < 1 for one in found.orbits)
    size = " x ".join(map(str, counts))
    within = ", ".join(
        f"|{n}| <= {b:g}" for n, b in zip(("x_r", "v_r", "v_c"), bounds, strict=True)
    )
    longest = periods * (2**_ROUNDS - 1)
    text = (
        f"{len(found.orbits)} orbits, {stable} of them stable, from {size} starts at phase 0 with "
        f"{within}: {found.starts - found.open} settle within {longest} periods, {found.open} on "
        f"none of these; Newton's method over {', '.join(map(str, numbers))} periods from every "
        f"start and after {', '.join(map(str, _SEEDS[1:]))} periods of its run"
    )
    if along is not None and ends is not None:
        low, high = ends
        text += (
            f"; {len(found.branches)} branches followed in {along} from {low:g} to {high:g}, "
            f"{len(found.isolas)} closed"
        )
    if found.status is Status.TIME_LIMIT:
        text += "; the time was over before all this was done"
    return f"{text}. Not searched: other starts and phases, and orbits of other period numbers."
