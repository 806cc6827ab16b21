"""Layout of results for xarray: dimensions, coordinates, attributes."""

from __future__ import annotations

import platform
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.codecs import Crc32cCodec, ZstdCodec
from zarr.errors import ZarrUserWarning

import capsule_sym
from capsule_sym._native import live
from capsule_sym._parameters import Scene
from capsule_sym._sweeps.axes import START
from capsule_sym._sweeps.quantities import CellOutcome, variables
from capsule_sym._sweeps.sweep import Sweep
from capsule_sym._units import UNITS, units_of


class Added(NamedTuple):
    """A result of all cells that is computed from the others at the end of a run."""

    values: NDArray[np.generic]
    attributes: dict[str, Any]


def provenance(command: str, scene: Scene) -> dict[str, Any]:
    """Provenance of results: command, kernels, core, and versions of packages."""
    return {
        "command": command,
        "kernels": scene.digest,
        "core": live(scene),
        "versions": {
            "capsule-sym": capsule_sym.__version__,
            "python": platform.python_version(),
            "numpy": np.__version__,
            "zarr": zarr.__version__,
        },
    }


def create(place: Path, sweep: Sweep, origin: dict[str, Any]) -> None:
    """Write results of a sweep, as xarray opens them, with no cell computed.

    Results that are there are deleted.
    """
    attributes = _described(sweep, origin)
    columns = _coordinates(sweep)
    # xarray takes a column along an axis of another name for a result unless it is listed.
    if others := [name for name, (axis, *_) in columns.items() if name != axis]:
        attributes["coordinates"] = " ".join(others)
    group = zarr.create_group(place, attributes=attributes, overwrite=True)
    for name, (axis, column, units) in columns.items():
        group.create_array(name, data=column, dimension_names=[axis], attributes={**units})
    for name, v in variables(sweep.compute).items():
        about: dict[str, Any] = {"units": "1", "long_name": v.meaning, **_si(sweep, name)}
        if name == "outcome":  # and its codes, as CF flags
            about |= {
                "flag_values": [int(outcome) for outcome in CellOutcome],
                "flag_meanings": " ".join(outcome.name.lower() for outcome in CellOutcome),
            }
        _array(group, name, sweep, np.dtype(v.dtype), about, v.dimension)
    add(group, sweep, {})


def add(group: zarr.Group, sweep: Sweep, added: Mapping[str, Added]) -> None:
    """Write further results of all cells, and copy the arrays' metadata into the group's file."""
    for name, (result, attributes) in added.items():
        _array(group, name, sweep, result.dtype, attributes)[...] = result
    with warnings.catch_warnings():
        # Zarr warns that readers other than its own and xarray may ignore these copies.
        warnings.simplefilter("ignore", ZarrUserWarning)
        zarr.consolidate_metadata(group.store)


def _coordinates(sweep: Sweep) -> dict[str, tuple[str, NDArray[np.float64], dict[str, Any]]]:
    """Coordinates of a sweep by name, each with its axis, the values along it, and attributes."""
    start = {name: _si(sweep, name) for name in START}
    device = {
        axis.name: (axis.name, axis.device[0], {"units": axis.device[1]})
        for axis in sweep.axes
        if axis.device
    }
    return device | {
        quantity: (
            axis.name,
            np.ascontiguousarray(axis.values[:, i]),
            {"units": "1"} | start.get(quantity, {}),
        )
        for axis in sweep.axes
        for i, quantity in enumerate(axis.quantities)
    }


def _si(sweep: Sweep, name: str) -> dict[str, Any]:
    """SI unit and scale of a quantity, as attributes; none without a device or a unit."""
    if sweep.device is None or name not in UNITS:
        return {}
    return {"si_units": UNITS[name].name, "si_scale": sweep.device.scale(name)}


def _described(sweep: Sweep, origin: dict[str, Any]) -> dict[str, Any]:
    """Attributes of results: all that is the same for every cell of a sweep."""
    fixed = {
        **sweep.parameters.to_dict(),
        **dict(zip(START, (*sweep.state, sweep.phase), strict=True)),
    }
    varied = {quantity for axis in sweep.axes for quantity in axis.quantities}
    return {
        "scene": sweep.parameters.scene.source,
        "periods": sweep.periods,
        "tolerance": sweep.tolerance,
        **{name: value for name, value in fixed.items() if name not in varied},
        **({"si_scales": units_of(sweep.device)} if sweep.device else {}),
        **{name: origin[name] for name in ("command", "kernels", "core")},
        "versions": ", ".join(f"{name} {v}" for name, v in origin["versions"].items()),
    }


def _array(
    group: zarr.Group,
    name: str,
    sweep: Sweep,
    dtype: np.dtype[np.generic],
    attributes: dict[str, Any],
    dimension: tuple[str, int] | None = None,
) -> Any:
    """Empty array over the axes of a sweep, and over a dimension of its own if it has one."""
    own = [dimension] if dimension else []
    return group.create_array(
        name,
        shape=(*sweep.shape, *(size for _, size in own)),
        chunks=(*sweep.chunk, *(size for _, size in own)),
        dtype=dtype,
        fill_value=np.nan if dtype.kind in "fc" else 0,
        dimension_names=[*(axis.name for axis in sweep.axes), *(title for title, _ in own)],
        attributes=attributes,
        compressors=[ZstdCodec(), Crc32cCodec()],
        config={"write_empty_chunks": True},
        overwrite=True,
    )


def itinerary_flags(table: dict[str, tuple[int, int]]) -> dict[str, Any]:
    """Itineraries of a table by text, each with its code, as CF flags; _ replaces blanks."""
    meanings = " ".join(text.replace(" ", "_") for text in table)
    return {"flag_values": [code for code, _ in table.values()], "flag_meanings": meanings}
