"""The parameters of a scene: dimensionless, or of a device in SI units.

Definitions and scaling of the paper's scene are those of Section 2 of the paper (Guo & Liu,
Physica D, 2019, doi 10.1016/j.physd.2019.04.008).
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields
from functools import cache, cached_property
from importlib import import_module
from os import PathLike
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

from capsule_sym._arguments import checked, is_real
from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._units import Scales
from capsule_sym.generated.capsule.parameters import DeviceFields, Fields, Relations

if TYPE_CHECKING:
    from capsule_sym._closed_forms import Kernels

SHIPPED = ("capsule", "slope", "prototype", "reaction", "reaction_pulse")
"""Names of the scenes that ship; the first is the paper's."""
_ALLOWED = f"{', '.join(SHIPPED)}, or a folder that `python -m capsule_sym.codegen` wrote"
_Kind = TypeVar("_Kind", bound="_Frozen")
_MODULES = {"dataclasses": "parameters", "code": "kernels"}


class Scene:
    """Generated code of a scene: modules as attributes, imported on first use.

    `facts` describes parameters, state and fields, `switching` switching planes. `formulas` has
    forces, rates and gradients within a segment, `code` its closed form with derivatives,
    `dataclasses` the base classes of parameters.
    """

    facts: ModuleType
    formulas: ModuleType
    dataclasses: ModuleType
    switching: ModuleType
    code: ModuleType

    def __init__(self, source: str, package: str) -> None:
        self.source, self.package = source, package
        """Name of a shipped scene or a folder, and the package of the code."""

    def __getattr__(self, name: str) -> Any:
        if name not in Scene.__annotations__:
            raise AttributeError(f"a scene has no attribute {name!r}")
        found = import_module(f"{self.package}.{_MODULES.get(name, name)}")
        setattr(self, name, found)
        return found

    def __repr__(self) -> str:
        return f"<Scene {self.name}>"

    def __reduce__(self) -> Any:
        return scene, (self.source,)

    @property
    def name(self) -> str:
        """Name of the declaration, such as "capsule"."""
        return str(self.facts.SCENE)

    @property
    def entry(self) -> dict[str, str]:
        """Entry "scene" of records, by which `scene_in` finds the scene; empty for the paper's."""
        return {} if self is CAPSULE else {"scene": self.source}

    @property
    def shown(self) -> str:
        """Name in messages, with its folder if it is not a shipped one."""
        return self.name if self.source in SHIPPED else f"{self.name} in {self.source}"

    @property
    def told(self) -> str:
        """Name in messages about a scene other than the paper's."""
        return "" if self is CAPSULE else f" (scene {self.shown})"

    @property
    def digest(self) -> str:
        """Digest of the inputs from which the code was generated."""
        return str(import_module(self.package).DIGEST)

    @cached_property
    def kernels(self) -> Kernels:
        """Closed forms of segments, in doubles."""
        return self.kernels_by()

    def kernels_by(self, *functions: Any) -> Kernels:
        """Closed forms of segments, by mpmath's functions or others of their names."""
        from capsule_sym._closed_forms import Harmonic, Kernels  # loads NumPy

        return (Kernels if self.facts.PULSED else Harmonic)(self.code, *functions)

    @cached_property
    def records(self) -> Any:
        """Types of the C core's records, for arrays of NumPy."""
        from capsule_sym.generated.interface import records  # loads NumPy

        return records(self.facts)

    @cached_property
    def Parameters(self) -> type[SceneParameters]:
        """Class of the dimensionless parameters."""
        if self is CAPSULE:
            return Parameters
        return self._class("Parameters", SceneParameters, self.dataclasses.Fields)

    @cached_property
    def PhysicalParameters(self) -> type[SceneDevice]:
        """Class of the parameters of a device in SI units."""
        if self is CAPSULE:
            return PhysicalParameters
        own = self.dataclasses
        return self._class("PhysicalParameters", SceneDevice, own.DeviceFields, own.Relations)

    def values(self, **quantities: Any) -> Any:
        """Device of these quantities without checks: numbers or any values with arithmetic.

        It has `ratios()` and the units of a device, and no `dimensionless()`.
        """
        bases = (SimpleNamespace, self.dataclasses.Relations, Scales)
        return type("Values", bases, {"scene": self})(**quantities)

    def _class(self, name: str, base: type[_Kind], *generated: Any) -> type[_Kind]:
        """Frozen class of generated classes, the first of which has the fields, and a base."""
        held = {
            "scene": self,
            "__slots__": (),
            "__doc__": f"{base.__doc__}",
            "__module__": "capsule_sym.scenes",
            "__qualname__": f"{self.name}.{name}",
        }
        made: type[_Kind] = type(name, (*generated, base), held)
        return checked(dataclass(frozen=True)(made))


