"""TypeScript: what the explorer's page knows of the model."""

import json
from collections.abc import Mapping
from typing import Any, ClassVar

from capsule_sym._symbolic.model.model import SEGMENTS
from capsule_sym._symbolic.model.parts import spelled
from capsule_sym._symbolic.model.symbols import MODEL
from capsule_sym.codegen._backend import Backend


class TypeScript(Backend):
    """Facts of parameters, fields and devices, without kernels."""

    comment = "//"
    files: ClassVar = {"page/model.ts": "model.ts.in"}

    def texts(self) -> dict[str, str]:
        """Modes of the fields, number fields, and the relations of a device."""
        parameters = {p.name: _field(p, p.default) for p in MODEL.parameters}
        device = {
            q.name: _field(q, q.value, **({"unit": q.unit.replace("^2", "²")} if q.unit else {}))
            for q in MODEL.quantities
        }
        modes = {g.index: {"contact": g.contact, "drift": g.drift} for g in SEGMENTS}
        scales = (f"  const {u.letter} = {_relation(u.relation)};" for u in MODEL.units)
        ratios = (f"      {p.name}: {_relation(p.si)}," for p in MODEL.parameters if p.si)
        return {
            **super().texts(),
            "fields": json.dumps(modes),
            "modes": json.dumps([g.mode for g in SEGMENTS]),
            "names": json.dumps([*parameters]),
            "parameter_fields": _rows(parameters),
            "device": json.dumps([*device]),
            "optional": json.dumps([q.name for q in MODEL.quantities if q.optional]),
            "device_fields": _rows(device),
            "scales": "\n".join(scales),
            "units": "\n".join(f"    {u.name}: {u.letter}," for u in MODEL.units),
            "ratios": "\n".join(ratios),
        }


def _relation(relation: str) -> str:
    units = {unit.letter for unit in MODEL.units}
    return spelled(relation, lambda name: name if name in units else f"d.{name}", "Math.sqrt")


def _field(one: Any, value: float, **more: str) -> dict[str, object]:
    """A field of the page from a parameter or a quantity."""
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
