"""The texts of attractors, shocks and pulses."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import click

import capsule_sym
from capsule_sym._errors import counted
from capsule_sym._parameters import SceneDevice
from capsule_sym._texts import tables


def show_attractors(
    found: capsule_sym.results.Attractors | capsule_sym.results.ContinuedAttractors,
    device: SceneDevice | None,
) -> None:
    """Print attractors, or their branches over a parameter."""
    rows: Iterable[tuple[str, ...]]
    if isinstance(found, capsule_sym.results.Attractors):
        rows = (
            (
                str(number),
                f"{one.fraction:.2%}",
                f"{one.interval[0]:.2%} to {one.interval[1]:.2%}",
                str(one.period_number),
                tables.in_unit(one.progression, "progression", device),
                f"{one.multiplier:.6g}",
                "" if one.mirror is None else "itself" if one.mirror == number else str(one.mirror),
                one.itinerary,
            )
            for number, one in enumerate(found.attractors)
        )
        heads = ("", "starts", "95 %", "period", "progression", "|multiplier|", "image of")
        tables.table((*heads, "itinerary"), rows, right=heads, gap=2)
    else:
        rows = (
            (
                str(one.number),
                f"{one.values[0]:.6g} to {one.values[-1]:.6g}",
                f"{one.fractions.min():.2%} to {one.fractions.max():.2%}",
                *(_change(change) for change in (one.birth, one.death)),
                str(len(one.cycles[0].states)),
                one.shown[0][0],
            )
            for one in found.branches
        )
        unit = tables.units_of(device).get(found.name) if device else None
        name = f"{found.name} ({unit})" if unit else found.name
        heads = ("", name, "starts", "birth", "death", "period", "itinerary")
        tables.table(heads, rows, gap=2)
    tables.make_console().print(found.message)


def _change(change: capsule_sym.results.Change | None) -> str:
    if change is None:
        return ""
    if change.bifurcation is None:
        return change.type
    return f"{change.value:.9g} {change.type}"


def show_shock(found: capsule_sym.results.Shock, device: SceneDevice | None) -> None:
    """Print the smallest shock and what is beyond it."""
    record = found.to_dict()
    rows = {"motion": _motion(record["motion"], device)}
    if found.phase is not None:
        rows["smallest knock"] = f"{found.size:.9g}"
        for name, change in record["knock"].items():
            rows[f"  in {name}"] = tables.in_unit(change, name, device, 9)
        rows["at phase"] = tables.in_unit(found.phase, "phase", device, 9)
        if found.success or found.edge is not None:
            rows["edge state"] = _motion(record["edge"], device)
        if found.success or found.attractor is not None:
            rows["beyond it"] = _motion(record["attractor"], device)
    tables.grid(rows.items())
    click.echo(f"{found.status.value}: {found.message}")


def _motion(record: dict[str, Any] | None, device: SceneDevice | None) -> str:
    """One-line description of a motion."""
    if record is None:
        return "no periodic motion"
    largest = math.hypot(*record["multipliers"][0])
    progression = tables.in_unit(record["progression"], "progression", device)
    return (
        f"{' '.join(record['itinerary'])}, period number {record['period_number']}, "
        f"progression {progression}, largest multiplier {largest:.6g}"
    )


def show_pulse(found: capsule_sym.results.Pulse) -> None:
    """Print a pulse, if there is one."""
    if not found.periods:
        return
    units = tables.units_of(found.system)
    unit = units.get(found.parameter, "")
    low, high = (f"{end:.6g}" for end in found.interval)
    names = found.scene.facts.STATE
    state = "  ".join(
        tables.with_unit(value, units[name]) if units else f"{value:.9g}"
        for name, value in zip(names, found.state, strict=True)
    )
    velocity = units.get("velocity", "")
    scale = (
        found.system.velocity(1.0)
        if isinstance(found.system, capsule_sym.inputs.SceneDevice)
        else 1.0
    )
    ways = (float(one.average_velocity) * scale for one in (found.start, found.end))
    tables.grid(
        (
            (found.parameter, f"{found.value:.9g} {unit}".rstrip()),
            ("interval", f"{low} to {high} {unit}".rstrip()),
            ("periods", str(found.periods)),
            ("begins in state", f"{state} (period {found.begins} of the motion)"),
            ("duration", tables.with_unit(found.duration, "s" if units else "")),
            ("work", tables.with_unit(found.work, units.get("work", ""))),
            ("transient", counted(found.transient, "period")),
            ("velocity", " to ".join(tables.with_unit(one, velocity) for one in ways)),
        )
    )
