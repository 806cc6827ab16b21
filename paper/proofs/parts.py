"""Parts of a subdivision: patches of the (alpha, gamma) plane, intervals of alpha, and drives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from paper.proofs.case import ALPHA, DRIVES, GAMMA, GAMMAS
from paper.proofs.segments import Interval

_OVERLAP = 1e-14  # more than the roundings of middles: neighbours overlap


BOTH = len(GAMMAS)
"""Place of both mass ratios, and all between, beside those of each."""


class Patch(NamedTuple):
    """Patch of the plane: the number of halvings of each side, and the place among the patches."""

    alpha_level: int
    alpha_place: int
    gamma_level: int
    gamma_place: int

    @property
    def area(self) -> float:
        """Share of the whole plane."""
        return 2.0 ** -(self.alpha_level + self.gamma_level)

    @property
    def middle(self) -> tuple[float, float]:
        """Alpha and gamma at the middle."""
        return _middle(ALPHA, *self[:2]), _middle(GAMMA, *self[2:])

    @property
    def radii(self) -> tuple[float, float]:
        """Half of the sides, and more than the roundings of the middles."""
        return _radius(ALPHA, self.alpha_level), _radius(GAMMA, self.gamma_level)

    def halved(self, along: Sequence[int]) -> list[Patch]:
        """Patches after halving in alpha (0) or gamma (1), all of them in each direction."""
        found = [self]
        for side in along:
            found = [half for one in found for half in one._halves(side)]
        return found

    def _halves(self, along: int) -> list[Patch]:
        a, i, g, k = self
        if along == 0:
            return [Patch(a + 1, 2 * i + half, g, k) for half in (0, 1)]
        return [Patch(a, i, g + 1, 2 * k + half) for half in (0, 1)]


class AlphaPart(NamedTuple):
    """Part of alpha in [0.001, 2] at one of the mass ratios of Section 4, or between both (2).

    Places are counted from 2 downwards: motions settle fastest there, so the share grows fast.
    """

    ratio: int
    level: int
    place: int

    @property
    def area(self) -> float:
        """Share of all alphas at both mass ratios."""
        return 2.0**-self.level / (1 if self.ratio == BOTH else len(GAMMAS))

    @property
    def alphas(self) -> Interval:
        """Values of alpha."""
        return _interval(ALPHA[::-1], self.level, self.place)

    @property
    def gammas(self) -> tuple[str, ...]:
        """Mass ratios: one, or the ends of their interval."""
        return GAMMAS if self.ratio == BOTH else GAMMAS[self.ratio : self.ratio + 1]

    def halved(self, along: Sequence[int]) -> list[AlphaPart]:
        """Both halves in alpha (0), or both mass ratios (1)."""
        ratio, level, place = self
        if along and along[0] == 1:
            if ratio != BOTH:
                raise ValueError(f"one mass ratio alone: {self}")
            return [AlphaPart(one, level, place) for one in range(len(GAMMAS))]
        return [AlphaPart(ratio, level + 1, 2 * place + half) for half in (0, 1)]


class DrivePart(NamedTuple):
    """Part of the drives in the box of `case`: alpha and omega, each halved so many times."""

    level: int
    place: int
    omega_level: int
    omega_place: int

    @property
    def area(self) -> float:
        """Share of the box."""
        return 2.0 ** -(self.level + self.omega_level)

    @property
    def alphas(self) -> Interval:
        """Values of alpha."""
        return _interval(DRIVES[0], self.level, self.place)

    @property
    def omegas(self) -> Interval:
        """Values of omega."""
        return _interval(DRIVES[1], self.omega_level, self.omega_place)

    def halved(self, along: Sequence[int]) -> list[DrivePart]:
        """Both halves along alpha (0) or omega (1)."""
        a, i, w, k = self
        if along[0] == 0:
            return [DrivePart(a + 1, 2 * i + half, w, k) for half in (0, 1)]
        return [DrivePart(a, i, w + 1, 2 * k + half) for half in (0, 1)]


class Outcome(NamedTuple):
    """Outcome of a piece: the itinerary that is proved, or the directions in which to halve it.

    `state` is the motion's state at phase 0, for the runs of its pieces, `work` the seconds of one
    core.
    """

    itinerary: str | None
    along: tuple[int, ...]
    state: tuple[float, ...] = (0.0, 0.0, 0.0)
    work: float = 0.0


def _interval(ends: tuple[float, ...], level: int, place: int) -> Interval:
    return Interval(_middle(ends, level, place), _radius(ends, level))


def _middle(ends: tuple[float, ...], level: int, place: int) -> float:
    return ends[0] + (ends[1] - ends[0]) * (2 * place + 1) * 2.0 ** -(level + 1)


def _radius(ends: tuple[float, ...], level: int) -> float:
    return abs(ends[1] - ends[0]) * 2.0 ** -(level + 1) + _OVERLAP
