"""Branch of orbits proved without a gap: boxes of a parameter, each glued to the next.

Near a bifurcation at which a guard is touched, the inserted segment has a duration like the square
root of the distance. There this duration is the parameter, and alpha is solved for.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from capsule_sym._enclosures.interface import (
    Ball,
    Shooting,
    Signs,
    Tube,
    Unproved,
    arb,
    ball,
    enclose,
    held,
)
from paper.proofs.stable import prove

_LEAST = 1e-17  # least size of a box, relative to the rest of the interval
_GROWTH, _SHRINK = 1.4, 0.5


@dataclass(frozen=True)
class Box:
    """One box of a branch: its column, the values at its ends, and the tube that is proved."""

    column: int
    begin: float
    end: float
    tube: Tube

    def at(self, share: int) -> list[Ball]:
        """The columns at the begin (-1) or at the end (1) of the box."""
        along = share if self.end > self.begin else -share
        tube = self.tube
        return [
            x + tube.slopes[i, 0] * along + (arb(0, radius) if radius else 0)
            for i, (x, radius) in enumerate(zip(tube.centre, tube.radii, strict=True))
        ]


def march(
    shooting: Shooting,
    guess: Sequence[Ball],
    column: int,
    begin: float,
    end: float,
    *,
    step: float,
    watch: Signs,
    before: Box | None = None,
) -> Iterator[Box]:
    """Boxes of a column from one value to another, each with orbit, itinerary and stability.

    Neighbouring boxes are proved to hold the same orbit where they meet; so is the first one and
    the box `before`, if given. Raises Unproved with the place where a box cannot be proved.
    """
    sign = 1 if end > begin else -1
    at, latest = begin, before
    guess = list(guess)
    while sign * (end - at) > 0:
        length = min(step, sign * (end - at))
        ahead = end if length == sign * (end - at) else at + sign * length
        try:
            box = _box(shooting, guess, column, at, ahead, watch)
            if latest is not None:
                glue(latest, box)
        except Unproved as error:
            step = length * _SHRINK
            if step < _LEAST * max(abs(at), 1e-300) or at + sign * step == at:
                raise Unproved(
                    error.step, f"{error.detail}, at column {column} = {at!r}"
                ) from error
            continue
        yield box
        latest, at, step = box, ahead, length * _GROWTH
        guess = box.at(1)


def _box(
    shooting: Shooting, guess: Sequence[Ball], column: int, begin: float, end: float, watch: Signs
) -> Box:
    middle = (begin + end) / 2
    radius = max(abs(end - middle), abs(middle - begin)) * (1 + 2.0**-50)
    there = list(guess)
    there[column] = ball(middle)
    return Box(column, begin, end, prove(shooting, there, {column: radius}, watch=watch))


def glue(before: Box, after: Box) -> None:
    """Prove that two boxes hold the same orbit where one ends and the other begins."""
    meeting = before.at(1)
    if after.tube.holds(meeting):
        return
    column = before.column
    meeting[column] = ball(before.end)
    shooting = after.tube.shooting
    exact = enclose(shooting, meeting, {**held(shooting), column: 0.0}).hull()
    if not (before.tube.holds(exact) and after.tube.holds(exact)):
        raise Unproved("gluing", f"the orbits at column {column} = {before.end!r} may differ")
