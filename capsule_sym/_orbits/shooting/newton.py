"""Newton's method on the equations of an itinerary, in any number system."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from capsule_sym._map.backend import Backend, Number
from capsule_sym._orbits.shooting.equations import (
    ROUNDINGS,
    ShootingSystem,
    Vector,
    shooting,
    solve,
)
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym.generated.interface import Solving

_MOST_STEPS = 25
_LEAST_SCALE = 2.0**-12
_FINE = 2**13  # units of rounding in a step that is not tested further
_LOST = 0.01  # largest condition of the equations, times the unit of rounding
_BACK = 0.5  # largest negative duration of a segment, times its fastest rate


class Solution(NamedTuple):
    """Result of the iteration: unknowns, equations, status, steps, and largest residual."""

    z: Vector
    system: ShootingSystem
    solving: Solving
    steps: int
    norm: Number


def newton(
    numbers: Backend, values: tuple[Number, ...], itinerary: Itinerary, z: Vector
) -> Solution:
    """Solution near z, by damped Newton steps with the exact derivative, as in the C core."""
    system, steps = shooting(numbers, values, itinerary, z), 0

    def ended(solving: Solving) -> Solution:
        return Solution(z, system, solving, steps, _norm(system))

    if not _norm(system) < float("inf"):
        return ended(Solving.NOT_FINITE)
    for steps in range(1, _MOST_STEPS + 1):
        try:
            step = solve(numbers, system.by_z, system.residual)
        except np.linalg.LinAlgError:
            return ended(Solving.SINGULAR)
        solved = _norm(system) <= _tolerance(numbers, z)
        least = 1.0 if solved else _LEAST_SCALE
        # A solution is polished until the square of a step is rounding, if rounding allows.
        better = _step(numbers, values, itinerary, z, step, system, least)
        if better is not None:
            z, system = better
        elif solved_to_rounding(numbers, system, z):
            solved = True
        small = max(abs(step)) <= numbers.sqrt(numbers.unit) * max(1, *abs(z))
        if solved and (better is None or small or steps == _MOST_STEPS):
            lost = numbers.name != "mpmath" and _condition(system, z) * numbers.unit > _LOST
            return ended(Solving.IMPRECISE if lost else Solving.SOLVED)
        if better is None:
            break
    return ended(Solving.UNSOLVED)


def _condition(system: ShootingSystem, z: Vector) -> float:
    """Condition of the equations, with unknowns in units of the motion's size."""
    sizes = np.ones(len(z))
    sizes[:3] = abs(z[:3]).max() or 1.0
    matrix = system.by_z * sizes
    return float(np.linalg.cond(matrix / abs(matrix).max(axis=1, keepdims=True)))


def _tolerance(numbers: Backend, z: Vector) -> Number:
    """Largest entry of the residual that counts as zero."""
    tolerance = 1e-13 if numbers.name != "mpmath" else numbers.number(10) ** -50
    return tolerance * max(1, *abs(z))


def solved_to_rounding(numbers: Backend, system: ShootingSystem, z: Vector) -> bool:
    """True if each equation is solved to the rounding of its own terms.

    In a long itinerary all later segments amplify a rounding: the terms are large.
    """
    terms = numbers.unit * (abs(system.by_z) @ abs(z))
    return all(abs(system.residual) <= np.maximum(_tolerance(numbers, z), ROUNDINGS * terms))


def _step(
    numbers: Backend,
    values: tuple[Number, ...],
    itinerary: Itinerary,
    z: Vector,
    step: Vector,
    system: ShootingSystem,
    least_scale: float,
) -> tuple[Vector, ShootingSystem] | None:
    """Longest fraction of a Newton step that reduces the error; None if none does.

    The error is reduced if the residual or the next step is smaller.
    """
    scale, norm = 1.0, _norm(system)
    least = [-_BACK / flow.c.rate for flow in system.flows]
    while scale >= least_scale:
        trial = z - scale * step
        if all(h > low for h, low in zip(trial[4:], least, strict=True)):
            ahead = shooting(numbers, values, itinerary, trial)
            if _norm(ahead) < norm or _nearer(numbers, z, system, ahead, step, scale):
                return trial, ahead
        scale /= 2
    return None


def _nearer(
    numbers: Backend,
    z: Vector,
    system: ShootingSystem,
    ahead: ShootingSystem,
    step: Vector,
    scale: float,
) -> bool:
    """True if the next Newton step with the same Jacobian is certainly shorter.

    If an equation is weak, such as the balance of a small friction over a period, a step that
    solves it disturbs the others by more. The flow is affine in the states, so that only the times
    are compared: the natural monotonicity test of Deuflhard, Newton Methods for Nonlinear Problems,
    2011, Section 3.3.
    """
    size = max(abs(step[3:]))
    if not _norm(ahead) < float("inf") or size <= _FINE * numbers.unit * max(1, *abs(z[3:])):
        return False
    following = solve(numbers, system.by_z, ahead.residual)
    return bool(max(abs(following[3:])) <= (1 - scale / 2) * size)


def _norm(system: ShootingSystem) -> Number:
    return max(abs(system.residual))
