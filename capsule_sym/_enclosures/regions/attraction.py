"""Motion from rest, proved to tend to a periodic one for all alpha of an interval."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from capsule_sym._enclosures.case import EXACT, GAMMAS
from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    ball,
    floats,
    largest,
    matrix,
    precision,
    thin,
    unit,
)
from capsule_sym._enclosures.numbers.fields import C, at_rest
from capsule_sym._enclosures.passage.runs import itinerary_of, steps_of
from capsule_sym._enclosures.passage.segments import Bundle, Interval, Passage, Step
from capsule_sym._enclosures.regions.parts import AlphaPart, Outcome
from capsule_sym._errors import CapsuleError
from capsule_sym._map import Trajectory, simulate
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._parameters import Parameters

BITS = 80
PERIODS = 1200
_REPEATED = (1e-4, 1e-5, 1e-6, 1e-8)  # changes over a period at which a box is tried
_ROOM = 1.2  # size of the box beside the least that a contraction needs


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

    `values` are the parameters by name, decimals as text or fractions, including alpha if there is
    no interval.
    """
    alphas = alphas or Interval.about(values["alpha"])
    with precision(BITS):
        exact = {name: ball(values[name]) for name in PARAMETERS if name != "alpha"}
        given = {name: float(exact[name]) for name in exact}
        run = simulate(Parameters(alpha=alphas.middle, **given), periods=PERIODS)
        return Motions(Passage(exact, alphas), run).tendency()


def attempt(part: AlphaPart, state: tuple[float, ...] = ()) -> Outcome:
    """Try to prove the tendency of the motions from rest, for all alpha of a part."""
    gamma = GAMMAS[part.ratio]
    try:
        found = tendency(EXACT | {"gamma": gamma}, part.alphas).itinerary
    except (CapsuleError, ArithmeticError, ValueError):
        return Outcome(None, (0,))
    least = min(found[k:] + found[:k] for k in range(len(found)))
    return Outcome(f"{' '.join(f'F{field}' for field in least)}, gamma = {gamma}", ())


class Motions:
    """Motions from rest, from section to section, with a run at the middle as the guess."""

    def __init__(self, passage: Passage, run: Trajectory) -> None:
        self.passage, self.run = passage, run
        self.offset = _quiet(run)
        self.turn = passage.turn(arb(1))
        self.angle = 2 * arb.pi() * arb(self.offset)

    def steps(self, section: int) -> list[Step]:
        """The segments from one section to the next, in double precision."""
        return steps_of(self.run, section + self.offset, section + 1 + self.offset)

    def passed(self, bundle: Bundle, section: int) -> tuple[Bundle, Matrix]:
        """A bundle one period after a section, and the derivative."""
        return self.passage.period(bundle, self.steps(section), self.turn, self.angle)

    def displaced(self, bundle: Bundle, section: int) -> tuple[Bundle, list[Ball]]:
        """A bundle one period after a section, and the displacement until then, by its columns.

        For a passage with an interval of omega.
        """
        ended, _ = self.passage.carried(thin(bundle), self.steps(section), self.turn)
        return self.passage.section(ended, self.angle), ended.tolist()[-1]

    def tendency(self) -> Tendency:
        """Box that they enter; raises Unproved."""
        start = self.passage.section(matrix(3, self.passage.directions), arb(0))
        ahead = self.passage.turn(arb(self.offset))
        first = steps_of(self.run, 0, self.offset)
        bundle = self.passage.moved(start, first, ahead, self.angle)
        sections = iter(_repeated(self.run, self.offset))
        wanted = next(sections)
        section = 0
        while True:
            if section == wanted:
                try:
                    return self._entered(bundle, section)
                except Unproved:
                    following = next((one for one in sections if one > section), None)
                    if following is None:
                        raise
                    wanted = following
            bundle = self.passage.moved(bundle, self.steps(section), self.turn, self.angle)
            section += 1

    def _entered(self, bundle: Bundle, section: int) -> Tendency:
        """Prove that a bundle is in a box about its line that a period contracts."""
        steps = self.steps(section)
        if steps[0].field != steps[-1].field:
            raise Unproved("attraction", "the turn begins at a switch")
        size = 2 if at_rest(steps[0].field) else 3
        if size == 2 and np.any(bundle[C]):
            raise Unproved("attraction", "the turn does not begin at rest")
        n = self.passage.directions
        line = bundle[:3, :n]
        there, by = self.passed(self.passage.section(thin(line), self.angle), section)
        sides = sides_of(by, size)
        inverse, factor = contraction(by, sides)
        if not factor < 1:
            raise Unproved("attraction", f"the factor of the line is {factor:.3g}")
        inside, moved = (farthest(one, line, inverse) for one in (bundle, there))
        # The box: the line, and these directions, taken as exact from here on.
        directions = sides * (_ROOM * max(inside, moved / (1 - factor), 1e-12))
        wide = np.zeros((3, n + size))
        wide[:, :n], wide[:size, n:] = line, directions
        _, by = self.passed(self.passage.section(thin(wide), self.angle), section)
        inverse, factor = contraction(by, directions)
        inside, moved = (farthest(one, line, inverse) for one in (bundle, there))
        if not (arb(moved) + arb(factor) < 1 and inside < 1):
            detail = f"{inside:.2g}, then {moved:.2g} + {factor:.2g}, of a box"
            raise Unproved("attraction", f"{detail} is not within it")
        return Tendency(itinerary_of(steps), section, factor, wide)


def farthest(found: Bundle, line: Bundle, inverse: Matrix) -> float:
    """The farthest that a bundle is from a line, in units of a box's sides."""
    size = inverse.nrows()
    middle = np.zeros((size, found.shape[1]))
    middle[:, : line.shape[1]] = line[:size]
    return largest(inverse * (thin(found[:size]) - thin(middle)))


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
    """Sections at which the state repeats within each of some tolerances."""
    turn = math.tau / run.parameters.omega
    states = run([turn * (k + offset) for k in range(PERIODS - 1)])
    change = np.max(abs(np.diff(states, axis=0)), axis=1)
    last = len(change) - 1
    found = []
    for tolerance in _REPEATED:
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
