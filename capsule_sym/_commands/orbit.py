"""The command `orbit`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.certify import certify_found

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from capsule_sym._orbits.continuation.search import BoxSearch
    from capsule_sym._orbits.shooting.orbit import Orbit
    from capsule_sym._orbits.shooting.search import FoundOrbits
    from capsule_sym._parameters import Parameters, PhysicalParameters

settling_option = options.state_option("State at phase 0 from which the motion settles.")
tables_option = options.out_option("Write the JSON and its tables as CSV here.")


@click.command("orbit")
@options.parameter_options
@settling_option
@options.count_option(
    "--starts", 0, "Search from so many random states too: finds unstable and coexisting orbits.", 0
)
@options.count_option("--seed", 0, "Decides the random states of --starts.", 0)
@click.option(
    "--box",
    nargs=3,
    type=float,
    metavar="X_R V_R V_C",
    help="Search from a grid of states up to these x_r, v_r, v_c: attractors, others.",
)
@click.option(
    "--along",
    nargs=3,
    type=(str, float, float),
    metavar="NAME LOW HIGH",
    help="With --box: follow each orbit in a parameter too, to others and to isolas.",
)
@options.max_seconds_option()
@options.certify_option("the orbit")
@options.json_option
def orbit(
    system: options.System,
    state: tuple[float, float, float],
    starts: int,
    seed: int,
    box: tuple[float, float, float] | None,
    along: tuple[str, float, float] | None,
    max_seconds: float,
    certify: Path | None,
    as_json: bool,
) -> None:
    """Close the periodic orbit on which the motion settles, exactly.

    Shows its itinerary and section point, multipliers, velocities, energies per excitation period,
    and the tightest inequality of its itinerary. With --starts or --box, all orbits that are found.
    The JSON of one orbit is that object, of a search {"orbits": [...], "status": ...}; "value" and
    "gradient" of a figure are the figure and its derivative along the branch by each parameter.
    With --box the JSON says what was "searched", how many starts have "settled" on each orbit, how
    many are "open", settled on none, and has the closed branches as "isolas". Where --params is a
    device, "si" has the figures in SI units, energies per excitation period.

    Exits with 3, and the reason, where there is no orbit; the JSON then has the reason as "status".
    So it does where a search ends after --max-seconds, with the orbits that were found until then.
    Exits with 4 where --certify does not prove all.
    """
    from capsule_sym._native import Watch
    from capsule_sym._orbits.continuation.records import failure_record
    from capsule_sym._orbits.shooting.search import solve_orbit
    from capsule_sym._records import dumps

    parameters, device = system.load()
    options.check_beside("along", needs=("box",))
    options.check_beside("seed", needs=("starts",))
    options.check_beside("starts", never=("box",))
    options.check_beside("state", never=("starts", "box"))
    limit = Watch(max_seconds)
    search: BoxSearch | FoundOrbits | None = None
    found: Sequence[Orbit]
    if box is not None:
        search = boxes = _search_box(parameters, box, along, max_seconds)
        found = boxes.orbits
        present.result(
            lambda: _box_record(boxes, device), lambda: _print_box(boxes, device), as_json
        )
    elif starts:
        search = found = _search(parameters, starts, seed, max_seconds)

        def record() -> dict[str, Any]:
            orbits = [_record(one, device) for one in found]
            return {"orbits": orbits, "status": str(search.status)}

        def show() -> None:
            for one in found:
                _print_orbit(one, device)
            click.echo(f"{len(found)} orbits from {search.searched} random states")

        present.result(record, show, as_json)
    else:
        one = solve_orbit(parameters, state, max_seconds=max_seconds)
        if as_json and not one.success:
            click.echo(dumps(failure_record(one)))
        found = [checked(one)]
        present.result(lambda: _record(one, device), lambda: _print_orbit(one, device), as_json)
    if certify is not None:
        certify_found(certify, found, limit)
    if search is not None and search.status == "time-limit":
        present.fail(f"the search ends ({search.status}): {search.message}")


def _record(one: Orbit, device: PhysicalParameters | None) -> dict[str, Any]:
    from capsule_sym._orbits.continuation.records import orbit_record
    from capsule_sym._records import in_si

    record = orbit_record(one)
    return record if device is None else record | {"si": in_si(device, record)}


def _search_box(
    parameters: Parameters,
    box: tuple[float, float, float],
    along: tuple[str, float, float] | None,
    max_seconds: float,
) -> BoxSearch:
    from capsule_sym._orbits.continuation.search import search_box

    name, ends = (None, None) if along is None else (along[0].replace("-", "_"), along[1:])
    return search_box(parameters, box, along=name, ends=ends, max_seconds=max_seconds)


def _box_record(found: BoxSearch, device: PhysicalParameters | None) -> dict[str, Any]:
    from capsule_sym._orbits.continuation.records import branch_record

    return {
        "orbits": [_record(one, device) for one in found.orbits],
        "settled": list(found.settled),
        "open": found.open,
        "status": str(found.status),
        "searched": found.message,
        "isolas": [branch_record(one) for one in found.isolas],
    }


def _print_box(found: BoxSearch, device: PhysicalParameters | None) -> None:
    for one, count in zip(found.orbits, found.settled, strict=True):
        _print_orbit(one, device)
        click.echo(f"{count} of {found.starts} starts settle on it\n")
    for branch in found.isolas:
        values = [point.value for point in branch.points]
        click.echo(f"isola in {branch.parameter} from {min(values):.6g} to {max(values):.6g}")
    click.echo(found.message)


def _search(parameters: Parameters, starts: int, seed: int, max_seconds: float) -> FoundOrbits:
    from capsule_sym._orbits.shooting.search import search_orbits

    with present.make_progress() as progress:
        task = progress.add_task("Searching", total=starts)
        return search_orbits(
            parameters,
            starts,
            seed=seed,
            max_seconds=max_seconds,
            report=lambda done, _: progress.update(task, completed=done),
        )


def checked(found: Orbit) -> Orbit:
    """The orbit that was looked for; exits with 3 where there is none."""
    if not found.success:
        present.fail(f"no orbit ({found.status.value}): {found.message}")
    return found


def _print_orbit(one: Orbit, device: PhysicalParameters | None) -> None:
    from rich.markup import escape

    from capsule_sym._map.steady import shown_progression
    from capsule_sym._orbits.metrics.performance import METRICS

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
    values = {name: record[name]["value"] for name in METRICS} | record.get("si", {})
    for name, value in values.items():
        none = not drifts and name.startswith(("velocity", "progression"))
        rows[escape(name.replace("_", " "))] = f"{0 if none else value:.12g}"
    present.grid(rows.items())
    click.echo()


def _numbers(values: Sequence[float]) -> str:
    return "  ".join(f"{value:.12g}" for value in values)


def _complex(real: float, imaginary: float) -> str:
    return f"{real:.9g}{imaginary:+.9g}i" if imaginary else f"{real:.9g}"
