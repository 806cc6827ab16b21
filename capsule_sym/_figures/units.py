"""Units of a figure's axes: those of a device, or none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.style import LABELS
from capsule_sym._parameters import SceneDevice, SceneParameters
from capsule_sym._study.arcs import Arc
from capsule_sym._units import UNITS
from capsule_sym.generated.capsule.facts import DRIVEN, PARAMETERS

DIMENSIONLESS = "all quantities are dimensionless"
"""What a figure says that has no units, of a device or of what a file holds."""

_OTHERS = "the other quantities are dimensionless"

_PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k"}
_TIED = {tied: (name, unit) for name, (tied, unit) in DRIVEN.items()}
_UNTIED = tuple(name for name in PARAMETERS if name not in _TIED)
_PREFIXED = ("m", "m/s", "N", "J", "s")


@dataclass(frozen=True)
class Units:
    """How the quantities of a figure are drawn: dimensionless, or in the SI units of a device."""

    device: SceneDevice | None = None

    @classmethod
    def of_motion(cls, device: SceneDevice | None, parameters: SceneParameters) -> Units:
        """Units of a motion; raises InvalidInput unless its frequency and mass ratio are those."""
        return cls.of_known(device, parameters.to_dict())

    @classmethod
    def of_known(cls, device: SceneDevice | None, known: Mapping[str, Any]) -> Units:
        """The same of motions of which these parameters are known, the varied ones left out."""
        if device is not None:
            own = device.dimensionless()
            for name in ("omega", *_UNTIED):
                value, allowed = float(known.get(name, getattr(own, name))), getattr(own, name)
                if not math.isclose(value, allowed, rel_tol=1e-9):
                    raise InvalidInput(name, value, f"{allowed:.9g}, as of the device")
        return cls(device)

    def scale(self, name: str) -> float:
        """What a dimensionless value is multiplied with; time is in excitation periods."""
        return self._of(name)[0]

    def label(self, name: str, text: str = "", words: str = "") -> str:
        """Label of an axis, by default that of `LABELS`; of a device its words and the unit."""
        text, unit = text or LABELS.get(name, name), self.unit(name)
        # The symbols are those of dimensionless quantities.
        return f"{words or text.partition(' $')[0]} ({unit})" if unit else text

    def unit(self, name: str) -> str:
        """The unit of a quantity, with its prefix; empty without a device."""
        return self._of(name)[1]

    def arc(self, arc: Arc) -> Arc:
        """An arc in these units."""
        return replace(
            arc,
            time=arc.time * self.scale("time"),
            x_r=arc.x_r * self.scale("x_r"),
            v_r=arc.v_r * self.scale("v_r"),
            v_c=arc.v_c * self.scale("v_c"),
            x_c=arc.x_c * self.scale("x_c"),
        )

    def _of(self, name: str) -> tuple[float, str]:
        device = self.device
        if device is None:
            return 1.0, ""
        if name in _UNTIED:  # they change the units themselves
            raise InvalidInput(
                "parameter", name, f"one of {', '.join(_TIED)} where a device is given"
            )
        if name == "time":
            factor, unit = math.tau / device.Omega, "s"
        elif name in _TIED:
            physical, unit = _TIED[name]
            factor = 1 / device.tie(physical)[1]
        else:
            factor, unit = device.scale(name), UNITS[name].name
        if unit not in _PREFIXED:
            return factor, unit
        power = 3 * math.floor((math.log10(factor) + 1) / 3)
        power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
        return factor / 10.0**power, _PREFIXES[power] + unit


def named(name: str) -> str:
    """Label of a parameter as files name it, with its unit if it is a device's."""
    from capsule_sym._design.quantities import OF_DEVICE

    if name in LABELS:
        return LABELS[name]
    unit = OF_DEVICE.get(name, "")
    symbol = f"${name.replace('Omega', chr(92) + 'Omega')}$"
    return f"{symbol} ({unit})" if unit else name


def said(*parameters: str) -> str:
    """What a figure says of units over parameters that may be a device's."""
    return DIMENSIONLESS if all(name in LABELS for name in parameters) else _OTHERS
