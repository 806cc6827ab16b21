"""How the dimensionless parameters and the units of a device depend on what it is made of."""

from __future__ import annotations

from functools import lru_cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._orbits.continuation.parameter_paths import Slope
from capsule_sym._parameters import PhysicalParameters
from capsule_sym.generated.facts import PARAMETERS

DEVICE = PhysicalParameters.__slots__


class Slopes(NamedTuple):
    """Derivatives by the fields of PhysicalParameters, in their order; n of them."""

    parameters: NDArray[np.float64]
    """Of the dimensionless parameters, shape (7, n)."""
    length: NDArray[np.float64]
    """Of the logarithm of the unit of length, shape (n,)."""
    rate: NDArray[np.float64]
    """Of the logarithm of the natural frequency, shape (n,)."""


class _Varied(SimpleNamespace):
    """A device whose fields are numbers with derivatives, with the scaling of any device."""

    friction_force = PhysicalParameters.friction_force
    natural_frequency = PhysicalParameters.natural_frequency
    length_scale = PhysicalParameters.length_scale
    ratios = PhysicalParameters.ratios
    scale = PhysicalParameters.scale


@lru_cache(maxsize=16)
def varied(device: PhysicalParameters) -> Any:
    """The device with derivatives by its fields, of each of them and of all units."""
    own = zip(DEVICE, np.eye(len(DEVICE)), strict=True)
    return _Varied(**{name: Slope(getattr(device, name), row) for name, row in own})


@lru_cache(maxsize=16)
def slopes_of(device: PhysicalParameters) -> Slopes:
    """How parameters and units change with each physical parameter."""
    own, none = varied(device), np.zeros(len(DEVICE))
    found = [getattr(own.ratios()[name], "slope", none) for name in PARAMETERS]
    length, rate = own.length_scale, own.natural_frequency
    return Slopes(np.array(found), length.slope / length.value, rate.slope / rate.value)
