"""All orbits of one itinerary over a patch of the (alpha, gamma) plane, proved in polynomial form.

The equations are those of `shooting`, with nothing divided out: a segment inserted at the edge
of its region is too short there for the guards' proof anyway, unless its duration is a coordinate
of the patch (`curve_sides`). Over the patch the orbit is sought as x(s) + b, |b| <= radii, with a
polynomial x of the place s, and with Y(s) the inverse derivative as a polynomial

    -Y(s) F(x(s)) + (1 - Y(s) F_x(x(s) + b)) b

inside the radii proves that for every s there is one orbit with such a b, and only one. Terms
up to the third order in s are propagated exactly, so that only those of fourth order limit a patch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import comb

import numpy as np
from flint import arb_series

from capsule_sym._enclosures.interface import (
    SIZE,
    Ball,
    BoxValues,
    Characteristic,
    Field,
    Matrix,
    Shooting,
    Signs,
    Unproved,
    arb,
    floats,
    generated,
    held,
    image_of,
    matrix,
    newton,
    thin,
    upper,
    zeros,
)
from capsule_sym._orbits.interface import PARAMETERS
from paper.proofs.forms import (
    DEGREE,
    MONOMIALS,
    Form,
    exponential,
    hull,
    identity,
    number,
    polynomial,
    series,
    shifted,
)
from paper.proofs.stable import prove_stable

Part = tuple[float, float, float, float]
"""A part of a patch: middle and radius of s_1, then of s_2."""
_AXES = ("alpha", "gamma")
_TRIALS = 5
_DEEPEST = 4  # halvings of a patch for the proof of its guards
_LARGEST = 0.9  # bound on the remainder of the unit matrix
_MOST = 8  # halvings at once


class TooLarge(Unproved):
    """A patch whose orbits are not proved to exist; `halvings` guesses a sufficient subdivision.

    They are the directions in which to halve, one after the other.
    """

    def __init__(self, halvings: tuple[int, ...]) -> None:
        super().__init__("existence", "the patch is too large")
        self.halvings = halvings


class _Flow:
    """Field over a patch: its rates and its flow as forms, its guards as balls.

    No field depends on alpha, and no guard on gamma.
    """

    def __init__(self, index: int, given: Mapping[str, Ball], gamma: Form) -> None:
        self.index = index
        self.whole = Field(index, {**given, "gamma": gamma.hull})
        self.stick, self.guards = self.whole.stick, self.whole.guards
        self.depends, self.guard_slope = self.whole.depends, self.whole.guard_slope
        near, over = (_rates(index, given, value) for value in (gamma.c, gamma.hull))
        self.A = gamma.composed(near[: DEGREE + 1], over[DEGREE + 1])

    def flow(self, h: Form) -> Form:
        """exp(A h)."""
        if not self.whole.depends("gamma"):
            return shifted(self.whole.A, h, self.whole.flow)
        return exponential(self.A, h)

    def divided(self, row: Matrix, zeros: int, h: Form) -> tuple[Form, Form]:
        """`Field.divided` as forms, for a short duration."""
        value, next_one = (series(self.A, h, zeros + k) for k in range(2))
        return row * value, row * (self.A * value - next_one * zeros)


def _rates(index: int, given: Mapping[str, Ball], gamma: Ball) -> list[Matrix]:
    """Matrix of a field about a gamma: the coefficients of its Taylor series."""
    values = {**given, "gamma": arb_series([gamma, 1], prec=DEGREE + 2)}
    entries = generated.RATES[index - 1](*(values[name] for name in generated.PARAMETERS))
    series = [(i, j, x + 0 * values["gamma"]) for i, j, x in entries]
    return [matrix(SIZE, SIZE, ((i, j, x[k]) for i, j, x in series)) for k in range(DEGREE + 2)]


class PatchOrbits:
    """Equations of an itinerary over a patch, about columns that solve them at its middle.

    The patch's coordinates are alpha and gamma, or others of the `axes`, in their columns.
    """

    divided: tuple[int, ...] = ()
    """Segments in whose equations the root at their start is divided out."""
    varied: tuple[str, ...] = ()
    """Parameters that are columns over the patch."""
    promising = 0.0016
    """Bound as `_LARGEST`, about the polynomial itself: a guess, above which radii only grow."""

    def __init__(
        self,
        shooting: Shooting,
        guess: Sequence[Ball],
        radii: tuple[float, float],
        axes: tuple[int, int] | None = None,
    ) -> None:
        self.axes = axes or tuple(map(shooting.parameter, _AXES))
        solved = [k for k in range(shooting.columns) if k not in (*held(shooting), *self.axes)]
        self.centre, there, inverse = newton(shooting, guess, solved, 1e-14)
        drive = floats(there.by)[:, self.axes]
        self.path = np.zeros((len(solved), len(MONOMIALS)))
        self.path[:, 1:3] = -inverse @ (drive * radii)
        self.given = given = shooting.parameters(self.centre)
        self.radii = radii
        self.alpha, self.gamma = (
            self._coordinate(shooting.parameter(name), given[name].mid()) for name in _AXES
        )
        over = given | {"alpha": self.alpha, "gamma": self.gamma}
        values = [over[name] for name in PARAMETERS]
        self.shooting = Shooting(shooting.itinerary, values, self.varied)
        self.solved = tuple(solved)
        self.flows = {
            index: _Flow(index, given, self.gamma) for index in set(shooting.itinerary.fields)
        }
        places = ((at, k, 1) for k, at in enumerate(solved))
        self.chosen = matrix(self.shooting.columns, len(solved), places)

    def _coordinate(self, column: int, middle: Ball) -> Form:
        """A column that is given: constant, but for the patch's coordinates."""
        reach = (r * (at == column) for at, r in zip(self.axes, self.radii, strict=True))
        return polynomial([middle, *reach])

    def halvings(self, share: float = 1.0) -> tuple[int, ...]:
        """Directions to halve the patch in: each time the one in which the orbit changes more.

        One, or so many that the remainder falls to a share, as a guess.
        """
        reached = np.abs(self.path[:, 1:3]).max(axis=0)
        goal, found = reached.sum() * share ** (1 / (DEGREE + 1)), list[int]()
        while not found or (reached.sum() > goal and len(found) < _MOST):
            found.append(int(reached[1] > reached[0]))
            reached[found[-1]] /= 2
        return tuple(found)

    def columns(self, radii: Sequence[float]) -> list[Form]:
        """Every unknown over the patch, within radii of its polynomial."""
        found = [number(self.centre[at]) for at in range(self.shooting.columns)]
        for at in self.axes:
            if at < self.shooting.columns:
                found[at] = self._coordinate(at, self.centre[at])
        for k, at in enumerate(self.solved):
            found[at] = polynomial([self.centre[at], *self.path[k, 1:]], radii[k])
        return found

    def evaluate(self, columns: Sequence[Form]) -> tuple[BoxValues, Form]:
        """The equations, and their derivative by the unknowns that are solved for."""
        found = self.shooting.evaluate(columns, self.flows, divided=self.divided)
        return found, found.by * self.chosen

    def enclose(self) -> BoxValues:
        """The segments of all orbits over the patch; raises Unproved without existence."""
        size = len(self.solved)
        found, by = self.evaluate(self.columns([0.0] * size))
        # Unlike in Newton's method, roots at which segments are inserted are not divided out here.
        inverse = thin(np.linalg.inv(floats(by.c)).astype(np.float64))
        radii = np.zeros(size)
        for trial in range(_TRIALS):
            near = inverse * by  # close to the unit matrix
            tilt = _inverse(near)
            left = _sizes((identity(size) - tilt * near).hull)
            most = max(abs(np.linalg.eigvals(left))) if np.all(np.isfinite(left)) else np.inf
            if most > (_LARGEST if trial else self.promising):
                raise TooLarge(self.halvings(1.0 if trial else self.promising / most))
            if trial == 0:
                found = self._refined(found, inverse)
                residual = inverse * found.residual
            moved = _sizes((tilt * residual).hull)[:, 0]
            if trial and np.all(image_of(moved, left, radii) < radii):
                self.unique, self.inverse = radii, inverse
                return found
            least = np.linalg.solve(np.eye(size) - left, moved)
            radii = 1.3 * least + 0.02 * max(least) + 1e-15
            found, by = self.evaluate(self.columns(radii.tolist()))
        raise TooLarge(self.halvings())

    def _refined(self, found: BoxValues, inverse: Matrix) -> BoxValues:
        """The equations after terms of higher degree have been added to the polynomials."""
        for degree in range(2, DEGREE + 1):
            for k, powers in enumerate(MONOMIALS):
                if sum(powers) == degree:
                    self.path[:, k] -= floats(inverse * found.residual.p[k])[:, 0]
            found, _ = self.evaluate(self.columns([0.0] * len(self.solved)))
        return found

    def admissible(self, found: BoxValues) -> None:
        """Prove the itinerary of every orbit, or raise Unproved.

        If a segment's guards are not proved over the whole patch, they are proved over parts of it.
        """
        watches: dict[Part, tuple[dict[int, Field], Signs]] = {}
        for i, node in enumerate(found.nodes):
            flow, following = found.fields[i], found.nodes[(i + 1) % len(found.nodes)]
            name = f"segment {i + 1}, F{flow.index}"
            parts: list[tuple[Part, int]] = [((0.0, 1.0, 0.0, 1.0), 0)]
            while parts:
                part, depth = parts.pop()
                fields, watch = watches.setdefault(part, ({}, Signs()))
                if flow.index not in fields:
                    fields[flow.index] = self._field(flow.index, part)
                start, end = (_columns(within(one.state, part)) for one in (node, following))
                try:
                    h = hull(found.durations[i])
                    self.watched(i, watch, fields[flow.index], start, end, h, name)
                except Unproved:
                    if depth == _DEEPEST:
                        raise
                    along = 0 if flow.stick or depth % 3 == 2 else 1
                    parts += [(half, depth + 1) for half in _halves(part, along)]

    def watched(
        self, i: int, watch: Signs, field: Field, start: Matrix, end: Matrix, h: Ball, name: str
    ) -> None:
        """Prove the guards of segment i over a part, or raise Unproved."""
        watch.segment(field, start, end, h, zeros(self.shooting.itinerary, i), name)

    def _field(self, index: int, part: Part) -> Field:
        """A field over a part of the patch."""
        place = self.gamma.p[2] * arb(part[2], part[3])
        return Field(index, self.given | {"gamma": self.gamma.c + place})

    def prove(self) -> Characteristic:
        """Prove existence, uniqueness, itinerary and stability over the patch; raises Unproved."""
        found = self.enclose()
        self.admissible(found)
        return prove_stable(found)


