"""The command `tolerances`."""

from __future__ import annotations

from typing import Annotated, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import between, command, option
from capsule_sym._design.counts import SEED
from capsule_sym._errors import InvalidInput
from capsule_sym._texts import bars


@command()
def tolerances(
    *,
    system: options.Chosen,
    metric: Annotated[tuple[str, ...], option(metavar="METRIC")] = (),
    shares: options.Tolerances,
    normal: Annotated[dict[str, float], options.by_name(options.SHARE, metavar="NAME=SHARE")],
    samples: int = 4096,
    seed: Annotated[int, between(*SEED)] = 0,
    state: options.State = (0.0, 0.0, 0.0),
    max_seconds: options.TimeLimit = 600.0,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Show the spread of metrics due to tolerances of parameters, and the share of each.

    With --tolerance a parameter is uniformly distributed within a share below and above its value.
    For each metric the table has mean, deviation and quantiles over the samples, and Sobol's
    indices: the shares of its variance due to each parameter. It also has the probabilities of a
    periodic motion and of another itinerary.

    Exits with 3 at the time limit.

    Parameters
    ----------
    metric
        A metric, or arithmetic of metrics. Repeatable. [default: velocity]
    shares
        A parameter with a uniform distribution within ±SHARE of its value. Repeatable.
    normal
        A parameter with a normal distribution of this relative deviation. Repeatable.
    samples
        Number of samples, a power of two from 64 on.
    seed
        Random seed of the samples.
    out
        Write the JSON, the indices as CSV and the picture here.
    """
    parameters, device = system.load()
    which = device or parameters
    over: dict[str, Any] = dict(shares)
    if not over and not normal:
        raise click.UsageError("give --tolerance or --normal for one parameter or more")
    for name, share in normal.items():
        if name in over:
            raise InvalidInput("--normal", name, "a parameter without --tolerance")
        over[name] = _normal(which, name, share)
    with bars.reporting("Sampling") as progress:
        found = capsule_sym.tolerances(
            metric or ("velocity",),
            over,
            which,
            start=state,
            samples=samples,
            seed=seed,
            max_seconds=max_seconds,
            progress=progress,
        )
    present.report(found, "tolerances", out, as_json)
    present.end(found)


def _normal(which: Any, name: str, share: float) -> Any:
    """Normal distribution about the value of a parameter, whose deviation is a share of it.

    Raises InvalidInput for another name, a value of 0, and a share that is not between 0 and 1.
    """
    from scipy.stats import norm

    nominal = getattr(which, name, None)
    if not isinstance(nominal, float):
        raise InvalidInput("--normal", name, "a parameter")
    if not (0 < share < 1 and nominal):
        raise InvalidInput(
            f"deviation of {name}", share, "a share between 0 and 1 of a value not 0"
        )
    return norm(nominal, share * abs(nominal))