_known: dict[str, Scene] = {}


def scene(source: str) -> Scene:
    """Scene of a shipped name, or of a folder that was loaded before; it runs no code of a folder.

    Names in files are read by it. Raises InvalidInput for any other.
    """
    if not isinstance(source, str) or "\0" in source:
        raise InvalidInput("scene", source, _ALLOWED)
    if source in SHIPPED:
        return _known.setdefault(source, Scene(source, f"capsule_sym.generated.{source}"))
    if (found := _known.get(os.path.realpath(source))) is None:
        why = "; its code runs, so name it yourself: --scene FOLDER, or scenes.load in Python"
        raise InvalidInput("scene", source, f"{_ALLOWED}{why}")
    return found


def load(source: str | os.PathLike[str]) -> Scene:
    """Scene of a shipped name, or of a folder that `capsule_sym.codegen` wrote, whose code runs.

    Raises InvalidInput if there is neither, and for a folder that is not as it was written. One
    that was loaded before is not read again.
    """
    source = os.fspath(source) if isinstance(source, os.PathLike) else source
    with suppress(InvalidInput):
        return scene(source)
    if not isinstance(source, str) or "\0" in source or not os.path.isdir(source):
        raise InvalidInput("scene", source, _ALLOWED)
    from capsule_sym._folders import imported  # loads hashlib

    folder, package = os.path.realpath(source), f"_capsule_sym_scene_{len(_known)}"
    imported(source, folder, package)
    return _known.setdefault(folder, Scene(folder, package))


def as_scene(given: Scene | str) -> Scene:
    """Scene given as such, by name, or by a folder that was loaded before."""
    return given if isinstance(given, Scene) else scene(given)


CAPSULE = scene(SHIPPED[0])
"""The paper's scene."""


def _number(facts: ModuleType, name: str, value: Any, positive: bool | None = None) -> float:
    """Value as a float; raises InvalidInput unless it is allowed for the parameter."""
    positive = name in facts.POSITIVE if positive is None else positive
    least = 0.0 if name not in facts.SIGNED else -math.inf
    allowed = "finite" + ("" if least else " and > 0" if positive else " and >= 0")
    # Types whose conversion to double would silently drop digits (mpf, Fraction, strings) are
    # refused, and so is bool, which is an int in Python.
    if not is_real(value):
        raise InvalidInput(name, value, f"a real number, {allowed}")
    number = float(value)
    if not math.isfinite(number) or number < least or (positive and number == 0):
        raise InvalidInput(name, number, allowed)
    return number


class _Frozen:
    """Base of the parameters of a scene and of a device."""

    __slots__ = ()
    scene: ClassVar[Scene]

    def __post_init__(self) -> None:
        for name in names_of(self):
            value = _number(self.scene.facts, name, getattr(self, name))
            object.__setattr__(self, name, value)

    def __reduce__(self) -> Any:
        return _made, (self.scene.source, type(self).__name__, tuple(self.to_dict().values()))

    @checked
    def replace(self, **changes: float) -> Self:
        """Return a copy with some parameters changed.

        Raises `InvalidInput` like construction, and for an unknown name.
        """
        for name in changes:
            check_one_of("parameter", name, names_of(self), self.scene.told)
        return type(self)(**self.to_dict() | changes)

    def to_dict(self) -> dict[str, float]:
        """Return the parameters by name, in the order of the fields."""
        return {name: getattr(self, name) for name in names_of(self)}


