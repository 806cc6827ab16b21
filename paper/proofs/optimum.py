"""Average velocity of the motion from rest, proved to be nowhere larger than at one drive.

Over each part of a box of (alpha, omega) the motion from rest is proved to tend to a periodic one,
as in `attraction`, and its average velocity is enclosed. A part is proved where no velocity is
larger by more than `ROOM` than that at `BEST`, which is enclosed in the same way.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from capsule_sym import CapsuleError, Parameters, simulate
from capsule_sym._enclosures.interface import (
    Ball,
    arb,
    ball,
    precision,
    symmetric,
    thin,
    upper,
)
from capsule_sym._orbits.interface import PARAMETERS
from paper.proofs.attraction import BITS, PERIODS, Motions
from paper.proofs.case import EXACT
from paper.proofs.parts import DrivePart, Outcome
from paper.proofs.segments import Interval, Passage

BEST: Mapping[str, str] = {"alpha": "2", "omega": "0.76828901338"}
"""Drive of the largest velocity, as `optimise` found it; with a worse one less is proved."""
ROOM = 1e-6
_TURNS = 4  # between two enclosures of the velocity, while they become narrower
_SHRUNK = 0.7  # width of an enclosure, over that before, above which no more turns are tried
_STEEPER = 5.0  # change of the motion by omega, over that by alpha: a guess, for halving


def velocity(alphas: Interval, omegas: Interval, least: Ball | None = None) -> Ball:
    """Average velocities of the motions from rest, for all drives of a part; raises Unproved.

    The case study's device. Narrow, unless all of them are below `least`.
    """
    with precision(BITS):
        values = {name: ball(EXACT[name]) for name in EXACT if name != "omega"}
        values |= {"gamma": ball("3.3"), "omega": omegas.hull}
        middles = {name: float(values[name].mid()) for name in PARAMETERS if name in values}
        start = Parameters(**middles | {"alpha": alphas.middle, "omega": omegas.middle})
        motions = Motions(Passage(values, alphas, omegas=omegas), simulate(start, periods=PERIODS))
        found = motions.tendency()
        section = found.periods
        bundle, width = motions.passage.section(thin(found.box), motions.angle), float("inf")
        while True:
            bundle, displaced = motions.displaced(bundle, section)
            speed = _speed(displaced, motions.passage)
            narrow = upper(speed.rad()) > _SHRUNK * width
            if narrow or (least is not None and speed < least):
                return speed
            width = upper(speed.rad())
            for _ in range(_TURNS):
                bundle = motions.passage.moved(
                    bundle, motions.steps(section), motions.turn, motions.angle
                )


def _speed(displaced: list[Ball], passage: Passage) -> Ball:
    """Displacements over a turn, as a bundle's row, times omega/(2 pi)."""
    assert passage.omegas is not None
    middle, radius = arb(passage.omegas.middle), arb(passage.omegas.radius)
    columns = [x * middle for x in displaced]
    columns[2] += displaced[0] * radius
    rest = sum((abs(x) for x in displaced[1:]), arb(0)) * radius
    around = sum((abs(x) for x in columns[1:]), rest)
    return (columns[0] + symmetric(around.abs_upper())) / (2 * arb.pi())


@cache
def best() -> Ball:
    """Average velocity at `BEST`."""
    return velocity(*(Interval.about(BEST[name]) for name in ("alpha", "omega")))


def attempt(part: DrivePart, state: tuple[float, ...] = ()) -> Outcome:
    """Try to prove that no velocity of a part is larger than `best` by more than ROOM."""
    alphas, omegas = part.alphas, part.omegas
    along = (int(omegas.radius * _STEEPER > alphas.radius),)
    try:
        with precision(BITS):
            most = best().lower() + arb(ROOM)
            if not velocity(alphas, omegas, most) < most:
                return Outcome(None, along)
    except (CapsuleError, ArithmeticError, ValueError):
        return Outcome(None, along)
    return Outcome(f"not above {float(most.mid()):.9f}", ())
