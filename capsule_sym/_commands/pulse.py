"""The command `pulse`."""

from __future__ import annotations

from typing import Annotated

import click

import capsule_sym
from capsule_sym._commands import options, present, signature
from capsule_sym._commands.orbit import settled
from capsule_sym._commands.signature import command, option
from capsule_sym._errors import InvalidInput
from capsule_sym._texts import bars


@command()
def pulse(
    *,
    system: options.Chosen,
    state: options.State = (0.0, 0.0, 0.0),
    to: Annotated[options.Triple | None, option(metavar="X_R V_R V_C")] = None,
    between: Annotated[tuple[int, int] | None, option(metavar="FROM TO")] = None,
    windows: options.Windows,
    over: options.Over,
    most_periods: Annotated[int, signature.between(1, 1000, "--max-periods")] = 8,
    max_seconds: options.TimeLimit = 60.0,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Switch from one motion to another by a pulse of the drive, the shortest one.

    For some periods one parameter of the drive has another value, by default alpha, or P_d of a
    device; then the drive is as before. --over names another parameter. The motions are those from
    --state and --to, or numbers --between attractors of ranges of starts, in the list of
    `capsule-sym attractors`.

    Exits with 3 if a motion is not periodic, if no pulse is found, or at the time limit. After
    Ctrl-C, as at the limit, the results so far are shown and written.

    Parameters
    ----------
    state
        State of the present motion. [default: 0 0 0]
    to
        State that leads to the target motion.
    over
        The changed parameter of the drive with its bounds: dimensionless, or of the device.
    between
        Numbers of the two motions among the attractors of the ranges below.
    most_periods
        Most periods of the pulse.
    out
        Write the JSON here, the drive and both displacements over time as CSV, and the picture.
    """
    from capsule_sym._native import Watch

    options.check_beside("between", never=("state", "to"))
    for name in windows:
        options.check_beside(name, needs=("between",))
    if over and len(over) != 1:
        raise InvalidInput("--over", list(over), "one parameter of the drive")
    parameters, device = system.load()
    limit = Watch(max_seconds)
    with bars.reporting("Switching", limit) as report:
        if between is None:
            if to is None:
                raise click.UsageError("give --to X_R V_R V_C or --between FROM TO")
            ends = [settled(parameters, one, limit, as_json) for one in (state, to)]
        elif not windows:
            raise click.UsageError("give a range of starts, such as --x-r -1:1")
        else:
            box = capsule_sym.attractors(parameters, windows, max_seconds=limit.left)
            if limit.stopped:
                raise KeyboardInterrupt
            for number in between:
                if not 0 <= number < len(box.attractors):
                    allowed = f"from 0 to {len(box.attractors) - 1}"
                    raise InvalidInput("--between", number, allowed)
            ends = [box.attractors[number].orbit for number in between]
        found = capsule_sym.switch_by_pulse(
            *(ends[0], ends[1], over or None, device or parameters),
            most_periods=most_periods,
            max_seconds=limit.left,
            progress=report,
        )
    present.report(found, "pulse", out, as_json)
    present.end(found, limit)
