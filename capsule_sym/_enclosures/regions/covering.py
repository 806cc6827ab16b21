"""Every motion, proved to tend to one periodic orbit, where the capsule comes to rest for good.

A trap holds every motion in the end (`trapping`). Its states at phase 0 are covered by
parallelograms, and each is carried, period by period, until it is in a box that a period contracts.
No itinerary is needed: while a parallelogram is on both sides of the gap, the force of the second
spring, which is convex there, is a chord and a ball, and the ball becomes more sides. Where a
parallelogram is not carried into the box, its start is divided into four.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    ball,
    floats,
    largest,
    precision,
    thin,
    upper,
)
from capsule_sym._enclosures.numbers.fields import at_rest
from capsule_sym._enclosures.passage.runs import itinerary_of, steps_of
from capsule_sym._enclosures.passage.segments import Bundle, Interval, Passage
from capsule_sym._enclosures.regions.attraction import contraction, farthest, sides_of
from capsule_sym._enclosures.regions.trapping import Trap, trap
from capsule_sym._map import simulate
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._parameters import Parameters

ALPHAS = ("0.005", "0.02")
"""Amplitudes in the first two regimes of Section 4, at both mass ratios."""
_BITS = 80
_SETTLED = 400  # periods of the run that guesses the orbit
_TURNS = 4  # periods of which the box is seen to be contracted
_RADII = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4)
_INSIDE = 1 - 1e-6  # of a box, of which doubles are sure
_STEPS = 256  # of a period
_ORDER = 9  # of a step's Taylor polynomial
_LOST = 2.0**-36
"""More than a step loses of states below `_LARGEST`: its matrix times its length is below 1/4, so
that 4 (1/4)^10/10! e^(1/4) bounds the rest of the series; and it takes fewer than 2^12 operations
on numbers below 4, of which each loses less than 2^-51."""
_LARGEST = 3.0
_FIRST = 16  # parallelograms along each axis to begin with
_PERIODS = 32  # after which a parallelogram is divided
_DEEPEST = 8  # divisions
_MANY = 128  # parallelograms carried together
_DIRECTIONS = 16  # of the sides that errors become after a period
_WIDE = 4  # growth of a parallelogram at which it is divided

Doubles = NDArray[np.float64]


@dataclass(frozen=True)
class Covering:
    """A periodic orbit, by its itinerary, to which every motion is proved to tend.

    `cells` parallelograms cover the trap, and each is in the contracted box after some periods, at
    most `periods`.
    """

    itinerary: tuple[int, ...]
    trap: Trap
    target: Target
    cells: int
    periods: int


def covering(values: Mapping[str, object]) -> Covering:
    """What every motion tends to; raises Unproved.

    `values` are the seven parameters by name, decimals as text or fractions.
    """
    with precision(_BITS):
        exact = {name: ball(values[name]) for name in PARAMETERS}
        held, near = trap(exact), target(exact)
        resting = _Resting({name: float(exact[name]) for name in exact}, held)
        cells, periods = resting.carried(near)
    return Covering(near.itinerary, held, near, cells, periods)


def record(values: Mapping[str, str]) -> dict[str, Any]:
    """What is proved at parameters given as decimals, as plain data; `failed` says why not."""
    begin = process_time()
    told: dict[str, Any] = {name: values[name] for name in ("alpha", "gamma")}
    try:
        found = covering(values)
    except Unproved as error:
        return told | {"failed": str(error)}
    told |= {"itinerary": [f"F{field}" for field in found.itinerary], "cells": found.cells}
    told |= {"periods": found.periods, "force": found.trap.force, "level": found.trap.level}
    return told | {"failed": "", "seconds": round(process_time() - begin, 1)}


@dataclass(frozen=True)
class Target:
    """The states (x_r, v_r) at phase 0 with |inverse (state - middle)| <= radius, capsule at rest.

    Some periods carry them into themselves and shrink their distances at least by `factor`.
    """

    itinerary: tuple[int, ...]
    middle: Doubles
    inverse: Doubles
    radius: float
    factor: float

    def holds(self, middle: Doubles, sides: Doubles) -> NDArray[np.bool_]:
        """Which sets of a middle (n, 2) and sides (n, 2, m) are in it."""
        off = abs((middle - self.middle) @ self.inverse.T)
        reach = np.sum(abs(self.inverse @ sides), axis=2)
        return np.asarray(np.all(off + reach <= self.radius * _INSIDE, axis=1))


def target(values: Mapping[str, Ball]) -> Target:
    """As large a box about the orbit near which the motion from rest settles as is contracted."""
    given = {name: float(values[name]) for name in PARAMETERS}
    run = simulate(Parameters(**given), periods=_SETTLED + _TURNS + 1)
    steps = steps_of(run, _SETTLED, _SETTLED + _TURNS)
    rests = all(at_rest(step.field) for step in steps)
    if not rests or steps[0].field != steps[-1].field:
        raise Unproved("covering", "no orbit with the capsule at rest is found")
    turns = _TURNS * 2 * arb.pi() / values["omega"]
    passage = Passage(values, Interval(given["alpha"], upper(values["alpha"] - given["alpha"])))
    line = np.zeros((3, 4))
    line[:2, 0] = run([_SETTLED * math.tau / given["omega"]])[0][:2]

    def turned(sides: Doubles) -> tuple[Bundle, Matrix]:
        line[:2, 2:] = sides
        return passage.period(passage.section(thin(line), arb(0)), steps, turns, arb(0))

    there, by = turned(np.zeros((2, 2)))
    sides = sides_of(by, 2)
    inverse, _ = contraction(by, sides)
    shift = farthest(there, line[:, :2], inverse)
    for radius in _RADII:
        try:
            _, factor = contraction(turned(sides * radius)[1], sides)
        except Unproved:
            continue
        if arb(shift) / radius + arb(factor) < 1:
            near = floats(inverse)
            if not largest(inverse - thin(near)) < 1e-12:
                raise Unproved("covering", "the sides of the box are nearly parallel")
            turn = steps_of(run, _SETTLED, _SETTLED + 1)
            return Target(itinerary_of(turn), line[:2, 0].copy(), near, radius, factor)
    raise Unproved("covering", "no box about the orbit is seen to be contracted")


class _Resting:
    """The capsule at rest, and the inner mass between its springs, in parallelograms of states."""

    def __init__(self, values: Mapping[str, float], held: Trap) -> None:
        self.values, self.trap = values, held
        self.step = math.tau / values["omega"] / _STEPS
        norm = 3 + values["beta"] + 2 * values["zeta"]
        if not (norm * self.step < 1 / 4 and values["omega"] < 1 and held.speed < 1):
            raise Unproved("covering", "the steps are too long for their bounds")
        self.growth = math.exp(norm * self.step)
        angles = [arb(2 * k) / _STEPS for k in range(_STEPS)]
        self.force = [
            tuple(values["alpha"] * float(x) for x in (angle.cos_pi(), angle.sin_pi()))
            for angle in angles
        ]

    def carried(self, target: Target) -> tuple[int, int]:
        """How many parallelograms cover the trap, all carried into a target, and the most periods.

        Raises Unproved with a start that is not.
        """
        trap, sides = self.trap, np.array([1.0, 1.0]) / _FIRST
        half = np.array([(trap.ahead + trap.back) / 2, trap.speed]) * sides
        middle = np.array([(trap.ahead - trap.back) / 2, 0.0])
        places = np.arange(1 - _FIRST, _FIRST, 2)
        starts = np.array([middle + half * (i, j) for i in places for j in places])
        cells = longest = 0
        half *= 1 + 1e-9  # neighbours overlap
        for _ in range(_DEEPEST + 1):
            starts = starts[self._lowest(starts, half) <= trap.level]
            cut = range(0, len(starts), _MANY)
            found = np.concatenate([self._into(target, starts[k : k + _MANY], half) for k in cut])
            cells += int(np.sum(found >= 0))
            longest = max(longest, int(np.max(found)))
            starts = starts[found < 0]
            if not len(starts):
                return cells, longest
            half = half / 2
            starts = np.concatenate([starts + half * side for side in _QUARTERS])
            half = half * (1 + 1e-9)
        x, v = starts[0].tolist()
        raise Unproved("covering", f"motions from x_r = {x:.6g}, v_r = {v:.6g} are not carried in")

    def _lowest(self, starts: Doubles, half: Doubles) -> Doubles:
        """A bound on W from below, all over rectangles."""
        zeta, beta, delta = (self.values[name] for name in ("zeta", "beta", "delta"))
        x, v = starts.T
        near = np.maximum(abs(x) - half[0], 0)
        inner = np.maximum(abs(v + zeta * x) - half[1] - zeta * half[0], 0)
        beyond = np.maximum(x - half[0] - delta, 0)
        whole = inner**2 + (1 + zeta**2) * near**2 + beta * beyond**2
        return np.asarray(whole / 2 * (1 - 1e-9))

    def _into(self, target: Target, starts: Doubles, half: Doubles) -> NDArray[np.int64]:
        """The periods after which rectangles are in a target; -1 where they are not carried in."""
        found = np.full(len(starts), -1)
        left = np.arange(len(starts))
        middle, sides = starts, np.tile(np.diag(half), (len(starts), 1, 1))
        for period in range(_PERIODS + 1):
            inside = target.holds(middle, sides)
            found[left[inside]] = period
            kept = ~inside & np.all(np.sum(abs(sides), axis=2) < _WIDE * np.max(half), axis=1)
            left, middle, sides = left[kept], middle[kept], sides[kept]
            if not len(left):
                break
            middle, sides = self._period(middle, sides)
        return found

    def _period(self, middle: Doubles, sides: Doubles) -> tuple[Doubles, Doubles]:
        """Parallelograms after a period: where all motions are that begin in them in the trap."""
        count, most = sides.shape[2], np.zeros(len(middle))
        whole = np.zeros((len(middle), 2, count + 2 * _STEPS))
        whole[:, :, :count] = sides
        for force in self.force:
            now = whole[:, :, :count]
            around = np.sum(abs(now), axis=2)
            most = np.maximum(most, np.max(abs(middle) + around, axis=1))
            flow, middle, error = self._moved(middle, around, force)
            whole[:, :, :count] = flow @ now
            whole[:, 0, count], whole[:, 1, count + 1] = error
            count += 2
        found = np.concatenate([whole[:, :, :2], _fewer(whole[:, :, 2:])], axis=2)
        found[~(most < _LARGEST)] = np.inf
        return middle, found

    def _moved(
        self, middle: Doubles, around: Doubles, force: tuple[float, ...]
    ) -> tuple[Doubles, Doubles, tuple[Doubles, Doubles]]:
        """Of a step its matrix, the middles after it, and an error in x_r and v_r.

        States are within `around` of `middle`, and their motions in the trap.
        """
        h = self.step
        zeta = self.values["zeta"]
        (x, v), (wide, high) = middle.T, around.T
        stiff, constant, ball = self._spring(x, v, wide, high)
        size = len(middle)
        term = np.zeros((3, 2, size))  # of the middle, and of both directions
        term[0], term[1, 0], term[2, 1] = (x, v), 1, 1
        total = term.copy()
        steady, quadrature = force
        for k in range(_ORDER):
            rate = -2 * zeta * term[:, 1] - stiff * term[:, 0]
            rate[0] += steady + (constant if k == 0 else 0)
            term = np.stack([term[:, 1], rate], axis=1) * (h / (k + 1))
            omega = self.values["omega"] * h / (k + 1)
            steady, quadrature = -omega * quadrature, omega * steady
            total += term
        error = ball * (h * self.growth)
        flow = np.moveaxis(total[1:], 2, 0).swapaxes(1, 2)
        return flow, total[0].T, (error * (h / 2) + _LOST, error + _LOST)

    def _spring(
        self, x: Doubles, v: Doubles, wide: Doubles, high: Doubles
    ) -> tuple[Doubles, Doubles, Doubles]:
        """Both springs along a step as (stiffness) x - (constant) + what is within a ball.

        A chord of the second spring's force is above it, at delta farthest, on the other side of
        which it is 0.
        """
        h, delta, beta = self.step, self.values["delta"], self.values["beta"]
        alpha, zeta, speed = self.values["alpha"], self.values["zeta"], self.trap.speed
        most = alpha + 2 * zeta * speed + (1 + beta) * (abs(x) + wide + h * speed)
        bend = most * h**2 / 2 + _LOST  # |v_r'| is at most `most`
        low = x - wide + np.minimum(h * (v - high), 0) - bend
        top = x + wide + np.maximum(h * (v + high), 0) + bend
        both = (low < delta) & (top > delta)
        share = np.where(both, (top - delta) / (top - low), low >= delta)
        gap = np.where(both, share * (delta - low), 0)
        begin = np.where(both, low, delta)
        return 1 + beta * share, beta * (share * begin + gap / 2), beta * gap / 2


_QUARTERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


def _fewer(sides: Doubles) -> Doubles:
    """Sides that span no less: each is split along the nearest of some directions and across it."""
    angles = np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS)
    along = np.stack([np.cos(angles), np.sin(angles)])
    across = np.stack([-along[1], along[0]])
    length = abs(np.einsum("dk,ndm->nkm", along, sides))
    rest = abs(np.einsum("dk,ndm->nkm", across, sides))
    nearest = length == np.max(length, axis=1, keepdims=True)
    length = np.sum(np.where(nearest, length, 0), axis=2)
    rest = np.sum(np.where(nearest, rest, 0), axis=2) + 1e-12 * length
    length = length * (1 + 1e-12) + 1e-12 * rest
    return np.concatenate([along * length[:, None, :], across * rest[:, None, :]], axis=2)
