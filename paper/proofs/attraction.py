"""Motion from rest, proved to tend to a periodic one for all alpha of an interval.

The motions of the interval are carried together, from section to section, once a period, until they
are in a box about the line of the periodic motions that the next period maps into itself as a
contraction. Beside the line in alpha their set is a sum of short columns. After every period all
but the longest are put into a box along the eigenvectors of the goal's derivative. Such a box turns
and shrinks with the motions, so that their set shrinks as the motions do; a box along the axes
would grow. The box is proved to contain the columns in place of which it stands.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym import CapsuleError, Parameters, simulate
from capsule_sym._enclosures.interface import (
    Ball,
    C,
    Leg,
    Matrix,
    Unproved,
    arb,
    at_rest,
    ball,
    floats,
    largest,
    matrix,
    precision,
    thin,
    unit,
)
from capsule_sym._orbits.interface import PARAMETERS
from capsule_sym.results import Trajectory
from paper.proofs.case import EXACT
from paper.proofs.guesses import itinerary_of, steps_of
from paper.proofs.parts import BOTH, AlphaPart, Outcome
from paper.proofs.segments import Bundle, Interval, Passage, carried
from paper.proofs.touches import Soft

BITS = 80
PERIODS = 1200
_NEAR = (3e-3, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6, 1e-8)  # distances at which a box is tried
_ROOM = 1.2  # size of the box beside the least that a contraction needs
_KEPT = 12  # columns that are not put into a box after a period
_IMAGES = 60  # of a box, until its periodic motions are seen to have one itinerary


@dataclass(frozen=True)
class Tendency:
    """Periodic motion, for each alpha, to which the motion from rest is proved to tend.

    Within a period after the first `periods` the motion is in a box that every further period
    shrinks by `factor`: `box`, in columns about those of the parameters.
    """

    itinerary: tuple[int, ...]
    periods: int
    factor: float
    box: Bundle


def tendency(values: Mapping[str, object], alphas: Interval | None = None) -> Tendency:
    """Attracting motions of those from (0, 0, 0) at tau = 0, for all alpha; raises Unproved.

    `values` are the parameters by name, decimals as text, fractions or balls, including alpha if
    there is no interval.
    """
    alphas = alphas or Interval.about(values["alpha"])
    with precision(BITS):
        exact = {name: ball(values[name]) for name in PARAMETERS if name != "alpha"}
        given = {name: float(exact[name].mid()) for name in exact}
        run = simulate(Parameters(alpha=alphas.middle, **given), periods=PERIODS)
        return Motions(Passage(exact, alphas), run).tendency()


def attempt(part: AlphaPart, state: tuple[float, ...] = ()) -> Outcome:
    """Try to prove the tendency of the motions from rest, for all alpha of a part.

    While the capsule is at rest, its mass has no effect: both ratios have one proof.
    """
    with precision(BITS):
        low, *_, high = sorted(map(Fraction, (part.gammas[0], part.gammas[-1])))
        gamma = ball(low).union(ball(high))
    if part.ratio == BOTH:
        alone = Parameters(alpha=part.alphas.middle, gamma=float(gamma.mid()))
        if not all(at_rest(one.field) for one in simulate(alone, periods=PERIODS).segments):
            return Outcome(None, (1,))
    try:
        found = tendency(EXACT | {"gamma": gamma}, part.alphas).itinerary
    except (CapsuleError, ArithmeticError, ValueError):
        return Outcome(None, (0,))
    least = min(found[k:] + found[:k] for k in range(len(found)))
    ratios = " and ".join(part.gammas)
    return Outcome(f"{' '.join(f'F{field}' for field in least)}, gamma = {ratios}", ())


class Motions:
    """Motions from rest, from section to section, with a run at the middle as the guess."""

    def __init__(self, passage: Passage, run: Trajectory) -> None:
        self.passage, self.run = passage, run
        self.offset = _quiet(run)
        self.turn = passage.turn(arb(1))
        self.angle = 2 * arb.pi() * arb(self.offset)
        self._soft = Soft(passage)

    def steps(self, section: int) -> list[Leg]:
        """The segments from one section to the next, in double precision."""
        return steps_of(self.run, section + self.offset, section + 1 + self.offset)

    def passed(self, bundle: Bundle, section: int) -> tuple[Bundle, Matrix]:
        """A bundle one period after a section, and the derivative."""
        angles = self.angle, self.angle
        return self._soft.period(bundle, self.steps(section), self.turn, angles)

    def displaced(self, bundle: Bundle, section: int) -> tuple[Bundle, list[Ball]]:
        """A bundle one period after a section, and the displacement until then, by its columns.

        For a passage with an interval of omega.
        """
        ended, _ = carried(self.passage, thin(bundle), self.steps(section), self.turn)
        return self.passage.section(ended, self.angle), ended.tolist()[-1]

    def tendency(self) -> Tendency:
        """Box that they enter; raises Unproved."""
        n, sides = self.passage.directions, self._goal.sides
        start = self.passage.section(matrix(3, n), arb(0))
        ahead = self.passage.turn(arb(self.offset))
        first = steps_of(self.run, 0, self.offset)
        bundle = self._soft.moved(start, first, ahead, (arb(0), self.angle))
        sections = sorted({*_repeated(self.run, self.offset)})
        for section in range(sections[-1] + 1):
            if section in sections:
                try:
                    return self._entered(bundle, section, section == sections[-1])
                except Unproved:
                    if section == sections[-1]:
                        raise
            steps, angles = self.steps(section), (self.angle, self.angle)
            bundle = grouped(self._soft.moved(bundle, steps, self.turn, angles), sides, n)
        raise AssertionError("the last section is tried")

    @cached_property
    def _goal(self) -> _Goal:
        """Line of the periodic motions, at the run's end, and what a period makes of it."""
        section = PERIODS - 2
        steps = self.steps(section)
        if steps[0].field != steps[-1].field:
            raise Unproved("attraction", "the turn begins at a switch")
        size = 2 if at_rest(steps[0].field) else 3
        n = self.passage.directions
        line, turn = np.zeros((3, n)), math.tau / self.run.parameters.omega
        line[:size, 0] = self.run([turn * (section + self.offset)])[0][:size]
        there, by = self.passed(self.passage.section(thin(line), self.angle), section)
        change = there[:size, :n] - line[:size]
        line[:size] += np.linalg.lstsq(np.eye(size) - floats(by)[:size, :size], change)[0]
        there, by = self.passed(self.passage.section(thin(line), self.angle), section)
        sides = sides_of(by, size)
        inverse, factor = contraction(by, sides)
        if not factor < 1:
            raise Unproved("attraction", f"the factor of the line is {factor:.3g}")
        return _Goal(section, line, there, sides, farthest(there, line, inverse) / (1 - factor))

    def _entered(self, bundle: Bundle, section: int, touching: bool) -> Tendency:
        """Prove that a bundle is in a box about the line that a period contracts.

        Touches in the box are tried for the smallest box alone.
        """
        goal = self._goal
        size = len(goal.sides)
        if size == 2 and np.any(bundle[C]):
            raise Unproved("attraction", "the turn does not begin at rest")
        inside = farthest(bundle, goal.line, thin(goal.sides).inv())
        # The box: the line, and these directions, taken as exact from here on.
        directions = goal.sides * (_ROOM * max(inside, goal.moved, 1e-12))
        n = self.passage.directions
        wide = np.zeros((3, n + size))
        wide[:, :n], wide[:size, n:] = goal.line, directions
        box = self.passage.section(thin(wide), self.angle)
        passed = self._soft.period if touching else self._soft.hard
        _, by = passed(box, self.steps(goal.section), self.turn, (self.angle, self.angle))
        inverse, factor = contraction(by, directions)
        inside, moved = (farthest(one, goal.line, inverse) for one in (bundle, goal.there))
        if not (arb(moved) + arb(factor) < 1 and inside < 1):
            detail = f"{inside:.2g}, then {moved:.2g} + {factor:.2g}, of a box"
            raise Unproved("attraction", f"{detail} is not within it")
        if touching:
            self._repeats(box)
        return Tendency(itinerary_of(self.steps(goal.section)), section, factor, wide)

    def _repeats(self, bundle: Bundle) -> None:
        """Prove that the periodic motions of a bundle have the run's itinerary; raises Unproved.

        All images of the bundle hold them. In a window it is open whether a guard is touched.
        """
        goal, angles = self._goal, (self.angle, self.angle)
        steps = self.steps(goal.section)
        for left in reversed(range(_IMAGES)):
            try:
                self._soft.hard(bundle, steps, self.turn, angles)
                return
            except Unproved:
                if not left:
                    raise
            moved = self._soft.moved(bundle, steps, self.turn, angles)
            bundle = grouped(moved, goal.sides, self.passage.directions)


