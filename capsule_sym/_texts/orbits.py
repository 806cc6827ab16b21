"""The text of one orbit, or of several."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import click

import capsule_sym
from capsule_sym._errors import counted
from capsule_sym._texts import tables


def show_orbits(
    found: Sequence[capsule_sym.results.Orbit], records: Sequence[dict[str, Any]], searched: int
) -> None:
    """Print the orbits of a search."""
    for one, record in zip(found, records, strict=True):
        show_orbit(one, record)
    click.echo(f"{counted(len(found), 'orbit')} from {counted(searched, 'random state')}")


def show_orbit(one: capsule_sym.results.Orbit, record: dict[str, Any]) -> None:
    """Print an orbit, of which the record has all numbers."""
    from capsule_sym._map.steady import shown_progression
    from capsule_sym._orbits.metrics.performance import shown

    tightest, stable = record["admissibility"], "stable" if record["stable"] else "unstable"
    multipliers = "  ".join(_complex(*pair) for pair in record["multipliers"])
    rows = {
        "itinerary": " ".join(record["itinerary"]),
        "global map": one.motion.global_map,
        "period number": str(record["period_number"]),
        "section": f"phase {record['phase']:.12g}, state {_numbers(record['state'])}",
        "durations": _numbers(record["durations"]),
        "multipliers": f"{multipliers}  ({stable})",
        "tightest": f"{tightest['inequality']}: {tightest['value']:.6g}",
    }
    drifts = shown_progression(one.motion) != 0
    values = {name: record[name]["value"] for name in shown(one.scene)} | record.get("si", {})
    for name, value in values.items():
        none = not drifts and name.startswith(("velocity", "progression"))
        rows[name.replace("_", " ")] = f"{0 if none else value:.12g}"
    tables.grid(rows.items())
    click.echo()


def _numbers(values: Sequence[float]) -> str:
    return "  ".join(f"{value:.12g}" for value in values)


def _complex(real: float, imaginary: float) -> str:
    return f"{real:.9g}{imaginary:+.9g}i" if imaginary else f"{real:.9g}"
