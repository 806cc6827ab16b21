"""What a run of the map gives: segments, states at any time, steady motion, global map."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym.errors import InvalidInput, Outcome
from capsule_sym.generated import formulas
from capsule_sym.map.backend import Number, backend
from capsule_sym.map.itinerary import cyclic_start
from capsule_sym.parameters import Parameters

LONGEST = 16  # excitation periods of the longest periodic motion that is looked for
_MODES = ("NC-FD", "NC-S", "NC-BD", "C-FD", "C-S", "C-BD")
Triple = tuple[Number, Number, Number]


class Instant(NamedTuple):
    """A time as whole excitation periods and the phase in [0, 2 pi/omega) within the next."""

    period: int
    phase: Number


@dataclass(frozen=True)
class Segment:
    """One segment of a trajectory, from one switching plane to the next, dimensionless.

    States are (x_r, v_r, v_c). `source` and `target` are switching planes "Σ1" to "Σ10"; `target`
    is empty for a segment that the end of the run cuts off, `source` for one that starts off every
    plane. `tangencies` are contacts within the error bound that did not end the segment, with the
    duration after which they occur. `position` is x_c at the start, `advance` its change.
    """

    field: int
    source: str
    target: str
    start: Instant
    end: Instant
    start_state: Triple
    end_state: Triple
    duration: Number
    outcome: Outcome
    tangencies: tuple[tuple[Outcome, Number], ...]
    evaluations: int
    position: Number
    advance: Number
    closed: Any  # start of the closed form, for evaluation in between

    @property
    def name(self) -> str:
        """Name of the field, "F1" to "F6"."""
        return f"F{self.field}"

    @property
    def mode(self) -> str:
        """Mode of operation in the paper's notation, such as "NC-FD"."""
        return _MODES[self.field - 1]

    @property
    def local_map(self) -> str:
        """The segment as a local map in the paper's notation, such as "P_{Σ4,F5,Σ5}"."""
        return f"P_{{{self.target},{self.name},{self.source}}}"


@dataclass(frozen=True)
class SteadyMotion:
    """A periodic motion modulo drift: its segments over one period of the motion.

    `period_multiple` counts excitation periods; `progression` is the advance of x_c per
    excitation period, dimensionless.
    """

    segments: tuple[Segment, ...]
    period_multiple: int
    progression: Number

    @property
    def word(self) -> tuple[str, ...]:
        """Fields of one period in the order of time, such as ("F5", "F2")."""
        return tuple(segment.name for segment in self.segments)

    @property
    def global_map(self) -> str:
        """The motion as a composition of local maps, right to left, in the paper's notation."""
        if len(self.segments) == 1:
            return self.segments[0].local_map.replace("P", "Id", 1)
        return " ∘ ".join(segment.local_map for segment in reversed(self.segments))


