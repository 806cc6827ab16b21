"""What a store holds, as a record and as text."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import click

from capsule_sym._options import make_console


def info_record(path: Path, check: bool = False) -> dict[str, Any]:
    """What a store holds, in plain values; with `check` also what of it is damaged.

    Raises InvalidInput where there is no store.
    """
    from capsule_sym._sweeps.quantities import ATTRACTOR
    from capsule_sym._sweeps.results import Held, damaged_in_chart, open_results

    record: dict[str, Any]
    rounds = sorted(path.glob("round-*")) if os.path.isdir(path) else []
    if rounds:
        record = {"store": str(path), "rounds": [info_record(place, check) for place in rounds]}
        if check:
            record["damaged_parts"] = damaged_in_chart(path)
        return record
    held = Held(path)
    tally = held.tally()
    described = held.head["sweep"]
    record = {
        "store": str(path),
        "axes": described["axes"],
        "cells": math.prod(axis["count"] for axis in described["axes"]),
        "done": tally.outcomes.total(),
        "outcomes": dict(tally.outcomes),
        "itineraries": {text: cells for text, (_, cells) in tally.itineraries.items()},
        "reasons": dict(tally.reasons.most_common(20)),
        "cores": tally.cores,
        "sweep": {name: v for name, v in described.items() if name != "axes"},
        "provenance": held.head["provenance"],
    }
    if check:
        found = held.check()
        record["damaged_parts"] = [*found.files, *(f"chunk {index}" for index in found.chunks)]
    elif held.head["kind"] == "basin":
        with open_results(path) as results:
            if ATTRACTOR in results:
                record["attractors"] = results[ATTRACTOR].attrs["attractors"]
    return record


def damaged_parts(record: dict[str, Any]) -> int:
    """How many damaged parts a record of a checked store tells of."""
    own: list[str] = record.get("damaged_parts", [])
    return len(own) + sum(damaged_parts(part) for part in record.get("rounds", ()))


def show(record: dict[str, Any], as_json: bool) -> None:
    """Prints a record."""
    from capsule_sym._records import dumps

    if as_json:
        click.echo(dumps(record))
        return
    screen = make_console()
    for part in record.get("rounds", ()):
        show(part, as_json)
    for axis in record.get("axes", ()):
        names = ", ".join(axis["quantities"])
        screen.print(
            f"axis {axis['name']:<12} {axis['count']} values of {names} "
            f"from {_numbers(axis['first'])} to {_numbers(axis['last'])}"
        )
    for name in ("cells", "done", "computed", "damaged", "fraction_computed"):
        if name in record:
            screen.print(f"{name.replace('_', ' '):<17} {record[name]:,}")
    if record.get("computed"):
        screen.print(f"{'seconds':<17} {record['seconds']:.2f}")
    if record.get("periods_per_second_and_core"):
        rate = record["periods_per_second_and_core"]
        screen.print(f"{'speed':<17} {rate:,.0f} excitation periods per second and core")
    for one, title in zip(
        ("outcome", "itinerary", "reason", "core"),
        ("outcomes", "itineraries", "reasons", "cores"),
        strict=True,
    ):
        _print_shares(screen, one, record.get(title, {}))
    for number, attractor in enumerate(record.get("attractors", ())):
        screen.print(
            f"attractor {number:<7} {attractor['share']:7.2%}  {attractor['itinerary']}  "
            f"period number {attractor['period_number']}, "
            f"progression {attractor['progression']:.9g}, "
            f"multiplier {attractor['multiplier']:.6g}"
        )
    for name, value in record.get("provenance", {}).items():
        if isinstance(value, dict):
            value = ", ".join(f"{part} {version}" for part, version in value.items())
        screen.print(f"{name:<17} {value}")
    if "damaged_parts" in record:
        screen.print(f"{'damaged':<17} {len(record['damaged_parts']):,}")
        for part in record["damaged_parts"]:
            screen.print(f"{'':<17} {part}", soft_wrap=True)


def _print_shares(screen: Any, title: str, counts: dict[str, int]) -> None:
    ranked = sorted(counts.items(), key=lambda item: -item[1])
    for name, cells in ranked[:12]:
        screen.print(f"{title:<17} {cells:>12,}  {name}")
    if len(ranked) > 12:
        screen.print(f"{'':<17} {sum(n for _, n in ranked[12:]):>12,}  in {len(ranked) - 12} more")


def _numbers(values: list[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)
