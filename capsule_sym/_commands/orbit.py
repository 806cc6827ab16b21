"""The command `orbit`, and what the commands of orbits share."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from capsule_sym._commands.options import (
    certify_option,
    check_beside,
    chosen_parameters,
    json_option,
    make_console,
    make_progress,
    max_seconds_option,
    out_option,
    parameter_options,
    state_option,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from capsule_sym._enclosures.certificates.certify import Certified
    from capsule_sym._native import Watch
    from capsule_sym._orbits.continuation.search import BoxSearch
    from capsule_sym._orbits.shooting.orbit import Orbit
    from capsule_sym._orbits.shooting.search import FoundOrbits
    from capsule_sym._parameters import Parameters, PhysicalParameters

settling_option = state_option("State at phase 0 from which the motion settles.")
tables_option = out_option("Write the JSON and its tables as CSV here.")


@click.command("orbit")
@parameter_options
@settling_option
@click.option(
    "--starts",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Search from so many random states too: finds unstable and coexisting orbits.",
)
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Decides the random states of --starts.",
)
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
@max_seconds_option()
@certify_option("the orbit")
@json_option
def orbit(
    file: str | None,
    state: tuple[float, float, float],
    starts: int,
    seed: int,
    box: tuple[float, float, float] | None,
    along: tuple[str, float, float] | None,
    max_seconds: float,
    certify: Path | None,
    as_json: bool,
    **dimensionless: float | None,
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

    parameters, device = chosen_parameters(file, dimensionless)
    check_beside("along", needs=("box",))
    check_beside("seed", needs=("starts",))
    check_beside("starts", never=("box",))
    check_beside("state", never=("starts", "box"))
    found: Sequence[Orbit]
    search: BoxSearch | FoundOrbits | None = None
    limit = Watch(max_seconds)
    if box is not None:
        search = _search_box(parameters, device, box, along, max_seconds, as_json)
        found = search.orbits
    elif starts:
        found = search = _search(parameters, starts, seed, max_seconds)
        if as_json:
            orbits = [_record(one, device) for one in found]
            click.echo(dumps({"orbits": orbits, "status": str(search.status)}))
        else:
            for one in found:
                _print_orbit(one, _record(one, device))
            click.echo(f"{len(found)} orbits from {search.searched} random states")
    else:
        settled = solve_orbit(parameters, state, max_seconds=max_seconds)
        if as_json:
            click.echo(
                dumps(_record(settled, device) if settled.success else failure_record(settled))
            )
        if not settled.success:
            _give_up(settled)
        if not as_json:
            _print_orbit(settled, _record(settled, device))
        found = [settled]
    if certify is not None:
        certify_found(certify, found, limit)
    if search is not None and search.status == "time-limit":
        click.echo(f"the search ends ({search.status}): {search.message}", err=True)
        raise click.exceptions.Exit(3)


def certify_found(path: Path, found: Sequence[Certified], limit: Watch) -> None:
    """Write the certificates of what was found; exits with 4 where something is not proved.

    A file is left as it was where nothing is proved.
    """
    from capsule_sym._enclosures.certificates.certify import certificates

    proved, failed = certificates(found, limit)
    if proved or not failed:
        _write_certificates(path, proved)
    if failed:
        click.echo(f"not proved: {'; '.join(failed)}", err=True)
        raise click.exceptions.Exit(4)


def _write_certificates(path: Path, proved: Sequence[dict[str, Any]]) -> None:
    from capsule_sym._files import write_whole
    from capsule_sym._records import dumps

    write_whole(path, dumps({"certificates": list(proved)}) + "\n", "--certify")
    claims = "existence, uniqueness, itinerary"
    if any(one["kind"] == "run" for one in proved):
        claims = f"{sum(len(one['fields']) for one in proved)} segments, switch by switch"
    else:
        claims += f"; {sum(bool(one['stable']) for one in proved)} stable"
    click.echo(f"proved {len(proved)} ({claims}), wrote {path}", err=True)


def _record(one: Orbit, device: PhysicalParameters | None) -> dict[str, Any]:
    from capsule_sym._orbits.continuation.records import orbit_record
    from capsule_sym._records import in_si

    record = orbit_record(one)
    return record if device is None else record | {"si": in_si(device, record)}


def _search_box(
    parameters: Parameters,
    device: PhysicalParameters | None,
    box: tuple[float, float, float],
    along: tuple[str, float, float] | None,
    max_seconds: float,
    as_json: bool,
) -> BoxSearch:
    from capsule_sym._orbits.continuation.records import branch_record
    from capsule_sym._orbits.continuation.search import search_box
    from capsule_sym._records import dumps

    name, ends = (None, None) if along is None else (along[0].replace("-", "_"), along[1:])
    found = search_box(parameters, box, along=name, ends=ends, max_seconds=max_seconds)
    if as_json:
        record = {
            "orbits": [_record(one, device) for one in found.orbits],
            "settled": list(found.settled),
            "open": found.open,
            "status": str(found.status),
            "searched": found.message,
            "isolas": [branch_record(one) for one in found.isolas],
        }
        click.echo(dumps(record))
    else:
        for one, count in zip(found.orbits, found.settled, strict=True):
            _print_orbit(one, _record(one, device))
            click.echo(f"{count} of {found.starts} starts settle on it\n")
        for branch in found.isolas:
            values = [point.value for point in branch.points]
            click.echo(f"isola in {branch.parameter} from {min(values):.6g} to {max(values):.6g}")
        click.echo(found.message)
    return found


def _search(parameters: Parameters, starts: int, seed: int, max_seconds: float) -> FoundOrbits:
    from capsule_sym._orbits.shooting.search import search_orbits

    with make_progress() as progress:
        task = progress.add_task("Searching", total=starts)
        return search_orbits(
            parameters,
            starts,
            seed=seed,
            max_seconds=max_seconds,
            report=lambda done, _: progress.update(task, completed=done),
        )


def settled(parameters: Parameters, state: Sequence[float], max_seconds: float = math.inf) -> Orbit:
    """The orbit on which the motion settles from a state; exits with 3 where there is none."""
    from capsule_sym._orbits.shooting.search import solve_orbit

    found = solve_orbit(parameters, state, max_seconds=max_seconds)
    if found.success:
        return found
    _give_up(found)


def _give_up(found: Orbit) -> NoReturn:
    click.echo(f"no orbit ({found.status.value}): {found.message}", err=True)
    raise click.exceptions.Exit(3)


def _print_orbit(one: Orbit, record: dict[str, Any]) -> None:
    from rich.markup import escape
    from rich.table import Table

    from capsule_sym._map.steady import shown_progression
    from capsule_sym._orbits.metrics.performance import METRICS

    console = make_console()
    table = Table.grid(padding=(0, 2))
    table.add_row("itinerary", " ".join(record["itinerary"]))
    table.add_row("global map", one.motion.global_map)
    table.add_row("period number", str(record["period_number"]))
    table.add_row("section", f"phase {record['phase']:.12g}, state {_numbers(record['state'])}")
    table.add_row("durations", _numbers(record["durations"]))
    multipliers = [_complex(*pair) for pair in record["multipliers"]]
    stable = "stable" if record["stable"] else "unstable"
    table.add_row("multipliers", f"{'  '.join(multipliers)}  ({stable})")
    tightest = record["admissibility"]
    table.add_row("tightest", f"{tightest['inequality']}: {tightest['value']:.6g}")
    drifts = shown_progression(one.motion) != 0
    values = {name: record[name]["value"] for name in METRICS} | record.get("si", {})
    for name, value in values.items():
        none = not drifts and name.startswith(("velocity", "progression"))
        table.add_row(escape(name.replace("_", " ")), f"{0 if none else value:.12g}")
    console.print(table)
    console.print()


def _numbers(values: Sequence[float]) -> str:
    return "  ".join(f"{value:.12g}" for value in values)


def _complex(real: float, imaginary: float) -> str:
    return f"{real:.9g}{imaginary:+.9g}i" if imaginary else f"{real:.9g}"
