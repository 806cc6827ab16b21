"""Search for periodic orbits: from a motion that settles, and from random starts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import Ended, InvalidInput, Status, counted
from capsule_sym._map import Segment, Trajectory, simulate
from capsule_sym._map.checks import LARGEST_STATE, SEARCH_SECONDS, check_count, checked_seconds
from capsule_sym._map.drift import dragged
from capsule_sym._map.many import spread
from capsule_sym._map.result import brief
from capsule_sym._map.steady import LONGEST
from capsule_sym._native import Watch
from capsule_sym._orbits.shooting.admissibility import is_admissible, rerun, tightest
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import NoOrbit, Orbit, solve_itinerary
from capsule_sym._orbits.shooting.stability import floquet_multipliers, jacobian
from capsule_sym._orbits.shooting.symmetry import primitive, same
from capsule_sym._parameters import SceneParameters

_BLOCK = 64  # excitation periods before the first test for a periodic motion
_NEAR = 0.1  # largest change of a run that nearly repeats, and distance of an orbit from its guess
_NEWTON_STEPS = 30
_CLOSED = 1e-6  # change over the periods, over 1 + the state's size, that ends Newton's method
_REPEATED = 1e-7  # change over a period of the motion below which a run has settled
_ARRIVED = 1e-6  # distance, over the motion's size, below which a run is on its orbit
_CLOSER = 1e-3  # share of its distance from an orbit to which a run should decay
_SLACK = 10  # factor by which a run may be further from an orbit than the multipliers predict
_FURTHER = 4096  # largest number of excitation periods to test that a run converges
_MOST_STARTS, _LONGEST_SOUGHT = 10**6, 1024
_MOST_NAMED = 3  # largest number of itineraries in a message


def solve_orbit(
    parameters: SceneParameters,
    state: Sequence[float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    periods: int = 1024,
    *,
    max_seconds: float = math.inf,
) -> Orbit:
    """Stable orbit on which the simulated motion settles within a number of excitation periods.

    The motion is simulated over 64, 128, 256, ... periods, each time from the start. Where the
    state at its end nearly repeats after 1 to 16 excitation periods, the nearby orbit is solved
    for. It is accepted if it is stable and admissible, and if the motion approaches it. The motion
    need not have settled to the last digit.

    If there is no orbit, the message gives the reason, also against each of at most three
    itineraries that were tried. The status is then "not-periodic", or that of the refused orbit if
    the run repeats. No orbit is found if drive and load drag the capsule without end, or if a run
    stops early, as after 10^6 segments.

    Parameters
    ----------
    parameters : Parameters
        Parameters of the capsule or of another scene, dimensionless.
    state : sequence of 3 floats, default (0, 0, 0), each from -1e20 to 1e20
        Start state (x_r, v_r, v_c), dimensionless.
    phase : float, default 0, from 0 to below 2 pi/omega
        Phase at the start, a dimensionless time in the excitation period.
    periods : int, default 1024, 1 to 10^12
        Length of the longest run, in excitation periods from phase 0 on.
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time. The status is then "time-limit".

    Returns
    -------
    Orbit
        The orbit, or a result whose `success` is False, with `status` and `message`.

    Raises
    ------
    InvalidInput
        For a value that is not allowed, as by `simulate`.

    See Also
    --------
    search_orbits : orbits from many random starts, stable or not.
    solve_itinerary : orbit of a given itinerary, near a guess.
    continue_orbit : branch of orbits from one orbit.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))  # on which the run from rest settles
    >>> print(orbit.itinerary, orbit.status, orbit.stable)
    F5 F4 F1 F2 converged True
    >>> print(f"{orbit.progression:.6f}")  # per excitation period
    0.801161
    """
    length, refused, begin = 0, list[_Refused](), f"from {tuple(state)} at phase {phase}"
    status, why = Status.NOT_PERIODIC, ""
    check_count("periods", periods)
    with Watch(checked_seconds(max_seconds)):
        while length < periods:
            length = min(2 * length or _BLOCK, periods)
            # Always from the start: a chaotic transient would differ after a restart.
            trajectory = simulate(parameters, state, phase, length)
            refused, why = (
                [],
                dragged(parameters) or ("" if trajectory.success else trajectory.message),
            )
            if why:
                break
            for ending in endings(trajectory):
                found = _accepted(trajectory, ending)
                if found.success:
                    return found
                refused.append(_Refused(ending, found))
        for one in refused:
            # The run may repeat, although its equations have no such solution.
            if one.ending.change < _REPEATED and one.why.status is not Status.NOT_PERIODIC:
                return one.why
        why = why or (
            f"the run {begin} has not settled within {periods} excitation periods on a motion of "
            f"at most {LONGEST}; {_tried(refused)}"
        )
    if not why:
        status = Status.TIME_LIMIT
        why = f"time limit reached in {length} excitation periods {begin}; {_tried(refused)}"
    values = tuple(parameters.to_dict().values())
    return NoOrbit(status, why, None, values, float("inf"), scene=parameters.scene)


class LastPeriod(NamedTuple):
    """Period that follows a run that nearly repeats: itinerary, unknowns z, and change.

    `change` is the largest change of the state over as many excitation periods at the end of the
    run, over the largest entry of the last states at phase 0.
    """

    itinerary: Itinerary
    guess: list[float]
    change: float


class _Refused(NamedTuple):
    """An itinerary that was tried, and the reason why its orbit is not accepted."""

    ending: LastPeriod
    why: Orbit


def _tried(refused: Sequence[_Refused]) -> str:
    """Message with the itineraries tried and the reasons against them."""
    if not refused:
        return "the end of the run repeats no itinerary"
    tried = [
        f"{one.ending.itinerary} over {one.ending.itinerary.period_number} "
        f"({one.why.status}: {one.why.message})"
        for one in refused[:_MOST_NAMED]
    ]
    more = [f"and {len(refused) - _MOST_NAMED} more"] if len(refused) > _MOST_NAMED else []
    return f"tried {', '.join(tried + more)}"


def _accepted(trajectory: Trajectory, ending: LastPeriod) -> Orbit:
    """Orbit next to the end of a run, if the run settles on it."""
    found = _tested(solve_itinerary(trajectory.parameters, ending.itinerary, ending.guess))
    if not found.success:
        return found
    orbit = primitive(found)
    largest = float(abs(floquet_multipliers(orbit)[0]))
    if not _near(orbit, ending.guess):
        detail = "the orbit of this itinerary is far from the run"
    elif not largest < 1:
        detail = f"the orbit of this itinerary is unstable, its multiplier {largest:.6g}"
    elif not _tends_to(trajectory, orbit, largest):
        detail = "the run moves away from the orbit of this itinerary"
    else:
        return orbit
    return NoOrbit(Status.NOT_PERIODIC, detail, orbit.itinerary, orbit.values, orbit.residual)


def _tends_to(trajectory: Trajectory, orbit: Orbit, largest: float) -> bool:
    """True if a run is on an orbit, or approaches it at the rate of the largest multiplier."""
    period_number = orbit.itinerary.period_number
    marks = np.array(rerun(orbit).stroboscopic[-period_number:], dtype=float)
    size = 1 + abs(np.array([flow.start for flow in orbit.system.flows], dtype=float)).max()

    def distance(run: Trajectory) -> float:
        return float(abs(marks - np.array(run.final[1], dtype=float)).max(axis=1).min())

    first = distance(trajectory)
    if first <= _ARRIVED * size:
        return True
    turns = math.ceil(math.log(_CLOSER) / math.log(max(largest, _CLOSER)))
    turns = min(turns, max(_FURTHER // period_number, 1))
    state = [float(value) for value in trajectory.final[1]]
    later = distance(simulate(trajectory.parameters, state, periods=turns * period_number))
    return bool(later <= max(_ARRIVED * size, first * min(_SLACK * largest**turns, 1.0)))


def _tested(found: Orbit) -> Orbit:
    """The orbit if it is a motion of the map, or a result that names what fails."""
    if not found.success or (min(found.durations) > 0 and is_admissible(found)):
        return found
    worst, itinerary = tightest(found), found.itinerary
    detail = "the map has another itinerary, although all inequalities hold"
    if worst.value <= 0:
        detail = f"{worst.named(itinerary)} is {float(worst.value):.3g}; it has to be above 0"
    return NoOrbit(Status.NOT_ADMISSIBLE, detail, itinerary, found.values, found.residual)


def endings(trajectory: Trajectory) -> Iterator[LastPeriod]:
    """Itineraries over 1, 2, ... excitation periods after a run that nearly repeats over so many.

    Each is that of a further run over these periods. A motion that repeats after one turn also
    repeats after several: a longer period is accepted only if it repeats better than each of its
    divisors.
    """
    marks = np.array(trajectory.stroboscopic[-LONGEST - 1 :], dtype=float)
    size, seen = abs(marks).max() or 1.0, dict[int, float]()
    for number in range(1, len(marks)):
        change = float(abs(marks[-1] - marks[-1 - number]).max() / size)
        if change > _NEAR or any(not number % one and change >= seen[one] for one in seen):
            continue
        seen[number] = change
        further = simulate(trajectory.parameters, marks[-1].tolist(), periods=number)
        if (guess := _one_period(further, number)) is not None:
            yield LastPeriod(*guess, change)


def _guess(
    segments: Sequence[Segment], period_number: int, parameters: SceneParameters
) -> tuple[Itinerary, list[float]] | None:
    """Itinerary and unknowns of segments that form a cycle; None if they cannot."""
    scene = parameters.scene
    try:
        fields = (segment.field for segment in segments)
        itinerary = Itinerary.of(fields, period_number, scene=scene)
    except InvalidInput:
        return None
    if len(itinerary) == 1:
        itinerary = Itinerary(itinerary.segments, scene=scene)
    first = itinerary.first
    durations = [float(segment.duration) for segment in (*segments[first:], *segments[:first])]
    start, omega = segments[first], parameters.omega
    place = *map(float, start.start_state), float(start.start.phase) * omega
    return itinerary.rotated(first), [*place, *durations]


def search_orbits(
    parameters: SceneParameters,
    starts: int = 50,
    *,
    period_numbers: Sequence[int] = (1, 2, 3),
    box: Sequence[float] | None = None,
    transient: int = 50,
    seed: int = 0,
    report: Callable[[int, int], None] | None = None,
    max_seconds: float = SEARCH_SECONDS,
) -> FoundOrbits:
    """Periodic orbits found from random initial states, stable or not, each once.

    Newton's method on the map over each number of periods in `period_numbers` starts from every
    start, and from its state after `transient` excitation periods. The orbit is then solved for in
    its itinerary. All orbits found are admissible, and each is traversed once. A random search may
    miss orbits.

    Parameters
    ----------
    parameters : Parameters
        Parameters of the capsule or of another scene, dimensionless.
    starts : int, default 50, 1 to 1,000,000
        Number of random starts, at phase 0.
    period_numbers : sequence of int, default (1, 2, 3), each 1 to 1,024
        Numbers of excitation periods over which orbits are searched.
    box : sequence of 3 floats or None, default None, each from 0 to 1e20
        Bounds b of (x_r, v_r, v_c), dimensionless; starts are uniform in (-b, b). None is twice the
        largest sizes at the switches of the motion from rest over 20 periods, and at least 1 and
        the gaps.
    transient : int, default 50, 1 to 10^12
        Length of the run before the second Newton search from a start, in excitation periods.
    seed : int, default 0, 0 to 2^64 - 1
        Seed of the random starts.
    report : callable or None, default None
        Function that is called after each start with the number of starts and of known orbits.
    max_seconds : float, default 600, above 0
        Time limit, in seconds of wall time. The orbits found so far are then returned, with the
        status time-limit.

    Returns
    -------
    FoundOrbits
        Tuple of orbits in the order of their period numbers, with `status`, `message`, and the
        number of `searched` starts.

    Raises
    ------
    InvalidInput
        For a value that is not allowed.

    See Also
    --------
    solve_orbit : stable orbit from one start.
    attractors : stable motions with their fractions of starts.

    Notes
    -----
    A Newton step uses the derivative of the map, `jacobian`. A step with an entry above 1 plus the
    largest entry of the state is shortened to that. At most 30 steps are taken.

    Examples
    --------
    Two stable orbits, and an unstable one that lies between them:

    >>> import capsule_sym as cs
    >>> parameters = cs.Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    >>> found = cs.search_orbits(parameters, 5, period_numbers=[1], seed=1)
    >>> for orbit in sorted(found, key=lambda one: one.progression):
    ...     print(f"{orbit.progression:.3f}", orbit.stable)
    -2.689 False
    -0.326 True
    4.208 True
    """
    check_count("starts", starts, most=_MOST_STARTS)
    check_count("transient", transient)
    check_count("seed", seed, 0, 2**64 - 1)
    periods = _checked_periods(period_numbers)
    given = None if box is None else _checked_box(box)
    found, done = list[Orbit](), 0
    with Watch(checked_seconds(max_seconds)):
        bounds = _reach(parameters) if given is None else given
        random = np.random.default_rng(seed)
        for done in range(starts):
            state = random.uniform(-1.0, 1.0, 3) * bounds
            settled = simulate(parameters, state.tolist(), periods=transient, keep="final")
            for begin in (state, np.array(settled.final[1], dtype=float)):
                for period_number in periods:
                    orbit = newton_orbit(parameters, begin, period_number)
                    if orbit is not None and not any(same(orbit, known) for known in found):
                        found.append(orbit)
            if report is not None:
                report(done + 1, len(found))
        done = starts
    return FoundOrbits(found, done, starts)


class FoundOrbits(Ended, tuple[Orbit, ...]):
    """Tuple of orbits in the order of their period numbers.

    `searched` is the number of searched starts, `starts` that of all.
    """

    searched: int
    starts: int

    def __new__(cls, found: Sequence[Orbit], searched: int, starts: int) -> FoundOrbits:
        """Orbits found, each once, from `searched` of the `starts`."""
        self = super().__new__(cls, sorted(found, key=lambda one: one.itinerary.period_number))
        self.searched, self.starts = searched, starts
        return self

    def __getnewargs__(self) -> tuple[tuple[Orbit, ...], int, int]:
        return tuple(self), self.searched, self.starts

    @property
    def status(self) -> Status:
        """FINISHED if all starts were searched, else TIME_LIMIT."""
        return Status.FINISHED if self.searched == self.starts else Status.TIME_LIMIT

    @property
    def message(self) -> str:
        """Number of orbits and of searched starts, as a sentence."""
        over = "" if self.success else "; time limit reached"
        starts = counted(self.starts, "start")
        return f"{counted(len(self), 'orbit')} from {self.searched} of {starts}{over}"

    def __repr__(self) -> str:
        return brief(self, "; ".join([self.message, *(str(one.itinerary) for one in self)]))


def _checked_box(box: Sequence[float]) -> NDArray[np.float64]:
    """Bounds of states; raises InvalidInput unless they are three numbers that states may have."""
    bounds = spread("box", box, (3,))
    if not np.all((bounds >= 0) & (bounds <= LARGEST_STATE)):
        allowed = f"three bounds of |x_r|, |v_r|, |v_c|, from 0 to {LARGEST_STATE:g}"
        raise InvalidInput("box", box, allowed)
    return bounds


def _checked_periods(period_numbers: Sequence[int]) -> tuple[int, ...]:
    """Period numbers, each once; raises InvalidInput unless all are allowed integers."""
    for number in period_numbers:
        check_count("period_numbers", number, most=_LONGEST_SOUGHT)
    return tuple(sorted(set(period_numbers)))


def _reach(parameters: SceneParameters) -> NDArray[np.float64]:
    run = simulate(parameters, periods=20)
    states = np.array([s.end_state for s in run.segments], dtype=float)
    reach: NDArray[np.float64] = 2 * abs(states).max(axis=0)
    gaps = (getattr(parameters, distance) for distance, _ in parameters.scene.facts.STOPS)
    return np.maximum(reach, max(1.0, *gaps))


def newton_orbit(
    parameters: SceneParameters, state: NDArray[np.float64], period_number: int
) -> Orbit | None:
    """Admissible orbit to which Newton's method on the map over some periods converges, or None.

    It is traversed once: its periods may be fewer.

    Steps are shortened for the sake of far starts: from 230 random starts with an orbit,
    `capsule_solve_orbit`, which polishes a motion that is nearly closed, finds it from 198.
    """
    for _ in range(_NEWTON_STEPS):
        run = simulate(parameters, state.tolist(), periods=period_number)
        if not run.success:
            return None
        change = np.array(run.final[1], dtype=float) - state
        size = 1 + abs(state).max()
        if abs(change).max() < _CLOSED * size:
            return _read_off(run, period_number)
        try:
            step = np.linalg.solve(jacobian(run) - np.eye(3), change)
        except np.linalg.LinAlgError:
            return None
        # A step beyond the size of the motion indicates a poor guess.
        state = state - step * min(1.0, size / abs(step).max())
    return None


def orbit_at(
    parameters: SceneParameters, state: Sequence[float], period_number: int
) -> Orbit | None:
    """Orbit next to a state at phase 0, in the itinerary of the map's run; None if there is none.

    The map is run from the state over `period_number` excitation periods. This run is the guess
    from which the orbit of its itinerary is solved for, so that the state may be slightly off the
    orbit. Its distance from the orbit is not tested. The result is None if the run stops early, as
    after 10^6 segments, or is no cycle of segments, if Newton's method does not converge, or if the
    orbit is not admissible.

    Parameters
    ----------
    parameters : Parameters
        Parameters of the capsule or of another scene, dimensionless.
    state : sequence of 3 floats, each from -1e20 to 1e20
        State (x_r, v_r, v_c) at phase 0, dimensionless.
    period_number : int, 1 to 10^12
        Number of excitation periods of the run. An orbit that closes earlier is given once.

    Returns
    -------
    Orbit or None
        The orbit, stable or not, or None.

    Raises
    ------
    InvalidInput
        For a value that is not allowed, as by `simulate`.

    See Also
    --------
    solve_orbit : orbit on which a run settles.
    performance_many : orbits next to many states.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> parameters = cs.Parameters(alpha=0.9)
    >>> state = cs.simulate(parameters, periods=50, keep="final").final[1]
    >>> print(cs.orbits.orbit_at(parameters, state, 1).itinerary)
    F5 F4 F1 F2
    >>> print(cs.orbits.orbit_at(parameters, (0.0, 0.0, 0.0), 1))
    None
    """
    check_count("period_number", period_number)
    run = simulate(parameters, state, periods=period_number)
    return _read_off(run, period_number) if run.success else None


def _read_off(run: Trajectory, period_number: int) -> Orbit | None:
    """Admissible orbit of the itinerary of a run over one period, traversed once, or None."""
    guess = _one_period(run, period_number)
    orbit = solve_itinerary(run.parameters, *guess) if guess else None
    return (
        primitive(orbit) if orbit is not None and orbit.success and is_admissible(orbit) else None
    )


def _one_period(run: Trajectory, period_number: int) -> tuple[Itinerary, list[float]] | None:
    """Itinerary and unknowns of a run over one period of an orbit, from phase 0; or None."""
    segments = [*run.segments]
    if len(segments) > 1 and segments[0].field == segments[-1].field:
        # The period starts in the middle of a segment: the last segment is its first part.
        joined = replace(segments[-1], duration=segments[-1].duration + segments[0].duration)
        segments = [*segments[1:-1], joined]
    return _guess(segments, period_number, run.parameters)


def _near(orbit: Orbit, guess: Sequence[float]) -> bool:
    states = np.array([flow.start for flow in orbit.system.flows])
    return bool(abs(orbit.z[:3] - guess[:3]).max() <= _NEAR * abs(states).max())
