"""Units of results in SI: powers of a device's units of force, length and rate."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from capsule_sym._arguments import checked
from capsule_sym._errors import check_one_of


class Unit(NamedTuple):
    """A quantity's unit: powers of a device's units of force, length and rate, and its SI name."""

    force: int
    length: int
    rate: int
    name: str


_TIME, _LENGTH, _VELOCITY = Unit(0, 0, -1, "s"), Unit(0, 1, 0, "m"), Unit(0, 1, 1, "m/s")
_FORCE, _ENERGY = Unit(1, 0, 0, "N"), Unit(1, 1, 0, "J")
METRIC_UNITS = {
    **dict.fromkeys(("velocity", "speed"), _VELOCITY),
    "progression": _LENGTH,
    **dict.fromkeys(("work", "damper_loss", "friction_loss"), _ENERGY),
    "power": Unit(1, 1, 1, "W"),
    **dict.fromkeys(("peak_force", "peak_contact"), _FORCE),
    "speed_per_work": Unit(-1, 0, 0, "m/J"),
    "cost_of_transport": Unit(0, 0, 0, ""),
}
"""The metrics of a steady motion by name. Energies and progression are per excitation period; speed
is `|velocity|`, power is work over the period, speed_per_work is `|progression|` over work, which
is average speed over average power; cost_of_transport is work over friction bound and
`|progression|`."""
UNITS = {
    **METRIC_UNITS,
    **dict.fromkeys(("phase", "duration"), _TIME),
    **dict.fromkeys(("x_r", "x_c", "advance"), _LENGTH),
    **dict.fromkeys(("v_r", "v_c", "average_velocity"), _VELOCITY),
    "lyapunov": Unit(0, 0, 1, "1/s"),
    "lift": _ENERGY,
}
"""The units of all results that have one."""


def mean_power(work: Any, rate: Any) -> Any:
    """The mean power of a motion, from work per excitation period and angular frequency."""
    return work * rate / math.tau


def scale_of(units: Sequence[float], name: str) -> float:
    """SI unit of a result, from the units of force, length and rate."""
    force, length, rate = units
    powers = UNITS[name]
    scale: float = force**powers.force * length**powers.length * rate**powers.rate
    return scale


def units_of(device: Scales) -> tuple[float, float, float]:
    """Units of force (N), length (m) and rate (rad/s) of a device."""
    return device.friction_force, device.length_scale, device.natural_frequency


class Scales:
    """The SI units of results, from the units of a device in any arithmetic."""

    __slots__ = ()

    friction_force: float
    """Coulomb friction, the unit of force (N)."""
    natural_frequency: float
    """Natural frequency, the unit of rates (rad/s)."""
    length_scale: float
    """Length that friction stretches the spring, the unit of length (m)."""

    @checked
    def scale(self, name: str) -> float:
        """The SI unit of a result: what its dimensionless value is multiplied with.

        The name is one of trajectories, orbits, sweeps or metrics, such as `duration` (s), `x_r`
        (m), `velocity` (m/s), `work` (J) or `peak_force` (N). Raises `InvalidInput` for another.
        """
        check_one_of("quantity", name, UNITS)
        return scale_of(units_of(self), name)
