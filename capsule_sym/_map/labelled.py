"""Results as tables of pandas, and optional packages."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import InvalidInput, NotInstalled
from capsule_sym._units import UNITS

if TYPE_CHECKING:
    from pandas import DataFrame

    from capsule_sym._parameters import SceneDevice


def lock(result: Any) -> None:
    """Make the arrays of a result read-only, by views; other references stay writable."""
    held = vars(result)
    for name, value in held.items():
        if isinstance(value, np.ndarray):
            held[name] = view = value.view()
            view.setflags(write=False)


class Labelled:
    """Base of results with columns, which can be a table of pandas."""

    _of_system = False
    """True if the columns have the units of the result's system, which may be a device."""

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns, as arrays of shape (n,)."""
        raise NotImplementedError

    @checked
    def to_dataframe(self, device: SceneDevice | None = None) -> DataFrame:
        """Return the columns as a pandas DataFrame, with texts as categories.

        Dimensionless, or in SI units if a device is given, except parameters. A result of a system,
        which may be a device, has the units of the system. Another result's parameters are not
        compared with those of the device. Raises InvalidInput if a result of a system is given a
        device, and NotInstalled without pandas.
        """
        if device is not None and self._of_system:
            raise InvalidInput("device", device, "None: the table has the units of the system")
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


def package(name: str) -> Any:
    """Package, imported when it is used; raises NotInstalled, which names what installs it."""
    from capsule_sym._processes import deferred

    try:
        with deferred():  # modules compiled by Cython may drop an interrupt
            return import_module(name)
    except ModuleNotFoundError as error:
        raise NotInstalled(error) from error
