"""The command `design`: drives of a device, by speed, cost and steering."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.optimise import print_steering
from capsule_sym._commands.signature import command
from capsule_sym._commands.tolerances import print_tolerances
from capsule_sym._design.counts import POINTS
from capsule_sym._errors import InvalidInput

_METRICS = "speed", "cost_of_transport"
_SAMPLES = 1024  # number of samples of tolerances


@command()
def design(
    system: options.System = options.parameters(),
    over: dict[str, Any] = options.over,
    subject_to: tuple[str, ...] = options.subject_to,
    margin: float | None = options.margin,
    tolerances: dict[str, float] = options.tolerances,
    points: int = options.count("Points of the front of speed and cost.", 20, *POINTS),
    max_seconds: float = options.max_seconds(),
    out: options.Path | None = options.out(
        "Write the JSON here, front and path as CSV, and their pictures."
    ),
    as_json: bool = options.as_json,
) -> None:
    """Study the drives of a device: the fastest, the most economical, and steering.

    The drive is alpha and omega, or P_d and Omega of a device. Without --over it varies from 0.1 to
    2 times the friction force, and from 0.5 to 1.5 times the natural frequency. With --tolerance
    the most robust drive, whose worst motion is fastest, is added, with the spread of speed and
    cost there.

    Exits with 2 if the constraints cannot be satisfied, and with 3 if an optimum is missing.
    """
    from capsule_sym._design.program import scenarios_of
    from capsule_sym._design.steering import usual_drive
    from capsule_sym._map.checks import checked_seconds
    from capsule_sym._native import Watch

    parameters, device = system.load()
    which = device or parameters
    bounds = over or usual_drive(which)
    scenarios_of(((0.0, 0.0, 0.0),), tolerances, which)  # refused before work begins
    watch, spread = Watch(checked_seconds(max_seconds)), None
    with present.telling("") as progress:

        def asked(doing: str) -> dict[str, Any]:
            return {
                "subject_to": subject_to,
                "margin": margin,
                "max_seconds": watch.left,
                "progress": lambda said: progress(f"{doing}: {said}"),
            }

        steering = capsule_sym.steer(which, bounds, **asked("Steering"))
        front = capsule_sym.pareto(*_METRICS, bounds, which, points=points, **asked("Front"))
        # The front ends at the fastest drive, if it has points.
        fastest = front.points[-1] if front.points else None
        found: dict[str, capsule_sym.Optimum] = {
            "fastest": fastest or capsule_sym.optimise("speed", bounds, which, **asked("Fastest")),
            "most economical": capsule_sym.optimise(
                "speed_per_work", bounds, which, **asked("Economical")
            ),
        }
        if tolerances:
            robust = {"tolerances": tolerances, **asked("Robust")}
            found["most robust"] = capsule_sym.optimise("speed", bounds, which, **robust)
            if found["most robust"].orbits:
                spread = capsule_sym.tolerances(
                    _METRICS,
                    tolerances,
                    found["most robust"].system,
                    samples=_SAMPLES,
                    max_seconds=watch.left,
                    progress=lambda said: progress(f"Tolerances: {said}"),
                )
    for one in found.values():
        if one.status is capsule_sym.OptimumStatus.INFEASIBLE:
            raise InvalidInput("subject_to", list(subject_to), f"possible: {one.message}")
    record = present.finite(
        {
            **{name.replace(" ", "_"): one.to_dict() for name, one in found.items()},
            "front": front.to_dict(),
            "steering": steering.to_dict(),
            **({} if spread is None else {"tolerances": spread.to_dict()}),
        }
    )

    def show() -> None:
        _print(found, present.units_of(which))
        if spread is not None:
            print_tolerances(spread)
            click.echo()
        print_steering(steering)

    parts: dict[str, Any] = {"front": front, "path": steering}
    if spread is not None and spread.metrics:
        parts["tolerances"] = spread
    files: dict[str, Any] = {"design.json": record}
    files |= {f"{name}.csv": present.table_of(one) for name, one in parts.items()}
    pictures = {
        f"{name}.svg": partial(capsule_sym.plot, one)
        for name, one in parts.items()
        if any(map(len, one.columns.values()))
    }
    present.result(lambda: record, show, as_json, out, lambda: files, pictures)
    missing = {name: one.message for name, one in found.items() if not one.success}
    if front.status is capsule_sym.OptimumStatus.TIME_LIMIT:
        missing["the whole front"] = front.message
    if missing:
        why = "; ".join(dict.fromkeys(missing.values()))
        present.fail(f"not found: {', '.join(missing)}: {why}")


def _print(found: Mapping[str, capsule_sym.Optimum], units: Mapping[str, str]) -> None:
    shown = {name: one for name, one in found.items() if one.metrics}
    if not shown:
        return
    metrics = ["speed", "cost of transport", "power", "peak force"]
    rows = (
        (
            name,
            *(f"{value:.5g} {units.get(key, '')}".rstrip() for key, value in one.over.items()),
            *(
                present.with_unit(one.metrics[key], units.get(key, ""))
                for key in (metric.replace(" ", "_") for metric in metrics)
            ),
        )
        for name, one in shown.items()
    )
    heads = [*next(iter(shown.values())).over, *metrics]
    present.table(("drive", *heads), rows, right=heads, gap=2)
    click.echo()
