"""The command `design`: which drive for a device, in speed, cost and steering."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from capsule_sym._commands.optimise import (
    NO_RESULT,
    bounds_of,
    finite,
    margin_option,
    over_option,
    print_steering,
    shares_of,
    subject_option,
    table_of,
    telling,
    tolerance_option,
    units_of,
    with_unit,
    write_all,
)
from capsule_sym._commands.options import (
    chosen_parameters,
    json_option,
    make_console,
    make_table,
    max_seconds_option,
    out_option,
    parameter_options,
)
from capsule_sym._design.counts import POINTS
from capsule_sym._errors import InvalidInput

if TYPE_CHECKING:
    from capsule_sym._design.optimum import Optimum


@click.command("design")
@parameter_options
@over_option
@subject_option
@margin_option
@tolerance_option
@click.option(
    "--points",
    type=click.IntRange(*POINTS),
    default=20,
    show_default=True,
    help="Points of the front of speed and cost.",
)
@max_seconds_option()
@out_option("Write the JSON here, front and path as CSV, and their pictures.")
@json_option
def design(
    file: str | None,
    over: tuple[Any, ...],
    subject_to: tuple[str, ...],
    margin: float | None,
    tolerances: tuple[tuple[str, float], ...],
    points: int,
    max_seconds: float,
    out: Path | None,
    as_json: bool,
    **dimensionless: float | None,
) -> None:
    """Study the drives of one device: the fastest, the most economical, and steering.

    The drive is alpha and omega, or P_d and Omega of a device; without --over it goes from a tenth
    of the friction force to twice that, and from half the natural frequency to one and a half.
    With --tolerance there is also the most robust one: that whose worst motion is fastest.

    Exits with 2 where the constraints cannot be satisfied, and with 3 where an optimum is missing.
    """
    from capsule_sym._design.optimise import optimise
    from capsule_sym._design.optimum import OptimumStatus
    from capsule_sym._design.pareto import pareto
    from capsule_sym._design.scenarios import scenarios_of
    from capsule_sym._design.steering import steer, usual_drive
    from capsule_sym._map.checks import checked_seconds
    from capsule_sym._native import Watch
    from capsule_sym._records import dumps

    parameters, device = chosen_parameters(file, dimensionless)
    system = device or parameters
    bounds = bounds_of(over) or usual_drive(system)
    shares = shares_of(tolerances)
    scenarios_of(((0.0, 0.0, 0.0),), shares, system)  # refused before work begins
    watch = Watch(checked_seconds(max_seconds))
    with telling("") as progress:

        def asked(doing: str) -> dict[str, Any]:
            return {
                "subject_to": subject_to,
                "margin": margin,
                "max_seconds": watch.left,
                "progress": lambda said: progress(f"{doing}: {said}"),
            }

        steering = steer(system, bounds, **asked("Steering"))
        which = "speed", "cost_of_transport"
        front = pareto(*which, bounds, system, points=points, **asked("Front"))
        # The front ends at the fastest drive, where it has points at all.
        fastest = front.points[-1] if front.points else None
        found: dict[str, Optimum] = {
            "fastest": fastest or optimise("speed", bounds, system, **asked("Fastest")),
            "most economical": optimise("speed_per_work", bounds, system, **asked("Economical")),
        }
        if shares:
            robust = {"tolerances": shares, **asked("Robust")}
            found["most robust"] = optimise("speed", bounds, system, **robust)
    for one in found.values():
        if one.status is OptimumStatus.INFEASIBLE:
            raise InvalidInput("subject_to", list(subject_to), f"possible: {one.message}")
    record = {
        **{name.replace(" ", "_"): one.to_dict() for name, one in found.items()},
        "front": front.to_dict(),
        "steering": steering.to_dict(),
    }
    text = dumps(finite(record))
    if out is not None:
        texts = {"design.json": text + "\n"}
        texts |= {"front.csv": table_of(front), "path.csv": table_of(steering)}
        pictures: dict[str, tuple[str, Any]] = {}
        if front.points:
            pictures["front.svg"] = "front", front
        if steering.branches:
            pictures["path.svg"] = "steering", steering
        write_all(out, texts, pictures)
    if as_json:
        click.echo(text)
    else:
        _print(found, units_of(system))
        print_steering(steering)
    missing = {name: one.message for name, one in found.items() if not one.success}
    if front.status is OptimumStatus.TIME_LIMIT:
        missing["the whole front"] = front.message
    if missing:
        why = "; ".join(dict.fromkeys(missing.values()))
        click.echo(f"not found: {', '.join(missing)}: {why}", err=True)
        raise click.exceptions.Exit(NO_RESULT)


def _print(found: Mapping[str, Optimum], units: Mapping[str, str]) -> None:
    if not any(one.metrics for one in found.values()):
        return
    names: Sequence[str] = list(next(one.over for one in found.values() if one.metrics))
    heads = ["speed", "cost of transport", "power", "peak force"]
    shown = make_table("drive", *names, *heads, right=[*names, *heads], gap=2)
    for name, one in found.items():
        if one.metrics:
            drive = [
                f"{value:.5g} {units.get(key, '')}".rstrip() for key, value in one.over.items()
            ]
            metrics = [
                with_unit(one.metrics[key.replace(" ", "_")], units.get(key.replace(" ", "_"), ""))
                for key in heads
            ]
            shown.add_row(name, *drive, *metrics)
    console = make_console()
    console.print(shown)
    console.print()
