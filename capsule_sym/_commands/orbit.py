"""The command `orbit`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import between, command
from capsule_sym._texts import bars

if TYPE_CHECKING:
    from capsule_sym._native import Watch


@command()
def orbit(
    *,
    system: options.Chosen,
    state: options.State = (0.0, 0.0, 0.0),
    starts: Annotated[int, between(0)] = 0,
    seed: Annotated[int, between(0)] = 0,
    max_seconds: options.TimeLimit = 600.0,
    out: options.Folder = None,
    certify: options.Certificate = None,
    as_json: options.Json = False,
) -> None:
    """Solve for the periodic orbit on which the motion settles.

    Shows its itinerary and section point, Floquet multipliers, velocities, energies per excitation
    period, and the tightest inequality of its itinerary. With --starts, all orbits found.

    The JSON of one orbit is that object; of a search it is {"orbits": [...], "status": ...}.
    "value" and "gradient" of a metric are its value and its derivative along the branch by each
    parameter. If --params is a device, "si" has the metrics in SI units.

    Exits with 3, and the reason, if the motion settles on no orbit; the JSON then has the reason as
    "status". Exits with 3 also if a search reaches --max-seconds, with the orbits found so far, and
    with 4 if --certify does not prove all.

    Parameters
    ----------
    starts
        Search from so many random states instead, for unstable and coexisting orbits.
    seed
        Random seed of --starts.
    out
        Write the JSON here, of one orbit with its picture.
    certify
        Prove the orbit in ball arithmetic, and write its certificate here.
    """
    from capsule_sym._native import Watch

    parameters, device = system.load()
    options.check_beside("seed", needs=("starts",))
    options.check_beside("state", never=("starts",))
    limit = Watch(max_seconds)
    search: capsule_sym.results.FoundOrbits | None = None
    found: Sequence[capsule_sym.results.Orbit]
    if starts:
        with bars.reporting("Searching") as report:
            search = found = capsule_sym.search_orbits(
                parameters,
                starts,
                seed=seed,
                max_seconds=max_seconds,
                report=report,
            )
    else:
        found = [settled(parameters, state, limit, as_json)]
    exact = as_json or out is not None
    records = [_record(one, device, exact) for one in found]
    if search is None:
        record, pictures = records[0], {"orbit.svg": partial(capsule_sym.plot, found[0])}
    else:
        said = {"status": str(search.status), "message": search.message}
        record, pictures = {"orbits": records, **said}, {}
    present.result(record, as_json, out, {"orbit.json": record}, pictures)
    present.certificates(certify, found, limit)
    if search is not None and search.status == "time-limit":
        present.fail_early("the search ends", search)


def _record(one: capsule_sym.results.Orbit, device: options.Device, exact: bool) -> dict[str, Any]:
    """Record of an orbit, with SI units as "si" if there is a device.

    Unless it is exact, a velocity and a progression that are rounding alone are 0.
    """
    from capsule_sym._map.steady import shown_progression
    from capsule_sym._orbits.continuation.records import orbit_record
    from capsule_sym._records import in_si

    record = orbit_record(one)
    if not exact and shown_progression(one.motion) == 0:
        record |= {name: {"value": 0.0} for name in ("velocity", "progression")}
    return record if device is None else record | {"si": in_si(device, record)}


def settled(
    parameters: capsule_sym.inputs.SceneParameters,
    state: Sequence[float],
    limit: Watch,
    as_json: bool = False,
) -> capsule_sym.results.Orbit:
    """Orbit on which a start settles; exits with 3, and the reason, if there is none.

    With `as_json` the record of the failure is then printed. Raises KeyboardInterrupt after Ctrl-C.
    """
    from capsule_sym._orbits.continuation.records import failure_record
    from capsule_sym._records import dumps

    found = capsule_sym.solve_orbit(parameters, state, max_seconds=limit.left)
    if limit.stopped:
        raise KeyboardInterrupt
    if not found.success:
        if as_json:
            click.echo(dumps(failure_record(found)))
        present.fail_early("no orbit", found)
    return found
