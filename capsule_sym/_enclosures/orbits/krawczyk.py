"""Krawczyk's method for an orbit over a box of parameters, in first-order form.

Some columns are given, each about its middle with a radius (0 for a number); the others are solved
for. The solution is sought in the tube  x = x0 + X1 s + b,  s in [-1, 1]^k the place in the box of
given columns, |b| <= radii. With Y close to the inverse derivative at the middle,

    -Y F(x0) - Y (F_x X1 + F_p r) s + (1 - Y F_x) b

inside the radii proves that for every s there is exactly one solution with such a b, and that the
derivative is regular in the whole tube.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from flint import arb_mat
from numpy.typing import NDArray

from capsule_sym._enclosures.numbers.balls import (
    Ball,
    Matrix,
    Unproved,
    arb,
    bits,
    floats,
    matrix,
    spread,
    symmetric,
    thin,
    unit,
    upper,
)
from capsule_sym._enclosures.orbits.shooting import BoxValues, Shooting

_MOST_STEPS = 60
_TRIALS = 6
_CONTRACTED = 0.95
_SLACK = 1.2  # ratio of the radii to those that would map into themselves exactly


@dataclass(frozen=True)
class Tube:
    """Proved solutions of an itinerary's equations over a box of given columns.

    `solved` are the columns solved for, `moving` the k given ones with a radius. `centre` has a
    number for every column, `slopes` (columns, k) the first-order part, `radii` the remainder of
    each column, and `unique` the radii within which there is no second solution. `narrow` and
    `wide` are the equations at the centre and over the whole tube.
    """

    shooting: Shooting
    solved: tuple[int, ...]
    moving: tuple[int, ...]
    centre: tuple[Ball, ...]
    slopes: Matrix
    radii: tuple[float, ...]
    unique: tuple[float, ...]
    narrow: BoxValues
    wide: BoxValues

    def hull(self, radii: Sequence[float] | None = None) -> list[Ball]:
        """Every column over the whole tube, with the proved radii or others."""
        return _hull(self.centre, self.slopes, radii or self.radii)

    def holds(self, columns: Sequence[Ball]) -> bool:
        """True if a solution with these columns is the tube's, by its uniqueness."""
        shares = [
            (columns[at] - self.centre[at]) / self.slopes[at, k] for k, at in enumerate(self.moving)
        ]
        if not all(abs(share) <= 1 for share in shares):
            return False
        for at, (x, middle) in enumerate(zip(columns, self.centre, strict=True)):
            if at in self.moving:
                continue
            ahead = sum((self.slopes[at, k] * s for k, s in enumerate(shares)), middle)
            if not (abs(x - ahead) < self.unique[at] or (x - ahead).is_zero()):
                return False
        return True


def _hull(centre: Sequence[Ball], slopes: Matrix, radii: Sequence[float]) -> list[Ball]:
    found = []
    for i, (x, radius) in enumerate(zip(centre, radii, strict=True)):
        reach = sum((abs(slopes[i, k]) for k in range(slopes.ncols())), arb(radius))
        found.append(x + symmetric(reach.upper()) if reach > 0 else x)
    return found


def newton(
    shooting: Shooting, guess: Sequence[Ball], solved: Sequence[int], enough: float = 0.0
) -> tuple[list[Ball], BoxValues, np.ndarray]:
    """Columns of radius 0 near a solution, the equations there, and the inverse of the derivative.

    The derivative is that by the columns `solved`, which alone differ from the middle of the guess;
    its inverse is rounded. Steps no longer than `enough` are not taken. Raises Unproved if the
    iteration does not converge, or if the derivative has no inverse.
    """
    centre = [arb(arb(value).mid()) for value in guess]
    before = float("inf")
    for _ in range(_MOST_STEPS):
        there = shooting.evaluate(centre, shooting.fields(centre))
        slopes = floats(there.by)[:, list(solved)]
        try:
            inverse = np.linalg.inv(slopes)
        except np.linalg.LinAlgError as error:
            raise Unproved("existence", "the derivative at the middle is singular") from error
        if not np.all(np.isfinite(inverse)):
            raise Unproved("existence", "the derivative at the middle has no inverse")
        step = thin(inverse.astype(float)) * there.residual
        size = max(upper(step[k, 0]) for k in range(len(solved)))
        exact = max(spread(step[k, 0]) for k in range(len(solved)))
        if size <= max(4 * exact, enough) or (size >= before / 2 and before < 1e-6) or size == 0:
            return centre, there, inverse
        if not size < 1e3:
            raise Unproved("existence", "Newton's method leaves the neighbourhood of the guess")
        before = size
        for k, at in enumerate(solved):
            centre[at] = arb((centre[at] - step[k, 0]).mid())
    raise Unproved("existence", "Newton's method does not come to rest")


