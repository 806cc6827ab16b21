"""A sweep as a TOML file, or the table that one holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

from capsule_sym._errors import InvalidInput
from capsule_sym._parameters import Parameters, read_toml
from capsule_sym._sweeps.axes import PARAMETERS, START, Axis, check_name
from capsule_sym._sweeps.sweep import Sweep

_SETTINGS = ("periods", "tolerance", "compute", "chunk")
_SPACINGS = {"linear": Axis.linear, "log": Axis.log}


def load_sweep(path: str | PathLike[str]) -> Sweep:
    """The sweep in a TOML file, as `read_plan` reads its table.

    Raises InvalidInput when the file cannot be read, is not TOML, or holds what is not allowed.
    """
    return read_plan(read_toml(path))


def read_plan(plan: Mapping[str, Any]) -> Sweep:
    """The sweep that a table describes.

    Tables `axes`, `parameters` and `start` (x_r, v_r, v_c, phase); keys `periods`, `tolerance`,
    `compute` and `chunk`. An axis is a list of values, a table with `from`, `to`, `count` and
    perhaps `spacing = "log"`, or a table with `sobol` (ranges by name), `count` and `seed`.
    Raises InvalidInput for what is not allowed.
    """
    if not isinstance(plan, Mapping):
        raise InvalidInput("plan", plan, "a table")
    _check_table("key", plan, ("axes", "parameters", "start", *_SETTINGS))
    axes, parameters, start = (plan.get(name, {}) for name in ("axes", "parameters", "start"))
    _check_table("parameters", parameters, PARAMETERS)
    _check_table("start", start, START)
    _check_table("axes", axes)
    return Sweep(
        tuple(_axis(name, given) for name, given in axes.items()),
        Parameters(**parameters),
        tuple(start.get(name, 0.0) for name in START[:3]),
        start.get("phase", 0.0),
        **{name: plan[name] for name in _SETTINGS if name in plan},
    )


def _axis(name: str, given: Any) -> Axis:
    check_name(name)
    if isinstance(given, list | tuple):
        return Axis.of(name, given)
    if not isinstance(given, Mapping):
        raise InvalidInput(name, given, "a list of values or a table")
    if "sobol" in given:
        _check_table(name, given, ("sobol", "count", "seed"), needed=("count", "seed"))
        axis = Axis.sobol(given["sobol"], given["count"], given["seed"])
        return Axis(name, axis.quantities, axis.values)
    _check_table(name, given, ("from", "to", "count", "spacing"), needed=("from", "to", "count"))
    spacing = given.get("spacing", "linear")
    if not isinstance(spacing, str) or spacing not in _SPACINGS:
        raise InvalidInput("spacing", spacing, f"one of {', '.join(_SPACINGS)}")
    return _SPACINGS[spacing](name, given["from"], given["to"], given["count"])


def _check_table(
    field: str, given: Any, allowed: Sequence[str] | None = None, needed: Sequence[str] = ()
) -> None:
    """Raises InvalidInput unless this is a table with these keys alone."""
    if not isinstance(given, Mapping):
        raise InvalidInput(field, given, "a table")
    for name in given:
        if allowed is not None and name not in allowed:
            raise InvalidInput(field, name, f"one of {', '.join(allowed)}")
    for name in needed:
        if name not in given:
            raise InvalidInput(field, dict(given), f"a table with {', '.join(needed)}")
