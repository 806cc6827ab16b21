"""A system: parameters of a scene, or of a device in SI units, and what a design varies of them."""

from __future__ import annotations

from capsule_sym._errors import InvalidInput
from capsule_sym._map.checks import real as real
from capsule_sym._parameters import SceneDevice, SceneParameters, names_of

System = SceneParameters | SceneDevice


def dimensionless(system: System) -> SceneParameters:
    """The dimensionless parameters of a system."""
    return system if isinstance(system, SceneParameters) else system.dimensionless()


def values_of(system: System) -> dict[str, float]:
    """The parameters of a system with their values."""
    return {name: getattr(system, name) for name in names_of(system)}


def check_parameter(field: str, name: str, system: System, *further: str) -> None:
    """Raise InvalidInput unless a name is that of a system's parameter, or a further one."""
    if name not in (names := (*names_of(system), *further)):
        facts, device = system.scene.facts, isinstance(system, SceneDevice)
        known = name in (facts.PARAMETERS if device else facts.DEVICE)
        why = "dimensionless, and a device is" if device else "a quantity of a device, and none is"
        more = f"; {name} is {why} given" * known
        raise InvalidInput(field, name, f"one of {', '.join(names)}{more}")


def drives(system: System) -> dict[str, float]:
    """Parameters of the drive, amplitude and frequency first, each with its scale.

    Of a device these are the quantities proportional to them, with the SI value of the
    dimensionless parameter's unit; dimensionless parameters have the scale 1.
    """
    facts = system.scene.facts
    names = ("alpha", "omega", *(name for name in ("alpha_low", "D") if facts.PULSED))
    if isinstance(system, SceneParameters):
        return dict.fromkeys(names, 1.0)
    units = dict.fromkeys(names, system.friction_force)
    units |= {"omega": system.natural_frequency, "D": 1.0}
    tied = {parameter: name for name, (parameter, _) in facts.DRIVEN.items()}
    return {tied[name]: units[name] for name in names if name in tied}
