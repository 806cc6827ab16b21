"""The command `enclose`: Section 4 proved in balls."""

from __future__ import annotations

import json
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from capsule_sym.options import json_option, make_console, make_table, track
from capsule_sym.processes import end, spawning, undisturbed

if TYPE_CHECKING:
    from collections.abc import Sequence


@click.command("enclose")
@click.option("--thresholds", is_flag=True, help="Only the bifurcations, not the intervals.")
@json_option
def enclose(thresholds: bool, as_json: bool) -> None:
    """Prove Section 4 in ball arithmetic: every bifurcation, and alpha between them.

    At both mass ratios, each bifurcation is enclosed with its type, line and order of contact, and
    on each interval between them existence, uniqueness, itinerary and stability of the orbit are
    proved, box by box, but for 1e-12 on either side of a bifurcation. Takes some two minutes on two
    cores. Exits with 1 where a step is left unproved.
    """
    from capsule_sym.enclosures.section4 import GAMMAS

    begin = perf_counter()
    with undisturbed():
        pool = spawning(2)
        proved = [pool.submit(_proved, gamma, not thresholds) for gamma in GAMMAS]
    try:
        results = (one.result() for one in proved)
        records = list(track(results, "Enclosing both mass ratios", len(GAMMAS)))
    finally:
        end(pool)
    seconds = perf_counter() - begin
    if as_json:
        click.echo(json.dumps({"sections": records, "seconds": round(seconds, 1)}))
    else:
        _print(records, thresholds, seconds)
    if any(one["failed"] for one in records):
        raise click.exceptions.Exit(1)


def _proved(gamma: str, intervals: bool) -> dict[str, Any]:
    from capsule_sym.enclosures.section4 import prove_section, record

    return record(prove_section(gamma, intervals=intervals))


def _print(records: Sequence[dict[str, Any]], thresholds: bool, seconds: float) -> None:
    console = make_console()
    for one in records:
        console.print(f"γ = {one['gamma']}")
        table = make_table("type", "line", "order", "alpha")
        for event in one["thresholds"]:
            table.add_row(event["type"], event["line"], str(event["order"]), event["alpha"])
        console.print(table)
        if not thresholds:
            table = make_table("orbit", "from", "to", "boxes")
            for row in one["intervals"]:
                ends = (f"{row[end]:.13f}" for end in ("from", "to"))
                table.add_row(" ".join(row["word"]), *ends, str(row["boxes"]))
            console.print(table)
        if one["failed"]:
            console.print(f"not proved: {one['failed']}")
        console.print()
    count = sum(len(one["thresholds"]) for one in records)
    worst = max((e["radius"] for one in records for e in one["thresholds"]), default=0.0)
    table = make_table("", "proved", "goal")
    table.add_row("bifurcations, with type", f"{count}, within {worst:.0e}", "16, within 1e-30")
    if not thresholds:
        left = " and ".join(f"{one['unproved']:.1e}" for one in records)
        table.add_row("alpha in [0.001, 2] left open", left, "1e-11 at each mass ratio")
    table.add_row("seconds", f"{seconds:.0f}", "300")
    console.print(table)