def _sizes(found: Matrix) -> np.ndarray:
    return np.array([[upper(x) for x in row] for row in found.tolist()])


def _inverse(near: Form) -> Form:
    """Inverse of a form close to the unit matrix, up to the degree that is kept."""
    one = identity(near.c.nrows())
    away = one - Form(near.p, near.e * 0)
    found = one
    for _ in range(DEGREE):
        found = one + away * found
    return Form(found.p, found.e * 0)


def _halves(part: Part, along: int) -> list[Part]:
    a, wide, b, high = part
    if along == 0:
        return [(a + side * wide / 2, wide / 2, b, high) for side in (-1, 1)]
    return [(a, wide, b + side * high / 2, high / 2) for side in (-1, 1)]


def within(state: Form, part: Part) -> Form:
    """A form over a part of its patch."""
    a, wide, b, high = part
    found = []
    for i, j in MONOMIALS:
        total = state.c * 0
        for p, (m, n) in zip(state.p, MONOMIALS, strict=True):
            if m >= i and n >= j:
                share = comb(m, i) * arb(a) ** (m - i) * comb(n, j) * arb(b) ** (n - j)
                total += p * share
        found.append(total * (arb(wide) ** i * arb(high) ** j))
    return Form(found, state.e)


def _columns(state: Form) -> Matrix:
    """A state as middle, directions and rest, in columns."""
    found = matrix(SIZE, len(MONOMIALS) + 1)
    for k, part in enumerate((*state.p, state.e)):
        for i in range(SIZE):
            found[i, k] = part[i, 0]
    return found
