"""All orbits of one itinerary over a patch of the (alpha, gamma) plane, proved in polynomial form.

The equations are those of `equations`, with nothing divided out: a segment inserted at the edge
of its region is too short there for the guards' proof anyway. Over the patch the orbit is sought as
x(s) + b, |b| <= radii, with a polynomial x of the place s, and with Y(s) the inverse derivative as
a polynomial

    -Y(s) F(x(s)) + (1 - Y(s) F_x(x(s) + b)) b

inside the radii proves that for every s there is one orbit with such a b, and only one. What is of
first and second order in s is carried exactly, so that only what is of third order limits a patch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from capsule_sym._enclosures.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    floats,
    matrix,
    thin,
    upper,
)
from capsule_sym._enclosures.equations import GUARD_ROWS, Shooting
from capsule_sym._enclosures.fields import ONE, SIZE, C, Field, U, V, W, X
from capsule_sym._enclosures.forms import (
    MONOMIALS,
    Form,
    assembled,
    entry,
    exponential,
    identity,
    number,
    polynomial,
    shifted,
)
from capsule_sym._enclosures.guards import Known, Watch, known
from capsule_sym._enclosures.krawczyk import newton
from capsule_sym._enclosures.stability import Characteristic
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.itinerary import drift

Part = tuple[float, float, float, float]
"""A part of a patch: middle and radius of s_1, then of s_2."""
_TRIALS = 5
_DEEPEST = 4  # halvings of a patch for the proof of its guards
_LARGEST = 0.9  # of what is left of the unit matrix
_PROMISING = 0.03  # of that about the polynomial itself, as guessed: with more, radii only grow
_FAR = 2e3  # times that, beyond which it tells nothing any more


class TooLarge(Unproved):
    """A patch whose orbits are not proved to exist; `halvings` guesses what would be small enough.

    They are the directions in which to halve, one after the other.
    """

    def __init__(self, halvings: tuple[int, ...]) -> None:
        super().__init__("existence", "the patch is too large")
        self.halvings = halvings


@dataclass(frozen=True)
class SegmentForms:
    """What the equations give segment by segment: starts and flows as forms, durations as balls."""

    starts: list[Form]
    flows: list[Form]
    durations: list[Ball]
    residual: Form
    by: Form


class Patch:
    """The equations of an itinerary over a patch, about columns that solve them at its middle."""

    def __init__(self, shooting: Shooting, guess: Sequence[Ball], radii: tuple[float, float]):
        self.shooting = shooting
        self.solved = tuple(range(shooting.unknowns))
        if shooting.itinerary.segments[0].guard is None:
            self.solved = tuple(k for k in self.solved if k != shooting.angle)
        self.centre, there, inverse = newton(shooting, guess, self.solved, 1e-14)
        drive = floats(there.by)[:, [shooting.parameter("alpha"), shooting.parameter("gamma")]]
        self.path = np.zeros((len(self.solved), len(MONOMIALS)))
        self.path[:, 1:3] = -inverse @ (drive * radii)
        given = shooting.parameters(self.centre)
        self.given = given
        self.alpha = polynomial([given["alpha"].mid(), radii[0], 0.0])
        self.gamma = polynomial([given["gamma"].mid(), 0.0, radii[1]])
        hull = given | {"alpha": self.alpha.hull, "gamma": self.gamma.hull}
        self.fields = {index: Field(index, hull) for index in set(shooting.itinerary.fields)}
        self._rates = {index: self._rate(index) for index in self.fields}

    def _rate(self, index: int) -> Form:
        """The matrix of a field, which is linear in 1/gamma."""
        one, other = (Field(index, self.given | {"gamma": arb(value)}).A for value in (1, "0.5"))
        slope = other - one  # 1/gamma is 1 and 2
        if not drift(index):
            return Form([one, *[slope * 0] * (len(MONOMIALS) - 1)], slope * 0)
        share = self.gamma.inverse()
        found = [slope * x for x in share.p]
        return Form([one - slope + found[0], *found[1:]], slope * share.e)

    def halvings(self, count: int) -> tuple[int, ...]:
        """Directions to halve the patch in: each time that in which the orbit changes more."""
        reached = np.abs(self.path[:, 1:3]).max(axis=0)
        found = []
        for _ in range(count):
            found.append(int(reached[1] > reached[0]))
            reached[found[-1]] /= 2
        return tuple(found)

    def columns(self, radii: Sequence[float]) -> list[Form]:
        """Every unknown over the patch, within radii of its polynomial."""
        found = [number(self.centre[at]) for at in range(self.shooting.unknowns)]
        for k, at in enumerate(self.solved):
            found[at] = polynomial([self.centre[at], *self.path[k, 1:]], radii[k])
        return found

    def evaluate(self, columns: Sequence[Form]) -> SegmentForms:
        """The equations and their derivative by the unknowns."""
        shooting = self.shooting
        itinerary, n, omega = shooting.itinerary, len(shooting.itinerary), self.given["omega"]
        starts, rates = self._starts(columns)
        flows = []
        size = len(self.solved)
        place = {at: k for k, at in enumerate(self.solved)}
        values: list[Form] = []
        by: dict[tuple[int, int], Form] = {}
        for i, segment in enumerate(itinerary.segments):
            h = columns[shooting.durations[i]]
            flow = self._flow(segment.field, h)
            end = flow * starts[i]
            rate, by_angle = self._rates[segment.field] * end, flow * rates[i]
            flows.append(flow)
            after = (i + 1) % n
            for row in (X, V, C)[: 3 if drift(segment.field) else 2]:
                at = len(values)
                values.append(entry(end, row, 0) - entry(starts[after], row, 0))

                def add(column: int, value: Form, at: int = at) -> None:
                    if column in place:
                        key = at, place[column]
                        by[key] = by[key] + value if key in by else value

                for column, vector in self._free(i):
                    add(column, entry(flow * vector, row, 0))
                for column, vector in self._free(after):
                    add(column, entry(vector, row, 0) * -1)
                add(shooting.durations[i], entry(rate, row, 0))
                if shooting.angle in place:
                    add(shooting.angle, entry(by_angle, row, 0))
                for j in range(i):
                    add(shooting.durations[j], entry(by_angle, row, 0) * omega)
        at = len(values)
        total = columns[shooting.durations[0]]
        for k in shooting.durations[1:]:
            total = total + columns[k]
        phase_advance = 2 * itinerary.period_number * arb.pi()
        values.append(total * omega - number(phase_advance))
        for k in shooting.durations:
            by[at, place[k]] = number(omega)
        residual = assembled(size, 1, {(k, 0): x for k, x in enumerate(values)})
        durations = [columns[k].hull for k in shooting.durations]
        return SegmentForms(starts, flows, durations, residual, assembled(size, size, by))

    def _flow(self, index: int, h: Form) -> Form:
        if drift(index):
            return exponential(self._rates[index], h)
        field = self.fields[index]  # no parameter of the patch is in stick
        return shifted(field.A, h, field.flow)

    def _starts(self, columns: Sequence[Form]) -> tuple[list[Form], list[Form]]:
        """Where the segments begin, and the derivative of that by the forcing angle."""
        shooting, omega = self.shooting, self.given["omega"]
        starts, rates = [], []
        angle = columns[shooting.angle]
        for i in range(len(shooting.itinerary)):
            sine, cosine = angle.sin_cos()
            u, w = self.alpha * cosine, self.alpha * sine
            entries = {(U, 0): u, (W, 0): w, (ONE, 0): number(1)}
            for k, row in enumerate(shooting.free[i]):
                entries[row, 0] = columns[shooting.places[i] + k]
            if X not in shooting.free[i]:
                slope, constant = self._pin(i)
                entries[X, 0] = entries[V, 0] * slope + number(constant)
            starts.append(assembled(SIZE, 1, entries))
            rates.append(assembled(SIZE, 1, {(U, 0): w * -1, (W, 0): u}))
            angle = angle + columns[shooting.durations[i]] * omega
        return starts, rates

    def _pin(self, i: int) -> tuple[Ball, Ball]:
        """x_r = slope v_r + constant, where the guard of the segment before vanishes."""
        before = self.shooting.itinerary.segments[i - 1]
        assert before.guard is not None
        guards, row = self.fields[before.field].guards, GUARD_ROWS[before.guard]
        g_x, g_v, g_1 = (guards[row, k] for k in (X, V, ONE))
        return -g_v / g_x, -g_1 / g_x

    def _free(self, i: int) -> list[tuple[int, Form]]:
        """The free columns of a segment's start, and the derivative of the start by each."""
        found = []
        for k, row in enumerate(self.shooting.free[i]):
            entries = {(row, 0): number(1)}
            if row == V and X not in self.shooting.free[i]:
                entries[X, 0] = number(self._pin(i)[0])
            found.append((self.shooting.places[i] + k, assembled(SIZE, 1, entries)))
        return found

    def enclose(self) -> SegmentForms:
        """The segments of all orbits over the patch; raises Unproved without existence."""
        size = len(self.solved)
        still = [0.0] * size
        segments = self.evaluate(self.columns(still))
        # Not Newton's: there the roots at which segments are inserted are divided out.
        inverse = thin(np.linalg.inv(floats(segments.by.c)).astype(np.float64))
        for k in range(3, len(MONOMIALS)):
            self.path[:, k] -= floats(inverse * segments.residual.p[k])[:, 0]
        segments = self.evaluate(self.columns(still))
        residual = segments.residual.before(inverse)
        radii = np.zeros(size)
        for trial in range(_TRIALS):
            near = segments.by.before(inverse)  # close to the unit matrix
            tilt = _inverse(near)
            left = _sizes((identity(size) - tilt * near).hull)
            most = max(abs(np.linalg.eigvals(left))) if np.all(np.isfinite(left)) else np.inf
            if most > (_LARGEST if trial else _PROMISING):
                raise TooLarge(self.halvings(1 if trial else _missing(most)))
            moved = _sizes((tilt * residual).hull)[:, 0]
            image = (moved + left @ radii) * (1 + 1e-12) + 1e-300
            if trial and np.all(image < radii):
                return segments
            least = np.linalg.solve(np.eye(size) - left, moved)
            radii = 1.3 * least + 0.02 * max(least) + 1e-15
            segments = self.evaluate(self.columns(radii.tolist()))
        raise TooLarge(self.halvings(1))

    def admissible(self, segments: SegmentForms) -> None:
        """Prove the itinerary of every orbit, or raise Unproved.

        Where a segment's guards are not proved over the whole patch, they are over parts of it.
        """
        itinerary, n = self.shooting.itinerary, len(self.shooting.itinerary)
        watches: dict[Part, tuple[dict[int, Field], Watch]] = {}
        for i, segment in enumerate(itinerary.segments):
            before, after = known(itinerary, i), known(itinerary, (i + 1) % n)
            if segment.guard is None:
                before = after = Known()
            orders = before.orders(segment.field), after.orders(segment.field)
            ends = segments.starts[i], segments.starts[(i + 1) % n]
            parts: list[tuple[Part, int]] = [((0.0, 1.0, 0.0, 1.0), 0)]
            while parts:
                part, depth = parts.pop()
                if part not in watches:
                    watches[part] = {}, Watch()
                fields, watch = watches[part]
                if segment.field not in fields:
                    fields[segment.field] = self._field(segment.field, part)
                start, end = (_columns(_within(one, part)) for one in ends)
                name = f"segment {i + 1}, F{segment.field}"
                try:
                    watch.segment(
                        fields[segment.field], start, end, segments.durations[i], orders, name
                    )
                except Unproved:
                    if depth == _DEEPEST:
                        raise
                    along = 0 if not drift(segment.field) or depth % 3 == 2 else 1
                    parts += [(half, depth + 1) for half in _halves(part, along)]

    def _field(self, index: int, part: Part) -> Field:
        """A field over a part of the patch."""
        place = self.gamma.p[2] * arb(part[2], part[3])
        return Field(index, self.given | {"alpha": self.alpha.hull, "gamma": self.gamma.c + place})

    def prove(self) -> Characteristic:
        """Prove existence, uniqueness, itinerary and stability over the patch; raises Unproved."""
        segments = self.enclose()
        self.admissible(segments)
        return self.stable(segments)

    def stable(self, segments: SegmentForms) -> Characteristic:
        """Prove that all multipliers are inside the unit circle (Jury), or raise Unproved."""
        itinerary, n = self.shooting.itinerary, len(self.shooting.itinerary)
        first = next((i for i in range(n) if drift(itinerary.fields[i]) == 0), 0)
        size = 3 if drift(itinerary.fields[first]) else 2
        product = assembled(3, 3, {(k, k): number(1) for k in range(size)})
        for step in range(n):
            i = (first + step) % n
            product = _three(segments.flows[i]) * product
            if itinerary.segments[i].guard is Guard.DRIFT:
                product = self._jump(segments, i, (i + 1) % n) * product
        m = [[entry(product, i, j) for j in range(3)] for i in range(3)]
        trace = m[0][0] + m[1][1] + m[2][2]
        minors = _minor(m, 0, 1) + _minor(m, 0, 2) + _minor(m, 1, 2)
        determinant = (
            m[0][0] * _minor(m, 1, 2)
            - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
        )
        found = Characteristic(trace.hull, minors.hull, determinant.hull)
        for place, value in enumerate(found.jury, 1):
            if not value > 0:
                raise Unproved("stability", f"Jury's condition {place} is not proved")
        return found

    def _jump(self, segments: SegmentForms, segment: int, following: int) -> Form:
        found = identity(3)
        lost = number(1)
        if drift(self.shooting.itinerary.fields[following]):
            state = segments.starts[following]
            before, after = (
                entry(self._rates[self.shooting.itinerary.fields[k]] * state, C, 0)
                for k in (segment, following)
            )
            lost = lost - after * before.inverse()
        kept = number(1) - lost
        entries = {(i, j): entry(found, i, j) for i in range(3) for j in range(3)}
        entries[V, C], entries[C, C] = lost, kept
        return assembled(3, 3, entries)


