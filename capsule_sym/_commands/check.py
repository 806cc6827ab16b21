"""The command `check`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import argument, command, option
from capsule_sym._commands.values import SECONDS
from capsule_sym._errors import InvalidInput
from capsule_sym._texts import bars

if TYPE_CHECKING:
    from capsule_sym._check.switch_file import Switches
    from capsule_sym._parameters import SceneParameters


@command()
def check(
    *,
    switches: Annotated[str, argument(type=click.Path(), metavar="SWITCHES.csv")],
    system: options.Chosen,
    state: Annotated[options.Triple | None, option(metavar="X_R V_R V_C")] = None,
    phase: float | None = None,
    end: float | None = None,
    tolerance: Annotated[float | None, option(type=SECONDS)] = None,
    max_seconds: options.TimeLimit = 120.0,
    as_json: options.Json = False,
) -> None:
    """Compare an integrator's switches with the exact ones, with the causes of differences.

    SWITCHES.csv has the columns "time" and "entered" (the field: F5, 5 or C-S). Lines "# name =
    value" above it give parameters, state, phase, end and tolerance; options override them, and
    --params excludes those of parameters. Times are dimensionless, or in seconds where --params is
    a device. The drive's angle is omega times the time.

    Errors are compared with their growth along the motion, up to the horizon of double precision.
    Exits with 1 if a switch is missed or invented. At the time limit only the switches up to there
    are compared.

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
    unit = device.scale("duration") if device else 1.0

    def chosen(name: str, given: float | None) -> float | None:
        return next(iter(table.settings.get(name, ())), None) if given is None else given

    last, begin = chosen("end", end), chosen("phase", phase) or 0.0
    with bars.reporting("Checking the switches") as report:
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
            progress=lambda turns: report(f"exact run to period {turns}"),
        )
    record = parameters.scene.entry | {"parameters": parameters.to_dict()}
    record |= found.to_dict()
    present.result(record, as_json)
    if not found.success:
        raise click.exceptions.Exit(1)


def _loaded(system: options.System, table: Switches) -> tuple[SceneParameters, options.Device]:
    """Parameters of the command line and of the lines above the switches, and their device.

    Raises InvalidInput if --params is given beside parameters above the switches. The device is
    None unless --params is one.
    """
    names = system.of.facts.PARAMETERS
    above = {name: value[0] for name, value in table.settings.items() if name in names}
    if above and system.file is not None:
        name, value = next(iter(above.items()))
        raise InvalidInput(f"# {name}", value, "absent beside --params")
    system.given = above | system.given
    return system.load()
