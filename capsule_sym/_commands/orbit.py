"""The command `orbit`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import between, command
from capsule_sym._errors import counted

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
    certify: options.Certificate = None,
    as_json: options.Json = False,
) -> None:
    """Solve for the periodic orbit on which the motion settles.

    Shows its itinerary and section point, Floquet multipliers, velocities, energies per excitation
    period, and the tightest inequality of its itinerary. With --starts, all orbits found.

    The JSON of one orbit is that object; of a search it is {"orbits": [...], "status": ...}.
    "value" and "gradient" of a metric are its value and its derivative along the branch by each
    parameter. If --params is a device, "si" has the metrics in SI units.

    Exits with 3, and the reason, if there is no orbit; the JSON then has the reason as "status".
    Exits with 3 also if a search reaches --max-seconds, with the orbits found so far, and with 4 if
    --certify does not prove all.

    Parameters
    ----------
    starts
        Search from so many random states too, for unstable and coexisting orbits.
    seed
        Random seed of --starts.
    certify
        Prove the orbit in ball arithmetic, and write its certificate here.
    """
    from capsule_sym._native import Watch

    parameters, device = system.load()
    options.check_beside("seed", needs=("starts",))
    options.check_beside("state", never=("starts",))
    limit = Watch(max_seconds)
    search: capsule_sym.FoundOrbits | None = None
    found: Sequence[capsule_sym.Orbit]
    if starts:
        with present.progress("Searching", starts) as update:
            search = found = capsule_sym.search_orbits(
                parameters,
                starts,
                seed=seed,
                max_seconds=max_seconds,
                report=lambda done, _: update(completed=done),
            )
        present.result(
            lambda: {
                "orbits": [_record(one, device) for one in found],
                "status": str(search.status),
            },
            lambda: _print_found(found, search.searched, device),
            as_json,
        )
    else:
        found = [one := settled(parameters, state, limit, as_json)]
        present.result(lambda: _record(one, device), lambda: _print_orbit(one, device), as_json)
    present.certificates(certify, found, limit)
    if search is not None and search.status == "time-limit":
        present.fail_early("the search ends", search)


def _record(one: capsule_sym.Orbit, device: options.Device) -> dict[str, Any]:
    from capsule_sym._orbits.continuation.records import orbit_record
    from capsule_sym._records import in_si

    record = orbit_record(one)
    return record if device is None else record | {"si": in_si(device, record)}


def _print_found(found: Sequence[capsule_sym.Orbit], searched: int, device: options.Device) -> None:
    for one in found:
        _print_orbit(one, device)
    click.echo(f"{counted(len(found), 'orbit')} from {counted(searched, 'random state')}")


def settled(
    parameters: capsule_sym.SceneParameters,
    state: Sequence[float],
    limit: Watch,
    as_json: bool = False,
) -> capsule_sym.Orbit:
    """Orbit on which a start settles; exits with 3, and the reason, if there is none."""
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


def _print_orbit(one: capsule_sym.Orbit, device: options.Device) -> None:
    from capsule_sym._map.steady import shown_progression
    from capsule_sym._orbits.metrics.performance import shown

    record = _record(one, device)
    tightest, stable = record["admissibility"], "stable" if record["stable"] else "unstable"
    multipliers = "  ".join(_complex(*pair) for pair in record["multipliers"])
    rows = {
        "itinerary": " ".join(record["itinerary"]),
        "global map": one.motion.global_map,
        "period number": str(record["period_number"]),
        "section": f"phase {record['phase']:.12g}, state {_numbers(record['state'])}",
        "durations": _numbers(record["durations"]),
        "multipliers": f"{multipliers}  ({stable})",
        "tightest": f"{tightest['inequality']}: {tightest['value']:.6g}",
    }
    drifts = shown_progression(one.motion) != 0
    values = {name: record[name]["value"] for name in shown(one.scene)} | record.get("si", {})
    for name, value in values.items():
        none = not drifts and name.startswith(("velocity", "progression"))
        rows[name.replace("_", " ")] = f"{0 if none else value:.12g}"
    present.grid(rows.items())
    click.echo()


def _numbers(values: Sequence[float]) -> str:
    return "  ".join(f"{value:.12g}" for value in values)


def _complex(real: float, imaginary: float) -> str:
    return f"{real:.9g}{imaginary:+.9g}i" if imaginary else f"{real:.9g}"
