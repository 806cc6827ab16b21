"""Metrics of a steady motion by name, with those derived from them, and their SI units.

A metric is a number with its derivatives by all parameters of the system, dimensionless or a
device's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from capsule_sym._arrays import Matrix
from capsule_sym._errors import check_one_of
from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._orbits.metrics.performance import performance, shown
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import Scene, SceneDevice, SceneParameters, names_of
from capsule_sym._systems import System, values_of
from capsule_sym._units import METRIC_UNITS, UNITS, mean_power


def units_of(scene: Scene) -> dict[str, str]:
    """Units of a device's parameters, and of a start."""
    start = {name: UNITS[name].name for name in (*scene.facts.STATE, "x_c", "phase")}
    return dict(scene.facts.DEVICE) | start


def units_in(system: System) -> dict[str, str]:
    """SI units of the metrics, parameters and start of a device; empty without one."""
    if not isinstance(system, SceneDevice):
        return {}
    return units_of(system.scene) | {name: unit.name for name, unit in METRIC_UNITS.items()}


def varied(scene: Scene, values: Mapping[str, float], by: Sequence[str]) -> Any:
    """Values of a system as attributes by name, with derivatives (k,) by the k of them in `by`.

    Those of a device also have its `ratios()` and units.
    """
    rows, none = dict(zip(by, np.eye(len(by)), strict=True)), np.zeros(len(by))
    return scene.values(
        **{name: Slope(value, rows.get(name, none)) for name, value in values.items()}
    )


@lru_cache(maxsize=16)
def dimensionless_slopes(system: System) -> Matrix:
    """Derivatives (n, k) of n dimensionless parameters by the k parameters of the system."""
    dimensionless = system.scene.facts.PARAMETERS
    if isinstance(system, SceneParameters):
        return np.eye(len(dimensionless))
    names = names_of(system)
    ratios, none = varied(system.scene, values_of(system), names).ratios(), np.zeros(len(names))
    return np.array([getattr(ratios[name], "slope", none) for name in dimensionless])


def of(metrics: Mapping[str, Slope], system: System) -> dict[str, Slope]:
    """All metrics and parameters, with derivatives (k,) by the k parameters of the system.

    In SI units if the system is a device. `metrics` are those of a motion of the system,
    dimensionless, with derivatives by its dimensionless parameters.
    """
    own = varied(system.scene, values_of(system), names_of(system))
    by = dimensionless_slopes(system)
    found = {name: Slope(one.value, one.slope @ by) for name, one in metrics.items()}
    return with_units(found, own, system)


def with_units(metrics: Mapping[str, Slope], own: Any, system: System) -> dict[str, Slope]:
    """All metrics and parameters of one motion or of n, in SI units if the system is a device.

    `own` are its parameters, as by `varied`, with derivatives by the same parameters as those of
    the dimensionless `metrics`.
    """
    device = isinstance(system, SceneDevice)
    with np.errstate(all="ignore"):
        ratios = own.ratios() if device else vars(own)
        found = with_derived(metrics, ratios, system.scene.facts.BOUNDS)
        if device:
            found = {name: one * own.scale(name) for name, one in found.items()}
    every: dict[str, Slope] = found | vars(own)
    return every


def with_derived(
    metrics: Mapping[str, Slope], own: Mapping[str, Slope], bounds: Mapping[int, str]
) -> dict[str, Slope]:
    """Dimensionless metrics of one motion or of n, by names, with those derived from them.

    Derived are speed, power, speed_per_work and cost_of_transport.

    `own` are the parameters, and `bounds` names the bound of friction for each sign of progression.
    Values are numbers, or arrays (n,) with derivatives (k, n).
    """
    given, velocity = metrics["work"], metrics["velocity"]
    work = Slope(np.asarray(given.value), given.slope)
    forward = np.where(velocity.value < 0, -1.0, 1.0)
    way = metrics["progression"] * forward
    # The cost of transport of a capsule without progression is infinite; without work
    # speed_per_work is 0.
    cost = Slope(math.inf, 0 * work.slope)
    with np.errstate(all="ignore"):
        for sign, bound in bounds.items():
            there = (forward == sign) & (way.value > 0)
            cost = _where(there, work / (own[bound] * way), cost)
        per_work = _where(work.value > 0, way / work, 0 * work)
    return dict(metrics) | {
        "speed": velocity * forward,
        "power": mean_power(work, own["omega"]),
        "speed_per_work": per_work,
        "cost_of_transport": cost,
    }


def _where(condition: Any, one: Slope, other: Slope) -> Slope:
    """One of two quantities, by a condition on each motion."""
    value = np.where(condition, one.value, other.value)
    return Slope(value, np.where(condition, one.slope, other.slope))


def metric_of(orbit: Orbit, name: str) -> float:
    """A dimensionless metric or parameter of an orbit, by its name.

    It is nan at a fold, where `performance` has no gradient. Raises InvalidInput for another name.
    """
    try:
        found = performance(orbit)
    except np.linalg.LinAlgError:
        return math.nan
    none = np.zeros(len(orbit.scene.facts.PARAMETERS))
    plain = {one: Slope(float(getattr(found, one).value), none) for one in shown(orbit.scene)}
    every = of(plain, orbit.parameters)
    check_one_of("quantity", name, every, " in this scene")
    return float(every[name].value)
