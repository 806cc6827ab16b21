"""Facts of a scene and layouts of the C library's records, in TypeScript, for the page.

python explorer/model.py SCENE      prints src/models/SCENE.ts, which `build.py` writes
"""

from __future__ import annotations

import ast
import json
import sys
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from string import Template
from typing import Any

from capsule_sym._symbolic.model import declaration

if __name__ == "__main__":  # before the modules that derive from the model of a process
    declaration.choose(declaration.home(sys.argv[1]))

import sympy as sp

from capsule_sym._symbolic.model import geometry
from capsule_sym._symbolic.model.elimination import GAPS
from capsule_sym._symbolic.model.model import ANY_LEVEL, BACKWARD, FORWARD
from capsule_sym._symbolic.model.parts import spelled
from capsule_sym._symbolic.model.symbols import MODEL, PULSES, v_c, v_r, x_r
from capsule_sym.codegen._derived import read
from capsule_sym.codegen._interface import Entry, Interface, members
from capsule_sym.codegen.backends.python import facts

HERE = Path(__file__).resolve().parent
RECORDS = ("state", "segment", "motion")
"""Records of the C library that the page reads from its memory."""
SIZES = {"int32_t": 4, "int64_t": 8, "double": 8}


def places() -> dict[tuple[int, int, int, int], str]:
    """Surface, line or corner point by the signs of v_c, the gap and v_r, and by the excess of Q.

    Of two stops the gap's sign is -2 on the one behind, and -3 beyond it. The last number is 3 (-3)
    for Q beyond its bound, 2 (-2) for Q on it, else 0; the sign is Q's.
    Off rest it has no meaning and is 0. A corner point on L9 is named before a line, O1 before O3.
    """
    levels = {3: 2 * FORWARD, 2: FORWARD, 0: sp.S.Zero, -2: -BACKWARD, -3: -2 * BACKWARD}
    force = sp.Symbol("P_3", real=True)
    order = geometry.POINTS
    pieces = [geometry.PIECES[n] for n in order] + [
        p for name, p in geometry.PIECES.items() if name not in order
    ]
    places = (0, 1, -1) if len(MODEL.stops) == 1 else (0, 1, -1, -2, -3)
    found = {}
    for v_c_sign, side, speed, level in product((0, 1, -1), places, (0, 1, -1), levels):
        if v_c_sign and level:
            continue
        contact = 1 if side > 0 else 2 if side == -3 else 0
        model = ANY_LEVEL[3 * contact + 1].pull
        for piece in pieces:
            values = {v_c: v_c_sign, v_r: speed, x_r: 1 + side, **dict.fromkeys(GAPS, 1)}
            relations = [r.subs(model, force) for r in piece.relations]
            if any(force not in r.free_symbols and _in_force(r) for r in relations):
                continue
            if all(bool(r.subs({**values, force: levels[level]}).simplify()) for r in relations):
                found[v_c_sign, side, speed, level] = piece.name
                break
    return found


def _in_force(relation: sp.Basic) -> bool:
    """True if a relation constrains the pull on the other side."""
    return len(relation.free_symbols & {x_r, v_r}) == 2


def text() -> str:
    """Parameters, fields, the relations of a device, and layouts of records of the chosen scene."""
    known = facts.values()
    parameters = {p.name: _field(p, p.default) for p in MODEL.parameters}
    device = {
        q.name: _field(q, q.value, **({"unit": q.unit.replace("^2", "²")} if q.unit else {}))
        for q in MODEL.quantities
    }
    interface = Interface(read("interface"))
    enums = {e["name"]: [n.replace("-", " ") for n in e["values"]] for e in interface.enums}
    fields = {
        index: {"contact": contact, "drift": drift, "level": known["LEVELS"][index]}
        for index, (contact, drift) in known["FIELDS"].items()
    }
    pulses = (PULSES.amplitude, PULSES.low, PULSES.share) if PULSES else ()
    # Names of events: lines and corner points, not surfaces.
    named = {",".join(map(str, at)): name for at, name in places().items() if name[0] != "S"}
    scales = (f"  const {u.letter} = {_relation(u.relation)};" for u in MODEL.units)
    ratios = (f"      {p.name}: {_relation(p.si)}," for p in MODEL.parameters if p.si)
    texts = {
        "about": json.dumps(_about(), ensure_ascii=False),
        "fields": json.dumps(fields),
        "modes": json.dumps(known["MODES"]),
        "springs": json.dumps(known["STOPS"]),
        "bounds": json.dumps(known["BOUNDS"]),
        "load": json.dumps(str(-MODEL.load) if MODEL.load else ""),
        "pulses": json.dumps([*map(str, pulses)]),
        "reacts": json.dumps(known["REACTS"]),
        "places": json.dumps(named),
        "names": json.dumps([*parameters]),
        "parameter_fields": _rows(parameters),
        "device": json.dumps([*device]),
        "optional": json.dumps([q.name for q in MODEL.quantities if q.optional]),
        "device_fields": _rows(device),
        "scales": "\n".join(scales),
        "units": "\n".join(f"    {u.name}: {u.letter}," for u in MODEL.units),
        "ratios": "\n".join(ratios),
        "stops": json.dumps(enums["stop"]),
        "outcomes": json.dumps(enums["outcome"]),
        "records": "".join(
            _record(s, interface) for s in interface.structs if s["name"] in RECORDS
        ),
    }
    return Template((HERE / "model.ts.in").read_text(encoding="utf-8")).substitute(texts)


def _about() -> str:
    """First sentence of the declaration."""
    text = ast.get_docstring(ast.parse(declaration.path().read_text(encoding="utf-8"))) or ""
    return " ".join(text.partition("\n\n")[0].split())


def _record(struct: Entry, interface: Interface) -> str:
    """Reader of a record, and its size; each member is aligned to its own size."""
    offset, rows = 0, ""
    for name, kind, length in members(struct):
        size = SIZES[kind]
        offset += -offset % size
        count = interface.number(length) if length else 1
        values = [f"{kind}(v, at + {offset + size * i})" for i in range(count)]
        value = f"[{', '.join(values)}] as const" if length else values[0]
        rows += f"  {name}: {value},\n"
        offset += size * count
    return (
        f"/** {struct['doc']} */\n"
        f"export const {struct['name']}At = (v: DataView, at: number) => ({{\n{rows}}});\n"
        f"export const {struct['name'].upper()}_SIZE = {offset + -offset % 8};\n"
    )


def _relation(relation: str) -> str:
    units = {unit.letter for unit in MODEL.units}
    own = MODEL.in_quantities(relation)
    return spelled(own, lambda name: name if name in units else f"d.{name}", "Math.sqrt")


def _field(one: Any, value: float, **more: str) -> dict[str, object]:
    """Field of the page from a parameter or a quantity."""
    return {
        **{"kind": "number", "symbol": one.letter, "name": one.label},
        **{"low": one.low, "high": one.high, "value": value},
        **{"about": one.about, "slider": one.slider},
        **more,
    }


def _rows(fields: Mapping[str, object]) -> str:
    return "\n".join(
        f"  {name}: {json.dumps(field, ensure_ascii=False)}," for name, field in fields.items()
    )


if __name__ == "__main__":
    sys.stdout.buffer.write(text().encode())
