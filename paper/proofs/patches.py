"""Patch of the plane proved: one stable orbit all over it, or one on each side of a curve."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

from capsule_sym import CapsuleError, Parameters, simulate
from capsule_sym._enclosures.interface import Shooting, ball, precision
from capsule_sym._orbits.interface import PARAMETERS
from capsule_sym.results import Itinerary, SteadyMotion, Trajectory
from paper.proofs.case import EXACT
from paper.proofs.curve_patches import Guess, named, prove_curve
from paper.proofs.parts import Outcome, Patch
from paper.proofs.patch_orbits import PatchOrbits, TooLarge
from paper.proofs.steady import guess_of_run

_BITS = 64
_LARGEST = 2.0**-12  # share of the plane above which a curve is not tried, as a guess
_PERIODS = ((96, 1e-6), (2048, 1e-6), (2048, 1e-4))  # of a run, and its change over a period


class _Motion(NamedTuple):
    """Motion on which a run settles."""

    run: Trajectory
    motion: SteadyMotion
    itinerary: Itinerary


def attempt(patch: Patch, state: tuple[float, ...]) -> Outcome:
    """Try to prove one stable orbit with one itinerary, all over a patch or on each side."""
    alpha, gamma = patch.middle
    along: tuple[int, ...] = (int(patch.alpha_level > patch.gamma_level),)
    middle = _settled(Parameters(alpha=alpha, gamma=gamma), state)
    if middle is None:
        return Outcome(None, along, state)
    reached = tuple(float(x) for x in middle.run.final[1])
    border = None
    try:
        corners = _corners(patch, reached)
        with precision(_BITS):
            border = _border(corners)
            if border is not None:
                along = (border,)
                if patch.area > _LARGEST:
                    return Outcome(None, along, reached)
                return Outcome(prove_curve(patch, [*map(_guess, corners.values())]), (), reached)
            shooting, guess = _guess(middle)
            orbits = PatchOrbits(shooting, guess, patch.radii)
            along = orbits.halvings()
            orbits.prove()
    except TooLarge as error:
        return Outcome(None, error.halvings if border is None else along, reached)
    except (CapsuleError, ArithmeticError, ValueError):
        return Outcome(None, along, reached)
    return Outcome(named(middle.itinerary), (), reached)


def _settled(parameters: Parameters, state: tuple[float, ...]) -> _Motion | None:
    """Motion on which a run settles, if it does."""
    for periods, change in _PERIODS:
        run = simulate(parameters, state, periods=periods)
        motion = run.steady(change)
        if motion is not None:
            return _Motion(run, motion, Itinerary.of_motion(motion))
    return None


def _guess(one: _Motion) -> Guess:
    """Equations of a motion, and their columns."""
    alpha, gamma = one.run.parameters.alpha, one.run.parameters.gamma
    values = [ball((EXACT | {"alpha": alpha, "gamma": gamma})[name]) for name in PARAMETERS]
    shooting = Shooting(one.itinerary, values, ("alpha", "gamma"))
    columns = [*guess_of_run(shooting, one.run, one.motion), ball(alpha), ball(gamma)]
    return Guess(shooting, columns)


def _corners(patch: Patch, state: tuple[float, ...]) -> dict[tuple[int, int], _Motion]:
    """Motions at a patch's corners that are found to settle, as guesses."""
    (alpha, gamma), (wide, high) = patch.middle, patch.radii
    found = {}
    for right, up in product((-1, 1), repeat=2):
        corner = Parameters(alpha=max(alpha + right * wide, 0.0), gamma=gamma + up * high)
        motion = _settled(corner, state)
        if motion is not None:
            found[right, up] = motion
    return found


def _border(corners: dict[tuple[int, int], _Motion]) -> int | None:
    """Direction in which itineraries differ more among a patch's corners, if they do.

    A guess that saves attempts that cannot succeed.
    """
    if len(corners) < 4:
        return None
    itineraries = {place: one.itinerary.cyclic for place, one in corners.items()}
    in_alpha = sum(itineraries[-1, side] != itineraries[1, side] for side in (-1, 1))
    in_gamma = sum(itineraries[side, -1] != itineraries[side, 1] for side in (-1, 1))
    return None if in_alpha == in_gamma == 0 else int(in_gamma > in_alpha)
