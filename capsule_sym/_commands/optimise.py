"""The command `optimise`, and the presentation of its results."""

from __future__ import annotations

from typing import Annotated, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import between, command, group, option
from capsule_sym._design.counts import MAX_SECONDS, POINTS, SAMPLES, SEED
from capsule_sym._texts import bars


def _searching(
    *,
    margin: float | None = None,
    samples: Annotated[int | None, between(*SAMPLES)] = None,
    seed: Annotated[int, between(*SEED)] = 0,
    max_seconds: options.TimeLimit = MAX_SECONDS,
) -> dict[str, Any]:
    """Settings of a search, without those that are not given.

    Parameters
    ----------
    margin
        Floquet multipliers at most 1 - MARGIN.
    samples
        Number of points of each survey. [default: by the number of variables, of a front 256]
    seed
        Random seed of the surveys.
    """
    return {name: value for name, value in locals().items() if value is not None}


@command()
def optimise(
    *,
    system: options.Chosen,
    maximise: Annotated[str | None, option(metavar="METRIC")] = None,
    minimise: Annotated[str | None, option(metavar="METRIC")] = None,
    over: options.Over,
    subject_to: Annotated[tuple[str, ...], option(metavar="LIMIT")] = (),
    how: Annotated[dict[str, Any], group(_searching)],
    against: Annotated[str | None, option("--pareto", metavar="METRIC")] = None,
    points: Annotated[int, between(*POINTS)] = 50,
    state: options.State = (0.0, 0.0, 0.0),
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Find the parameters at which a metric of the steady motion is greatest or least.

    A metric is velocity, speed, progression, work, damper_loss, friction_loss, power, peak_force,
    peak_contact, speed_per_work or cost_of_transport, or arithmetic of these and of parameters.
    Energies and progression are per excitation period; speed_per_work is the absolute progression
    over the work. With a device all values are in SI units, but --state is dimensionless.

    Exits with 3 if no point within the bounds satisfies the constraints, if no motion or no optimum
    is found, or at the time limit.

    Parameters
    ----------
    maximise
        Metric to maximise.
    minimise
        Metric to minimise.
    subject_to
        A constraint, such as 'peak_force <= 2'. Repeatable.
    against
        Pareto front: minimise this second metric too.
    points
        Largest number of points of the front of --pareto.
    out
        Write the JSON here, of a front with its table as CSV and its picture.
    """
    options.check_beside("maximise", never=("minimise",))
    options.check_beside("points", needs=("against",))
    metric = maximise if maximise is not None else minimise
    if metric is None:
        raise click.UsageError("give --maximise or --minimise METRIC")
    if not over:
        raise click.UsageError("give --over NAME=LOW:HIGH for one parameter or more")
    parameters, device = system.load()
    which = device or parameters
    how |= {"maximise": maximise is not None, "start": state, "subject_to": subject_to}
    found: capsule_sym.results.Optimum | capsule_sym.results.Front
    with bars.reporting("Optimising") as progress:
        how["progress"] = progress
        if against is None:
            found = capsule_sym.optimise(metric, over, which, **how)
        else:
            found = capsule_sym.pareto(metric, against, over, which, points=points, **how)
    present.report(found, "optimum" if against is None else "front", out, as_json)
    present.end(found)