@dataclass(frozen=True)
class Trajectory:
    """A run of the exact map: its segments, and the closed form to evaluate between them."""

    parameters: Parameters
    backend: str
    origin: tuple[Instant, Triple]
    """Time and state at the start of the run."""
    segments: tuple[Segment, ...]
    stroboscopic: tuple[Triple, ...]
    """States at phase 0 in the order of time; of a segment over very many periods only the last."""
    settled: int
    """How many switches and departures double precision left open and 50 digits looked at."""
    stopped: str
    """Why the run ended before its periods were over; empty if it did not."""

    @property
    def final(self) -> tuple[Instant, Triple]:
        """Time and state at the end of the run."""
        if not self.segments:
            return self.origin
        last = self.segments[-1]
        return last.end, last.end_state

    @property
    def advance(self) -> Number:
        """Change of the capsule's position x_c over the run."""
        if not self.segments:
            return self.origin[1][0] * 0
        last = self.segments[-1]
        return last.position + last.advance

    def __call__(self, t: ArrayLike) -> NDArray[np.float64]:
        """States (x_r, v_r, v_c) at times t, shape t.shape + (3,), from the closed form.

        Times are absolute and dimensionless: excitation periods times 2 pi/omega plus phase.
        Raises InvalidInput outside the run.
        """
        return self._evaluate(t)[..., :3]

    def position(self, t: ArrayLike) -> NDArray[np.float64]:
        """Capsule positions x_c at times t, shape t.shape, zero at the start of the run."""
        return self._evaluate(t)[..., 3]

    def _evaluate(self, t: ArrayLike) -> NDArray[np.float64]:
        times = np.asarray(t, dtype=float)
        period = self.parameters.period
        starts = np.array([s.start.period * period + float(s.start.phase) for s in self.segments])
        (_, begin), _ = self.origin
        end, _ = self.final
        stop = end.period * period + float(end.phase)
        outside = ~((times >= float(begin)) & (times <= stop))
        if np.any(outside) or not self.segments:
            value = float(times[outside].flat[0]) if np.any(outside) else float(begin)
            raise InvalidInput("t", value, f"a time in [{float(begin)!r}, {stop!r}]")
        index = np.searchsorted(starts, times, side="right") - 1
        out = np.empty((*times.shape, 4))
        with backend("numpy") as numbers:
            for i in np.unique(index):
                chosen = index == i
                h = np.clip(times[chosen] - starts[i], 0.0, float(self.segments[i].duration))
                out[chosen] = _inside(numbers, self.parameters, self.segments[i], h)
        return out

    def steady(self, tolerance: float = 1e-9) -> SteadyMotion | None:
        """The periodic motion at the end of the run, None if it has not settled on one.

        The motion is periodic with multiple m if the stroboscopic states repeat after m periods
        within `tolerance`, and so do the segments; the least m up to 16 is taken. Slow
        alternating convergence to a shorter period looks almost periodic too: it is told apart by
        asking that states within the period differ by a thousand tolerances.
        """
        states = np.array([[float(v) for v in state] for state in self.stroboscopic])

        def change(after: int, multiple: int) -> float:
            """Largest change of the last `multiple` states from those `after` periods before."""
            last, before = states[-multiple:], states[-multiple - after : len(states) - after]
            return float(np.max(np.abs(last - before)))

        for multiple in range(1, min(LONGEST, len(states) // 2) + 1):
            if change(multiple, multiple) > tolerance:
                continue
            divisors = (d for d in range(1, multiple) if multiple % d == 0)
            if any(change(divisor, multiple) <= 1e3 * tolerance for divisor in divisors):
                continue
            segments, previous = self._last_periods(multiple, 0), self._last_periods(multiple, 1)
            if not segments and not previous:
                return SteadyMotion((self._last_period(),), 1, self.segments[-1].advance * 0)
            if _labels(segments) == _labels(previous):
                return _steady(segments, multiple)
        return None

    def _last_period(self) -> Segment:
        """The last excitation period of a run that ends without switches, as a segment."""
        last, (x_r, v_r, v_c) = self.segments[-1], self.stroboscopic[-2]
        delta, zeta = type(x_r)(self.parameters.delta), type(x_r)(self.parameters.zeta)
        free = SimpleNamespace(kappa=x_r * 0, zeta=zeta)
        force = formulas.force(free, x_r, x_r - delta, v_r)
        plane = f"Σ{last.field}"
        return replace(
            last,
            source=plane,
            target=plane,
            start=Instant(last.end.period - 1, x_r * 0),
            start_state=self.stroboscopic[-2],
            duration=type(x_r)(self.parameters.period),
            tangencies=(),
            position=last.position + last.advance,
            advance=last.advance * 0,
            closed=type(last.closed)(x_r, x_r - delta, v_r, v_c, force, x_r * 0 + 1, x_r * 0),
        )

    def _last_periods(self, multiple: int, back: int) -> tuple[Segment, ...]:
        """The segments that end in the given number of whole periods before the run's end."""
        stop = self.segments[-1].end.period - back * multiple
        ended = [s for s in self.segments if s.target]
        return tuple(s for s in ended if stop - multiple <= s.end.period < stop)


def _labels(segments: tuple[Segment, ...]) -> list[tuple[int, str, str]]:
    return [(s.field, s.source, s.target) for s in segments]


def _steady(segments: tuple[Segment, ...], multiple: int) -> SteadyMotion:
    first = cyclic_start([s.field for s in segments])
    advance = sum((s.advance for s in segments), segments[0].advance * 0)
    return SteadyMotion(segments[first:] + segments[:first], multiple, advance / multiple)


def _inside(
    numbers: Any, parameters: Parameters, segment: Segment, h: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(x_r, v_r, v_c, x_c) at durations h after the start of a segment, shape (len(h), 4)."""
    c = numbers.constants(segment.field, parameters)
    closed = type(numbers.kernels.Start(*segment.closed))(*map(float, segment.closed))
    values = numbers.kernels.flow(c, closed, h, True)
    x_r, _, v_c = (float(v) for v in segment.start_state)
    columns = [x_r + values[0], values[1]]
    if c.drift:
        columns += [v_c + values[2], float(segment.position) + values[3]]
    else:
        columns += [np.zeros_like(h), np.full_like(h, float(segment.position))]
    return np.stack(columns, axis=-1)


def instant(turns: int, angle: Number, omega: Number) -> Instant:
    """The time at a forcing angle in [0, 2 pi) after whole turns."""
    return Instant(turns, angle / omega if angle else angle * 0)
