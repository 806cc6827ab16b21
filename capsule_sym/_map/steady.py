"""Periodic motion at the end of a run, from its last periods."""

from __future__ import annotations

import math
import textwrap
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._map.backend import Number
from capsule_sym._map.checks import check_count, is_real
from capsule_sym._map.drift import UNIT, drifts
from capsule_sym._map.itinerary import cyclic_start
from capsule_sym._map.result import brief
from capsule_sym._map.segments import Instant, Segment
from capsule_sym._parameters import SceneParameters

LONGEST = 16  # longest period number that is tried
_Run = Any  # a `Trajectory` that has ended, whose module imports this one


@dataclass(frozen=True)
class SteadyMotion:
    """Periodic motion modulo drift: its segments over one period of the motion.

    Segments of a run are those of its last period, from the standard first field, so the first in
    time may stand later. Those of an orbit are in its own order. `period_number` is the period in
    excitation periods; `progression` is the advance of x_c per excitation period, dimensionless.
    """

    segments: tuple[Segment, ...]
    period_number: int
    progression: Number
    parameters: SceneParameters

    def __repr__(self) -> str:
        itinerary, pace = abbreviated(" ".join(self.itinerary), 20), shown_progression(self)
        text = f"period number {self.period_number}, progression {pace:.6g}"
        return brief(self, text, itinerary)

    @property
    def itinerary(self) -> tuple[str, ...]:
        """Fields of one period in the order of the segments, such as ("F5", "F2")."""
        return tuple(segment.name for segment in self.segments)

    @property
    def global_map(self) -> str:
        """The motion as a composition of local maps, right to left, in the paper's notation.

        That of a single segment is an identity, such as "Id_{Σ2,F2,Σ2}".
        """
        if len(self.segments) == 1:
            return self.segments[0].local_map.replace("P", "Id", 1)
        return " ∘ ".join(segment.local_map for segment in reversed(self.segments))


def shown_progression(motion: SteadyMotion) -> float:
    """Progression as shown: 0 for a motion that does not drift, or by rounding alone."""
    segments, number, scene = motion.segments, motion.period_number, motion.parameters.scene
    drifting = drifts(
        list(motion.parameters.to_dict().values()),
        contact=any(scene.facts.FIELDS[segment.field][0] for segment in segments),
        progression=float(motion.progression),
        way=sum(abs(float(segment.advance)) for segment in segments) / number,
        segments=len(segments),
        unit=UNIT if isinstance(motion.progression, float) else 1e-50,
        scene=scene,
    )
    return float(motion.progression) if drifting else 0.0


def steady_motion(run: _Run, tolerance: float, longest: int) -> SteadyMotion | None:
    """Periodic motion at the end of a run, as in `Trajectory.steady`."""
    if not (is_real(tolerance) and 0 < tolerance < math.inf):
        raise InvalidInput("tolerance", tolerance, "a finite number > 0")
    check_count("longest", longest)
    _ = run.segments  # raises if they were not kept
    states = np.array(run.stroboscopic[-2 * longest :], dtype=float)

    def change(after: int, period_number: int) -> float:
        """Largest change of the last `period_number` states from those `after` periods before."""
        last, before = states[-period_number:], states[-period_number - after : len(states) - after]
        return float(np.max(np.abs(last - before)))

    for period_number in range(1, min(longest, len(states) // 2) + 1):
        if change(period_number, period_number) > tolerance:
            continue
        divisors = (d for d in range(1, period_number) if period_number % d == 0)
        if any(change(divisor, period_number) <= 1e3 * tolerance for divisor in divisors):
            continue
        segments, previous = (
            _last_periods(run, period_number, 0),
            _last_periods(run, period_number, 1),
        )
        if not segments and not previous:
            last = _last_period(run)
            return SteadyMotion((last,), 1, last.advance, run.parameters)
        if _labels(segments) == _labels(previous):
            return _steady(segments, period_number, run.parameters)
    return None


def _last_period(run: _Run) -> Segment:
    """Last excitation period of a run that ends without switches, as a segment."""
    last: Segment = run.segments[-1]
    x_r, v_r, v_c = run.stroboscopic[-2].tolist()
    number = type(x_r)
    given = {name: number(value) for name, value in run.parameters.to_dict().items()}
    free, scene = SimpleNamespace(kappa=x_r * 0, **given), run.parameters.scene
    gap = x_r - given[scene.facts.STOPS[0][0]]
    pull = scene.formulas.Formulas.pull(free, x_r, gap, v_r, x_r * 0 + 1)
    return replace(
        last,
        source=f"Σ{last.field}",
        target=f"Σ{last.field}",
        start=Instant(last.end.period - 1, x_r * 0, run.parameters.omega),
        start_state=(x_r, v_r, v_c),
        duration=number(run.parameters.period),
        tangencies=(),
        position=last.position + last.advance,
        advance=last.advance * 0,
        closed=type(last.closed)(x_r, gap, v_r, v_c, pull, x_r * 0 + 1, x_r * 0),
    )


def _last_periods(run: _Run, period_number: int, back: int) -> tuple[Segment, ...]:
    """Segments that end in the given number of whole periods before the run's end."""
    ends, switched = run.records["end_period"], run.records["target"] != 0
    stop = int(ends[-1]) - back * period_number
    first, beyond = np.searchsorted(ends, (stop - period_number, stop)).tolist()
    return tuple(run.segments[i] for i in range(first, beyond) if switched[i])


def _labels(segments: tuple[Segment, ...]) -> list[tuple[int, str, str]]:
    return [(s.field, s.source, s.target) for s in segments]


def _steady(
    segments: tuple[Segment, ...], period_number: int, parameters: SceneParameters
) -> SteadyMotion:
    first = cyclic_start([s.field for s in segments], parameters.scene)
    advance = sum((s.advance for s in segments), segments[0].advance * 0)
    whole = segments[first:] + segments[:first]
    return SteadyMotion(whole, period_number, advance / period_number, parameters)


def abbreviated(text: str, most: int = 60) -> str:
    """Text, shortened between words if it is longer than `most` characters."""
    return textwrap.shorten(text, most, placeholder=" ...")