class _Goal(NamedTuple):
    """Line of periodic motions over alpha at a section, a guess, and its image after a period.

    `sides` are directions in which a period stretches or shrinks, and `moved` is about the size in
    them of the least box about the line that a period maps into itself.
    """

    section: int
    line: Bundle
    there: Bundle
    sides: NDArray[np.float64]
    moved: float


def farthest(found: Bundle, line: Bundle, inverse: Matrix) -> float:
    """The farthest that a bundle is from a line, in units of a box's sides."""
    size = inverse.nrows()
    middle = np.zeros((size, found.shape[1]))
    middle[:, : line.shape[1]] = line[:size]
    return largest(inverse * (thin(found[:size]) - thin(middle)))


def grouped(bundle: Bundle, sides: NDArray[np.float64], directions: int) -> Bundle:
    """A bundle that contains another one, with its short columns in a box along some sides.

    Columns stay that are long, or not within the span of the sides.
    """
    size, rest = len(sides), bundle[:, directions:]
    if size > C and not np.any(bundle[C]):
        return bundle  # all are at rest, and stay so
    short = ~np.any(rest[size:], axis=0)
    short[np.argsort(-np.sum(abs(rest), axis=0), kind="stable")[:_KEPT]] = False
    held = rest[:size, short]
    box = np.zeros((len(bundle), size))
    box[:size] = sides * (np.sum(abs(np.linalg.solve(sides, held)), axis=1) * (1 + 1e-9) + 1e-30)
    if not largest(thin(box[:size]).inv() * thin(held)) <= 1:
        return bundle
    return np.column_stack([bundle[:, :directions], rest[:, ~short], box])


