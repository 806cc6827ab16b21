"""Drift: of a steady motion, distinguished from rounding errors, and drift without end.

Drive and load may exceed friction, so that no motion is periodic. The equations of both bodies add
up to

    v_r' + (gamma + 1) v_c' = (1 - eps) u - s - F,

with F = f_plus in forward drift, -f_minus in backward drift, and F = Q between these at rest. Over
the periods of a periodic motion the left side adds up to 0. So the mean of F, which is within its
bounds, is that of (1 - eps) u - s; a cosine has none. Beyond a bound the momentum of every motion,
v_r + (gamma + 1) v_c, grows by at least the excess times the time. A capsule that always drifts one
way is at a bound: such motions differ by a constant velocity, and no branch of orbits passes there.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._map.quasistatic import load_of
from capsule_sym._parameters import CAPSULE, Scene, SceneParameters

UNIT = 2.0**-53
"""Unit roundoff of double precision."""
_ROUNDED = 8.0  # units of the largest term, by which a segment's advance may be off


def drifts(
    parameters: ArrayLike,
    contact: ArrayLike,
    progression: ArrayLike,
    way: ArrayLike,
    segments: ArrayLike,
    attracting: ArrayLike = False,
    unit: float = UNIT,
    scene: Scene = CAPSULE,
) -> NDArray[np.bool_]:
    """True for steady motions that drift; n motions of a scene's parameters by row, or one.

    Each argument has shape (n,) or is one number: `contact` is true for motions with contact;
    `progression` is the advance and `way` the length of the capsule's way, both per excitation
    period; `segments` is the number of segments of a motion; `attracting` is true for motions known
    to attract all motions near them. The result has the shape of the arguments.

    Without contact, or on a stop of zero stiffness, all forces are monotone and two motions never
    move apart. With damping, zeta > 0, two periodic motions then have the same v_r, since the
    damper would otherwise bring them together, and the same drift. The mirror image of a motion,
    half a period later, is also a motion and drifts in the other direction, so none drifts. Without
    damping their difference may also be a free oscillation that never ends. The motions between
    them are then periodic too, and neither attracts them; a motion that attracts is its own mirror
    image. In all other cases a drift counts if it is above its rounding error. The advance of a
    segment is a sum of terms of the size of the capsule's way, and over 1 + gamma of f h^2, with h
    the period and f the larger bound, a bias and a constant drive, and of alpha/omega^2.
    """
    facts, formulas = scene.facts, scene.formulas.Formulas
    p = dict(zip(facts.PARAMETERS, np.asarray(parameters, dtype=float).T, strict=True))
    bound = np.max([p[name] for name in facts.BOUNDS.values()], axis=0, initial=0.0)
    constant = bound + abs(formulas.load_force(SimpleNamespace(**p)))
    if facts.PULSED:
        levels = [formulas.drive_level(SimpleNamespace(high=high, **p)) for high in (1, 0)]
        constant = constant + np.max(np.abs(levels), axis=0)
    period = math.tau / p["omega"]
    terms = way + (constant * period**2 + p["alpha"] / p["omega"] ** 2) / (1 + p["gamma"])
    above: Any = np.abs(progression) > _ROUNDED * unit * np.asarray(segments) * terms
    soft = np.all([p[stiffness] == 0 for _, stiffness in facts.STOPS], axis=0)
    alone = ~np.asarray(contact, dtype=bool) | soft
    free = facts.SYMMETRIC & alone & ((p["zeta"] > 0) | np.asarray(attracting, dtype=bool))
    found: NDArray[np.bool_] = above & ~free
    return found


_ROUNDINGS = 2.0**-48  # share of the terms by which rounding alone may exceed a bound


def dragged(parameters: SceneParameters) -> str:
    """Message that the device is dragged; empty if the mean force is within the friction bounds."""
    force, bound, roundings = mean_force(parameters)
    if abs(force) - bound <= roundings:
        return ""
    return (
        f"the mean force of drive and load, {force:.6g}, exceeds friction, {bound:.6g}, "
        f"so that it drags the device {'forward' if force > 0 else 'backward'} without end"
    )


def mean_force(parameters: SceneParameters) -> tuple[float, float, float]:
    """Mean force of drive and load, size of the friction bound against it, and rounding error.

    All are dimensionless; a force forward is positive.
    """
    scene, values = parameters.scene, parameters.to_dict().values()
    fields = {level: field for field, level in scene.facts.LEVELS.items()}
    levels = [scene.kernels.constants(fields[level], *values) for level in sorted(fields)]
    share = levels[0].high_share() if scene.facts.PULSED else 1.0
    shares = (share, 1.0 - share)
    terms = [part * load_of(c) for part, c in zip(shares, levels, strict=False)]
    force = sum(terms)
    bound = abs(levels[0].friction_at(1 if force > 0 else -1))
    size = bound + abs(levels[0].load_force()) + sum(map(abs, terms))
    return force, bound, _ROUNDINGS * size
