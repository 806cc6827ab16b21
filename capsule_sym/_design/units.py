"""How the dimensionless parameters and the units of a device depend on what it is made of."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._parameters import PhysicalParameters
from capsule_sym.generated.facts import PARAMETERS

DEVICE = PhysicalParameters.__slots__
_UNIT = {name: i for i, name in enumerate(DEVICE)}


class Slopes(NamedTuple):
    """Derivatives by the ten fields of PhysicalParameters, in their order."""

    parameters: NDArray[np.float64]
    """Of the seven parameters, shape (7, 10)."""
    length: NDArray[np.float64]
    """Of the logarithm of the unit of length, shape (10,)."""
    rate: NDArray[np.float64]
    """Of the logarithm of the natural frequency, shape (10,)."""


def slopes_of(device: PhysicalParameters) -> Slopes:
    """How parameters and units change with each physical parameter; all are products of powers.

    Only the friction force is not: it has the sum of the masses.
    """
    total = device.M_m + device.M_c
    friction = _powers(mu=1, g=1, M_m=device.M_m / total, M_c=device.M_c / total)
    rate = _powers(k1=0.5, M_m=-0.5)
    powers = {
        "alpha": _powers(P_d=1) - friction,
        "omega": _powers(Omega=1) - rate,
        "delta": _powers(k1=1, G=1) - friction,
        "zeta": _powers(c=1, M_m=-1) - rate,
        "beta": _powers(k2=1, k1=-1),
        "gamma": _powers(M_c=1, M_m=-1),
        "f_b": _powers(),
    }
    values = np.array([getattr(device, name) for name in DEVICE])
    size = np.where(values == 0.0, 1.0, values)
    found = np.array(
        [getattr(device.dimensionless(), name) * powers[name] / size for name in PARAMETERS]
    )
    for name in ("k2", "c", "G", "P_d"):  # what may be 0, where a parameter is in proportion to it
        if getattr(device, name) == 0.0:
            one = replace(device, **{name: 1.0}).dimensionless()
            for row, parameter in enumerate(PARAMETERS):
                if powers[parameter][_UNIT[name]]:
                    found[row, _UNIT[name]] = getattr(one, parameter)
    return Slopes(found, (friction - _powers(k1=1)) / size, rate / size)


def _powers(**powers: float) -> NDArray[np.float64]:
    row = np.zeros(len(DEVICE))
    for name, power in powers.items():
        row[_UNIT[name]] = power
    return row
