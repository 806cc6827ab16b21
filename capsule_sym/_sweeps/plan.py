"""A sweep as a TOML file, or the table that one holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._files import read_toml
from capsule_sym._parameters import CAPSULE, SceneDevice, scene_in
from capsule_sym._sweeps.axes import START, Axis, check_name
from capsule_sym._sweeps.sweep import Sweep

_SETTINGS = ("periods", "tolerance", "compute", "chunk")


def read_plan(plan: str | PathLike[str] | Mapping[str, Any]) -> Sweep:
    r"""Sweep from a TOML file, or from the table that one holds.

    An axis is a list of values. Or it is a table with `from`, `to`, `count` and optionally
    `spacing`, "linear" or "log". Or it is a design, a table with `sobol` (ranges by name), `count`
    and `seed`. A `count` is 1 to 10^8, of a design over its number of ranges; a `seed` is 0 to
    10^12.

    Parameters
    ----------
    plan : str, path or mapping of str
        Name of a file in UTF-8, or a table. It has these keys; all may be missing except `axes`.

        - `axes`: the axes by name: a parameter, or x_r, v_r, v_c or phase of the start.
        - `parameters`: the fixed parameters, dimensionless; by default those of the scene.
        - `device`: the fixed parameters in SI units instead. Quantities proportional to one
          parameter, such as P_d, may then be axes in SI units, but not in a design.
        - `start`: x_r, v_r, v_c and phase, dimensionless; each is 0 by default.
        - `scene`: the name of a scene, such as "slope", or its folder, relative to the file and
          loaded before; by default the paper's.
        - `periods`: length of a run in excitation periods, 1 or more, by default 300.
        - `tolerance`: change within which stroboscopic states repeat, dimensionless, above 0 and
          below 1, by default 1e-9.
        - `compute`: the quantities, by default `["itinerary"]`: some of itinerary, progression,
          final, multipliers, energies, forces and lyapunov.
        - `chunk`: number of cells of a chunk along each axis. By default a chunk takes at most
          about two seconds in the C core, or has at most 16 cells; small sweeps are cut finer.

    Returns
    -------
    Sweep
        The sweep, of at most 10^10 cells.

    Raises
    ------
    InvalidInput
        For a value that is not allowed, for an unknown key, and for a file that cannot be read or
        is not TOML.

    See Also
    --------
    run_sweep : run of the sweep.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> alpha = {"from": 0.01, "to": 1.0, "count": 3, "spacing": "log"}
    >>> sweep = cs.inputs.read_plan({"axes": {"alpha": alpha, "omega": [0.7, 0.9]}, "periods": 100})
    >>> print(sweep.shape, sweep.axes[0].values.ravel().round(6))
    (3, 2) [0.01 0.1  1.  ]

    The same from a file:

    >>> import tempfile
    >>> from pathlib import Path
    >>> text = "periods = 200\n[axes]\nalpha = { from = 0.5, to = 0.9, count = 5 }\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "sweep.toml")
    ...     size = path.write_text(text)
    ...     sweep = cs.inputs.read_plan(path)
    >>> print(sweep.shape, sweep.periods)
    (5,) 200
    """
    path = "" if isinstance(plan, Mapping) else plan
    plan = plan if isinstance(plan, Mapping) else read_toml(plan)
    _check_table("key", plan, ("scene", "axes", "parameters", "device", "start", *_SETTINGS))
    scene = scene_in(plan, path) or CAPSULE
    axes, parameters, start = (plan.get(name, {}) for name in ("axes", "parameters", "start"))
    device = None
    if "device" in plan:
        defaults = scene.facts.DEVICE_DEFAULTS
        needed = [name for name in scene.facts.DEVICE if name not in defaults]
        _check_table("device", plan["device"], [*scene.facts.DEVICE], needed, scene.told)
        device = scene.PhysicalParameters(**plan["device"])
        if parameters:
            raise InvalidInput("parameters", [*parameters], "absent if a device is given")
    _check_table("parameters", parameters, scene.facts.PARAMETERS, told=scene.told)
    _check_table("start", start, START)
    _check_table("axes", axes)
    return Sweep(
        tuple(_axis(name, given, device) for name, given in axes.items()),
        scene.Parameters(**parameters),
        tuple(start.get(name, 0.0) for name in START[:-1]),
        start.get(START[-1], 0.0),
        device=device,
        **{name: plan[name] for name in _SETTINGS if name in plan},
    )


def _axis(name: str, given: Any, device: SceneDevice | None) -> Axis:
    """Axis of a plan, in SI units if its name is that of a quantity of the device."""
    check_name(name)
    own = device if device is not None and name in device.scene.facts.DRIVEN else None
    if isinstance(given, list | tuple):
        axis = Axis.of(name, given)
    elif not isinstance(given, Mapping):
        raise InvalidInput(name, given, "a list of values or a table")
    elif "sobol" in given and own is None:
        _check_table(name, given, ("sobol", "count", "seed"), needed=("count", "seed"))
        axis = Axis.sobol(given["sobol"], given["count"], given["seed"])
        return Axis(name, axis.quantities, axis.values)
    else:
        ends = ("from", "to", "count")
        _check_table(name, given, (*ends, "spacing"), needed=ends)
        check_one_of("spacing", spacing := given.get("spacing", "linear"), ("linear", "log"))
        axis = getattr(Axis, spacing)(name, *(given[one] for one in ends))
    return axis if own is None else Axis.of_device(own, name, axis.values[:, 0])


def _check_table(
    field: str,
    given: Any,
    allowed: Sequence[str] | None = None,
    needed: Sequence[str] = (),
    told: str = "",
) -> None:
    """Raises InvalidInput unless this is a table with allowed keys alone, and all needed ones."""
    if not isinstance(given, Mapping):
        raise InvalidInput(field, given, "a table")
    for name in given:
        if allowed is not None:
            check_one_of(field, name, allowed, told)
    if missing := [name for name in needed if name not in given]:
        raise InvalidInput(field, dict(given), f"a table with {', '.join(missing)} too{told}")
