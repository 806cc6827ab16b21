"""The command `fit`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import argument, between, command, group, option
from capsule_sym._design.counts import SEED, STARTS
from capsule_sym._texts import bars

_UNKNOWN = option(type=options.Named(optional="value"), multiple=True)


def _fitting(
    *,
    state: options.State = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    loss: Literal["linear", "soft_l1", "huber", "cauchy", "arctan"] = "linear",
    starts: Annotated[int, between(*STARTS)] = 0,
    seed: Annotated[int, between(*SEED)] = 0,
    max_seconds: options.TimeLimit = 600.0,
) -> dict[str, Any]:
    """Settings of a fit.

    Parameters
    ----------
    state
        State at the first time; for an unknown component its guess. [default: 0 0 0]
    phase
        Phase at the first time. [default: 0]
    loss
        Loss function; all but linear reduce the weight of outliers.
    starts
        Number of further guesses.
    seed
        Random seed of --starts.
    """
    return locals()


@command()
def fit(
    *,
    data: Annotated[
        Path, argument(type=click.Path(path_type=Path, dir_okay=False), metavar="DATA")
    ],
    system: options.Chosen,
    unknown: Annotated[tuple[Any, ...], _UNKNOWN] = (),
    how: Annotated[dict[str, Any], group(_fitting)],
    intervals: bool = False,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Find parameters, start and phase from measured series, by least squares.

    DATA is a text or Parquet file with times t and one or more of the columns x_m, x_c, x_r, v_m,
    v_c, v_r, with an empty cell for a gap. Separator, decimal comma, comments and units, as in
    "x_m [mm]", are detected. Or it is a TOML file of a rig, with the files of several
    runs in a camera's units, their drives, and the unknowns. With a device, times and results are
    in SI units.

    Exits with 3 if the fit does not converge or explain each column, or if a parameter is not
    identifiable or at a bound.

    Parameters
    ----------
    unknown
        Unknown to fit, with optional bounds: a parameter, x_r, v_r, v_c, phase or x_c. Repeatable.
    intervals
        Profile intervals (95 %), from repeated fits.
    out
        Write the JSON here, the residuals as CSV, and their picture.
    """
    from capsule_sym._map.checks import checked_seconds
    from capsule_sym._native import Watch

    parameters, device = system.load()
    which = device or parameters
    rig = data.suffix == ".toml"
    for name in ("unknown", "state", "phase") if rig else ():
        if options.is_given(name):
            raise click.UsageError(f"--{name} is for one run; for a rig it is given in {data}")
    if not (unknown or rig):
        raise click.UsageError("give --unknown for each unknown")
    options.check_beside("seed", needs=("starts",))
    with bars.reporting("Fitting") as progress:
        watch = Watch(checked_seconds(how["max_seconds"]))
        if rig:
            how = {name: how[name] for name in how if name not in ("state", "phase")}
            recorded = capsule_sym.inputs.read_rig(data)
            read = [f"{run.name}: {getattr(run.data, 'message', '')}" for run in recorded.runs]
            found = capsule_sym.fit_rig(recorded, which, progress=progress, **how)
        else:
            how["bounds"] = {name: ends for name, ends in unknown if ends is not None}
            measured = capsule_sym.inputs.read_measured(data)
            read = [measured.message]
            found = capsule_sym.fit(
                measured,
                which,
                tuple(name for name, _ in unknown),
                progress=progress,
                **how,
            )
        ranges = {}
        for name in found.values if intervals else ():
            progress(f"interval of {name}")
            ranges[name] = found.interval(name, max_seconds=watch.left)
    extra: dict[str, Any] = {"read": read}
    extra |= {"intervals": {name: list(ends) for name, ends in ranges.items()}} if ranges else {}
    present.report(found, "fit", out, as_json, extra)
    if found.success and any(math.isnan(end) for ends in ranges.values() for end in ends):
        present.fail("time-limit: intervals are missing")
    present.end(found)