def _made(source: str, kind: str, values: tuple[float, ...]) -> Any:
    """Parameters from pickled values."""
    return getattr(scene(source), kind)(*values)


def names_of(parameters: Any) -> tuple[str, ...]:
    """Names of parameters, dimensionless or of a device, from a set of them or its type."""
    return _names_of(parameters if isinstance(parameters, type) else type(parameters))


@cache
def _names_of(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in fields(kind))


class SceneParameters(_Frozen):
    """Dimensionless parameters of a scene.

    Every value is converted to a float. Raises `InvalidInput` unless all are finite, of the signs
    that the scene's declaration gives, and shares in their ranges, and unless two stops are apart.
    A run checks the other ranges.
    """

    __slots__ = ()
    alpha: float
    omega: float
    zeta: float
    gamma: float

    def __post_init__(self) -> None:
        _Frozen.__post_init__(self)
        for name, (low, high) in self.scene.facts.RANGES.items():
            if high < 1 and not low <= getattr(self, name) <= high:  # a share
                raise InvalidInput(name, getattr(self, name), f"in [{low!r}, {high!r}]")
        gaps = [name for name, _ in self.scene.facts.STOPS]
        if len(gaps) > 1 and sum(getattr(self, name) for name in gaps) == 0:
            raise InvalidInput(" + ".join(gaps), 0.0, "> 0, or the stops overlap")

    @property
    def period(self) -> float:
        """Period of the excitation, 2 pi / omega (dimensionless)."""
        return 2 * math.pi / self.omega


