"""Finding periodic orbits: from a motion that settles, and from random starts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym.errors import InvalidInput
from capsule_sym.map import Segment, Trajectory, simulate
from capsule_sym.map.trajectory import LONGEST
from capsule_sym.orbits.admissibility import realised, tightest
from capsule_sym.orbits.orbit import NoOrbit, Orbit, Reason, close
from capsule_sym.orbits.stability import jacobian, multipliers
from capsule_sym.orbits.word import Word
from capsule_sym.parameters import Parameters

_BLOCK = 64  # excitation periods after which to look whether the motion is periodic
_LATEST = 16  # segments that tell the size of the motion
_NEAR = 0.1  # how far, in units of the motion's own size, an orbit may be from where it is sought
_NEWTON_STEPS = 30
_CLOSED = 1e-6  # change over the orbit's periods below which a word is read off
_ALIKE = 1e-4  # durations of a turn that repeats itself differ by less
_SAME = 1e-7  # states of one orbit, found twice, differ by less


def find_orbit(
    parameters: Parameters,
    state: Sequence[float] = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    periods: int = 1024,
) -> Orbit | NoOrbit:
    """The stable orbit on which the simulated motion settles within so many excitation periods.

    The motion need not have settled to the last digit: an orbit close by, of the word that the
    motion has come to, is taken if it is stable and the map realises it. Raises InvalidInput as
    `simulate` does.
    """
    done, last = 0, None
    while done < periods:
        trajectory = simulate(parameters, state, phase, min(_BLOCK, periods - done))
        if trajectory.stopped:
            return NoOrbit(
                Reason.NOT_PERIODIC, trajectory.stopped, None, _values(parameters), float("inf")
            )
        for word, guess in endings(trajectory):
            last = realise(parameters, word, guess)
            if isinstance(last, Orbit) and _near(last, guess) and abs(multipliers(last)[0]) < 1:
                return last
        done += _BLOCK
        _, final = trajectory.final
        state, phase = [float(value) for value in final], 0.0
    if isinstance(last, NoOrbit):
        return last
    detail = f"the motion has not settled on a periodic one within {periods} excitation periods"
    return NoOrbit(Reason.NOT_PERIODIC, detail, None, _values(parameters), float("inf"))


def realise(
    parameters: Parameters, word: Word, guess: Sequence[float] | None = None
) -> Orbit | NoOrbit:
    """The orbit of a given word near a guess z, as `close` finds it, if the map goes along it.

    Where it does not, the reason is NOT_REALISED, and the detail names the inequality of the word
    that fails most.
    """
    orbit = close(parameters, word, guess)
    if isinstance(orbit, NoOrbit) or (min(orbit.durations) > 0 and realised(orbit)):
        return orbit
    worst = tightest(orbit)
    detail = "the map goes another way, though every inequality of the word holds"
    if worst.value <= 0:
        detail = f"{worst.named(word)} is {float(worst.value):.3g}, where the word needs it above 0"
    return NoOrbit(Reason.NOT_REALISED, detail, word, orbit.values, orbit.residual)


def endings(trajectory: Trajectory) -> Iterator[tuple[Word, list[float]]]:
    """Words and unknowns z of the last 1, 2, ... excitation periods of a run, where they repeat.

    They do where the fields are those of as many periods before, and the states are not far off.
    """
    period, omega = trajectory.parameters.period, trajectory.parameters.omega
    last = trajectory.segments[-1]
    if float(last.duration) > period:
        state = [float(value) for value in trajectory.stroboscopic[-1]]
        yield Word.of((last.field,)), [*state, 0.0, period]
        return
    segments = [s for s in trajectory.segments if s.target]
    times = np.array([s.start.period * period + float(s.start.phase) for s in segments])
    starts = np.array([s.start_state for s in segments], dtype=float)
    end = times[-1] + float(segments[-1].duration)
    size = abs(starts[-_LATEST:]).max()
    for multiple in range(1, LONGEST + 1):
        # The switch that comes nearest to so many periods before the last one.
        first = int(np.argmin(abs(end - multiple * period - times)))
        chosen = segments[first:]
        fields = [s.field for s in segments[max(0, 2 * first - len(segments)) :]]
        change = starts[first] - np.array(chosen[-1].end_state, dtype=float)
        if fields != 2 * fields[-len(chosen) :] or abs(change).max() > _NEAR * size:
            continue
        legs = [_Leg(s.field, _start(s, omega), float(s.duration)) for s in chosen]
        if (guess := _guess(legs, multiple)) is not None:
            yield guess


class _Leg(NamedTuple):
    """A leg of a run: field, unknowns (x_r, v_r, v_c, theta) at its start, duration."""

    field: int
    start: list[float]
    duration: float


def _start(segment: Segment, omega: float) -> list[float]:
    return [*map(float, segment.start_state), float(segment.start.phase) * omega]


def _guess(legs: Sequence[_Leg], multiple: int) -> tuple[Word, list[float]] | None:
    """Word and unknowns of legs that follow themselves, None if they cannot."""
    try:
        word = Word.of((leg.field for leg in legs), multiple)
    except InvalidInput:
        return None
    if len(word) == 1:
        word = Word(word.legs)
    first = word.first
    durations = [leg.duration for leg in (*legs[first:], *legs[:first])]
    return word.rotated(first), [*legs[first].start, *durations]


def random_search(
    parameters: Parameters,
    starts: int = 50,
    *,
    multiples: Sequence[int] = (1, 2, 3),
    box: Sequence[float] | None = None,
    transient: int = 50,
    seed: int = 0,
    report: Callable[[int, int], None] | None = None,
) -> tuple[Orbit, ...]:
    """Periodic orbits found from random initial states, stable or not, each once.

    From every start, and from where it has come to after `transient` excitation periods, Newton's
    method is applied to the map over each number of periods in `multiples`, and what it finds is
    polished by its word. Starts are uniform in (-b, b) for the bounds b in `box`, by default
    twice what the motion from rest reaches, and at least the gap. `report` is told after each start
    how many starts are done and how many orbits are known. Orbits are in order of their multiple.
    """
    bounds = _reach(parameters) if box is None else np.asarray(box, dtype=float)
    random = np.random.default_rng(seed)
    found: list[Orbit] = []
    for start in range(starts):
        state = random.uniform(-1.0, 1.0, 3) * bounds
        settled = simulate(parameters, state.tolist(), periods=transient).final[1]
        for begin in (state, np.array(settled, dtype=float)):
            for multiple in multiples:
                orbit = _newton(parameters, begin, multiple)
                if orbit is not None and not any(_same(orbit, known) for known in found):
                    found.append(orbit)
        if report is not None:
            report(start + 1, len(found))
    return tuple(sorted(found, key=lambda orbit: orbit.word.multiple))


def _reach(parameters: Parameters) -> NDArray[np.float64]:
    run = simulate(parameters, periods=20)
    states = np.array([s.end_state for s in run.segments], dtype=float)
    reach: NDArray[np.float64] = 2 * abs(states).max(axis=0)
    return np.maximum(reach, max(1.0, parameters.delta))


def _newton(parameters: Parameters, state: NDArray[np.float64], multiple: int) -> Orbit | None:
    """The orbit that Newton's method on the map over some periods leads to; None if to none."""
    for _ in range(_NEWTON_STEPS):
        run = simulate(parameters, state.tolist(), periods=multiple)
        if run.stopped:
            return None
        change = np.array(run.final[1], dtype=float) - state
        size = 1 + abs(state).max()
        if abs(change).max() < _CLOSED * size:
            guess = _one_turn(run, multiple)
            orbit = close(parameters, *guess) if guess else None
            return orbit if isinstance(orbit, Orbit) and realised(orbit) else None
        try:
            step = np.linalg.solve(jacobian(run) - np.eye(3), change)
        except np.linalg.LinAlgError:
            return None
        # A step beyond the size of the motion itself says that the guess was no good.
        state = state - step * min(1.0, size / abs(step).max())
    return None


