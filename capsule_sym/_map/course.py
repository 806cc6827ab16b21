"""Closed form of one segment from one start, with bounds on its errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from capsule_sym._map import quasistatic
from capsule_sym._map.backend import Backend, Number
from capsule_sym._map.expansion import Guard, Point, amplitude_of, pulsed, reaction_of


class Begin(NamedTuple):
    """Start of a segment: state, forcing angle, and the guards that vanish there exactly.

    `gap` is relative to the field's own stop, `other` to the other one of two; `margin` is Q -
    friction. `zeros` gives, for each such guard, how many derivatives vanish, counted from the
    guard itself. `angle_rest` is the rounding error of the angle.
    """

    x_r: Number
    gap: Number
    v_r: Number
    v_c: Number
    margin: Number
    angle: Number
    zeros: Mapping[Guard, int]
    angle_rest: Number = 0
    other: Number = None


@dataclass(frozen=True)
class SegmentStart:
    """Successor field at a state, and the start of its segment."""

    field: int
    start: Begin


class Course:
    """Closed form of one segment from one start, with error bounds and a count of calls."""

    def __init__(self, backend: Backend, c: Any, begin: SegmentStart) -> None:
        self.backend, self.c, self.start = backend, c, begin.start
        self.field, start = begin.field, begin.start
        self.evaluations = 0
        cosine, sine = backend.cos_sin(start.angle, start.angle_rest)
        self.closed = backend.kernels.Start(
            start.x_r, start.gap, start.v_r, start.v_c, start.margin, cosine, sine
        )
        zero = start.x_r * 0
        # Far from the impact surface the gap is a rounded difference.
        far = 2 * abs(start.gap) > abs(c.own_stop())
        self._error_gap = backend.unit * abs(start.gap) if far else zero
        self._error_other = zero
        if start.other is not None and 2 * abs(start.other) > abs(start.other - start.x_r):
            self._error_other = backend.unit * (abs(start.other) + abs(start.x_r))
        self.origin = Point(
            *start[:5],
            cosine,
            sine,
            self._error_gap,
            zero,
            zero,
            2 * backend.unit * start.angle,
            start.other,
            self._error_other,
        )
        self._forcing, self._reaction = amplitude_of(c), reaction_of(c)
        magnitudes = abs(start.x_r), abs(start.gap), abs(start.v_r)
        self._force = c.rest_force_size(*magnitudes[:2])
        self._root_K = backend.sqrt(c.K)
        # Terms of the margin's sum; where a slip begins it is 0 and exact.
        exact = start.zeros.get(Guard.DRIFT, 0) > 1
        self._margin = zero if exact else c.margin_at_size(*magnitudes)
        # Bounds of the response to forcing from rest, in units of its amplitude.
        detuning = abs(c.K - c.omega * c.omega)
        self._bounded = not pulsed(c) and c.Z2 > 0
        if self._bounded:
            both = c.omega + self._root_K
            self._largest = (
                (2 * c.sigma * both + 2 * detuning) / c.Z2,
                (4 * c.sigma * c.omega * c.omega + detuning * both) / c.Z2,
            )

    def __call__(self, h: Number) -> Point:
        """State at a duration h > 0 after the start, with its error bounds."""
        self.evaluations += 1
        c, start, number = self.c, self.start, self.backend.number
        values = self.backend.kernels.flow(c, self.closed, h)
        position, v_r = number(values[0]), number(values[1])
        x_r, gap = start.x_r + position, start.gap + position
        v_c = start.v_c + number(values[2]) if c.drift else start.v_c
        turned = c.omega * h
        cosine, sine = self.backend.cos_sin(start.angle + turned, start.angle_rest)
        margin = c.margin_at(x_r, gap, v_r, cosine)
        errors = self._errors(h, x_r, v_r, v_c)
        error_angle = 2 * self.backend.unit * (start.angle + turned)
        point = Point(x_r, gap, v_r, v_c, margin, cosine, sine, *errors, error_angle)
        return self._beside(point, position)

    def _beside(self, point: Point, position: Number) -> Point:
        """The point with its gap to the other one of two stops."""
        if self.start.other is None:
            return point
        other = self.start.other + position
        error = self._error_other + point.error_x + self.backend.unit * abs(other)
        return point._replace(other=other, error_other=error)

    def to_edge(self) -> tuple[Number, Number]:
        """Duration from the start to the pulses' next edge, and a bound on its error."""
        c, start, unit = self.c, self.start, self.backend.unit
        angle, rest = self.backend.edge(c.high_share() if c.high else start.x_r * 0 + 1)
        h = ((angle - start.angle) + (rest - start.angle_rest)) / c.omega
        off = 8 * unit * unit if rest else 4 * unit
        return max(h, h * 0), off * angle / c.omega + 4 * unit * abs(h)

    def at_mark(self, h: Number) -> Point:
        """State at a duration h > 0, of any length, after which the forcing's angle is 0.

        The closed form takes the forcing's phase from h, with an error in proportion to h. Here the
        forced response is evaluated at the two angles, both known, and only the free part uses the
        duration. For pulses, for a short duration and near resonance, where this would lose more
        digits, the state is that of a call.
        """
        c, start = self.c, self.start
        if pulsed(c) or c.omega * h * self.backend.sqrt(c.Z2) < 8 * (c.K + c.omega * c.omega):
            return self(h)
        cosine, sine = self.closed.cos_theta, self.closed.sin_theta
        before, rate_before = c.forced(cosine, sine)
        after, rate_after = c.forced(h * 0 + 1, h * 0)
        free = self.closed._replace(
            x_r=start.x_r - before, gap=start.gap - before, v_r=start.v_r - rate_before
        )
        unforced = c._replace(alpha=c.alpha * 0, resonant=False)
        values = self.backend.kernels.flow(unforced, free, h)
        self.evaluations += 1
        number = self.backend.number
        position, v_r = number(values[0]) + (after - before), number(values[1]) + rate_after
        x_r, gap, v_c = start.x_r + position, start.gap + position, start.v_c
        if c.drift:
            drive = c.alpha * 0 if self._reaction else c.alpha
            forced = rate_before - rate_after - drive * sine / c.omega
            v_c = v_c + number(values[2]) + forced / (c.gamma + 1)
        zero = h * 0
        margin = c.margin_at(x_r, gap, v_r, zero + 1)
        errors = self._errors(h, x_r, v_r, v_c)
        point = Point(x_r, gap, v_r, v_c, margin, zero + 1, zero, *errors, zero)
        return self._beside(point, position)

    def _errors(
        self, h: Number, x_r: Number, v_r: Number, v_c: Number
    ) -> tuple[Number, Number, Number]:
        """Bounds on the errors of x_r, v_r and v_c, from the largest terms of the closed form.

        The phases of forced and of oscillating free motion have an error in proportion to the
        duration; that of the free motion decays with it.
        """
        c, start, unit = self.c, self.start, self.backend.unit
        g = min(h, 1 / c.fast)
        forced_x, forced_v = min(h * h / 2, h / self._root_K), h
        alpha = self._forcing
        if self._bounded:
            forced_x, forced_v = min(forced_x, self._largest[0]), min(forced_v, self._largest[1])
        terms_x = abs(start.v_r) * g + self._force * min(h * h / 2, 2 / c.K) + alpha * forced_x
        terms_v = abs(start.v_r) + self._force * g + alpha * forced_v
        phase = c.fast * h / (1 + c.sigma * h) if c.q >= 0 else 1
        units = self.backend.closed_form_units * unit * (1 + phase + c.omega * h)
        # Propagated errors of the start's gap and angle.
        carried = 2 * (1 + c.zeta) * self._error_gap + 2 * unit * start.angle * alpha * forced_x
        error_x = units * terms_x + unit * abs(x_r) + carried
        carried = 2 * (1 + c.zeta) * self._root_K * self._error_gap
        error_v = units * terms_v + carried + 2 * unit * start.angle * alpha * forced_v
        if not c.drift:
            return error_x, error_v, h * 0
        if c.rate * h < 1:
            grown = c.force_change_size(terms_x * h, terms_x + abs(start.v_r) * h)
            terms = c.v_c_rate(self._margin * h + grown + self._reaction * h)
        else:
            constant = abs(c.friction) + abs(quasistatic.load_of(c))
            impulse = constant * h + alpha * min(h, 2 / c.omega)
            terms = (abs(start.v_r) + terms_v + impulse) / (c.gamma + 1)
        return error_x, error_v, units * terms + unit * abs(v_c)
