"""All orbits of one itinerary over a patch of the (alpha, gamma) plane, proved in polynomial form.

The equations are those of `equations`, with nothing divided out: a segment inserted at the edge
of its region is too short there for the guards' proof anyway. Over the patch the orbit is sought as
x(s) + b, |b| <= radii, with a polynomial x of the place s, and with Y(s) the inverse derivative as
a polynomial

    -Y(s) F(x(s)) + (1 - Y(s) F_x(x(s) + b)) b

inside the radii proves that for every s there is one orbit with such a b, and only one. Terms of
first and second order in s are propagated exactly, so that only terms of third order limit a patch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import product
from math import log

import numpy as np
from flint import arb_series

from capsule_sym._enclosures.case import EXACT
from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    ball,
    floats,
    matrix,
    precision,
    thin,
    upper,
)
from capsule_sym._enclosures.numbers.fields import SIZE, Field, generated
from capsule_sym._enclosures.numbers.forms import (
    DEGREE,
    MONOMIALS,
    Form,
    exponential,
    hull,
    identity,
    number,
    polynomial,
    shifted,
)
from capsule_sym._enclosures.orbits.krawczyk import image_of, newton
from capsule_sym._enclosures.orbits.proof import held
from capsule_sym._enclosures.orbits.shooting import Evaluation, Shooting
from capsule_sym._enclosures.orbits.stability import Characteristic, prove_stable
from capsule_sym._enclosures.orbits.steady import guess_of_run
from capsule_sym._enclosures.passage.guards import Watch
from capsule_sym._enclosures.passage.switches import zeros
from capsule_sym._enclosures.regions.parts import Outcome, Patch
from capsule_sym._errors import CapsuleError
from capsule_sym._map import simulate
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._parameters import Parameters

Part = tuple[float, float, float, float]
"""A part of a patch: middle and radius of s_1, then of s_2."""
_AXES = ("alpha", "gamma")
_BITS = 64
_PERIODS = ((96, 1e-6), (2048, 1e-6), (2048, 1e-4))  # of a run, and its change over a period
_TRIALS = 5
_DEEPEST = 4  # halvings of a patch for the proof of its guards
_LARGEST = 0.9  # bound on the remainder of the unit matrix
_PROMISING = 0.03  # the same about the polynomial itself, as a guess: above it, radii only grow
_FAR = 2e3  # times that: beyond it a guess is useless


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
        self._whole = Field(index, {**given, "gamma": gamma.hull})
        self.stick, self.guards = self._whole.stick, self._whole.guards
        near, over = (_rates(index, given, value) for value in (gamma.c, gamma.hull))
        self.A = gamma.composed(near[: DEGREE + 1], over[DEGREE + 1])

    def flow(self, h: Form) -> Form:
        """exp(A h)."""
        if not self._whole.depends("gamma"):
            return shifted(self._whole.A, h, self._whole.flow)
        return exponential(self.A, h)


def _rates(index: int, given: Mapping[str, Ball], gamma: Ball) -> list[Matrix]:
    """Matrix of a field about a gamma: the coefficients of its Taylor series."""
    values = {**given, "gamma": arb_series([gamma, 1], prec=DEGREE + 2)}
    entries = generated.RATES[index - 1](*(values[name] for name in generated.PARAMETERS))
    series = [(i, j, x + 0 * values["gamma"]) for i, j, x in entries]
    return [matrix(SIZE, SIZE, ((i, j, x[k]) for i, j, x in series)) for k in range(DEGREE + 2)]


class PatchOrbits:
    """Equations of an itinerary over a patch, about columns that solve them at its middle."""

    def __init__(self, shooting: Shooting, guess: Sequence[Ball], radii: tuple[float, float]):
        solved = [k for k in range(shooting.unknowns) if k not in held(shooting)]
        self.centre, there, inverse = newton(shooting, guess, solved, 1e-14)
        drive = floats(there.by)[:, [shooting.parameter(name) for name in _AXES]]
        self.path = np.zeros((len(solved), len(MONOMIALS)))
        self.path[:, 1:3] = -inverse @ (drive * radii)
        self.given = given = shooting.parameters(self.centre)
        self.alpha = polynomial([given["alpha"].mid(), radii[0], 0.0])
        self.gamma = polynomial([given["gamma"].mid(), 0.0, radii[1]])
        over = given | {"alpha": self.alpha, "gamma": self.gamma}
        self.shooting = Shooting(shooting.itinerary, [over[name] for name in PARAMETERS])
        self.solved = tuple(solved)
        self.flows = {
            index: _Flow(index, given, self.gamma) for index in set(shooting.itinerary.fields)
        }
        places = ((at, k, 1) for k, at in enumerate(solved))
        self._chosen = matrix(self.shooting.columns, len(solved), places)

    def halvings(self, count: int) -> tuple[int, ...]:
        """Directions to halve the patch in: each time the one in which the orbit changes more."""
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

    def evaluate(self, columns: Sequence[Form]) -> tuple[Evaluation, Form]:
        """The equations, and their derivative by the unknowns that are solved for."""
        found = self.shooting.evaluate(columns, self.flows, divided=False)
        return found, found.by * self._chosen

    def enclose(self) -> Evaluation:
        """The segments of all orbits over the patch; raises Unproved without existence."""
        size = len(self.solved)
        still = [0.0] * size
        found, by = self.evaluate(self.columns(still))
        # Unlike in Newton's method, roots at which segments are inserted are not divided out here.
        inverse = thin(np.linalg.inv(floats(by.c)).astype(np.float64))
        for k in range(3, len(MONOMIALS)):
            self.path[:, k] -= floats(inverse * found.residual.p[k])[:, 0]
        found, by = self.evaluate(self.columns(still))
        residual = inverse * found.residual
        radii = np.zeros(size)
        for trial in range(_TRIALS):
            near = inverse * by  # close to the unit matrix
            tilt = _inverse(near)
            left = _sizes((identity(size) - tilt * near).hull)
            most = max(abs(np.linalg.eigvals(left))) if np.all(np.isfinite(left)) else np.inf
            if most > (_LARGEST if trial else _PROMISING):
                raise TooLarge(self.halvings(1 if trial else _missing(most)))
            moved = _sizes((tilt * residual).hull)[:, 0]
            if trial and np.all(image_of(moved, left, radii) < radii):
                return found
            least = np.linalg.solve(np.eye(size) - left, moved)
            radii = 1.3 * least + 0.02 * max(least) + 1e-15
            found, by = self.evaluate(self.columns(radii.tolist()))
        raise TooLarge(self.halvings(1))

    def admissible(self, found: Evaluation) -> None:
        """Prove the itinerary of every orbit, or raise Unproved.

        If a segment's guards are not proved over the whole patch, they are proved over parts of it.
        """
        watches: dict[Part, tuple[dict[int, Field], Watch]] = {}
        for i, node in enumerate(found.nodes):
            flow, following = found.fields[i], found.nodes[(i + 1) % len(found.nodes)]
            orders, name = zeros(found.itinerary, i), f"segment {i + 1}, F{flow.index}"
            parts: list[tuple[Part, int]] = [((0.0, 1.0, 0.0, 1.0), 0)]
            while parts:
                part, depth = parts.pop()
                fields, watch = watches.setdefault(part, ({}, Watch()))
                if flow.index not in fields:
                    fields[flow.index] = self._field(flow.index, part)
                start, end = (_columns(_within(one.state, part)) for one in (node, following))
                try:
                    h = hull(found.durations[i])
                    watch.segment(fields[flow.index], start, end, h, orders, name)
                except Unproved:
                    if depth == _DEEPEST:
                        raise
                    along = 0 if flow.stick or depth % 3 == 2 else 1
                    parts += [(half, depth + 1) for half in _halves(part, along)]

    def _field(self, index: int, part: Part) -> Field:
        """A field over a part of the patch."""
        place = self.gamma.p[2] * arb(part[2], part[3])
        return Field(index, self.given | {"gamma": self.gamma.c + place})

    def prove(self) -> Characteristic:
        """Prove existence, uniqueness, itinerary and stability over the patch; raises Unproved."""
        found = self.enclose()
        self.admissible(found)
        return prove_stable(found)


def _missing(most: float) -> int:
    """Halvings after which the remainder of third order may be small: a guess from below."""
    return 1 + int(log(min(most / _PROMISING, _FAR)) / log(8))


def _sizes(found: Matrix) -> np.ndarray:
    return np.array([[upper(x) for x in row] for row in found.tolist()])


def _inverse(near: Form) -> Form:
    """Inverse of a form close to the unit matrix, up to the degree that is kept."""
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


def attempt(patch: Patch, state: tuple[float, ...]) -> Outcome:
    """Try to prove one stable orbit with one itinerary all over a patch."""
    alpha, gamma = patch.middle
    along: tuple[int, ...] = (int(patch.alpha_level > patch.gamma_level),)
    parameters = Parameters(alpha=alpha, gamma=gamma)
    for periods, change in _PERIODS:
        run = simulate(parameters, state, periods=periods)
        motion = run.steady(change)
        if motion is not None:
            break
    else:
        return Outcome(None, along, state)
    reached = tuple(float(x) for x in run.final[1])
    try:
        itinerary = Itinerary.of_motion(motion)
        border = _border(patch, reached)
        if border is not None:
            return Outcome(None, (border,), reached)
        with precision(_BITS):
            values = EXACT | {"alpha": alpha, "gamma": gamma}
            given = [ball(values[name]) for name in PARAMETERS]
            shooting = Shooting(itinerary, given, ("alpha", "gamma"))
            guess = [*guess_of_run(shooting, run, motion), ball(alpha), ball(gamma)]
            orbits = PatchOrbits(shooting, guess, patch.radii)
            along = orbits.halvings(1)
            orbits.prove()
    except TooLarge as error:
        return Outcome(None, error.halvings, reached)
    except (CapsuleError, ArithmeticError, ValueError):
        return Outcome(None, along, reached)
    over = f" over {itinerary.period_number}" if itinerary.period_number > 1 else ""
    return Outcome(f"{itinerary}{over}", (), reached)


def _border(patch: Patch, state: tuple[float, ...]) -> int | None:
    """Direction in which itineraries differ more among a patch's corners, if they do.

    A guess that saves attempts that cannot succeed.
    """
    (alpha, gamma), (wide, high) = patch.middle, patch.radii
    itineraries: dict[tuple[int, int], Itinerary] = {}
    for right, up in product((-1, 1), repeat=2):
        corner = Parameters(alpha=max(alpha + right * wide, 0.0), gamma=gamma + up * high)
        motion = simulate(corner, state, periods=_PERIODS[0][0]).steady(_PERIODS[-1][1])
        if motion is None:
            return None
        itineraries[right, up] = Itinerary.of_motion(motion).cyclic
    in_alpha = sum(itineraries[-1, side] != itineraries[1, side] for side in (-1, 1))
    in_gamma = sum(itineraries[side, -1] != itineraries[side, 1] for side in (-1, 1))
    return None if in_alpha == in_gamma == 0 else int(in_gamma > in_alpha)
