"""Search for periodic orbits: from a motion that settles, and from random starts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput, Status, counted
from capsule_sym._map import Segment, Trajectory, simulate
from capsule_sym._map.checks import SEARCH_SECONDS, check_count, checked_seconds
from capsule_sym._map.drift import dragged
from capsule_sym._map.result import brief
from capsule_sym._map.steady import LONGEST
from capsule_sym._native import Watch
from capsule_sym._orbits.shooting.admissibility import is_admissible, rerun, tightest
from capsule_sym._orbits.shooting.itinerary import Itinerary, drift
from capsule_sym._orbits.shooting.orbit import NoOrbit, Orbit, OrbitStatus, solve_itinerary
from capsule_sym._orbits.shooting.stability import floquet_multipliers, jacobian
from capsule_sym._orbits.shooting.symmetry import primitive, same
from capsule_sym._parameters import SceneParameters

_BLOCK = 64  # excitation periods before the first test for a periodic motion
_LATEST = 16  # number of last segments that give the size of the motion
_NEAR = 0.1  # largest distance of an orbit from its guess, over the motion's size
_NEWTON_STEPS = 30
_CLOSED = 1e-6  # change over the orbit's periods below which the itinerary is read from the run
_REPEATED = 1e-7  # change over a turn below which a run has settled
_ARRIVED = 1e-6  # distance, over the motion's size, below which a run is on its orbit
_SLACK = 10  # factor by which a run may be further from an orbit than the multipliers predict
_MOST_STARTS, _LONGEST_SOUGHT = 10**6, 1024
_BLOCKS = 64  # number of blocks for which a slowly converging run is followed
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

    The start state at phase `phase` is dimensionless. The motion need not have settled to the last
    digit: when the itinerary repeats, the nearby orbit is accepted if it is stable and admissible,
    and if the motion approaches it. Itineraries over 1 to 16 excitation periods are tried. If there
    is no orbit, the message names the itineraries at the end of the run and the reason against
    each. The search ends after `max_seconds`. Raises InvalidInput as `simulate` does.
    """
    length, refused = 0, list[_Refused]()

    def none(status: OrbitStatus, message: str) -> NoOrbit:
        given = _values(parameters), float("inf")
        return NoOrbit(status, message, None, *given, scene=parameters.scene)

    check_count("periods", periods)
    with Watch(checked_seconds(max_seconds)):
        while length < periods:
            length = min(2 * length or _BLOCK, periods)
            # Always from the start: a chaotic transient would differ after a restart.
            trajectory = simulate(parameters, state, phase, length)
            if (why := dragged(parameters)) or not trajectory.success:
                return none(OrbitStatus.NOT_PERIODIC, why or trajectory.message)
            refused = []
            for ending in endings(trajectory):
                found = _accepted(trajectory, ending)
                if found.success:
                    return found
                refused.append(_Refused(ending, found))
        repeated = [one.why for one in refused if one.ending.change < _REPEATED]
        # The run may repeat, although its equations have no such solution.
        return (
            repeated[0]
            if repeated
            else none(
                OrbitStatus.NOT_PERIODIC,
                f"the run from {tuple(state)} at phase {phase} has not settled within {periods} "
                f"excitation periods on a motion of at most {LONGEST}; {_tried(refused)}",
            )
        )
    return none(
        OrbitStatus.TIME_LIMIT,
        f"time limit reached in {length} excitation periods from {tuple(state)} at phase {phase}; "
        f"{_tried(refused)}",
    )


class Ending(NamedTuple):
    """Last period of a run that repeats an itinerary: itinerary, unknowns z, and change.

    `change` is the largest change of the state over the turn, over the motion's size.
    """

    itinerary: Itinerary
    guess: list[float]
    change: float


class _Refused(NamedTuple):
    """An itinerary that was tried, and the reason why its orbit is not accepted."""

    ending: Ending
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


def _accepted(trajectory: Trajectory, ending: Ending) -> Orbit:
    """Orbit next to the end of a run, if the run settles on it."""
    found = solve_admissible(trajectory.parameters, ending.itinerary, ending.guess)
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
    return NoOrbit(OrbitStatus.NOT_PERIODIC, detail, orbit.itinerary, orbit.values, orbit.residual)


