"""Motion from rest at parameters given as decimals, and the orbit on which it settles.

Statements here are proved for the exact decimals; a run in double precision gives the guesses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from capsule_sym import Parameters, simulate
from capsule_sym._enclosures.interface import (
    Ball,
    Shooting,
    Tube,
    Unproved,
    V,
    arb,
    columns_of,
    enclose_run,
    precision,
    shooting_of,
)
from capsule_sym._orbits.interface import PARAMETERS
from capsule_sym.results import Itinerary, SteadyMotion, Trajectory
from paper.proofs.stable import prove

_BITS = 192
_PERIODS, _REPEATED = 512, (1e-9, 1e-6, 1e-4)  # changes over a period, as guesses


@dataclass(frozen=True)
class SteadyOrbit:
    """Stable orbit of one excitation period, proved: the fields of its segments in order of time.

    `speeds` bounds v_r where each segment begins, `state` is (x_r, v_r, v_c) at omega tau = 0,
    rounded.
    """

    fields: tuple[int, ...]
    speeds: tuple[tuple[Fraction, Fraction], ...]
    state: tuple[float, ...]


def steady_orbit(values: Mapping[str, str]) -> SteadyOrbit:
    """Stable orbit near which the motion from rest settles; raises Unproved.

    `values` are the parameters by name, as decimals. It is not proved that the motion from
    rest tends to it: see `attraction`.
    """
    run = simulate(_rounded(values), periods=_PERIODS)
    motion = next(filter(None, map(run.steady, _REPEATED)), None)
    if motion is None or motion.period_number != 1:
        raise Unproved("search", "the motion from rest does not settle on one period")
    itinerary = Itinerary.of_motion(motion)
    with precision(_BITS):
        shooting = shooting_of(itinerary, [values[name] for name in PARAMETERS])
        tube = prove(shooting, guess_of_run(shooting, run, motion), {})
        speeds = tuple(_bounds(node.state[V, 0]) for node in tube.wide.nodes)
        return SteadyOrbit(itinerary.fields, speeds, _at_crest(tube))


def guess_of_run(shooting: Shooting, run: Trajectory, motion: SteadyMotion) -> list[Ball]:
    """Unknowns of the motion at the end of a run, without the varied parameters."""
    omega = run.parameters.omega
    if len(motion.segments) == 1:
        return columns_of(shooting, [run.final[1]], [0.0, math.tau / omega])
    states = [segment.start_state for segment in motion.segments]
    angle = omega * float(motion.segments[0].start.phase)
    return columns_of(shooting, states, [angle, *(one.duration for one in motion.segments)])


def first_fields(values: Mapping[str, str]) -> tuple[int, ...]:
    """Fields of the motion from (0, 0, 0) at tau = 0 within one period; raises Unproved."""
    run = simulate(_rounded(values), periods=1)
    enclose_run(run, values)
    return tuple(segment.field for segment in run.segments)


def _rounded(values: Mapping[str, str]) -> Parameters:
    return Parameters(**{name: float(values[name]) for name in PARAMETERS})


def _bounds(value: Ball) -> tuple[Fraction, Fraction]:
    """Rational numbers that enclose a ball."""
    ends = (end.man_exp() for end in (value.lower(), value.upper()))
    low, high = (Fraction(int(man)) * Fraction(2) ** int(exp) for man, exp in ends)
    return low, high


def _at_crest(tube: Tube) -> tuple[float, ...]:
    """State at the instant at which the forcing angle is a whole number of turns."""
    shooting, hull = tube.shooting, tube.hull()
    omega, angle = shooting.parameters(hull)["omega"], hull[shooting.angle]
    crest = 2 * arb.pi() * math.ceil(float(angle.mid()) / math.tau)
    for at, field, node in zip(shooting.durations, tube.wide.fields, tube.wide.nodes, strict=True):
        ahead = (crest - angle) / omega
        if not ahead > hull[at]:
            state = field.flow(ahead) * node.state
            return tuple(float(state[row, 0].mid()) for row in range(2 if field.stick else 3)) + (
                (0.0,) if field.stick else ()
            )
        angle += omega * hull[at]
    raise Unproved("search", "the orbit is shorter than a period")
