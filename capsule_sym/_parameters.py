"""The parameters of the capsule system: dimensionless, or physical in SI units.

Definitions and scaling are those of Section 2 of the paper (Guo & Liu, Physica D, 2019,
doi 10.1016/j.physd.2019.04.008).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace
from os import PathLike
from types import SimpleNamespace
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput
from capsule_sym.generated.capsule import facts
from capsule_sym.generated.capsule.parameters import DeviceFields, Fields, Relations

_Quantity = TypeVar("_Quantity", float, NDArray[np.float64])


class Unit(NamedTuple):
    """A quantity's unit: powers of a device's units of force, length and rate, and its SI name."""

    force: int
    length: int
    rate: int
    name: str


_TIME, _LENGTH, _VELOCITY = Unit(0, 0, -1, "s"), Unit(0, 1, 0, "m"), Unit(0, 1, 1, "m/s")
_FORCE, _ENERGY = Unit(1, 0, 0, "N"), Unit(1, 1, 0, "J")
METRIC_UNITS = {
    **dict.fromkeys(("velocity", "speed"), _VELOCITY),
    "progression": _LENGTH,
    **dict.fromkeys(("work", "damper_loss", "friction_loss"), _ENERGY),
    "power": Unit(1, 1, 1, "W"),
    **dict.fromkeys(("peak_force", "peak_contact"), _FORCE),
    "speed_per_work": Unit(-1, 0, 0, "m/J"),
    "cost_of_transport": Unit(0, 0, 0, ""),
}
"""The metrics of a steady motion by name. Energies and progression are per excitation period; speed
is `|velocity|`, power is work over the period, speed_per_work is `|progression|` over work, which
is average speed over average power; cost_of_transport is work over friction bound and
`|progression|`."""
UNITS = {
    **METRIC_UNITS,
    **dict.fromkeys(("phase", "duration"), _TIME),
    **dict.fromkeys(("x_r", "x_c", "advance"), _LENGTH),
    **dict.fromkeys(("v_r", "v_c", "average_velocity"), _VELOCITY),
    "lyapunov": Unit(0, 0, 1, "1/s"),
}
"""The units of all results that have one."""


def mean_power(work: Any, rate: Any) -> Any:
    """The mean power of a motion, from its work per excitation period and the frequency."""
    return work * rate / math.tau


def _number(name: str, value: object, positive: bool | None = None) -> float:
    """A value as a float; raises InvalidInput unless it is one that the parameter may have."""
    positive = name in facts.POSITIVE if positive is None else positive
    least = 0.0 if name not in facts.SIGNED else -math.inf
    allowed = "finite" + ("" if least else " and > 0" if positive else " and >= 0")
    # Kinds whose conversion to double would silently drop digits (mpf, Fraction, strings) are
    # refused, and so is bool, which Python counts as an int.
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        raise InvalidInput(name, value, f"a real number, {allowed}")
    try:
        number = float(value)
    except OverflowError:
        number = -math.inf if value < 0 else math.inf
    if not math.isfinite(number) or number < least or (positive and number == 0):
        raise InvalidInput(name, number, allowed)
    return number


def _validate(instance: Any) -> None:
    for name in names_of(instance):
        object.__setattr__(instance, name, _number(name, getattr(instance, name)))


def names_of(parameters: Any) -> tuple[str, ...]:
    """Names of parameters, dimensionless or of a device, from a set of them or its type."""
    return tuple(field.name for field in fields(parameters))


@dataclass(frozen=True, slots=True)
class Parameters(Fields):
    """The dimensionless parameters of Eqs. (7)-(12); the defaults are the case study's.

    Every value is converted to a float. Raises `InvalidInput` unless all are finite, omega,
    gamma and f_b are > 0 and the others are >= 0.
    """

    def __post_init__(self) -> None:
        _validate(self)

    @property
    def period(self) -> float:
        """Period of the excitation, 2 pi / omega (dimensionless)."""
        return 2 * math.pi / self.omega

    def replace(self, **changes: float) -> Self:
        """A copy with some parameters changed; raises `InvalidInput` as construction does."""
        names = names_of(self)
        for name in changes:
            if name not in names:
                raise InvalidInput("parameter", name, f"one of {', '.join(names)}")
        return replace(self, **changes)

    def to_dict(self) -> dict[str, float]:
        """The parameters by name, in the order of the fields."""
        return {name: getattr(self, name) for name in facts.PARAMETERS}


class _Scales(Relations):
    """The SI units of results, from the units of a device in any arithmetic."""

    __slots__ = ()

    def scale(self, name: str) -> float:
        """The SI unit of a result: what its dimensionless value is multiplied with.

        The name is one of trajectories, orbits, sweeps or metrics, such as `velocity` (m/s),
        `work` (J) or `peak_force` (N). Raises `InvalidInput` for another.
        """
        if name not in UNITS:
            raise InvalidInput("quantity", name, f"one of {', '.join(UNITS)}")
        force, length, rate, _ = UNITS[name]
        return self.friction_force**force * self.length_scale**length * self.natural_frequency**rate


class Values(SimpleNamespace, _Scales):
    """Quantities of a device that are not checked, numbers or others that arithmetic takes."""


@dataclass(frozen=True, slots=True)
class PhysicalParameters(DeviceFields, _Scales):
    """The parameters of the device in SI units, with the scales that carry results back.

    Every value is converted to a float. Raises `InvalidInput` unless all are finite, the masses,
    k1, Omega, mu and g are > 0 and the others are >= 0, and unless the friction force, the
    natural frequency, the length scale and the dimensionless parameters are representable.
    """

    def __post_init__(self) -> None:
        if not facts.DEVICE:
            raise InvalidInput("device", "", "absent: the model declares none")
        _validate(self)
        for name in ("friction_force", "natural_frequency", "length_scale"):
            _number(name, getattr(self, name), True)
        self.dimensionless()

    def dimensionless(self) -> Parameters:
        """The dimensionless parameters of this device, with f_b = 1 (dry friction)."""
        return Parameters(**self.ratios())

    def tie(self, name: str) -> tuple[str, float]:
        """The parameter that is in proportion to P_d, Omega, G, c or k2, and the factor (1/SI).

        These quantities do not change the units of force, length and time. Raises `InvalidInput`
        for another name.
        """
        if name not in facts.DRIVEN:
            raise InvalidInput(
                "parameter", name, f"one of {', '.join(facts.DRIVEN)}, of the device"
            )
        tied = facts.DRIVEN[name][0]
        one = Values(**{each: getattr(self, each) for each in facts.DEVICE} | {name: 1.0})
        return tied, one.ratios()[tied]

    def time(self, tau: _Quantity) -> _Quantity:
        """Time in s, from dimensionless time: a float or an array of any shape."""
        return tau / self.natural_frequency

    def displacement(self, x: _Quantity) -> _Quantity:
        """Displacement in m, from a dimensionless one: a float or an array of any shape."""
        return x * self.length_scale

    def velocity(self, v: _Quantity) -> _Quantity:
        """Velocity in m/s, from a dimensionless one: a float or an array of any shape."""
        return v * self.scale("velocity")

    def acceleration(self, a: _Quantity) -> _Quantity:
        """Acceleration in m/s^2, from a dimensionless one: a float or an array of any shape."""
        return a * (self.length_scale * self.natural_frequency**2)

    def force(self, p: _Quantity) -> _Quantity:
        """Force in N, from a dimensionless one: a float or an array of any shape."""
        return p * self.friction_force

    def energy(self, e: _Quantity) -> _Quantity:
        """Energy in J, from a dimensionless one: a float or an array of any shape."""
        return e * (self.friction_force * self.length_scale)


def load_parameters(path: str | PathLike[str]) -> Parameters | PhysicalParameters:
    """The parameters in a TOML file: dimensionless or physical, never a mix.

    The keys stand at the top level and are the fields of `Parameters` (each missing one takes
    the case study's value) or of `PhysicalParameters` (all but g required). Raises `InvalidInput`
    when the file cannot be read, is not TOML, or holds a key or a value that is not allowed.
    """
    table = read_toml(path)
    dimensionless, physical = names_of(Parameters), names_of(PhysicalParameters)
    for name in table:
        if name not in dimensionless and name not in physical:
            allowed = f"one of {', '.join(dimensionless)}, or of {', '.join(physical)}"
            raise InvalidInput("parameter", name, allowed)
    given = [name for name in physical if name in table]
    if not given:
        return Parameters(**table)
    for name in dimensionless:
        if name in table:
            raise InvalidInput(name, table[name], f"absent where {given[0]} is given in SI units")
    if missing := [name for name in physical if name not in {**table, **facts.DEVICE_DEFAULTS}]:
        raise InvalidInput("file", str(path), f"a whole device, with {', '.join(missing)} too")
    return PhysicalParameters(**table)


def read_toml(path: str | PathLike[str]) -> dict[str, Any]:
    """What a TOML file holds; raises `InvalidInput` when it cannot be read or is not TOML."""
    try:
        import tomllib
        from pathlib import Path

        return tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidInput("file", str(path), f"readable ({error.strerror})") from error
    except ValueError as error:  # neither UTF-8 nor TOML
        raise InvalidInput("file", str(path), f"a TOML file ({error})") from error
    except RecursionError:
        raise InvalidInput(
            "file", str(path), "a TOML file with fewer brackets in each other"
        ) from None
