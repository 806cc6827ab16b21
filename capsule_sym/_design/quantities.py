"""Metrics of a steady motion by name, functions of them, and their SI units.

A metric is a number with its derivatives by all parameters of the system, dimensionless or a
device's; arithmetic with it differentiates exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._arrays import Matrix
from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._orbits.continuation.parameter_paths import Slope, arithmetic
from capsule_sym._orbits.metrics.performance import performance, shown
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import Scene, SceneDevice, SceneParameters, names_of
from capsule_sym._systems import System, real, values_of
from capsule_sym._units import METRIC_UNITS, UNITS, mean_power

Function = Callable[[Mapping[str, Slope]], Slope]

_POSITIVE = 1e-12  # least value of a positive parameter in a search without a bound


def units_of(scene: Scene) -> dict[str, str]:
    """Units of a device's parameters, and of a start."""
    start = {name: UNITS[name].name for name in (*scene.facts.STATE, "x_c", "phase")}
    return dict(scene.facts.DEVICE) | start


def units_in(system: System) -> dict[str, str]:
    """SI units of the metrics, parameters and start of a device; empty without one."""
    if not isinstance(system, SceneDevice):
        return {}
    return units_of(system.scene) | {name: unit.name for name, unit in METRIC_UNITS.items()}


def allowed(system: System, name: str) -> tuple[float, float]:
    """Least and largest value of a parameter of a system, dimensionless or a device's."""
    facts = system.scene.facts
    low = -math.inf if name in facts.SIGNED else _POSITIVE if name in facts.POSITIVE else 0.0
    tied, _ = facts.DRIVEN.get(name, (name, ""))
    return low, facts.RANGES["D"][1] if tied == "D" else math.inf


def varied(scene: Scene, values: Mapping[str, float], by: Sequence[str]) -> Any:
    """Values by name with derivatives (k,) by k of them, as a device's with all of its units."""
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

    `own` are its parameters with derivatives, as those of the dimensionless `metrics` are.
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
    # The cost of transport of a capsule without progression is infinite; without work the ratio is
    # 0.
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
    """A dimensionless metric of an orbit; nan at a fold, where `performance` has no gradient."""
    try:
        found = performance(orbit)
    except np.linalg.LinAlgError:
        return math.nan
    none = np.zeros(len(orbit.scene.facts.PARAMETERS))
    plain = {one: Slope(float(getattr(found, one).value), none) for one in shown(orbit.scene)}
    every = of(plain, orbit.parameters)
    check_one_of("quantity", name, every, " in this scene")
    return float(every[name].value)


class Limit(NamedTuple):
    """Constraint: a function of the metrics is at most, or at least, a value."""

    text: str
    function: Function
    value: float
    sign: int
    """1 for "at least", -1 for "at most"."""

    def slack(self, found: Mapping[str, Slope]) -> Slope:
        """Distance to the limit; negative beyond it."""
        return (valued("subject_to", self.function, found, self.text) - self.value) * self.sign


def function_of(field: str, metric: str | Function, system: System) -> Function:
    """Function of metrics and parameters, from a text of arithmetic or a callable.

    Raises InvalidInput for other texts.
    """
    if callable(metric):
        return metric
    if not isinstance(metric, str):
        raise InvalidInput(field, metric, "a metric, arithmetic of metrics, or a function of them")
    text = metric.replace("-per-", "_per_")
    function = arithmetic(field, text, (*METRIC_UNITS, *names_of(system)))
    function.__name__ = text  # its name in messages
    return function


def limit_of(one: object, system: System) -> Limit:
    """Constraint from a text such as "peak_force <= 2", or from (function, "<=", value)."""
    must = 'a text such as "peak_force <= 2", or (function, "<=" or ">=", number)'
    given, text = one, one if isinstance(one, str) else ""
    if text:
        relation = "<=" if "<=" in text else ">="
        left, _, right = text.partition(relation)
        with suppress(ValueError):
            given = left.strip(), relation, float(right)
    if not (isinstance(given, tuple) and len(given) == 3 and given[1] in ("<=", ">=")):
        raise InvalidInput("subject_to", one, must)
    metric, relation, number = given
    if not real(number):
        raise InvalidInput("subject_to", one, must)
    function = function_of("subject_to", metric, system)
    text = text or f"{metric if isinstance(metric, str) else named(metric)} {relation} {number:g}"
    return Limit(text, function, float(number), 1 if relation == ">=" else -1)


def named(function: object) -> str:
    """Name of a function in messages."""
    return str(getattr(function, "__name__", "function"))


def valued(field: str, function: Function, metrics: Mapping[str, Slope], text: str = "") -> Slope:
    """A function of the metrics, with derivatives; nan where it is not finite.

    The metrics are those of one motion, or of n with values (n,). Raises InvalidInput for a
    function that returns anything but arithmetic of the metrics.
    """
    name = text or named(function)
    must = "arithmetic (+ - * / **) of the metrics and parameters that the function gets by name"
    found: object = Slope(math.nan, 0 * next(iter(metrics.values())).slope)
    try:
        with np.errstate(all="ignore"), suppress(ArithmeticError):  # such as a division by 0
            found = function(metrics)
    except Exception as error:
        raise InvalidInput(field, name, f"{must} ({type(error).__name__}: {error})") from error
    if not isinstance(found, Slope):
        # A plain number has no derivative, and would count as a constant.
        raise InvalidInput(field, name, f"{must}, not {type(found).__name__}")
    finite = not np.iscomplexobj(found.value) and np.isfinite(found.value)
    return Slope(np.where(finite, found.value, math.nan).real, found.slope)
