"""Identity of orbits, and those that are their own mirror image, solved by their first halves.

Without a load, with equal friction bounds, and while a single stop exerts no force or two stops are
equal, the capsule is symmetric under (x_r, v_r, v_c, tau) -> (-x_r, -v_r, -v_c, tau + pi/omega). On
an orbit that is its own image every event happens twice, except a switch at a single stop. In the
equations of its half it happens once.

Between two stops a smooth bifurcation breaks the symmetry where the half's map has a multiplier -1.
Without contact this cannot happen: the energy of the difference of two such motions, (x_r^2 + (v_r
+ v_c)^2 + gamma v_c^2)/2, never grows, since damping and friction reduce it. All multipliers are at
most 1 in modulus, and for zeta > 0 there is one orbit. Its symmetry is broken by a touch of a
single stop.
"""

from __future__ import annotations

from dataclasses import replace
from math import gcd

import numpy as np
from numpy.typing import NDArray

from capsule_sym._orbits.shooting.changes import rotated
from capsule_sym._orbits.shooting.equations import Vector, shooting
from capsule_sym._orbits.shooting.itinerary import Itinerary, contact, mirror
from capsule_sym._orbits.shooting.orbit import Orbit, solve_itinerary
from capsule_sym._parameters import SceneParameters

KEPT, BROKEN = "kept", "broken"
_SAME = 1e-7  # states of an orbit found twice differ by less
_SAMPLES = 16


def touches(itinerary: Itinerary) -> bool:
    """True if a segment is in contact."""
    return any(contact(field, itinerary.scene) for field in itinerary.fields)


def symmetric(parameters: SceneParameters) -> bool:
    """True if motions have mirror images; with one stop those without contact.

    Both friction bounds are equal, there is no load, two stops are equal, and pulses are as long
    and as high as the intervals between them.
    """
    scene = parameters.scene
    fields = scene.facts.FIELDS
    c = scene.kernels.constants(next(iter(fields)), *parameters.to_dict().values())
    alike = c.load_force() == 0 and c.friction_at(1) == -c.friction_at(-1)
    stops = [[getattr(parameters, name) for name in stop] for stop in scene.facts.STOPS]
    if scene.facts.PULSED:
        low = c._replace(high=1 - c.high)
        alike = alike and c.high_share() == 1 / 2 and c.drive_level() == -low.drive_level()
    return bool(alike and stops[0] == stops[-1])


def mirror_image(orbit: Orbit) -> bool:
    """True if an orbit is its own mirror image: (x_r, v_r, v_c) is reversed half a period later.

    Over an even number of excitation periods no orbit is its own image.

    Parameters
    ----------
    orbit : Orbit
        A solved orbit, whose `success` is True. A first half, as `half_orbit` gives, stands for its
        whole orbit.

    Returns
    -------
    bool
        True if the states of both halves are opposite at 16 times, within 1e-7 times 1 plus the
        largest entry of the states.

    Raises
    ------
    InvalidInput
        For an orbit that was not found, a `NoOrbit`.

    See Also
    --------
    half_orbit : the first half of such an orbit.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> free = cs.Parameters(alpha=1.2, delta=10.0)  # without contact
    >>> cs.orbits.mirror_image(cs.solve_orbit(free))
    True
    >>> cs.orbits.mirror_image(cs.solve_orbit(cs.Parameters(alpha=0.9)))
    False
    """
    orbit = whole_orbit(orbit)
    if orbit.itinerary.period_number % 2 == 0:
        return False
    run, half = orbit.trajectory(), orbit.itinerary.period_number * orbit.parameters.period / 2
    begin = float(run.origin[0].phase)
    times = begin + half * np.arange(_SAMPLES) / _SAMPLES
    states, later = run(times), run(times + half)
    return bool(abs(states + later).max() < _SAME * (1 + abs(states).max()))


def whole_orbit(orbit: Orbit) -> Orbit:
    """Whole orbit, if this is the first half, whose segments keep their indices.

    Parameters
    ----------
    orbit : Orbit
        A solved orbit, or the first half of one, as `half_orbit` gives.

    Returns
    -------
    Orbit
        The whole orbit; the given one if it is whole.

    Raises
    ------
    InvalidInput
        For an orbit that was not found, a `NoOrbit`.

    See Also
    --------
    half_orbit : the first half.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=1.2, delta=10.0))
    >>> whole = cs.orbits.whole_orbit(cs.orbits.half_orbit(orbit))
    >>> print(whole.itinerary, abs(whole.z - orbit.z).max() < 1e-12)
    F1 F3 True
    """
    if not orbit.itinerary.mirrored:
        return orbit
    itinerary, durations = orbit.itinerary.whole, orbit.durations
    if orbit.itinerary.segments[0].guard is None:
        z = np.array([*orbit.z[:4], 2 * durations[0]])
    else:
        z = np.array([*orbit.z, *durations])
    return _evaluated(orbit, itinerary, z)


