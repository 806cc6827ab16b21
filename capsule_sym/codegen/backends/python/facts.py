"""Facts of parameters, state, fields and devices, and dataclasses of parameters, in Python."""

from __future__ import annotations

from typing import Any

from capsule_sym._symbolic.model import declaration
from capsule_sym._symbolic.model.consistency import UNITS
from capsule_sym._symbolic.model.model import LOAD, REACTS, SEGMENTS, WEIGHT
from capsule_sym._symbolic.model.parts import DeclaredUnit, Quantity, shown, spelled
from capsule_sym._symbolic.model.symbols import MODEL, PULSED


def texts() -> dict[str, str]:
    """Constants, the members of dataclasses, and the relations of a device."""
    return {
        "facts": assigned(values(), _ABOUT),
        "parameter_fields": "\n".join(
            f"    {p.name}: float = {float(p.default)!r}\n"
            f"    {documented(f'{p.label[:1].upper()}{p.label[1:]}, {p.definition}.')}"
            for p in MODEL.parameters
        ),
        "device_fields": "\n".join(
            f"    {q.name}: float{f' = {float(q.value)!r}' if q.optional else ''}\n"
            f"    {documented(_about_quantity(q))}"
            for q in MODEL.quantities
        ),
        "relations": _relations(),
    }


def _about_quantity(one: Quantity) -> str:
    return f"{one.about.removesuffix('.')} ({one.unit or 'dimensionless'})."


def _about_unit(one: DeclaredUnit) -> str:
    return f"{one.about}: {one.letter} = {shown(one.relation)} ({UNITS[one.name]})."


def documented(text: str) -> str:
    """Docstring of a text of one line: quotes and backslashes are escaped."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"""{escaped}"""'


def assigned(values: dict[str, object], about: dict[str, str]) -> str:
    """Assignments of constants, each with its docstring."""
    return "\n".join(f'{name} = {value!r}\n"""{about[name]}"""' for name, value in values.items())


_ABOUT = {
    "SCENE": "Name of the scene.",
    "PARAMETERS": "Parameters of the model, in their order.",
    "STATE": "Symbols of the state.",
    "DEFAULTS": "Default values of the parameters.",
    "RANGES": "Least and largest value in a run.",
    "POSITIVE": "Parameters, dimensionless and of a device, above 0.",
    "SIGNED": "Parameters of either sign; all others are at least 0.",
    "LABELS": "Labels of parameters and state.",
    "TEX": "Symbols of parameters and state in TeX.",
    "DEVICE": "Quantities of a device with their units, in their order.",
    "DEVICE_LABELS": "Labels of the quantities.",
    "DEVICE_DEFAULTS": "Defaults of optional quantities.",
    "DRIVEN": "Quantities proportional to one parameter: that parameter and the units.",
    "BOUNDS": "Friction bounds, by the direction of drift.",
    "SYMMETRIC": "True if a motion without contact has a mirror image, half a period later.",
    "STOPS": "Distances of the stops, in front and behind, and the stiffnesses of their springs.",
    "FIELDS": "Fields by number: contact (1 in front, 2 behind, 0 none), drift (1, -1, 0 at rest).",
    "FIELD_OF": "Number of the field by both, at the high level of the drive.",
    "LEVELS": "Level of the drive in each field: 0 is the high one of pulses, 1 the low one.",
    "PULSED": "True if the drive is constant except for a rise and a fall in each period.",
    "REACTS": "True if the drive pushes back on the capsule.",
    "LIFTS": "True if progression lifts the bodies against a constant force, as on a slope.",
    "MODES": "Modes of operation of the fields in the paper's notation, in their order.",
}


def values() -> dict[str, Any]:
    """Facts by name."""
    own, device = MODEL.parameters, MODEL.quantities
    fields = {g.index: (g.contact, g.drift) for g in SEGMENTS}
    gaps = (way * place for way, place in zip((1, -1), MODEL.stops, strict=False))
    return {
        "SCENE": declaration.path().stem,
        "PARAMETERS": tuple(p.name for p in own),
        "STATE": tuple(MODEL.state_labels),
        "DEFAULTS": {p.name: float(p.default) for p in own},
        "RANGES": {p.name: (float(p.low), float(p.high)) for p in own},
        "POSITIVE": (*(p.name for p in own if p.positive), *(q.name for q in device if q.low > 0)),
        "SIGNED": (*(p.name for p in own if p.signed), *(q.name for q in device if q.low < 0)),
        "LABELS": {p.name: p.label for p in own} | MODEL.state_labels,
        "TEX": {p.name: p.tex for p in own} | {name: name for name in MODEL.state_labels},
        "DEVICE": {q.name: q.unit for q in device},
        "DEVICE_LABELS": {q.name: q.label for q in device},
        "DEVICE_DEFAULTS": {q.name: float(q.value) for q in device if q.optional},
        "DRIVEN": MODEL.driven,
        "BOUNDS": {way: str(bound) for way, bound in MODEL.bounds.items()},
        "SYMMETRIC": MODEL.bounds[1] == MODEL.bounds[-1] and MODEL.load == 0 and not PULSED,
        "STOPS": tuple((str(gap), str(k)) for gap, k in zip(gaps, MODEL.springs, strict=True)),
        "FIELDS": fields,
        "FIELD_OF": {fields[g.index]: g.index for g in SEGMENTS if g.level == 0},
        "LEVELS": {g.index: g.level for g in SEGMENTS},
        "PULSED": PULSED,
        "REACTS": REACTS,
        "LIFTS": WEIGHT != LOAD,
        "MODES": tuple(g.mode for g in SEGMENTS),
    }


def _relations() -> str:
    """Units of a device as properties, and the method `ratios`, each from a relation."""
    own = {unit.letter: unit.name for unit in MODEL.units}

    def written(relation: str) -> str:
        return spelled(
            MODEL.in_quantities(relation), lambda name: f"self.{own.get(name, name)}", "_root"
        )

    properties = (
        f"    @property\n    def {unit.name}(self: Any) -> float:\n"
        f"        {documented(_about_unit(unit))}\n"
        f"        return {written(unit.relation)}\n\n"
        for unit in MODEL.units
    )
    ratios = (f'            "{p.name}": {written(p.si)},\n' for p in MODEL.parameters if p.si)
    return (
        f"{''.join(properties)}    def ratios(self: Any) -> dict[str, Any]:\n"
        '        """The dimensionless parameters by name, in the arithmetic of the quantities."""\n'
        f"        return {{\n{''.join(ratios)}        }}"
    )
