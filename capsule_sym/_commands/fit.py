"""The command `fit`."""

from __future__ import annotations

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
    loss: Literal["linear", "cauchy"] = "linear",
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
        Loss function; that of Cauchy reduces the weight of outliers.
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
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Find parameters, start and phase from measured series, by least squares.

    DATA is a text file with times t and one or more of the columns x_m, x_c, x_r, v_m, v_c, v_r,
    with an empty cell for a gap. Separator, decimal comma, comments and units, as in "x_m [mm]",
    are detected. With a device all values are in SI units, those of --state and --phase too.

    Exits with 3 if the fit does not converge or explain each column, if a parameter is not
    identifiable or at a bound, or at the time limit.

    Parameters
    ----------
    unknown
        Unknown to fit, with optional bounds: a parameter, x_r, v_r, v_c, phase or x_c. Repeatable.
    out
        Write the JSON here, the residuals as CSV, and their picture.
    """
    if not unknown:
        raise click.UsageError("give --unknown for each unknown")
    options.check_beside("seed", needs=("starts",))
    parameters, device = system.load()
    measured = capsule_sym.inputs.read_measured(data)
    with bars.reporting("Fitting") as progress:
        found = capsule_sym.fit(
            measured,
            device or parameters,
            tuple(name for name, _ in unknown),
            bounds={name: ends for name, ends in unknown if ends is not None},
            progress=progress,
            **how,
        )
    present.report(found, "fit", out, as_json, {"read": measured.message})
    present.end(found)
