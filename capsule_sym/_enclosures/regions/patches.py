"""One patch of the (alpha, gamma) plane: where it is, and the attempt to prove it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from time import process_time
from typing import NamedTuple

from capsule_sym._enclosures.case import ALPHA, EXACT, GAMMA
from capsule_sym._enclosures.numbers.balls import ball, precision
from capsule_sym._enclosures.orbits.shooting import Shooting
from capsule_sym._enclosures.orbits.steady import guess_of_run
from capsule_sym._enclosures.regions.patch_orbits import PatchOrbits, TooLarge
from capsule_sym._errors import CapsuleError
from capsule_sym._map import simulate
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._parameters import Parameters

_BITS = 64
_PERIODS = ((96, 1e-6), (2048, 1e-6), (2048, 1e-4))  # of a run, and its change over a period
_OVERLAP = 1e-14


class Patch(NamedTuple):
    """A patch: how often each side was halved, and which of the parts it is."""

    alpha_level: int
    alpha_place: int
    gamma_level: int
    gamma_place: int

    @property
    def area(self) -> float:
        """The share of the whole plane."""
        return 2.0 ** -(self.alpha_level + self.gamma_level)

    @property
    def middle(self) -> tuple[float, float]:
        """Alpha and gamma at the middle."""
        return (
            _middle(ALPHA, self.alpha_level, self.alpha_place),
            _middle(GAMMA, self.gamma_level, self.gamma_place),
        )

    @property
    def radii(self) -> tuple[float, float]:
        """Half of the sides, and more than the roundings of the middles: neighbours overlap."""
        return (
            (ALPHA[1] - ALPHA[0]) * 2.0 ** -(self.alpha_level + 1) + _OVERLAP,
            (GAMMA[1] - GAMMA[0]) * 2.0 ** -(self.gamma_level + 1) + _OVERLAP,
        )

    def halved(self, along: Sequence[int]) -> list[Patch]:
        """The parts after halving in alpha (0) or gamma (1), all of them in each direction."""
        found = [self]
        for side in along:
            found = [half for one in found for half in one._halves(side)]
        return found

    def _halves(self, along: int) -> tuple[Patch, Patch]:
        a, i, g, k = self
        if along == 0:
            return Patch(a + 1, 2 * i, g, k), Patch(a + 1, 2 * i + 1, g, k)
        return Patch(a, i, g + 1, 2 * k), Patch(a, i, g + 1, 2 * k + 1)


def _middle(ends: tuple[float, float], level: int, place: int) -> float:
    return ends[0] + (ends[1] - ends[0]) * (2 * place + 1) * 2.0 ** -(level + 1)


class Outcome(NamedTuple):
    """What became of a patch: the itinerary that is proved, or the directions in which to halve it.

    `state` is where the motion is at phase 0, for the runs of its parts, `work` the seconds of
    one core.
    """

    itinerary: str | None
    along: tuple[int, ...]
    state: tuple[float, ...]
    work: float = 0.0


def attempt(patch: Patch, state: tuple[float, ...]) -> Outcome:
    """Try to prove one stable orbit with one itinerary all over a patch."""
    begin = process_time()
    outcome = _attempt(patch, state)
    return outcome._replace(work=process_time() - begin)


def _attempt(patch: Patch, state: tuple[float, ...]) -> Outcome:
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
    """The direction in which itineraries differ more among a patch's corners, if they do.

    A guess, that spares attempts which cannot succeed.
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
