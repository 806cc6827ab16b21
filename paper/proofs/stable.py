"""Orbits over a box of parameters proved, with stability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from capsule_sym._enclosures.interface import (
    Ball,
    BoxValues,
    Characteristic,
    Shooting,
    Signs,
    Tube,
    Unproved,
    characteristic,
    enclose,
    held,
    monodromy,
    prove_admissible,
)


def prove_stable(found: BoxValues) -> Characteristic:
    """Prove that every orbit attracts its neighbours, or raise Unproved."""
    proved = characteristic(monodromy(found))
    for number, value in enumerate(proved.jury, 1):
        if not value > 0:
            raise Unproved("stability", f"Jury's condition {number} is not proved: {value.str(3)}")
    return proved


def prove(
    shooting: Shooting,
    guess: Sequence[Ball],
    given: Mapping[int, float],
    *,
    stable: bool = True,
    watch: Signs | None = None,
) -> Tube:
    """Orbits near a guess over a box of given columns, with itinerary and optionally stability.

    Raises Unproved with the step that failed.
    """
    tube = enclose(shooting, guess, {**held(shooting), **given})
    prove_admissible(tube, watch)
    if stable:
        prove_stable(tube.wide)
    return tube
