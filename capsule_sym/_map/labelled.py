"""Results as tables of pandas and xarray, and trajectories drawn into matplotlib's axes."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import NotInstalled
from capsule_sym._parameters import CAPSULE, Scene
from capsule_sym._units import UNITS

if TYPE_CHECKING:
    from pandas import DataFrame
    from xarray import Dataset

    from capsule_sym._parameters import SceneDevice

_NAMES = {
    "period": "whole excitation periods before the start",
    "phase": "time in the excitation period at the start",
    "duration": "duration",
    "field": "field",
    "source": "switching plane at the start",
    "target": "switching plane at the end",
    "x_c": "capsule position at the start",
    "advance": "change of the capsule position",
    "outcome": "how the segment ends",
    "evaluations": "expansions or guard evaluations to find the end",
    "itinerary": "fields of one period of the motion",
    "period_number": "excitation periods of one period of the motion",
    "progression": "advance of the capsule per excitation period",
    "average_velocity": "advance of the capsule per unit of time",
    "largest_multiplier": "largest modulus of a Floquet multiplier",
    "line": "line of the switching surfaces on which the orbit bifurcates",
    "residual": "largest entry of the equations' residual",
    "periods": "whole excitation periods completed",
    "status": "whether the equations are solved, or the run is finished",
}
"""Long names of the columns of all tables, except parameters and states of their scene."""
_COUNTED = ("period", "periods", "evaluations", "period_number")
_MOST_ROWS = 8  # of a table in a notebook


def lock(result: Any) -> None:
    """Make the arrays of a result read-only, by views; other references stay writable."""
    held = vars(result)
    for name, value in held.items():
        if isinstance(value, np.ndarray):
            held[name] = view = value.view()
            view.setflags(write=False)


class Labelled:
    """Base of results with columns, which can be tables of pandas or xarray."""

    dimension: ClassVar[str]
    """Name of a row, such as "segment"."""
    place: ClassVar[str] = "at the start"
    """Place of the row's states."""

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns, as arrays of shape (n,)."""
        raise NotImplementedError

    @property
    def scene(self) -> Scene:
        """Scene whose parameters and states are among the columns."""
        return CAPSULE

    def attributes(self) -> dict[str, Any]:
        """Values that hold for all rows."""
        return {}

    def _repr_html_(self) -> str:
        """Result in a line, and its first rows as a table, for notebooks."""
        from html import escape

        said = f"<p>{escape(repr(self))}</p>"
        columns: dict[str, NDArray[Any]] = getattr(self, "columns", {})
        if not columns:  # where no orbit is found
            return said
        count = len(next(iter(columns.values()), ()))
        head = "".join(f"<th>{escape(name)}</th>" for name in columns)
        shown = range(min(count, _MOST_ROWS))
        cells = ([escape(_text(column[i])) for column in columns.values()] for i in shown)
        rows = "".join(f"<tr><td>{'</td><td>'.join(row)}</td></tr>" for row in cells)
        more = f"<p>and {count - _MOST_ROWS:,} more</p>" if count > _MOST_ROWS else ""
        table = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
        return f"{said}{table}{more}"

    @checked
    def to_dataframe(self, device: SceneDevice | None = None) -> DataFrame:
        """Return the columns as a pandas DataFrame, with texts as categories.

        Dimensionless, or in SI units (s, m, m/s) if a device is given, except parameters.
        """
        pandas = package("pandas")
        made: DataFrame = pandas.DataFrame(
            {
                name: pandas.Categorical(column) if column.dtype.kind == "U" else column
                for name, column in in_units(self.columns, device).items()
            }
        )
        return made

    @checked
    def to_xarray(self, device: SceneDevice | None = None) -> Dataset:
        """Return the columns as an xarray Dataset, each with its `units` and `long_name`.

        Dimensionless, or in SI units (s, m, m/s) if a device is given, except parameters.
        Raises ImportError without xarray.
        """
        xarray = package("xarray")
        variables, count, names = {}, 0, _names(self.scene, self.place)
        for name, column in in_units(self.columns, device).items():
            about, count = {"long_name": names.get(name, name)}, len(column)
            if column.dtype.kind != "U" and name in names:
                about["units"] = "1" if name in _COUNTED else "dimensionless"
            if device is not None and name in UNITS:
                about["units"] = UNITS[name].name
            variables[name] = (self.dimension, column, about)
        made: Dataset = xarray.Dataset(
            variables, {self.dimension: np.arange(count)}, in_units(self.attributes(), device)
        )
        return made


def _names(scene: Scene, place: str) -> dict[str, str]:
    """Long names of columns; a column without one keeps its name."""
    facts = scene.facts
    own = {
        name: f"{text} {place}" if name in facts.STATE else text
        for name, text in facts.LABELS.items()
    }
    return _NAMES | own


def in_units(values: dict[str, Any], device: SceneDevice | None) -> dict[str, Any]:
    """Values by name in SI units if a device is given; values without a unit stay unchanged."""
    if device is None:
        return values
    return {
        name: value * device.scale(name) if name in UNITS else value
        for name, value in values.items()
    }


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def package(name: str) -> Any:
    """Package, imported when it is used; raises NotInstalled, which names what installs it."""
    from capsule_sym._processes import deferred

    try:
        with deferred():  # modules compiled by Cython may drop an interrupt
            return import_module(name)
    except ModuleNotFoundError as error:
        raise NotInstalled(error) from error
