"""The text of a store, and of the run that fills it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from capsule_sym._errors import counted
from capsule_sym._texts import tables


def show_store(record: dict[str, Any]) -> None:
    """Print a record."""
    screen = tables.make_console()
    for label, text in _lines(record):
        screen.print(f"{label:<17} {text}", soft_wrap=not label)


def _lines(record: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Lines of a record, each with its label."""
    for axis in record.get("axes", ()):
        names, ends = ", ".join(axis["quantities"]), map(_numbers, (axis["first"], axis["last"]))
        values = f"{counted(axis['count'], 'value')} of {names}"
        yield f"axis {axis['name']}", f"{values} from {' to '.join(ends)}"
    for name in ("cells", "done", "computed", "damaged"):
        if name in record:
            yield name.replace("_", " "), f"{record[name]:,}"
    if record.get("computed"):
        yield "seconds", f"{record['seconds']:.2f}"
    if rate := record.get("periods_per_second_and_core"):
        yield "speed", f"{rate:,.0f} excitation periods per second and core"
    for one, title in (
        ("outcome", "outcomes"),
        ("itinerary", "itineraries"),
        ("reason", "reasons"),
        ("core", "cores"),
    ):
        ranked = sorted(record.get(title, {}).items(), key=lambda item: -item[1])
        yield from ((one, f"{cells:>12,}  {name}") for name, cells in ranked[:12])
        if rest := ranked[12:]:
            yield "", f"{sum(cells for _, cells in rest):>12,}  in {len(rest)} more"
    for number, attractor in enumerate(record.get("attractors", ())):
        yield (
            f"attractor {number}",
            f"{attractor['fraction']:7.2%}  {attractor['itinerary']}  "
            f"period number {attractor['period_number']}, "
            f"progression {attractor['progression']:.9g}, "
            f"multiplier {math.hypot(*attractor['multipliers'][0]):.6g}",
        )
    for name, value in record.get("provenance", {}).items():
        versions = value.items() if isinstance(value, dict) else ()
        yield name, ", ".join(f"{part} {version}" for part, version in versions) or value
    if "damaged_parts" in record:
        yield "damaged", f"{len(record['damaged_parts']):,}"
        yield from (("", part) for part in record["damaged_parts"])


def _numbers(values: list[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)
