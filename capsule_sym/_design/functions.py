"""Functions of the metrics of a steady motion, from texts or callables, and limits of them.

A metric is a number with its derivatives by all parameters of the system; arithmetic with it
differentiates exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput
from capsule_sym._orbits.continuation.parameter_paths import Slope, arithmetic
from capsule_sym._parameters import names_of
from capsule_sym._systems import System, real
from capsule_sym._units import METRIC_UNITS

Function = Callable[[Mapping[str, Slope]], Slope]

_POSITIVE = 1e-12  # least value of a positive parameter in a search without a bound


def allowed(system: System, name: str) -> tuple[float, float]:
    """Least and largest value of a parameter of a system, dimensionless or a device's.

    They may be infinite. The least one of a positive parameter is 1e-12.
    """
    facts = system.scene.facts
    low = -math.inf if name in facts.SIGNED else _POSITIVE if name in facts.POSITIVE else 0.0
    tied, _ = facts.DRIVEN.get(name, (name, ""))
    return low, facts.RANGES["D"][1] if tied == "D" else math.inf


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

    A callable is returned as it is. Raises InvalidInput for anything else.
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
    """Constraint from a text such as "peak_force <= 2", or from (function, "<=", value).

    Raises InvalidInput for anything else.
    """
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
    function that fails, or returns anything but arithmetic of the metrics. Errors of arithmetic,
    such as a division by 0, give nan.
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
