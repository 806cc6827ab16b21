"""The command `pulse`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import click

import capsule_sym
from capsule_sym._commands import options, present, signature
from capsule_sym._commands.orbit import settled
from capsule_sym._commands.signature import command, option
from capsule_sym._errors import InvalidInput
from capsule_sym._texts import bars

if TYPE_CHECKING:
    from capsule_sym._native import Watch


@command()
def pulse(
    *,
    system: options.Chosen,
    state: options.State = (0.0, 0.0, 0.0),
    to: Annotated[options.Triple | None, option(metavar="X_R V_R V_C")] = None,
    between: Annotated[tuple[int, int] | None, option(metavar="FROM TO")] = None,
    reverse: bool = False,
    windows: options.Windows,
    over: options.Over,
    most_periods: Annotated[int, signature.between(1, 1000, "--max-periods")] = 8,
    max_seconds: options.TimeLimit = 60.0,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Switch from one motion to another by a pulse of the drive, the shortest one.

    For some periods one parameter of the drive has another value, by default alpha; then the drive
    is as before. --over names another parameter. The motions are those from --state and --to, or
    numbers --between attractors of ranges of starts, as `capsule-sym attractors` shows them.

    Exits with 3 if a motion is not periodic, or no pulse is found. After Ctrl-C, as at the time
    limit, the results so far are shown and written.

    Parameters
    ----------
    state
        State of the present motion. [default: 0 0 0]
    to
        State that leads to the target motion.
    between
        Numbers of the two motions among the attractors of the ranges below.
    reverse
        Target: the fastest of these attractors in the opposite direction.
    most_periods
        Most periods of the pulse.
    out
        Write the JSON here, the drive and both displacements over time as CSV, and the picture.
    """
    from capsule_sym._native import Watch

    options.check_beside("to", never=("between", "reverse"))
    options.check_beside("between", never=("state", "reverse"))
    if to is None and between is None and not reverse:
        raise click.UsageError("give --to X_R V_R V_C, --between FROM TO or --reverse")
    if over and len(over) != 1:
        raise InvalidInput("--over", list(over), "one parameter of the drive")
    parameters, device = system.load()
    limit = Watch(max_seconds)
    with bars.reporting("Switching", limit) as report:
        ends = _motions(parameters, (state, to), between, windows, limit, as_json)
        try:
            found = capsule_sym.switch_by_pulse(
                *ends,
                over or None,
                device or parameters,
                most_periods=most_periods,
                max_seconds=limit.left,
                progress=report,
            )
        except InvalidInput as error:
            if error.field != "end":
                raise
            field = "--to" if between is None else "--between"
            raise InvalidInput(field, error.value, error.allowed) from None
    present.report(found, "pulse", out, as_json)
    present.end(found, limit)


def _motions(
    parameters: capsule_sym.inputs.SceneParameters,
    states: tuple[tuple[float, float, float], tuple[float, float, float] | None],
    between: tuple[int, int] | None,
    starts: dict[str, Any],
    limit: Watch,
    as_json: bool,
) -> tuple[capsule_sym.results.Orbit, capsule_sym.results.Orbit]:
    """The present motion and the target motion."""
    from capsule_sym._records import dumps

    state, to = states
    if to is not None:
        one, other = (settled(parameters, each, limit, as_json) for each in (state, to))
        return one, other
    if not starts:
        raise click.UsageError("give a range of starts, such as --x-r -1:1")
    box = capsule_sym.attractors(parameters, starts, max_seconds=limit.left)
    if limit.stopped:
        raise KeyboardInterrupt
    known = [one.orbit for one in box.attractors]
    if between is not None:
        for number in between:
            if not 0 <= number < len(known):
                raise InvalidInput("--between", number, f"from 0 to {len(known) - 1}")
        return known[between[0]], known[between[1]]
    now = settled(parameters, state, limit, as_json)
    way = -1 if now.average_velocity > 0 else 1
    best = max(known, key=lambda one: way * float(one.average_velocity), default=now)
    if not way * float(best.average_velocity) > 0:
        why = "no attractor of these starts goes in the opposite direction"
        if as_json:
            click.echo(dumps({"success": False, "status": "no-attractor", "message": why}))
        present.fail(why)
    return now, best
