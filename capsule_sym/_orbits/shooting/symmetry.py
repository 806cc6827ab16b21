"""Orbits that are their own mirror image, by their first halves.

While the second spring exerts no force the capsule is symmetric under (x_r, v_r, v_c, tau) ->
(-x_r, -v_r, -v_c, tau + pi/omega). An orbit that is its own image meets everything twice, a switch
at the spring apart. Half of it has equations of its own, in which it happens once.

Smooth bifurcations do not break the symmetry: of two motions without contact the energy of their
difference, (x_r^2 + (v_r + v_c)^2 + gamma v_c^2)/2, never grows, since damping and friction take
from it. All multipliers are at most 1 in modulus, and for zeta > 0 there is one orbit. What breaks
the symmetry is a touch of the spring.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.admissibility import inequalities
from capsule_sym._orbits.shooting.changes import rotated
from capsule_sym._orbits.shooting.equations import Vector, shooting
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact, drift, mirror
from capsule_sym._orbits.shooting.orbit import Orbit, solve_itinerary

KEPT, BROKEN = "kept", "broken"
_SAME = 1e-7  # states of one orbit, found twice, differ by less
_SAMPLES = 16


def springless(orbit: Orbit) -> bool:
    """Whether an itinerary without contact passes the second spring, as where beta = 0 only."""
    if orbit.value("beta") != 0 or any(map(contact, orbit.itinerary.fields)):
        return False
    with backend(orbit.backend) as numbers:
        held = inequalities(numbers, orbit.itinerary, orbit.system)
    return any(one.guard is Guard.GAP and one.value < 0 for one in held)


def mirror_image(orbit: Orbit) -> bool:
    """Whether an orbit is its own mirror image: all of (x_r, v_r, v_c) reversed half a turn later.

    Over an even number of excitation periods no orbit is its own image.
    """
    if orbit.itinerary.period_number % 2 == 0:
        return False
    run, half = orbit.trajectory(), orbit.itinerary.period_number * orbit.parameters.period / 2
    begin = float(run.origin[0].phase)
    times = begin + half * np.arange(_SAMPLES) / _SAMPLES
    states, later = run(times), run(times + half)
    return bool(abs(states + later).max() < _SAME * (1 + abs(states).max()))


def whole_orbit(orbit: Orbit) -> Orbit:
    """The whole orbit of which this may be the first half; a segment keeps its index."""
    if not orbit.itinerary.mirrored:
        return orbit
    itinerary, durations = orbit.itinerary.whole, orbit.durations
    if len(itinerary) == 1:
        z = np.array([*orbit.z[:4], 2 * durations[0]])
    else:
        z = np.array([*orbit.z, *durations])
    with backend(orbit.backend) as numbers:
        system = shooting(numbers, orbit.values, itinerary, z)
    return Orbit(orbit.values, itinerary, z, system, orbit.backend, orbit.iterations)


def half_orbit(orbit: Orbit) -> Orbit | None:
    """The first half of an orbit that is its own mirror image, None of any other.

    Where beta = 0 the half is of fields without contact: the second spring exerts no force.
    """
    plain = _without_contact(orbit)
    if plain is None:
        return None
    itinerary = half_itinerary(plain.itinerary)
    if itinerary is None or not mirror_image(orbit):
        return None
    half = _first_half(plain, itinerary, plain.z)
    found = solve_itinerary(half.values, itinerary, list(half.z), backend=half.backend)
    return found if found.success else None


def halved_at(orbit: Orbit, segment: int | None) -> tuple[Orbit, int | None] | None:
    """A bifurcating orbit's first half and its segment of duration 0; None as for `half_orbit`."""
    itinerary = half_itinerary(orbit.itinerary)
    if itinerary is None or not mirror_image(orbit):
        return None
    z, n = orbit.z, len(itinerary)
    if segment is not None and segment >= n:
        turned = rotated(orbit.itinerary, z, orbit.system, n)
        z, itinerary = turned.z, replace(itinerary, segments=turned.itinerary.segments[:n])
    return _first_half(orbit, itinerary, z), None if segment is None else segment % n


def _first_half(orbit: Orbit, itinerary: Itinerary, z: Vector) -> Orbit:
    z = z[: 4 + len(itinerary)].copy()
    if len(orbit.itinerary) == 1:
        z[4] = z[4] / 2
    with backend(orbit.backend) as numbers:
        system = shooting(numbers, orbit.values, itinerary, z)
    return Orbit(orbit.values, itinerary, z, system, orbit.backend, orbit.iterations)


def half_itinerary(itinerary: Itinerary) -> Itinerary | None:
    """The itinerary of the first half, None where the second is not of the images of its fields."""
    n = len(itinerary) // 2
    if itinerary.period_number % 2 == 0 or any(contact(field) for field in itinerary.fields):
        return None
    if len(itinerary) == 1:
        return Itinerary(itinerary.segments, itinerary.period_number, mirrored=True)
    if 2 * n < len(itinerary) or itinerary.fields[n:] != tuple(map(mirror, itinerary.fields[:n])):
        return None
    return Itinerary(itinerary.segments[:n], itinerary.period_number, mirrored=True)


def _without_contact(orbit: Orbit) -> Orbit | None:
    """The orbit in fields without contact; None where the second spring exerts a force."""
    itinerary = orbit.itinerary
    if not any(contact(field) for field in itinerary.fields):
        return orbit
    if orbit.value("beta") != 0:
        return None
    switches = [
        i for i in range(len(itinerary)) if itinerary.segments[i - 1].guard is not Guard.GAP
    ]
    if not switches:
        state = orbit.trajectory()(orbit.parameters.period * itinerary.period_number)
        z = [*map(float, state), 0.0, itinerary.period_number * orbit.parameters.period]
        found = solve_itinerary(
            orbit.values, Itinerary.of((2,), itinerary.period_number), z, backend=orbit.backend
        )
        return found if found.success else None
    with backend(orbit.backend) as numbers:
        turned = rotated(orbit.itinerary, orbit.z, orbit.system, switches[0])
        fields, durations = list[int](), list[float]()
        for segment, before, h in zip(
            turned.itinerary.segments,
            turned.itinerary.rotated(-1).segments,
            turned.z[4:],
            strict=True,
        ):
            if before.guard is Guard.GAP:
                durations[-1] += h
            else:
                fields.append(2 - drift(segment.field))
                durations.append(h)
        plain = Itinerary.of(fields, itinerary.period_number)
        unknowns = np.array([*turned.z[:4], *durations])
        system = shooting(numbers, orbit.values, plain, unknowns)
    return Orbit(orbit.values, plain, unknowns, system, orbit.backend, orbit.iterations)