def enclose(shooting: Shooting, guess: Sequence[Ball], given: Mapping[int, float]) -> Tube:
    """The solutions near a guess, all columns but the given ones solved for.

    `given` has the radius of each given column about its guess. Raises Unproved if existence and
    uniqueness are not proved.
    """
    solved = tuple(k for k in range(shooting.columns) if k not in given)
    moving = [at for at, radius in given.items() if radius > 0]
    # The remainder of the first-order form is of the order of the radii squared.
    enough = 1e-3 * min((given[at] for at in moving), default=0.0) ** 2
    centre, narrow, inverse = newton(shooting, guess, solved, enough)
    size, count = len(solved), len(moving)
    Y = thin(inverse)
    slopes = matrix(shooting.columns, count)
    drive = floats(narrow.by)[:, moving] * [given[at] for at in moving]
    first = -inverse @ drive
    for k, at in enumerate(moving):
        slopes[at, k] = arb(given[at])
        for i, place in enumerate(solved):
            slopes[place, k] = arb(first[i, k])
    ahead = Y * narrow.residual
    least = np.array([upper(ahead[i, 0]) for i in range(size)])
    # A first guess of the radii: the residual's share, and a small part of the first-order part.
    reached = np.sum(np.abs(first), axis=1, initial=0.0)
    floor = 2.0 ** -min(bits(), 900)  # of the radii: below it there are roundings only
    radii = 2 * least + 1e-3 * reached + 1e-4 * np.max(reached) + floor
    signs = matrix(count, 1, ((k, 0, symmetric(1)) for k in range(count)))
    for _ in range(_TRIALS):
        whole = _hull(centre, slopes, _spread(shooting.columns, solved, radii))
        wide = shooting.evaluate(whole, shooting.fields(whole))
        by = Y * arb_mat([[row[at] for at in solved] for row in wide.by.tolist()])
        along = Y * (wide.by * slopes)
        shrink = np.array([[upper(x) for x in row] for row in (unit(size) - by).tolist()])
        moved = np.array([upper(x) for (x,) in (ahead + along * signs).tolist()])
        if not np.all(np.isfinite(shrink)):
            break
        image = image_of(moved, shrink, radii)
        if np.all(image < radii):
            found = _spread(shooting.columns, solved, image)
            unique = _spread(shooting.columns, solved, radii)
            return Tube(
                shooting, solved, tuple(moving), tuple(centre), slopes, found, unique, narrow, wide
            )
        if max(abs(np.linalg.eigvals(shrink))) > _CONTRACTED:
            break
        radii = _SLACK * np.linalg.solve(np.eye(size) - shrink, moved) + 1e-3 * radii + floor
    raise Unproved("existence", "Krawczyk's operator does not map the box into itself")


def image_of(
    moved: NDArray[np.float64], shrink: NDArray[np.float64], radii: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Radii of the image of a box: more than moved + shrink @ radii, all of them at least 0."""
    image: NDArray[np.float64] = (moved + shrink @ radii) * (1 + 1e-12) + 1e-300
    return image


def _spread(columns: int, solved: Sequence[int], radii: np.ndarray) -> tuple[float, ...]:
    found = [0.0] * columns
    for at, radius in zip(solved, radii.tolist(), strict=True):
        found[at] = radius
    return tuple(found)