class SceneDevice(_Frozen, Scales):
    """Parameters of a device of a scene in SI units, with the scales of results in SI units.

    Every value is converted to a float. Raises `InvalidInput` unless all are finite and of the
    signs that the scene's declaration gives, unless the friction force, the natural frequency and
    the length scale are representable and above 0, and unless the dimensionless parameters are
    allowed; and for a scene that declares no device.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        if not self.scene.facts.DEVICE:
            raise InvalidInput("device", "", "absent: the model declares none")
        _Frozen.__post_init__(self)
        for name in ("friction_force", "natural_frequency", "length_scale"):
            _number(self.scene.facts, name, getattr(self, name), True)
        self.dimensionless()

    def ratios(self) -> dict[str, Any]:
        """Dimensionless parameters by name."""
        raise NotImplementedError

    def dimensionless(self) -> SceneParameters:
        """Return the dimensionless parameters of this device; f_b, if there is one, is 1."""
        try:
            return self.scene.Parameters(**self.ratios())
        except InvalidInput as error:
            raise self._cause(error) from error

    def _cause(self, error: InvalidInput) -> InvalidInput:
        """Error about the quantity of the device that causes an error about a parameter.

        It is a quantity proportional to the parameter, or an optional one whose default is allowed.
        Without such a quantity it is the error about the parameter.
        """
        facts = self.scene.facts
        causes = [name for name, (tied, _) in facts.DRIVEN.items() if tied == error.field]
        causes += (name for name, good in facts.DEVICE_DEFAULTS.items() if self._allows(name, good))
        for name in causes:
            of = f"{error.field}, the {facts.LABELS.get(error.field, 'parameter')},"
            return InvalidInput(name, getattr(self, name), f"such that {of} is {error.allowed}")
        return error

    def _allows(self, name: str, value: float) -> bool:
        """True if the device has dimensionless parameters with another value of a quantity."""
        try:
            ratios = self.scene.values(**self.to_dict() | {name: value}).ratios()
            return bool(self.scene.Parameters(**ratios))
        except InvalidInput:
            return False

    @property
    def rate(self) -> float:
        """Angular frequency of the drive (rad/s)."""
        for name, (tied, unit) in self.scene.facts.DRIVEN.items():
            if tied == "omega" and unit == "rad/s":
                return float(getattr(self, name))
        return self.dimensionless().omega * self.natural_frequency

    @checked
    def tie(self, name: str) -> tuple[str, float]:
        """Parameter proportional to a quantity, such as P_d, and its value for 1 SI unit of that.

        These quantities do not change the units of force, length and time. Raises `InvalidInput`
        for another name.
        """
        facts = self.scene.facts
        check_one_of("parameter", name, facts.DRIVEN, f", of the device{self.scene.told}")
        tied = facts.DRIVEN[name][0]
        one = self.scene.values(
            **{each: getattr(self, each) for each in facts.DEVICE} | {name: 1.0}
        )
        return tied, one.ratios()[tied]


@checked
@dataclass(frozen=True, slots=True)
class Parameters(Fields, SceneParameters):
    """Dimensionless parameters of Eqs. (7)-(12); the defaults are the case study's.

    Every value is converted to a float. Raises `InvalidInput` unless all are finite, omega,
    gamma and f_b are > 0 and the others are >= 0. The ranges below are those of a run. The
    quantities of a device in the definitions are those of `PhysicalParameters`: P_f is its
    `friction_force`, Omega0 its `natural_frequency`.

    Parameters
    ----------
    alpha : float, default 0.7, 0 to 1e+10
        Excitation amplitude, P_d / P_f. Dimensionless.
    omega : float, default 0.8, 1e-06 to 1000000
        Excitation frequency, Omega / Omega0. Dimensionless.
    delta : float, default 0.02, 0 to 1e+10
        Gap, k1 G / P_f. Dimensionless.
    zeta : float, default 0.05, 0 to 10000
        Damping ratio, c / (2 M_m Omega0). Dimensionless.
    beta : float, default 1.5, 0 to 1e+10
        Stiffness ratio, k2 / k1. Dimensionless.
    gamma : float, default 3.3, 1e-08 to 100000000
        Mass ratio, M_c / M_m. Dimensionless.
    f_b : float, default 1.0, 1e-10 to 1e+10
        Friction bound, max|F_r| / P_f; 1 for dry friction. Dimensionless.

    See Also
    --------
    PhysicalParameters : a device in SI units; its `dimensionless()` gives these parameters.
    load_parameters : parameters in a file.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> cs.Parameters(alpha=0.9)
    Parameters(alpha=0.9, omega=0.8, delta=0.02, zeta=0.05, beta=1.5, gamma=3.3, f_b=1.0)
    >>> cs.Parameters(gamma=0)
    Traceback (most recent call last):
    ...
    capsule_sym._errors.InvalidInput: gamma = 0.0: must be finite and > 0
    """

    scene: ClassVar[Scene] = CAPSULE


@checked
@dataclass(frozen=True, slots=True)
class PhysicalParameters(DeviceFields, Relations, SceneDevice):  # type: ignore[override]
    """Parameters of the device in SI units, with the scales of results in SI units.

    Every value is converted to a float. Raises `InvalidInput` unless all are finite, the masses,
    k1, Omega, mu and g are > 0 and the others are >= 0, and unless the friction force, the
    natural frequency, the length scale and the dimensionless parameters are representable.

    Parameters
    ----------
    M_m : float, above 0
        Mass that moves inside the capsule (kg).
    M_c : float, above 0
        Mass of the capsule without the inner mass (kg).
    k1 : float, above 0
        Stiffness of the spring between mass and capsule (N/m).
    k2 : float, at least 0
        Stiffness of the spring that the mass meets after the gap (N/m).
    c : float, at least 0
        Damping coefficient between mass and capsule (N s/m).
    G : float, at least 0
        Distance between the mass at rest and the second spring (m).
    P_d : float, at least 0
        Amplitude of the force that drives the inner mass (N).
    Omega : float, above 0
        Angular frequency of the driving force (rad/s).
    mu : float, above 0
        Coulomb friction between the capsule and what it lies on (dimensionless).
    g : float, default 9.81, above 0
        Gravitational acceleration (m/s^2).

    See Also
    --------
    Parameters : the dimensionless parameters.
    load_parameters : parameters in a file.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> device = cs.PhysicalParameters(
    ...     M_m=0.5, M_c=1.65, k1=50, k2=75, c=0.5, G=0.0017, P_d=3.0, Omega=8.0, mu=0.2
    ... )
    >>> parameters = device.dimensionless()
    >>> print(f"alpha = {parameters.alpha:.6f}, omega = {parameters.omega:.3f}")
    alpha = 0.711187, omega = 0.800
    >>> print(f"{device.scale('x_r'):.6f} m")  # the unit of length
    0.084366 m
    """

    scene: ClassVar[Scene] = CAPSULE


def of_paper(parameters: SceneParameters) -> Parameters:
    """Parameters of the paper's scene; raises InvalidInput for those of another."""
    if not isinstance(parameters, Parameters):
        raise InvalidInput("scene", parameters.scene.shown, f"{CAPSULE.name}, the paper's")
    return parameters


