"""Results as tables of pandas, and optional packages."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import NotInstalled
from capsule_sym._units import UNITS

if TYPE_CHECKING:
    from pandas import DataFrame

    from capsule_sym._parameters import SceneDevice

_MOST_ROWS = 8  # of a table in a notebook


def lock(result: Any) -> None:
    """Make the arrays of a result read-only, by views; other references stay writable."""
    held = vars(result)
    for name, value in held.items():
        if isinstance(value, np.ndarray):
            held[name] = view = value.view()
            view.setflags(write=False)


class Labelled:
    """Base of results with columns, which can be a table of pandas."""

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns, as arrays of shape (n,)."""
        raise NotImplementedError

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