def _tends_to(trajectory: Trajectory, orbit: Orbit, largest: float) -> bool:
    """True if a run is on an orbit, or approaches it at the rate of the largest multiplier."""
    period_number = orbit.itinerary.period_number
    marks = np.array(rerun(orbit).stroboscopic[-period_number:], dtype=float)
    size = 1 + abs(np.array([flow.start for flow in orbit.system.flows], dtype=float)).max()

    def distance(run: Trajectory) -> float:
        return float(abs(marks - np.array(run.final[1], dtype=float)).max(axis=1).min())

    first = now = distance(trajectory)
    for block in range(_BLOCKS):
        if now <= _ARRIVED * size:
            return True
        if now > _SLACK * first * largest ** (block * _BLOCK / period_number):
            return False
        state = [float(value) for value in trajectory.final[1]]
        trajectory = simulate(trajectory.parameters, state, periods=_BLOCK)
        now = distance(trajectory)
    return now < first


def solve_admissible(
    parameters: SceneParameters,
    itinerary: Itinerary,
    guess: Sequence[float] | None = None,
    *,
    max_seconds: float = math.inf,
) -> Orbit:
    """Orbit of a given itinerary near a guess z, if the map has this itinerary too.

    Otherwise the status is NOT_ADMISSIBLE, and the message names the inequality of the itinerary
    that fails most. The guess, dimensionless, and `max_seconds` are those of `solve_itinerary`.
    """
    orbit: Orbit | None = None
    with Watch(checked_seconds(max_seconds)):
        orbit = solve_itinerary(parameters, itinerary, guess)
        if not orbit.success or (min(orbit.durations) > 0 and is_admissible(orbit)):
            return orbit
        worst = tightest(orbit)
        detail = "the map has another itinerary, although all inequalities hold"
        if worst.value <= 0:
            value = f"{float(worst.value):.3g}"
            detail = f"{worst.named(itinerary)} is {value}; it has to be above 0"
        return NoOrbit(OrbitStatus.NOT_ADMISSIBLE, detail, itinerary, orbit.values, orbit.residual)
    detail = "time limit reached before an admissible orbit was found"
    residual = float("inf") if orbit is None else orbit.residual
    return NoOrbit(OrbitStatus.TIME_LIMIT, detail, itinerary, _values(parameters), residual)


def endings(trajectory: Trajectory) -> Iterator[Ending]:
    """The last 1, 2, ... excitation periods of a run that repeat those before.

    They repeat if the fields are equal and the states close. Segments may be longer than a period.
    Stick without end comes first, if the run ends with more than a period of it.
    """
    p = trajectory.parameters
    period, scene = p.period, p.scene
    last, marks = trajectory.segments[-1], np.array(trajectory.stroboscopic[-2:], dtype=float)
    if drift(last.field, scene) == 0 and not last.target and float(last.duration) > period:
        change = float(abs(marks[-1] - marks[0]).max()) if len(marks) > 1 else float("inf")
        yield Ending(
            Itinerary.of((last.field,), scene=scene), [*marks[-1].tolist(), 0.0, period], change
        )
    # Segments of the largest number of periods to test, and as many before.
    count, earliest = 1, last.start.period - LONGEST
    while count < len(trajectory.segments) and trajectory.segments[-count].start.period >= earliest:
        count += 1
    segments = [s for s in trajectory.segments[-2 * count :] if s.target]
    if not segments:
        return
    times = np.array([s.start.period * period + float(s.start.phase) for s in segments])
    starts = np.array([s.start_state for s in segments], dtype=float)
    end = times[-1] + float(segments[-1].duration)
    size, seen = abs(starts[-_LATEST:]).max(), dict[int, float]()
    for period_number in range(1, LONGEST + 1):
        # Switch that is nearest to this number of periods before the last one.
        first = int(np.argmin(abs(end - period_number * period - times)))
        chosen = segments[first:]
        fields = [s.field for s in segments[max(0, 2 * first - len(segments)) :]]
        change = abs(starts[first] - np.array(chosen[-1].end_state, dtype=float)).max()
        late = abs(end - period_number * period - times[first])
        if fields != 2 * fields[-len(chosen) :] or max(change / size, late / period) > _NEAR:
            continue
        # A motion that repeats after one turn also repeats after several: a longer period is
        # accepted only if it repeats better than each of its divisors.
        if any(not period_number % one and change >= other for one, other in seen.items()):
            continue
        seen[period_number] = change
        if (guess := _guess(chosen, period_number, p)) is not None:
            yield Ending(*guess, change / size)


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
    start, and from its state after `transient` excitation periods; the orbit is then solved in its
    itinerary. Starts are uniform in (-b, b) for the bounds b in `box`, by default twice the largest
    values of the motion from rest, and at least the gaps. `report` is called after each start with
    the number of starts and of known orbits. The search ends after `max_seconds`. States and bounds
    are dimensionless. Raises InvalidInput for a value that is not allowed.
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
            settled = simulate(parameters, state.tolist(), periods=transient).final[1]
            for begin in (state, np.array(settled, dtype=float)):
                for period_number in periods:
                    orbit = newton_orbit(parameters, begin, period_number)
                    if orbit is not None and not any(same(orbit, known) for known in found):
                        found.append(orbit)
            if report is not None:
                report(done + 1, len(found))
        done = starts
    return FoundOrbits(found, done, starts)


