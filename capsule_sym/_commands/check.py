"""The command `check`."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import argument, command, option
from capsule_sym._commands.values import Seconds
from capsule_sym._errors import InvalidInput

if TYPE_CHECKING:
    from capsule_sym._check.check import SwitchCheck
    from capsule_sym._check.switch_file import Switches
    from capsule_sym._parameters import SceneParameters

_SHOWN = 10  # differences


@command()
def check(
    *,
    switches: Annotated[str, argument(type=click.Path(), metavar="SWITCHES.csv")],
    system: options.Chosen,
    state: Annotated[options.Triple | None, option(metavar="X_R V_R V_C")] = None,
    phase: float | None = None,
    end: float | None = None,
    tolerance: Annotated[float | None, option(type=Seconds())] = None,
    max_seconds: options.TimeLimit = 120.0,
    as_json: options.Json = False,
) -> None:
    """Compare an integrator's switches with the exact ones, with the causes of differences.

    SWITCHES.csv has the columns "time" and "entered" (the field: F5, 5 or C-S). Lines "# name =
    value" above it give parameters, state, phase, end and tolerance; options override them, and
    --params excludes those of parameters. Times are dimensionless, or in seconds where --params is
    a device. The drive's angle is omega times the time.

    Errors are compared with their growth along the motion, up to the horizon of double precision.
    Exits with 1 if a switch is missed or invented.

    Parameters
    ----------
    state
        State at the start. [default: that of the file, or 0 0 0]
    phase
        Time at the start. [default: that of the file, or 0]
    end
        Time at the end. [default: that of the file, or the last one]
    tolerance
        Tolerance that the integrator had.
    """
    from capsule_sym._check.switch_file import read_switches

    table = read_switches(switches, system.of)
    parameters, device = _loaded(system, table)
    unit = device.time(1.0) if device else 1.0

    def chosen(name: str, given: float | None) -> float | None:
        return next(iter(table.settings.get(name, ())), None) if given is None else given

    last, begin = chosen("end", end), chosen("phase", phase) or 0.0
    with present.progress("Checking the switches") as update:
        found = capsule_sym.check_switches(
            [time / unit for time in table.times],
            table.events,
            parameters,
            state or table.settings.get("state", (0.0, 0.0, 0.0)),
            begin / unit,
            end=None if last is None else last / unit,
            resolution=table.resolution / unit,
            tolerance=chosen("tolerance", tolerance),
            max_seconds=max_seconds,
            progress=lambda turns: update(description=f"Exact run to period {turns}"),
        )
    present.result(
        lambda: {**parameters.scene.entry, "parameters": parameters.to_dict(), **found.record()},
        lambda: _print(found),
        as_json,
    )
    if not found.success:
        raise click.exceptions.Exit(1)


def _loaded(system: options.System, table: Switches) -> tuple[SceneParameters, options.Device]:
    """The parameters, of the line and of what stands above the switches."""
    names = system.of.facts.PARAMETERS
    above = {name: value[0] for name, value in table.settings.items() if name in names}
    if above and system.file is not None:
        name, value = next(iter(above.items()))
        raise InvalidInput(f"# {name}", value, "absent beside --params")
    system.given = above | system.given
    return system.load()


def _print(found: SwitchCheck) -> None:
    console = present.make_console()
    console.print(found.message)
    console.print()
    present.grid(_facts(found))
    if not found.differences:
        return
    rows = [
        (f"{event.time:.9g}", event.event, kind, str(one.cause))
        for one in found.differences
        for kind, events in (("missed", one.missed), ("invented", one.invented))
        for event in events
    ]
    console.print()
    present.table(("time", "event", "switch", "cause"), rows[:_SHOWN], right=("time",))
    if len(rows) > _SHOWN:
        console.print(f"and {len(rows) - _SHOWN} more (--json shows all)")


def _facts(found: SwitchCheck) -> Iterator[tuple[str, str]]:
    """Names of results and their texts."""
    own, late = found.segment_error, found.latest
    if late is not None:
        error, event, growth = late
        way = "late" if error > 0 else "early"
        yield "largest error", f"{event.event} at {event.time:.9g} is {abs(error):.2g} {way}"
        yield "growth there", f"an error of each segment's state shifts it by {growth:.3g} of that"
    if own is not None:
        yield "error of a segment", f"{own:.2g} at least" if own else "below what is printed"
    if found.horizon < math.inf:
        yield "judged", f"up to {found.horizon:.6g}"
    if found.own_horizon < found.horizon:
        yield "your errors", f"have grown to the size of the motion at {found.own_horizon:.6g}"
    if not found.differences:
        return
    first = found.differences[0]
    if first.agrees_again is not None:
        yield "agrees again", f"from {first.agrees_again:.9g} on"
    if first.gap is not None:
        yield "switches are", f"{first.gap:.2g} apart: the event search has to see both"
    if found.needed is not None:
        yield "needed", f"an error of a segment below {found.needed:.2g}"
    if found.tolerance is not None:
        yield "tolerance", f"{found.tolerance:.1g} would do, in place of {found.used:.1g}"
