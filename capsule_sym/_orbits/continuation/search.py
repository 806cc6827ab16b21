"""Search of a box of starts for orbits: attractors, unstable orbits, and isolas."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput, Status
from capsule_sym._map.checks import check_count
from capsule_sym._map.many import simulate_many
from capsule_sym._native import Watch, check_time, present
from capsule_sym._orbits.continuation.branches.branch import Branch
from capsule_sym._orbits.continuation.branches.continuing import (
    axis_within,
    follow_both_ways,
)
from capsule_sym._orbits.continuation.families.family import Ending
from capsule_sym._orbits.continuation.parameter_paths import Axis
from capsule_sym._orbits.continuation.settings import DEFAULT, ContinuationSettings, computing
from capsule_sym._orbits.metrics.many import performance_many
from capsule_sym._orbits.shooting.admissibility import rerun
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._orbits.shooting.search import (
    checked_box,
    checked_periods,
    orbit_at,
    solve_orbit,
)
from capsule_sym._orbits.shooting.stability import floquet_multipliers
from capsule_sym._orbits.shooting.symmetry import same
from capsule_sym._parameters import SceneParameters

_MOST_STARTS, _MOST_PERIODS = 100_000, 16


@dataclass(frozen=True)
class BoxSearch:
    """Orbits found from a box of starts, and the extent of the search; dimensionless.

    `orbits` are in the order of their period numbers. `settled` has for each the number of `starts`
    that settle on it, `open` the number that settle on none within the run. `branches` are the
    continued ones; the closed ones are `isolas`. `message` lists what was searched, and what may be
    missing.
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
        """True if the search finished and every start settles on one of the orbits."""
        return self.status is Status.FINISHED and self.open == 0

    @property
    def isolas(self) -> tuple[Branch, ...]:
        """Closed branches."""
        return tuple(one for one in self.branches if one.status is Ending.RETURNED)


def search_box(
    parameters: SceneParameters,
    box: Sequence[float],
    *,
    size: Sequence[int] = (12, 12, 3),
    period_numbers: Sequence[int] = (1, 2, 3, 4, 5, 6),
    periods: int = 256,
    along: str | None = None,
    ends: Sequence[float] | None = None,
    points: int = 50,
    settings: ContinuationSettings = DEFAULT,
    report: Callable[[str], None] | None = None,
    max_seconds: float = math.inf,
) -> BoxSearch:
    """All orbits reached from a grid of starts in a box, stable or not, and their branches.

    All quantities are dimensionless. The starts are a grid of `size` (n_x, n_v, n_c) states with
    `|x_r|`, `|v_r|`, `|v_c|` up to the bounds `box`, at phase 0. Runs from all starts until they
    settle give the attractors. Newton's method on the map over each of `period_numbers` excitation
    periods starts from every start, and from its state after 1, 2, 4, 8 and 16 periods: this also
    finds unstable orbits. With a parameter `along` the branch of each orbit is continued both ways
    between `ends`, through folds. Further orbits of a branch at the given parameters are added;
    closed branches are isolas. `settings` has the tolerances. `report` is called with the progress.
    The search ends after `max_seconds`. Raises InvalidInput for a box, a size or period numbers
    that are not allowed, without a C core, and as `continue_both_ways` does.
    """
    bounds, counts, numbers = _checked(box, size, period_numbers)
    check_count("periods", periods)
    if (along is None) != (ends is None):
        raise InvalidInput("ends", ends, "given if and only if along is given")
    axis = None
    if along is not None and ends is not None:
        axis = axis_within(parameters, [*parameters.to_dict().values()], along, ends)
    search, status = _Search(parameters, _grid(bounds, counts), settings), Status.TIME_LIMIT
    say, branches, many = report or (lambda text: None), list[Branch](), len(search.starts)
    say(f"running {many} starts")
    scene = parameters.scene
    with computing(points, settings, max_seconds, scene) as (doubles, limit), limit:
        search.find_attractors(periods)
        seeds = len(settings.seed_periods) * many
        say(f"{len(search.orbits)} attractors; Newton's method from {seeds} states")
        search.find_closed(numbers)
        on_branch: list[Orbit] = []
        for orbit in search.orbits:  # grows during the loop
            if axis is None or any(same(orbit, known) for known in on_branch):
                continue
            say(f"following {orbit.itinerary} in {along}; {len(search.orbits)} orbits")
            new, passed = follow_both_ways(doubles, orbit, axis, points, settings, Watch())
            branches += new
            check_time()
            on_branch += [orbit, *passed]
            search.add(passed)
        status = Status.FINISHED
    orbits, settled = search.orbits, search.settled
    order = sorted(range(len(orbits)), key=lambda k: orbits[k].itinerary.period_number)
    result = BoxSearch(
        tuple(orbits[k] for k in order),
        tuple(settled[k] if k < len(settled) else 0 for k in order),
        many,
        many - sum(settled),
        tuple(branches),
        "",
        status,
    )
    return replace(
        result, message=_searched(result, bounds, counts, numbers, periods, axis, settings)
    )


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
    """States (n, 3) of a grid in a box; its middle in a direction of one state."""
    lines = [
        np.linspace(-b, b, n) if n > 1 else np.zeros(1) for b, n in zip(bounds, counts, strict=True)
    ]
    return np.stack([one.ravel() for one in np.meshgrid(*lines, indexing="ij")], axis=1)


