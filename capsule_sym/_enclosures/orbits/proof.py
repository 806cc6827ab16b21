"""Columns of a found orbit, and its itinerary proved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb_mat

from capsule_sym._enclosures.numbers.balls import Ball, Matrix, arb, ball, matrix, symmetric
from capsule_sym._enclosures.orbits.krawczyk import Tube
from capsule_sym._enclosures.orbits.shooting import Node, Shooting
from capsule_sym._enclosures.passage.guards import Signs
from capsule_sym._enclosures.passage.switches import zeros
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit


def columns_of(shooting: Shooting, states: Sequence[Sequence[Any]], z: Sequence[Any]) -> list[Ball]:
    """The columns of an orbit: from its segments' start states, and forcing angle and durations."""
    angle, *durations = z
    found = [
        ball(state[row]) for state, free in zip(states, shooting.free, strict=True) for row in free
    ]
    found += [ball(h) for h in durations] + [ball(angle)]
    return found


def shooting_of(
    itinerary: Itinerary,
    values: Sequence[Any],
    varied: Sequence[str] = (),
    exact: Mapping[str, Any] | None = None,
) -> Shooting:
    """The equations of an itinerary at parameter values; `exact` replaces some of them by name."""
    given = [
        ball((exact or {}).get(name, value)) for name, value in zip(PARAMETERS, values, strict=True)
    ]
    return Shooting(itinerary, given, varied)


def guess_of(shooting: Shooting, orbit: Orbit) -> list[Ball]:
    """The columns of a found orbit."""
    found = columns_of(shooting, [[*flow.start] for flow in orbit.system.flows], list(orbit.z)[3:])
    named = dict(zip(PARAMETERS, orbit.values, strict=True))
    return found + [ball(named[name]) for name in shooting.varied]


def restarted(
    shooting: Shooting,
    columns: Sequence[Ball],
    nodes: Sequence[Node],
    other: Shooting,
    segments: Sequence[int],
    durations: Sequence[Ball],
) -> list[Ball]:
    """The columns of the orbit for equations whose segments begin where `segments` of these do."""
    given = shooting.parameters(columns)
    elapsed = sum((columns[at] for at in shooting.durations[: segments[0]]), arb(0))
    states = [[nodes[k].state[row, 0] for row in range(3)] for k in segments]
    angle = columns[shooting.angle] + given["omega"] * elapsed
    found = columns_of(other, states, [angle, *(durations[k] for k in segments)])
    return found + list(columns[shooting.unknowns :])


def held(shooting: Shooting) -> dict[int, float]:
    """Columns that an itinerary does not determine, given with radius 0.

    That is the angle, if nothing ever switches; else there is none.
    """
    return {} if shooting.itinerary.segments[0].guard else {shooting.angle: 0.0}


def affine_states(tube: Tube) -> list[Matrix]:
    """Starts of the segments over a tube, (6, k + 2): columns middle, k directions, and rest."""
    rest = matrix(len(tube.radii), 1, ((i, 0, symmetric(r)) for i, r in enumerate(tube.radii) if r))
    found = []
    for near, far in zip(tube.narrow.nodes, tube.wide.nodes, strict=True):
        by = far.by
        blocks = near.state, by * tube.slopes, by * rest
        rows = zip(*(block.tolist() for block in blocks), strict=True)
        found.append(arb_mat([[x for part in row for x in part] for row in rows]))
    return found


def prove_admissible(tube: Tube, watch: Signs | None = None, still: Sequence[int] = ()) -> None:
    """Prove that every orbit of a tube passes exactly the fields of its itinerary.

    Raises Unproved with the guard and the segment. The segments `still` have the duration 0.
    """
    watch, states, hull = watch or Signs(), affine_states(tube), tube.hull()
    for i, field in enumerate(tube.wide.fields):
        if i not in still:
            ends = states[i], states[(i + 1) % len(states)]
            orders, name = zeros(tube.wide.itinerary, i, still), f"segment {i + 1}, F{field.index}"
            watch.segment(field, *ends, hull[tube.shooting.durations[i]], orders, name)