def _one_turn(run: Trajectory, multiple: int) -> tuple[Word, list[float]] | None:
    """Word and unknowns of a run over one turn of an orbit, from phase 0 to phase 0."""
    omega = run.parameters.omega
    legs = [_Leg(s.field, _start(s, omega), float(s.duration)) for s in run.segments]
    if len(legs) > 1 and legs[0].field == legs[-1].field:
        # The turn is cut in the middle of a leg: the run's last segment is its first part.
        joined = legs[-1]._replace(duration=legs[-1].duration + legs[0].duration)
        legs = [*legs[1:-1], joined]
    times = _repeats(legs, multiple)
    return _guess(legs[: len(legs) // times], multiple // times)


def _repeats(legs: Sequence[_Leg], multiple: int) -> int:
    """How often the turn repeats a shorter one."""
    for times in range(multiple, 1, -1):
        count, rest = divmod(len(legs), times)
        if rest or multiple % times:
            continue
        shifted = (*legs[count:], *legs[:count])
        if all(
            leg.field == later.field and abs(leg.duration - later.duration) < _ALIKE
            for leg, later in zip(legs, shifted, strict=True)
        ):
            return times
    return 1


def _near(orbit: Orbit, guess: Sequence[float]) -> bool:
    states = np.array([span.start for span in orbit.shot.spans])
    return bool(abs(orbit.z[:3] - guess[:3]).max() <= _NEAR * abs(states).max())


def _same(orbit: Orbit, other: Orbit) -> bool:
    """Whether two orbits are one, begun at different switches perhaps."""
    if orbit.word.multiple != other.word.multiple or len(orbit.word) != len(other.word):
        return False
    place = _place(orbit, 0)
    return any(abs(place - _place(other, i)).max() < _SAME for i in range(len(other.word)))


def _place(orbit: Orbit, leg: int) -> NDArray[np.float64]:
    """State and forcing where a leg begins."""
    span = orbit.shot.spans[leg]
    return np.array([*span.start, np.cos(span.angle), np.sin(span.angle)], dtype=float)


def _values(parameters: Parameters) -> tuple[float, ...]:
    return tuple(parameters.to_dict().values())
