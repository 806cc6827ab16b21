"""What a run of the map gives: segments, states at any time, steady motion, global map."""

from __future__ import annotations

import math
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

    def __repr__(self) -> str:
        way = f"{self.source or 'start'} to {self.target or 'end'}"
        begun = f"({self.start.period}, {float(self.start.phase):.6g})"
        ended = f"{self.outcome} after {float(self.duration):.6g}"
        return f"<Segment {self.name} {self.mode}: {way}, from {begun}, {ended}>"

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

    def __repr__(self) -> str:
        word = shortened(" ".join(self.word))
        pace = f"{float(self.progression):.6g} per excitation period"
        return f"<SteadyMotion {word}: period multiple {self.period_multiple}, {pace}>"

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

    def __repr__(self) -> str:
        (periods, phase), (x_r, v_r, v_c) = self.final
        state = ", ".join(f"{float(value):.6g}" for value in (x_r, v_r, v_c))
        at = f"at ({periods}, {float(phase):.6g}) in ({state})"
        stopped = f", stopped {self.stopped}" if self.stopped else ""
        return f"<Trajectory by {self.backend}: {len(self.segments)} segments, {at}{stopped}>"

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
        index = np.searchsorted(starts, times.ravel(), side="right") - 1
        present, place = np.unique(index, return_inverse=True)
        segments = [self.segments[i] for i in present]
        h = times.ravel() - starts[index]
        h = np.clip(h, 0.0, np.array([s.duration for s in segments], dtype=float)[place])
        fields = np.array([s.field for s in segments], dtype=int)[place]
        begun = np.array([(*s.start_state, s.position) for s in segments], dtype=float)[place]
        closed = np.array([s.closed for s in segments], dtype=float)[place].T
        out = np.empty((times.size, 4))
        with backend("numpy") as numbers:
            for field in np.unique(fields):
                of = fields == field
                c = numbers.constants(int(field), self.parameters)
                start = numbers.kernels.Start(*closed[:, of])
                out[of] = _inside(numbers.kernels, c, start, begun[of], h[of])
        return out.reshape(*times.shape, 4)

    def steady(self, tolerance: float = 1e-9) -> SteadyMotion | None:
        """The periodic motion at the end of the run, None if it has not settled on one.

        The motion is periodic with multiple m if the stroboscopic states repeat after m periods
        within `tolerance`, and so do the segments; the least m up to 16 is taken. Slow
        alternating convergence to a shorter period looks almost periodic too: it is told apart by
        asking that states within the period differ by a thousand tolerances.

        Without forcing a motion may die away and switch for ever, ever smaller. It is rest if its
        energy, which never grows, keeps it within `tolerance` of that.

        Raises InvalidInput for a tolerance that is not a number > 0 and finite.
        """
        if not (_is_real(tolerance) and 0 < tolerance < math.inf):
            raise InvalidInput("tolerance", tolerance, "a finite number > 0")
        if self._rests(tolerance):
            return SteadyMotion((self._rest(),), 1, self.segments[-1].advance * 0)
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

    def _rests(self, tolerance: float) -> bool:
        """Whether it is proved that the run stays this near to rest for ever, and never slips."""
        p, (x_r, v_r, v_c) = self.parameters, map(float, self.final[1])
        if p.alpha > 0 or v_c != 0 or self.stopped or not self.segments:
            return False
        # Twice the energy at rest: v_r^2 + x_r^2 + beta (x_r - delta)^2 in contact.
        size = 1.000001 * math.hypot(v_r, x_r, math.sqrt(p.beta) * max(0.0, x_r - p.delta))
        pressed = SimpleNamespace(kappa=p.beta, zeta=p.zeta)
        force = float(formulas.force_change_size(pressed, size, size))
        return size <= tolerance and force < p.f_b

    def _rest(self) -> Segment:
        """The last excitation period, at rest."""
        last, zero = self.segments[-1], self.segments[-1].duration * 0
        gap = zero - self.parameters.delta
        field = 2 if gap else 5  # the region with contact is the closed one
        return replace(
            last,
            field=field,
            source=f"Σ{field}",
            target=f"Σ{field}",
            start=Instant(last.end.period - 1, zero),
            end=Instant(last.end.period, zero),
            start_state=(zero, zero, zero),
            end_state=(zero, zero, zero),
            duration=zero + self.parameters.period,
            outcome=Outcome.NEVER,
            tangencies=(),
            evaluations=0,
            position=last.position + last.advance,
            advance=zero,
            closed=type(last.closed)(zero, gap, zero, zero, zero, zero + 1, zero),
        )

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
    kernels: Any, c: Any, closed: Any, begun: NDArray[np.float64], h: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(x_r, v_r, v_c, x_c) at durations h after the starts `begun` of segments, shape (n, 4)."""
    values = kernels.flow(c, closed, h, True)
    out = begun.copy()
    out[:, 0] += values[0]
    out[:, 1] = values[1]
    if c.drift:
        out[:, 2] += values[2]
        out[:, 3] += values[3]
    else:
        out[:, 2] = 0.0
    return out


def _is_real(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def shortened(text: str, length: int = 60) -> str:
    """The text, cut off where it is longer."""
    return text if len(text) <= length else f"{text[: length - 4]} ..."


def instant(turns: int, angle: Number, omega: Number) -> Instant:
    """The time at a forcing angle in [0, 2 pi) after whole turns."""
    return Instant(turns, angle / omega if angle else angle * 0)
