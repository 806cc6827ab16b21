"""The command `attractors`."""

from __future__ import annotations

from typing import Annotated, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option
from capsule_sym._texts import bars


@command()
def attractors(
    *,
    system: options.CountedRanged,
    windows: options.Windows,
    state: options.State = (0.0, 0.0, 0.0),
    count: Annotated[int, option("--starts")] = 400,
    periods: int | None = None,
    threads: Annotated[int, option("--workers")] = 1,
    out: options.Folder = None,
    max_seconds: options.TimeLimit = 600.0,
    as_json: options.Json = False,
) -> None:
    """Find all attractors of a box of starts, and the fraction of starts for each.

    Starts are low-discrepancy points in the given ranges. Each attractor is a closed orbit, with
    its multipliers and a 95 % interval of the fraction. Starts that have not settled are counted. A
    parameter may have a range with a count, such as --alpha 0.5:4:100: all attractors are then
    continued over it, and births and deaths are located at the bifurcations of their branches. With
    a device progressions are in SI units too, in the JSON as "si"; ranges of starts are
    dimensionless.

    Exits with 3 at the time limit. After Ctrl-C, as at the limit, the results so far are shown and
    written.

    Parameters
    ----------
    state
        Start state, apart from the ranges. [default: 0 0 0]
    count
        Starts in the box.
    periods
        Excitation periods after which a run counts as unsettled. [default: 4096, over a range of a
        parameter 1024]
    threads
        Threads that run starts.
    out
        Write the JSON and the table as CSV here, over a range of a parameter the picture too.
    """
    from numpy import array

    from capsule_sym._native import Watch

    over = options.only_range()
    if not windows:
        raise click.UsageError("give a range of starts, such as --x-r -1:1")
    parameters, device = system.load()
    limit = Watch(max_seconds)
    starts = dict(zip(parameters.scene.facts.STATE, state, strict=True)) | windows
    how: dict[str, Any] = {"count": count, "threads": threads, "max_seconds": limit.left}
    if periods is not None:
        how["periods"] = periods
    found: capsule_sym.results.Attractors | capsule_sym.results.ContinuedAttractors
    with bars.reporting("Settling", limit) as how["progress"]:
        if over is None:
            found = capsule_sym.attractors(parameters, starts, **how)
        else:
            name, (low, high, number) = over
            try:
                values = capsule_sym.inputs.Axis.linear(name, low, high, int(number)).values.ravel()
            except capsule_sym.InvalidInput as error:  # `count` is also that of the starts
                error.field = error.field.replace("count", f"COUNT of {name}")
                raise
            if device is not None and name not in parameters.to_dict():
                how["ties"] = capsule_sym.inputs.device_path(device, name)
            found = capsule_sym.continue_attractors(parameters, name, values, starts, **how)
    extra = {}
    if device is not None:
        extra["attractors"], metre = found.to_dict()["attractors"], device.scale("progression")
        for one in extra["attractors"]:
            one["si"] = {"progression [m]": (array(one["progression"]) * metre).tolist()}
    drawn = over is not None
    present.report(found, "attractors", out, as_json, extra, device=device, drawn=drawn)
    present.end(found, limit)