class _Search:
    """Known orbits, and the number of starts that settle on each."""

    def __init__(
        self,
        parameters: SceneParameters,
        starts: NDArray[np.float64],
        settings: ContinuationSettings,
    ) -> None:
        self.parameters, self.starts, self.settings = parameters, starts, settings
        self.row = np.array([[*parameters.to_dict().values()]])
        self.orbits: list[Orbit] = []
        self.settled: list[int] = []

    def find_attractors(self, periods: int) -> None:
        """Add the orbits on which starts settle, with their numbers of starts."""
        ends, length = self.starts, periods
        for _ in range(self.settings.settling_rounds):
            ends = self._states(ends, length)
            left = np.ones(len(ends), dtype=bool)
            for k, orbit in enumerate(self.orbits):
                here = left & self._near(orbit, ends)
                self.settled[k] += int(here.sum())
                left &= ~here
            for _ in range(self.settings.settling_trials):
                if not left.any():
                    break
                first = int(np.argmax(left))
                orbit = solve_orbit(self.parameters, ends[first].tolist(), periods=256)
                if orbit.success and self.add([orbit]):
                    here = left & self._near(orbit, ends)
                    self.settled.append(int(here.sum()))
                    left &= ~here
                else:
                    # Runs that have not settled yet continue with the others.
                    ends, left = (np.roll(one, -first - 1, axis=0) for one in (ends, left))
            ends, length = ends[left], 2 * length
            if not len(ends):
                break

    def find_closed(self, period_numbers: Sequence[int]) -> None:
        """Add other orbits that Newton's method on the map finds from starts and their runs."""
        first, *later = self.settings.seed_periods
        seeds, before = [self._states(self.starts, first) if first else self.starts], first
        for after in later:
            seeds.append(self._states(seeds[-1], after - before))
            before = after
        states = np.concatenate(seeds)
        many = np.repeat(self.row, len(states), axis=0)
        for number in period_numbers:
            closed = performance_many(
                many,
                states,
                number,
                energies=False,
                forces=False,
                watch=present(),
                scene=self.parameters.scene,
            )
            check_time()
            left = closed.states[closed.closed]
            for orbit in self.orbits:
                left = left[~self._near(orbit, left)]
            while len(left):
                new = orbit_at(self.parameters, left[0].tolist(), number)
                same_state = self.settings.same_distance * (1 + abs(left[0]).max())
                others = abs(left - left[0]).max(axis=1) > same_state
                if new is not None and self.add([new]):
                    others &= ~self._near(new, left)
                left = left[others]

    def add(self, orbits: Sequence[Orbit]) -> bool:
        """Add orbits that are not known; returns True if there are any."""
        before = len(self.orbits)
        for orbit in orbits:
            if not any(same(orbit, one) for one in self.orbits):
                self.orbits.append(orbit)
        return len(self.orbits) > before

    def _states(self, starts: NDArray[np.float64], periods: int) -> NDArray[np.float64]:
        """States (n, 3) after so many periods."""
        rows = np.repeat(self.row, len(starts), axis=0)
        found = simulate_many(rows, starts, periods=periods).states
        check_time()
        return found

    def _near(self, orbit: Orbit, states: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Mask (n,) of the states (n, 3) that are on an orbit at phase 0."""
        marks = np.array(rerun(orbit).stroboscopic[-orbit.itinerary.period_number :], dtype=float)
        size = 1 + abs(np.array([flow.start for flow in orbit.system.flows], dtype=float)).max()
        apart = abs(states[:, None, :] - marks[None, :, :]).max(axis=2).min(axis=1)
        return np.asarray(apart < self.settings.settled_distance * size)


def _searched(
    found: BoxSearch,
    bounds: NDArray[np.float64],
    counts: Sequence[int],
    numbers: Sequence[int],
    periods: int,
    axis: Axis | None,
    settings: ContinuationSettings,
) -> str:
    """Message of a search: its extent, its result, and what may be missing."""
    stable = sum(abs(floquet_multipliers(one)[0]) < 1 for one in found.orbits)
    size = " x ".join(map(str, counts))
    within = ", ".join(
        f"|{n}| <= {b:g}" for n, b in zip(("x_r", "v_r", "v_c"), bounds, strict=True)
    )
    longest = periods * (2**settings.settling_rounds - 1)
    text = (
        f"orbits: {len(found.orbits)}, of these stable: {stable}, from {size} starts at phase 0 "
        f"with {within}: {found.starts - found.open} settle within {longest} periods, {found.open} "
        f"on none of these; Newton's method over {', '.join(map(str, numbers))} periods from every "
        f"start and after {', '.join(map(str, settings.seed_periods[1:]))} periods of its run"
    )
    if axis is not None:
        text += (
            f"; {len(found.branches)} branches followed in {axis.name} from {axis.begin:g} to "
            f"{axis.end:g}, "
            f"{len(found.isolas)} closed"
        )
    if found.status is Status.TIME_LIMIT:
        text += "; the time limit was reached before the end"
    return f"{text}. Not searched: other starts and phases, and orbits of other period numbers."
