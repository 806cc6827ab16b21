"""Trajectories as tables of pandas and xarray, and drawn into matplotlib's axes."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym.errors import InvalidInput, NotInstalled

if TYPE_CHECKING:
    from capsule_sym.map.trajectory import Trajectory

LONG_NAMES = {
    "period": "whole excitation periods before the start",
    "phase": "time in the excitation period at the start",
    "duration": "duration",
    "field": "field",
    "source": "switching plane at the start",
    "target": "switching plane at the end",
    "x_r": "relative displacement at the start",
    "v_r": "relative velocity at the start",
    "v_c": "capsule velocity at the start",
    "x_c": "capsule position at the start",
    "advance": "change of the capsule position",
    "outcome": "how the segment ends",
    "evaluations": "expansions or guard evaluations to find the end",
}
_COUNTED = ("period", "evaluations")
_MOST_POINTS = 100_000


def package(name: str, extra: str) -> Any:
    """An optional package; raises NotInstalled, which names the extra that brings it."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise NotInstalled(error, extra) from error


def dataframe(columns: Mapping[str, NDArray[Any]]) -> Any:
    """The columns as a pandas DataFrame, texts as categories."""
    pandas = package("pandas", "sweep")
    made = {
        name: pandas.Categorical(column) if column.dtype.kind == "U" else column
        for name, column in columns.items()
    }
    return pandas.DataFrame(made)


def dataset(columns: Mapping[str, NDArray[Any]], attributes: Mapping[str, Any]) -> Any:
    """The columns as an xarray Dataset along `segment`, with units and long names."""
    xarray = package("xarray", "sweep")
    variables = {}
    for name, column in columns.items():
        about = {"long_name": LONG_NAMES[name]}
        if column.dtype.kind != "U":
            about["units"] = "1" if name in _COUNTED else "dimensionless"
        variables[name] = ("segment", column, about)
    return xarray.Dataset(
        variables, {"segment": np.arange(len(columns["period"]))}, dict(attributes)
    )


def draw(run: Trajectory, axes: Any, of: str, points: int) -> Any:
    """A run drawn into axes: displacements over time, or the phase portrait."""
    if of not in ("displacements", "phase"):
        raise InvalidInput("of", of, "displacements or phase")
    if isinstance(points, bool) or not isinstance(points, int) or points < 2:
        raise InvalidInput("points", points, "a whole number from 2 on")
    if axes is None:
        axes = package("matplotlib.pyplot", "plot").subplots()[1]
    period = run.parameters.period
    first, last = (at.period * period + float(at.phase) for at in (run.origin[0], run.final[0]))
    count = int(min(_MOST_POINTS, 2 + points * (last - first) / period))
    times = np.linspace(first, last, count)
    x_r, v_r, _, x_c = run(times, position=True).T
    if of == "phase":
        axes.plot(x_r, v_r)
        axes.axvline(run.parameters.delta, color="0.7", zorder=0)
        axes.set(xlabel="$x_r$", ylabel="$v_r$")
        return axes
    axes.plot(times / period, x_r, label="$x_r$")
    axes.plot(times / period, x_c, label="$x_c$")
    axes.set(xlabel=r"time $\omega\tau/2\pi$ (periods)", ylabel="displacement")
    axes.legend()
    return axes