def load_parameters(path: str | PathLike[str]) -> SceneParameters | SceneDevice:
    """Parameters in a TOML file: dimensionless or of a device, never a mix.

    Keys are at the top level. The key `scene` is the name of a shipped scene, or a folder, relative
    to the file, that was loaded before. Without it the scene is the paper's. The other keys are the
    fields of the scene's `Parameters` or of its `PhysicalParameters`. Each missing field of
    `Parameters` takes its default. All fields of `PhysicalParameters` are required except those
    with a default.

    Parameters
    ----------
    path : str or PathLike
        Name of the file.

    Returns
    -------
    Parameters or PhysicalParameters
        Parameters of the scene, dimensionless, or those of a device in SI units.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is not TOML, mixes both kinds, lacks a quantity of a device, or
        has a key or a value that is not allowed.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> import capsule_sym as cs
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "capsule.toml")
    ...     _ = path.write_text("alpha = 0.9")
    ...     print(cs.load_parameters(path).alpha)
    0.9
    """
    return read_parameters(path, CAPSULE)


def read_parameters(path: str | PathLike[str], otherwise: Scene) -> SceneParameters | SceneDevice:
    """Parameters in a TOML file, as `load_parameters` reads it; without `scene` of `otherwise`."""
    from capsule_sym._files import read_toml

    table = read_toml(path)
    named = scene_in(table, path)
    of = named or otherwise
    table.pop("scene", None)
    dimensionless, physical = of.facts.PARAMETERS, tuple(of.facts.DEVICE)
    for name in table:
        if name not in dimensionless and name not in physical:
            allowed = f"one of {', '.join(dimensionless)}"
            allowed += f", or of {', '.join(physical)}" if physical else ""
            allowed += of.told
            raise InvalidInput("parameter", name, allowed)
    given = [name for name in physical if name in table]
    if not given:
        return of.Parameters(**table)
    for name in dimensionless:
        if name in table:
            raise InvalidInput(name, table[name], f"absent where {given[0]} is given in SI units")
    known = {**table, **of.facts.DEVICE_DEFAULTS}
    if missing := [name for name in physical if name not in known]:
        whole = f"a whole device, with {', '.join(missing)} too{of.told}"
        raise InvalidInput("file", str(path), whole)
    return of.PhysicalParameters(**table)


def scene_in(table: Mapping[str, Any], path: str | PathLike[str] = "") -> Scene | None:
    """Scene named by a table or record, with folders relative to the file; None if none is named.

    Raises InvalidInput for an unknown scene.
    """
    if "scene" not in table:
        return None
    named = table["scene"]
    if not isinstance(named, str):
        raise InvalidInput("scene", named, _ALLOWED)
    return scene(named if named in SHIPPED else os.path.join(os.path.dirname(path), named))
