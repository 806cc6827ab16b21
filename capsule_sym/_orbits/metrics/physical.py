"""The metrics of a device's motion in SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping

from capsule_sym._parameters import PhysicalParameters

UNITS = {
    "velocity": "m/s",
    "progression": "m",
    "work": "J",
    "damper_loss": "J",
    "friction_loss": "J",
    "power": "W",
    "peak_force": "N",
    "peak_contact": "N",
}
"""The metrics and their units; progression and energies are per excitation period."""


def physical_metrics(metrics: Mapping[str, float], device: PhysicalParameters) -> dict[str, float]:
    """The metrics by their names in the units of UNITS, and the drive's mean power in W.

    `metrics` are dimensionless, with all names of `Performance` but the imbalance; `device` is what
    they are computed of.
    """
    scale = {
        "m/s": device.velocity(1.0),
        "m": device.displacement(1.0),
        "J": device.energy(1.0),
        "N": device.force(1.0),
    }
    found = {name: metrics[name] * scale[unit] for name, unit in UNITS.items() if unit != "W"}
    found["power"] = found["work"] * device.Omega / (2 * math.pi)
    return {name: found[name] for name in UNITS}
