"""What is told of parameters, state and fields anywhere, for Python and for the explorer's page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pprint import pformat
from typing import Any

from capsule_sym._symbolic.model.consistency import UNITS
from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.parts import shown, spelled
from capsule_sym._symbolic.model.symbols import MODEL

_ABOUT = {
    "PARAMETERS": "Parameters of the model, in their order.",
    "STATE": "Symbols of the state.",
    "DEFAULTS": "Parameters that are not given.",
    "RANGES": "Least and largest value that a run takes.",
    "POSITIVE": "Parameters, dimensionless and of a device, above 0.",
    "SIGNED": "Parameters of either sign; all others are at least 0.",
    "LABELS": "Names of parameters and state in words.",
    "TEX": "Their symbols in TeX.",
    "DEVICE": "Quantities of a device with their units, in their order.",
    "DEVICE_LABELS": "Their names in words.",
    "DEVICE_DEFAULTS": "Those that need not be given.",
    "DRIVEN": "Quantities to which one parameter is in proportion, it, and their units.",
    "BOUNDS": "The friction bounds, by the way of drift.",
    "SYMMETRIC": "Whether a motion without contact has a mirror image, half a period later.",
    "FIELDS": "Fields by number: whether the second spring acts, and the drift's way (0 at rest).",
    "FIELD_OF": "Number of the field by both.",
    "MODES": "Modes of operation of the fields in the paper's notation, in their order.",
}


def python_facts() -> str:
    """Assignments of Python, each with its docstring."""
    own, device = MODEL.parameters, MODEL.quantities
    fields = {g.index: (int(g.contact), g.drift) for g in SEGMENTS}
    found = {
        "PARAMETERS": tuple(p.name for p in own),
        "STATE": tuple(MODEL.state_labels),
        "DEFAULTS": {p.name: float(p.default) for p in own},
        "RANGES": {p.name: (float(p.low), float(p.high)) for p in own},
        "POSITIVE": (*(p.name for p in own if p.positive), *(q.name for q in device if q.low > 0)),
        "SIGNED": tuple(p.name for p in own if p.signed),
        "LABELS": {p.name: p.label for p in own} | MODEL.state_labels,
        "TEX": {p.name: p.tex for p in own} | {name: name for name in MODEL.state_labels},
        "DEVICE": {q.name: q.unit for q in device},
        "DEVICE_LABELS": {q.name: q.label for q in device},
        "DEVICE_DEFAULTS": {q.name: float(q.value) for q in device if q.optional},
        "DRIVEN": MODEL.driven,
        "BOUNDS": {way: str(bound) for way, bound in MODEL.bounds.items()},
        "SYMMETRIC": MODEL.bounds[1] == MODEL.bounds[-1] and MODEL.load == 0,
        "FIELDS": fields,
        "FIELD_OF": {mode: number for number, mode in fields.items()},
        "MODES": tuple(g.mode for g in SEGMENTS),
    }
    return "\n".join(
        f'{name} = {pformat(value, width=90, sort_dicts=False)}\n"""{_ABOUT[name]}"""'
        for name, value in found.items()
    )


def python_fields() -> str:
    """Fields of Python's dataclass of parameters, each with its docstring."""
    return "\n".join(
        f"    {p.name}: float = {float(p.default)!r}\n"
        f'    """{p.label[:1].upper()}{p.label[1:]}, {p.definition}."""'
        for p in MODEL.parameters
    )


def python_device() -> str:
    """Fields of Python's dataclass of a device, likewise."""
    return "\n".join(
        f"    {q.name}: float{f' = {float(q.value)!r}' if q.optional else ''}\n"
        f'    """{q.about.removesuffix(".")} ({q.unit or "dimensionless"})."""'
        for q in MODEL.quantities
    )


def python_relations() -> str:
    """The device's units as properties, and the method `ratios`, of which each is a relation."""
    own = {unit.letter: unit.name for unit in MODEL.units}

    def written(relation: str) -> str:
        return spelled(relation, lambda name: f"self.{own.get(name, name)}", "_root")

    properties = (
        f"    @property\n    def {unit.name}(self: Any) -> float:\n"
        f'        """{unit.about}: {unit.letter} = {shown(unit.relation)}'
        f' ({UNITS[unit.name]})."""\n'
        f"        return {written(unit.relation)}\n\n"
        for unit in MODEL.units
    )
    ratios = (f'            "{p.name}": {written(p.si)},\n' for p in MODEL.parameters if p.si)
    return (
        f"{''.join(properties)}    def ratios(self: Any) -> dict[str, Any]:\n"
        '        """The dimensionless parameters by name, in the arithmetic of the quantities."""\n'
        f"        return {{\n{''.join(ratios)}        }}"
    )


def page_facts() -> str:
    """Number fields of the explorer's page, in TypeScript, and the relations of a device."""
    parameters = {p.name: _page_field(p, p.default) for p in MODEL.parameters}
    device = {
        q.name: _page_field(q, q.value, **({"unit": q.unit.replace("^2", "²")} if q.unit else {}))
        for q in MODEL.quantities
    }
    modes = {g.index: {"contact": g.contact, "drift": g.drift} for g in SEGMENTS}
    optional = [q.name for q in MODEL.quantities if q.optional]
    units = {unit.letter for unit in MODEL.units}

    def written(relation: str) -> str:
        return spelled(relation, lambda name: name if name in units else f"d.{name}", "Math.sqrt")

    scales = "".join(f"  const {u.letter} = {written(u.relation)};\n" for u in MODEL.units)
    kinds = "".join(f"    {u.name}: {u.letter},\n" for u in MODEL.units)
    ratios = "".join(f"      {p.name}: {written(p.si)},\n" for p in MODEL.parameters if p.si)
    return (
        f"export const FIELDS: Record<number, {{ contact: boolean; drift: number }}> = "
        f"{json.dumps(modes)};\n"
        f"export const MODES = {json.dumps([g.mode for g in SEGMENTS])} as const;\n"
        f"export const PARAMETERS = {json.dumps([*parameters])} as const;\n"
        f"export const DEVICE = {json.dumps([*device])} as const;\n"
        "/** Of a device, what need not be given. */\n"
        f"export const OPTIONAL: readonly string[] = {json.dumps(optional)};\n"
        f"export const PARAMETER_FIELDS = {_page_object(parameters)} as const;\n"
        f"export const DEVICE_FIELDS = {_page_object(device)} as const;\n"
        "export type Device = Record<(typeof DEVICE)[number], number>;\n"
        "/** The units of a device, and its dimensionless parameters. */\n"
        f"export function related(d: Device) {{\n{scales}"
        f"  return {{\n{kinds}    ratios: {{\n{ratios}    }},\n  }};\n}}\n"
    )


def _page_field(one: Any, value: float, **more: str) -> dict[str, object]:
    """A field of the page from a parameter or a quantity."""
    return {
        **{"kind": "number", "symbol": one.letter, "name": one.label},
        **{"low": one.low, "high": one.high, "value": value},
        **{"about": one.about, "slider": one.slider},
        **more,
    }


def _page_object(fields: Mapping[str, object]) -> str:
    rows = (
        f"  {name}: {json.dumps(field, ensure_ascii=False)},\n" for name, field in fields.items()
    )
    return "{\n" + "".join(rows) + "}"