def _quiet(run: Trajectory) -> float:
    """Phase, in periods, farthest from a switch of the last period."""
    turn = math.tau / run.parameters.omega
    steps = steps_of(run, PERIODS - 2, PERIODS - 1)
    if not steps:
        raise Unproved("attraction", "the run from rest ends early")
    at, best, found = 0.0, -1.0, 0.0
    if steps[0].field == steps[-1].field and len(steps) > 1:
        whole = steps[0].duration + steps[-1].duration
        best, found = whole, (whole / 2 - steps[-1].duration) % turn
    for step in steps:
        if step.duration > best:
            best, found = step.duration, at + step.duration / 2
        at += step.duration
    return round(found / turn * 1024) / 1024


def _repeated(run: Trajectory, offset: float) -> list[int]:
    """Sections from which on the state is within each of some distances of the last one."""
    turn = math.tau / run.parameters.omega
    states = run([turn * (k + offset) for k in range(PERIODS - 1)])
    change = np.max(abs(states - states[-1]), axis=1)
    last = len(change) - 1
    found = []
    for tolerance in _NEAR:
        above = np.flatnonzero(change > tolerance)
        section = int(above[-1]) + 1 if above.size else 0
        if section < last:
            found.append(section)
    if not found:
        raise Unproved("attraction", "the motion from rest has not come to repeat itself")
    return found


def sides_of(by: Matrix, size: int) -> NDArray[np.float64]:
    """Sides of a box, as columns: about the directions in which a turn stretches or shrinks."""
    values, vectors = np.linalg.eig(floats(by)[:size, :size])
    return np.where(values.imag >= 0, vectors.real, vectors.imag)


def contraction(by: Matrix, sides: NDArray[np.float64]) -> tuple[Matrix, float]:
    """Matrix from a state to its place along sides, and the factor by which a turn shrinks it.

    `by` is the turn's derivative. Raises Unproved if the sides span no box.
    """
    size = len(sides)
    try:
        inverse = thin(sides).inv()
    except ZeroDivisionError:
        raise Unproved("attraction", "the sides of the box are not seen to span it") from None
    return inverse, largest(inverse * (unit(size, 3) * by * unit(3, size)) * thin(sides))