def _missing(most: float) -> int:
    """Halvings after which what is left, of third order, may be small: a guess from below."""
    return 1 + int(log(min(most / _PROMISING, _FAR)) / log(8))


def _minor(m: list[list[Form]], i: int, j: int) -> Form:
    return m[i][i] * m[j][j] - m[i][j] * m[j][i]


def _sizes(found: Matrix) -> np.ndarray:
    return np.array([[upper(x) for x in row] for row in found.tolist()])


def _three(flow: Form) -> Form:
    def part(of: Matrix) -> Matrix:
        return matrix(3, 3, ((i, j, of[i, j]) for i in range(3) for j in range(3)))

    return Form([part(x) for x in flow.p], part(flow.e))


def _inverse(near: Form) -> Form:
    """The inverse of what is close to the unit matrix, up to the degree that is kept."""
    one = identity(near.c.nrows())
    away = one - Form(near.p, near.e * 0)
    found = one
    for _ in range(2):
        found = one + away * found
    return Form(found.p, found.e * 0)


def _halves(part: Part, along: int) -> list[Part]:
    a, wide, b, high = part
    if along == 0:
        return [(a + side * wide / 2, wide / 2, b, high) for side in (-1, 1)]
    return [(a, wide, b + side * high / 2, high / 2) for side in (-1, 1)]


def _within(state: Form, part: Part) -> Form:
    """A form over a part of its patch."""
    a, wide, b, high = part
    c, x, y, xx, xy, yy = state.p
    return Form(
        [
            c + x * a + y * b + xx * (a * a) + xy * (a * b) + yy * (b * b),
            (x + xx * (2 * a) + xy * b) * wide,
            (y + xy * a + yy * (2 * b)) * high,
            xx * (wide * wide),
            xy * (wide * high),
            yy * (high * high),
        ],
        state.e,
    )


def _columns(state: Form) -> Matrix:
    """A state as middle, directions and rest, in columns."""
    found = matrix(SIZE, len(MONOMIALS) + 1)
    for k, part in enumerate((*state.p, state.e)):
        for i in range(SIZE):
            found[i, k] = part[i, 0]
    return found
