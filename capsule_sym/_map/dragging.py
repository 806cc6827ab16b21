"""Drift without end: drive and load exceed friction, so that no motion is periodic.

The equations of both bodies add up to

    v_r' + (gamma + 1) v_c' = (1 - eps) u - s - F,

with F = f_plus in forward drift, -f_minus in backward drift, and F = Q between these at rest. Over
the periods of a periodic motion the left side adds up to 0. So the mean of F, which is within its
bounds, is that of (1 - eps) u - s; a cosine has none. Beyond a bound the momentum of every motion,
v_r + (gamma + 1) v_c, grows by at least the excess times the time. A capsule that always drifts one
way is at a bound: such motions differ by a constant velocity, and no branch of orbits passes there.
"""

from __future__ import annotations

from capsule_sym._map.quasistatic import load_of
from capsule_sym._parameters import SceneParameters

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
    """Mean force of drive and load, size of the friction bound against it, and rounding error."""
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