def half_orbit(orbit: Orbit) -> Orbit | None:
    """First half of an orbit that is its own mirror image, None for any other.

    The equations of the half have each event once, where the whole orbit has it twice.

    Parameters
    ----------
    orbit : Orbit
        A solved orbit, whose `success` is True; not a half itself.

    Returns
    -------
    Orbit or None
        The first half, whose `itinerary.mirrored` is True. None if the orbit is not its own image,
        or touches a single stop. It is also None if the parameters are not symmetric, or if the
        equations of the half are not solved.

    Raises
    ------
    InvalidInput
        For an orbit that was not found, a `NoOrbit`.

    See Also
    --------
    mirror_image : the test of the symmetry.
    whole_orbit : the whole orbit from its half.

    Notes
    -----
    Parameters are symmetric if there is no load and both friction bounds are equal. Two stops have
    to be equal. Pulses have to be as long and as high as the intervals between them.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=1.2, delta=10.0))  # without contact
    >>> half = cs.orbits.half_orbit(orbit)
    >>> orbit.durations.round(6).tolist(), half.durations.round(6).tolist()
    ([3.926991, 3.926991], [3.926991])
    >>> print(cs.orbits.half_orbit(cs.solve_orbit(cs.Parameters(alpha=0.9))))
    None
    """
    half, _ = halved_at(orbit, None) or (None, None)
    if half is None:
        return None
    found = solve_itinerary(half.values, half.itinerary, list(half.z), backend=half.backend)
    return found if found.success else None


def halved_at(orbit: Orbit, segment: int | None) -> tuple[Orbit, int | None] | None:
    """First half of a bifurcating orbit and its segment of duration 0; None as for `half_orbit`."""
    itinerary = half_itinerary(orbit.itinerary)
    if itinerary is None or not symmetric(orbit.parameters) or not mirror_image(orbit):
        return None
    z, n = orbit.z, len(itinerary)
    if segment is not None and segment >= n:
        turned = rotated(orbit.numbers, orbit.itinerary, z, orbit.system, n)
        z, itinerary = turned.z, replace(itinerary, segments=turned.itinerary.segments[:n])
    z = z[: 4 + n].copy()
    if len(orbit.itinerary) == 1:
        z[4] = z[4] / 2
    return _evaluated(orbit, itinerary, z), None if segment is None else segment % n


def half_itinerary(itinerary: Itinerary) -> Itinerary | None:
    """Itinerary of the first half; None if the second half's fields are not its mirror image.

    It is also None for an even period number, and for contact with a single stop.
    """
    n = len(itinerary) // 2
    scene, alone = itinerary.scene, len(itinerary.scene.facts.STOPS) == 1
    if itinerary.period_number % 2 == 0 or (alone and touches(itinerary)):
        return None
    if len(itinerary) == 1:
        return replace(itinerary, mirrored=True)
    images = tuple(mirror(field, scene) for field in itinerary.fields[:n])
    if 2 * n < len(itinerary) or itinerary.fields[n:] != images:
        return None
    return replace(itinerary, segments=itinerary.segments[:n], mirrored=True)


def _evaluated(orbit: Orbit, itinerary: Itinerary, z: Vector) -> Orbit:
    """Orbit with other unknowns, of another itinerary."""
    system = shooting(orbit.numbers, orbit.values, itinerary, z)
    return replace(orbit, itinerary=itinerary, z=z, system=system)


def same(orbit: Orbit, other: Orbit) -> bool:
    """True if two orbits are equal, also if they begin at different switches."""
    if orbit.itinerary.period_number != other.itinerary.period_number or len(
        orbit.itinerary
    ) != len(other.itinerary):
        return False
    return any(
        orbit.itinerary.fields == other.itinerary.rotated(i).fields and _alike(orbit, 0, other, i)
        for i in range(len(other.itinerary))
    )


def same_start(orbit: Orbit, other: Orbit) -> bool:
    """True if two orbits of one itinerary begin in the same state."""
    return orbit.itinerary == other.itinerary and _alike(orbit, 0, other, 0)


def primitive(orbit: Orbit) -> Orbit:
    """The orbit traversed once: that of the shortest itinerary that it repeats."""
    itinerary, most = orbit.itinerary, gcd(len(orbit.itinerary), orbit.itinerary.period_number)
    for times in range(most, 1, -1):
        count = len(itinerary) // times
        if most % times or itinerary.fields != itinerary.fields[:count] * times:
            continue
        turns = itinerary.period_number // times
        once = Itinerary(itinerary.segments[:count], turns, scene=itinerary.scene)
        found = solve_itinerary(
            orbit.values, once, list(orbit.z[: 4 + count]), backend=orbit.backend
        )
        if found.success and all(_alike(orbit, i, found, i % count) for i in range(len(itinerary))):
            return found
    return orbit


def _alike(orbit: Orbit, segment: int, other: Orbit, its: int) -> bool:
    one, two = _place(orbit, segment), _place(other, its)
    return bool(abs(one - two).max() < _SAME * (1 + abs(one).max()))


def _place(orbit: Orbit, segment: int) -> NDArray[np.float64]:
    """State and forcing at a segment's start."""
    flow = orbit.system.flows[segment]
    angle = float(flow.angle)
    return np.array([*flow.start, np.cos(angle), np.sin(angle)], dtype=float)
