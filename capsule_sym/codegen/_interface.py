"""Counts, enumerations and records of the C library, shared by C, its binding and Python."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from capsule_sym._symbolic.model.formulas import edge_planes, impact_planes
from capsule_sym._symbolic.model.model import LEVELS, REACTS, SEGMENTS
from capsule_sym._symbolic.model.symbols import MODEL, PARAMETERS, PULSED, STATE
from capsule_sym.codegen._blocks import flow_parameters

Entry = dict[str, Any]


class Interface:
    """Content of `codegen/interface.toml`, into which the model's counts and parameters are put."""

    def __init__(self, config: Entry) -> None:
        self.enums: list[Entry] = config["enum"]
        self.structs: list[Entry] = config["struct"]
        self.counts: dict[str, str] = {
            "parameter": str(len(PARAMETERS)),
            "run_parameter": str(len([p for p in PARAMETERS if p not in flow_parameters()])),
            "state": str(len(STATE)),
            "field": str(len(SEGMENTS)),
            "plane": str(max(*impact_planes().values(), *edge_planes())),
            "level": str(len(LEVELS)),
            "stop": str(len(MODEL.stops)),
            "flow": str(2 * len(MODEL.regions)),
            "response": str(2 if PULSED else 4),
            **config["count"],
        }
        for struct in self.structs:
            struct["fields"] = [e for e in struct["fields"] if len(e) < 4 or self.number(e.pop())]
            for entry in struct["fields"]:
                entry[1] = entry[1].replace("@parameters", ", ".join(map(str, PARAMETERS)))

    def spelt(self, length: str) -> str:
        """Length in counts, as C spells it."""

        def constant(word: re.Match[str]) -> str:
            return f"CAPSULE_{word[0].upper()}_COUNT" if word[0] in self.counts else word[0]

        return re.sub(r"[a-z]+", constant, length)

    def spelt_all(self, names: str) -> str:
        """Names of fields with their lengths, as C spells them."""
        return re.sub(r"\[(.+?)\]", lambda found: f"[{self.spelt(found[1])}]", names)

    def number(self, length: str) -> int:
        """Length in counts as a number."""
        numbers: dict[str, int] = {}
        for name, value in self.counts.items():
            numbers[name] = eval(value, {}, numbers)
        return int(eval(length, {}, numbers))


def flags() -> dict[str, int]:
    """Properties of the model, as 1 or 0, and the planes of the drive's edges; by name."""
    planes = dict(zip(("RISE_PLANE", "FALL_PLANE"), edge_planes(), strict=False))
    return {"PULSED": int(PULSED), "REACTS": int(REACTS), **planes}


def members(struct: Entry) -> Iterator[tuple[str, str, str]]:
    """Name, C type and length (empty for a scalar) of every field of a struct."""
    for kind, names, *_ in struct["fields"]:
        for name in names.split(", "):
            bare, length = re.fullmatch(r"(\w+)(?:\[(.+)\])?", name).groups()  # type: ignore[union-attr]
            yield bare, kind, length or ""
