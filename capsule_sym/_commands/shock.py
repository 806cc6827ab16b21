"""The command `shock`."""

from __future__ import annotations

from typing import Annotated

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.orbit import settled
from capsule_sym._commands.signature import between, command, option
from capsule_sym._texts import bars


@command()
def shock(
    *,
    system: options.Chosen,
    state: options.State = (0.0, 0.0, 0.0),
    weights: Annotated[
        options.Triple, option(type=(float, float, float), metavar="X_R V_R V_C")
    ] = (1.0, 1.0, 1.0),
    largest: float | None = None,
    samples: Annotated[int, between(100, 10_000_000)] = 10_000,
    periods: int | None = None,
    seed: Annotated[int, between(0)] = 0,
    max_seconds: options.TimeLimit = 60.0,
    out: options.Folder = None,
    as_json: options.Json = False,
) -> None:
    """Find the smallest knock, at any time, after which a motion is lost.

    The motion is that on which the run from --state settles. A knock changes x_r, v_r and v_c at
    once; its size, the root of the sum of squares, is dimensionless. With a device the knock is
    shown in SI units, in the JSON as "si".

    Exits with 3 if there is no motion, or at the time limit. After Ctrl-C, as at the limit, the
    results so far are shown and written.

    Parameters
    ----------
    weights
        Weights of x_r, v_r and v_c in a knock's size; inf excludes a component.
    largest
        Largest size of a knock to try.
    samples
        Final knocks within the smallest one found, to confirm it.
    periods
        Excitation periods within which a motion has to return. [default: 1024, more if the motion
        attracts slowly]
    seed
        Random seed of the knocks.
    out
        Write the JSON here, and the picture.
    """
    from capsule_sym._native import Watch

    parameters, device = system.load()
    limit = Watch(max_seconds)
    with bars.reporting("Knocking", limit) as report:
        orbit = settled(parameters, state, limit, as_json)
        found = capsule_sym.minimal_shock(
            orbit,
            weights=weights,
            largest=largest,
            samples=samples,
            periods=periods,
            seed=seed,
            max_seconds=limit.left,
            progress=report,
        )
    extra = {} if device is None else {"si": _in_si(found, device)}
    present.report(found, "shock", out, as_json, extra, drawn=found.phase is not None)
    present.end(found, limit)


def _in_si(found: capsule_sym.results.Shock, device: options.Device) -> dict[str, float]:
    """Knock and its time in SI units."""
    from capsule_sym._records import in_si

    return in_si(device, (found.to_dict()["knock"] or {}) | {"phase": found.phase})
