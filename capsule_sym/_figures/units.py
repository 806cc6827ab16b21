"""Units of a figure's axes: those of a device, or none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.arcs import Arc
from capsule_sym._figures.style import labels_of
from capsule_sym._parameters import CAPSULE, SHIPPED, Scene, SceneDevice, SceneParameters
from capsule_sym._parameters import scene as load
from capsule_sym._units import UNITS

DIMENSIONLESS = "quantities without a unit are dimensionless"
"""Note of a figure that may be that of a device, or of a file."""

_PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k"}
_PREFIXED = ("m", "m/s", "N", "J", "s", "W")


@dataclass(frozen=True)
class Units:
    """Units of the quantities of a figure: dimensionless, or in the SI units of a device."""

    device: SceneDevice | None = None
    scene: Scene = CAPSULE

    @classmethod
    def of_motion(cls, device: SceneDevice | None, parameters: SceneParameters) -> Units:
        """Units of a motion; raises InvalidInput unless it can be one of the device.

        Scene, frequency, and the parameters to which no quantity of a device is proportional, such
        as the mass ratio, have to be those of the device.
        """
        return cls.of_known(device, parameters.to_dict(), parameters.scene)

    @classmethod
    def of_known(
        cls, device: SceneDevice | None, known: Mapping[str, Any], scene: Scene = CAPSULE
    ) -> Units:
        """Units as from `of_motion`, where only the parameters `known` are compared."""
        if device is not None:
            if device.scene is not scene:
                raise InvalidInput("device", device, f"of the scene {scene.shown}")
            own, facts = device.dimensionless(), scene.facts
            tied = [name for name, _ in facts.DRIVEN.values()]
            untied = (name for name in facts.PARAMETERS if name not in tied)
            for name in ("omega", *untied):
                value, allowed = float(known.get(name, getattr(own, name))), getattr(own, name)
                if not math.isclose(value, allowed, rel_tol=1e-9):
                    raise InvalidInput(name, value, f"{allowed:.9g}, as of the device")
        return cls(device, scene)

    def scale(self, name: str) -> float:
        """Factor from a dimensionless value to `unit`; from excitation periods for "time"."""
        return self._of(name)[0]

    def label(self, name: str, text: str = "", words: str = "") -> str:
        """Label of an axis: `text`, by default that of `labels_of`.

        Of a device it is `words`, by default those of the text, with the unit.
        """
        unit = self.unit(name)
        text = text or labels_of(self.scene).get(name, name.replace("_", " "))
        # The symbols are those of dimensionless quantities.
        return f"{words or text.partition(' $')[0]} ({unit})" if unit else text

    def unit(self, name: str) -> str:
        """The unit of a quantity, with its prefix; empty without a device."""
        return self._of(name)[1]

    def arc(self, arc: Arc) -> Arc:
        """An arc in these units."""
        names = ("time", "x_r", "v_r", "v_c", "x_c")
        return replace(arc, **{name: getattr(arc, name) * self.scale(name) for name in names})

    def _of(self, name: str) -> tuple[float, str]:
        if self.device is None:
            return 1.0, ""
        if name == "time":
            return prefixed(math.tau / self.device.rate, "s")
        return prefixed(self.device.scale(name), UNITS[name].name)


def prefixed(factor: float, unit: str) -> tuple[float, str]:
    """A factor in an SI unit, converted to the unit with a suitable prefix; and that unit."""
    if unit not in _PREFIXED:
        return factor, unit
    power = 3 * math.floor((math.log10(factor) + 1) / 3)
    power = min(max(power, min(_PREFIXES)), max(_PREFIXES))
    return factor / 10.0**power, _PREFIXES[power] + unit


def named(name: str) -> str:
    """Label of a parameter as files name it, with its unit if it is a device's."""
    from capsule_sym._orbits.quantities import units_of

    if name in (known := known_labels()):
        return known[name]
    unit = next((u[name] for u in map(units_of, map(load, SHIPPED)) if u.get(name)), "")
    return f"${name.replace('Omega', chr(92) + 'Omega')}$ ({unit})" if unit else name


@cache
def known_labels() -> dict[str, str]:
    """Labels of all scenes that ship, in which a name means the same."""
    found: dict[str, str] = {}
    for scene in map(load, SHIPPED[::-1]):
        found |= labels_of(scene)
    return found
