"""What is told of parameters, state and fields anywhere, for Python and for the explorer's page."""

from __future__ import annotations

import json
from pprint import pformat

from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.symbols import MODEL

_ABOUT = {
    "PARAMETERS": "Parameters of the model, in their order.",
    "STATE": "Symbols of the state.",
    "DEFAULTS": "Parameters that are not given.",
    "RANGES": "Least and largest value that a run takes.",
    "POSITIVE": "Parameters above 0.",
    "SIGNED": "Parameters of either sign; all others are at least 0.",
    "LABELS": "Names of parameters and state in words.",
    "TEX": "Their symbols in TeX.",
    "DRIVEN": "What of a device one parameter alone is in proportion to, and its unit.",
    "BOUNDS": "The friction bounds, by the way of drift.",
    "SYMMETRIC": "Whether a motion without contact has a mirror image, half a period later.",
    "FIELDS": "Fields by number: whether the second spring acts, and the drift's way (0 at rest).",
    "FIELD_OF": "Number of the field by both.",
}


def python_facts() -> str:
    """Assignments of Python, each with its docstring."""
    own = MODEL.parameters
    fields = {g.index: (int(g.contact), g.drift) for g in SEGMENTS}
    found = {
        "PARAMETERS": tuple(p.name for p in own),
        "STATE": tuple(MODEL.state_labels),
        "DEFAULTS": {p.name: float(p.default) for p in own},
        "RANGES": {p.name: (float(p.low), float(p.high)) for p in own},
        "POSITIVE": tuple(p.name for p in own if p.positive),
        "SIGNED": tuple(p.name for p in own if p.signed),
        "LABELS": {p.name: p.label for p in own} | MODEL.state_labels,
        "TEX": {p.name: p.tex for p in own} | {name: name for name in MODEL.state_labels},
        "DRIVEN": {p.device[0]: (p.name, p.device[1]) for p in own if p.device},
        "BOUNDS": {way: str(bound) for way, bound in MODEL.bounds.items()},
        "SYMMETRIC": MODEL.bounds[1] == MODEL.bounds[-1] and MODEL.load == 0,
        "FIELDS": fields,
        "FIELD_OF": {mode: number for number, mode in fields.items()},
    }
    return "\n".join(
        f'{name} = {pformat(value, width=90, sort_dicts=False)}\n"""{_ABOUT[name]}"""'
        for name, value in found.items()
    )


def python_fields() -> str:
    """Fields of Python's dataclass of parameters, each with its docstring."""
    return "\n".join(
        f'    {p.name}: float = {float(p.default)!r}\n    """{_sentence(p.label, p.definition)}"""'
        for p in MODEL.parameters
    )


def _sentence(label: str, definition: str) -> str:
    return f"{label[0].upper()}{label[1:]}, {definition}."


def page_facts() -> str:
    """Number fields of the explorer's page, in TypeScript."""
    fields = {
        p.name: {
            "kind": "number",
            "symbol": p.letter,
            "name": p.label,
            "low": p.low,
            "high": p.high,
            "value": p.default,
            "about": p.about,
            "slider": p.slider,
        }
        for p in MODEL.parameters
    }
    names = json.dumps([p.name for p in MODEL.parameters])
    rows = "".join(
        f"  {name}: {json.dumps(field, ensure_ascii=False)},\n" for name, field in fields.items()
    )
    modes = {g.index: {"contact": g.contact, "drift": g.drift} for g in SEGMENTS}
    return (
        f"export const FIELDS: Record<number, {{ contact: boolean; drift: number }}> = "
        f"{json.dumps(modes)};\n"
        f"export const PARAMETERS = {names} as const;\n"
        f"export const PARAMETER_FIELDS = {{\n{rows}}} as const;\n"
    )
