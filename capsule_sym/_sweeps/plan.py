"""A sweep as a TOML file, or the table that one holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np

from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._files import read_toml
from capsule_sym._map.checks import is_real
from capsule_sym._parameters import CAPSULE, Scene, SceneDevice, scene_in
from capsule_sym._sweeps.axes import START, Axis, check_name
from capsule_sym._sweeps.sweep import Sweep

_SETTINGS = ("periods", "tolerance", "compute", "chunk")
_SPACINGS: dict[str, tuple[Callable[..., Axis], Callable[..., Any]]] = {
    "linear": (Axis.linear, np.linspace),
    "log": (Axis.log, np.geomspace),
}


def load_sweep(path: str | PathLike[str]) -> Sweep:
    """Sweep from a TOML file, whose table is read as by `read_plan`.

    Raises InvalidInput if the file cannot be read, is not TOML, or has a value that is not allowed.
    """
    return read_plan(read_toml(path), path)


def read_plan(plan: Mapping[str, Any], path: str | PathLike[str] = "") -> Sweep:
    """Sweep from a table, which may come from the file `path`.

    The table has the tables `axes`, `parameters` and `start` (x_r, v_r, v_c, phase), and the keys
    `scene` (as in a file of parameters), `periods`, `tolerance`, `compute` and `chunk`. A table
    `device` in SI units replaces `parameters`; quantities proportional to one parameter, such as
    P_d, may then be axes, or vary in a design, in SI units. An axis is a list of values; a table
    with `from`, `to`, `count` and optionally `spacing = "log"`; or a design, a table with `sobol`
    (ranges by name), `count` and `seed`. Raises InvalidInput for a value that is not allowed.
    """
    if not isinstance(plan, Mapping):
        raise InvalidInput("plan", plan, "a table")
    _check_table("key", plan, ("scene", "axes", "parameters", "device", "start", *_SETTINGS))
    scene = scene_in(plan, path) or CAPSULE
    axes, parameters, start = (plan.get(name, {}) for name in ("axes", "parameters", "start"))
    device = _device(scene, plan["device"]) if "device" in plan else None
    if device is not None and parameters:
        raise InvalidInput("parameters", [*parameters], "absent if a device is given")
    _check_table("parameters", parameters, scene.facts.PARAMETERS, told=scene.told)
    _check_table("start", start, START)
    _check_table("axes", axes)
    return Sweep(
        tuple(_axis(scene, name, given, device) for name, given in axes.items()),
        scene.Parameters(**parameters),
        tuple(start.get(name, 0.0) for name in START[:-1]),
        start.get(START[-1], 0.0),
        device=device,
        **{name: plan[name] for name in _SETTINGS if name in plan},
    )


def _device(scene: Scene, given: Any) -> SceneDevice:
    facts = scene.facts
    needed = [name for name in facts.DEVICE if name not in facts.DEVICE_DEFAULTS]
    _check_table("device", given, [*facts.DEVICE], needed, scene.told)
    return scene.PhysicalParameters(**given)


def _axis(scene: Scene, name: str, given: Any, device: SceneDevice | None) -> Axis:
    """Axis of a plan; in SI units it has the spacing of the proportional parameter."""
    check_name(name)
    own = device if name in scene.facts.DRIVEN else None
    if isinstance(given, list | tuple):
        return Axis.of(name, given, scene) if own is None else Axis.of_device(own, name, given)
    if not isinstance(given, Mapping):
        raise InvalidInput(name, given, "a list of values or a table")
    if "sobol" in given and own is None:
        _check_table(name, given, ("sobol", "count", "seed"), needed=("count", "seed"))
        ranges = given["sobol"] if device is None else _box(device, given["sobol"])
        axis = Axis.sobol(ranges, given["count"], given["seed"], scene)
        return Axis(name, axis.quantities, axis.values, scene=scene)
    _check_table(name, given, ("from", "to", "count", "spacing"), needed=("from", "to", "count"))
    spacing = given.get("spacing", "linear")
    check_one_of("spacing", spacing, tuple(_SPACINGS))
    of, spaced = _SPACINGS[spacing]
    low, high, count = given["from"], given["to"], given["count"]
    if own is None:
        return of(name, low, high, count, scene)
    tied, factor = own.tie(name)
    of(tied, _scaled(low, factor), _scaled(high, factor), count, scene)  # checks ends and count
    return Axis.of_device(own, name, spaced(low, high, count))


def _scaled(value: Any, factor: float) -> Any:
    """A number in other units; anything else, or a number too large for a double, unchanged."""
    try:
        return value * factor if is_real(value) else value
    except OverflowError:
        return value


def _box(device: SceneDevice, ranges: Any) -> Any:
    """Ranges by name; those in SI units become ranges of the proportional parameters."""
    if not isinstance(ranges, Mapping):
        return ranges
    box = {}
    for name, ends in ranges.items():
        tied, factor = device.tie(name) if name in device.scene.facts.DRIVEN else (name, 1.0)
        if tied in box:
            raise InvalidInput("sobol", [*ranges], f"a table in which {tied} varies once")
        if isinstance(ends, list | tuple):
            ends = [_scaled(end, factor) for end in ends]
        box[tied] = ends
    return box


def _check_table(
    field: str,
    given: Any,
    allowed: Sequence[str] | None = None,
    needed: Sequence[str] = (),
    told: str = "",
) -> None:
    """Raises InvalidInput unless this is a table with these keys alone."""
    if not isinstance(given, Mapping):
        raise InvalidInput(field, given, "a table")
    for name in given:
        if allowed is not None:
            check_one_of(field, name, allowed, told)
    if missing := [name for name in needed if name not in given]:
        raise InvalidInput(field, dict(given), f"a table with {', '.join(missing)} too{told}")