class FoundOrbits(tuple[Orbit, ...]):
    """Orbits in the order of their period numbers, and the number of searched starts."""

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
        return Status.FINISHED if self.success else Status.TIME_LIMIT

    @property
    def success(self) -> bool:
        """True if all starts were searched."""
        return self.searched == self.starts

    @property
    def message(self) -> str:
        """Number of orbits and of searched starts, as a sentence."""
        over = "" if self.success else "; time limit reached"
        starts = counted(self.starts, "start")
        return f"{counted(len(self), 'orbit')} from {self.searched} of {starts}{over}"

    def __repr__(self) -> str:
        return brief(self, "; ".join([self.message, *(str(one.itinerary) for one in self)]))


def _checked_box(box: Sequence[float]) -> NDArray[np.float64]:
    """Bounds of states; raises InvalidInput unless they are three finite numbers >= 0."""
    try:
        bounds = np.array([float(one) for one in box])
    except (TypeError, ValueError):
        bounds = np.zeros(0)
    if bounds.shape != (3,) or not np.all(np.isfinite(bounds)) or np.any(bounds < 0):
        raise InvalidInput("box", box, "three bounds of |x_r|, |v_r|, |v_c|, finite and >= 0")
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
    """Orbit to which Newton's method on the map over some periods converges; None if none.

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
    """Orbit through a state at phase 0, in the itinerary of the map's run; None if none.

    The state (x_r, v_r, v_c) is dimensionless.
    """
    return _read_off(simulate(parameters, state, periods=period_number), period_number)


def _read_off(run: Trajectory, period_number: int) -> Orbit | None:
    """Orbit next to a run over one period."""
    guess = _one_period(run, period_number)
    orbit = solve_itinerary(run.parameters, *guess) if guess else None
    return (
        primitive(orbit) if orbit is not None and orbit.success and is_admissible(orbit) else None
    )


def _one_period(run: Trajectory, period_number: int) -> tuple[Itinerary, list[float]] | None:
    """Itinerary and unknowns of a run over one period of an orbit, from phase 0 to phase 0."""
    segments = [*run.segments]
    if len(segments) > 1 and segments[0].field == segments[-1].field:
        # The period starts in the middle of a segment: the last segment is its first part.
        joined = replace(segments[-1], duration=segments[-1].duration + segments[0].duration)
        segments = [*segments[1:-1], joined]
    return _guess(segments, period_number, run.parameters)


def _near(orbit: Orbit, guess: Sequence[float]) -> bool:
    states = np.array([flow.start for flow in orbit.system.flows])
    return bool(abs(orbit.z[:3] - guess[:3]).max() <= _NEAR * abs(states).max())


def _values(parameters: SceneParameters) -> tuple[float, ...]:
    return tuple(parameters.to_dict().values())
