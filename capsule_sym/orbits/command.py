"""The commands `orbit`, `branch` and `curve`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from capsule_sym.errors import InvalidInput
from capsule_sym.options import (
    certify_option,
    chosen_parameters,
    json_option,
    make_console,
    make_progress,
    make_table,
    parameter_options,
    state_option,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from capsule_sym.orbits.bifurcations import Bifurcation
    from capsule_sym.orbits.continuation import Branch
    from capsule_sym.orbits.curves import Curve
    from capsule_sym.orbits.orbit import NoOrbit, Orbit
    from capsule_sym.parameters import Parameters

_settling_option = state_option("State at phase 0 from which the motion settles.")
_out_option = click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIRECTORY",
    help="Write the JSON and its tables as CSV here.",
)


@click.command("orbit")
@parameter_options
@_settling_option
@click.option(
    "--starts",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Search from so many random states too: finds unstable and coexisting orbits.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Decides the random states.")
@certify_option("the orbit")
@json_option
def orbit(
    file: str | None,
    state: tuple[float, float, float],
    starts: int,
    seed: int,
    certify: Path | None,
    as_json: bool,
    **dimensionless: float | None,
) -> None:
    """Close the periodic orbit on which the motion settles, exactly.

    Shows its word and section point, multipliers, velocities, energies per excitation period, and
    the tightest inequality of its word. With --starts, all orbits that are found. The JSON of one
    orbit is that object, of several it is {"orbits": [...]}; "value" and "gradient" of a figure
    are the figure and its derivative along the branch by each parameter.

    Exits with 3, and the reason, where there is no orbit; the JSON then has the reason as "status".
    Exits with 4 where --certify does not prove all.
    """
    from capsule_sym.orbits.orbit import NoOrbit
    from capsule_sym.orbits.records import failure_record, orbit_record
    from capsule_sym.orbits.search import find_orbit
    from capsule_sym.records import dumps

    parameters, _ = chosen_parameters(file, dimensionless)
    if starts:
        found = _search(parameters, starts, seed)
        if as_json:
            click.echo(dumps({"orbits": [orbit_record(one) for one in found]}))
        else:
            for one in found:
                _print_orbit(one)
            click.echo(f"{len(found)} orbits from {starts} random states")
        if certify is not None:
            _certify(certify, found)
        return
    settled = find_orbit(parameters, state)
    if isinstance(settled, NoOrbit):
        if as_json:
            click.echo(dumps(failure_record(settled)))
        _give_up(settled)
    if as_json:
        click.echo(dumps(orbit_record(settled)))
    else:
        _print_orbit(settled)
    if certify is not None:
        _certify(certify, [settled])


def _certify(path: Path, found: Sequence[Orbit | Bifurcation]) -> None:
    """Write the certificates of orbits and bifurcations; exits with 4 where one is not proved."""
    from capsule_sym.enclosures.certificates import certificates

    proved, failed = certificates(found)
    _write_certificates(path, proved)
    if failed:
        click.echo(f"not proved: {'; '.join(failed)}", err=True)
        raise click.exceptions.Exit(4)


def _write_certificates(path: Path, proved: Sequence[dict[str, Any]]) -> None:
    from capsule_sym.records import dumps, write

    write({path.name: dumps({"certificates": list(proved)}) + "\n"}, path.parent)
    claims = "existence, uniqueness, itinerary"
    stable = sum(bool(one["stable"]) for one in proved)
    click.echo(f"proved {len(proved)} ({claims}; {stable} stable), wrote {path}", err=True)


def _search(parameters: Parameters, starts: int, seed: int) -> Sequence[Orbit]:
    from capsule_sym.orbits.search import random_search

    with make_progress() as progress:
        task = progress.add_task("Searching", total=starts)
        return random_search(
            parameters,
            starts,
            seed=seed,
            report=lambda done, _: progress.update(task, completed=done),
        )


def _settled(parameters: Parameters, state: Sequence[float]) -> Orbit:
    from capsule_sym.orbits.orbit import Orbit
    from capsule_sym.orbits.search import find_orbit

    found = find_orbit(parameters, state)
    if isinstance(found, Orbit):
        return found
    _give_up(found)


def _give_up(found: NoOrbit) -> NoReturn:
    click.echo(f"no orbit ({found.reason.value}): {found.detail}", err=True)
    raise click.exceptions.Exit(3)


def _print_orbit(one: Orbit) -> None:
    from rich.table import Table

    from capsule_sym.orbits.records import orbit_record

    record = orbit_record(one)
    console = make_console()
    table = Table.grid(padding=(0, 2))
    table.add_row("word", " ".join(record["word"]))
    table.add_row("global map", one.motion.global_map)
    table.add_row("period multiple", str(record["period_multiple"]))
    table.add_row("section", f"phase {record['phase']:.12g}, state {_numbers(record['state'])}")
    table.add_row("durations", _numbers(record["durations"]))
    multipliers = [_complex(*pair) for pair in record["multipliers"]]
    stable = "stable" if record["stable"] else "unstable"
    table.add_row("multipliers", f"{'  '.join(multipliers)}  ({stable})")
    tightest = record["admissibility"]
    table.add_row("tightest", f"{tightest['inequality']}: {tightest['value']:.6g}")
    for name in ("progression", "velocity", "work", "damper_loss", "friction_loss"):
        table.add_row(name.replace("_", " "), f"{record[name]['value']:.12g}")
    for name in ("peak_force", "peak_contact"):
        table.add_row(name.replace("_", " "), f"{record[name]['value']:.12g}")
    console.print(table)
    console.print()


def _numbers(values: Sequence[float]) -> str:
    return "  ".join(f"{value:.12g}" for value in values)


def _complex(real: float, imaginary: float) -> str:
    return f"{real:.9g}{imaginary:+.9g}i" if imaginary else f"{real:.9g}"


@click.command("branch")
@parameter_options
@click.option("--parameter", required=True, help="The parameter that varies, such as alpha.")
@click.option("--from", "begin", type=float, required=True, help="Its value at the begin.")
@click.option("--to", "end", type=float, required=True, help="Its value at the end.")
@click.option("--points", type=int, default=100, show_default=True, help="Least number of steps.")
@_settling_option
@_out_option
@certify_option("the bifurcations")
@json_option
def branch(
    file: str | None,
    parameter: str,
    begin: float,
    end: float,
    points: int,
    state: tuple[float, float, float],
    out: Path | None,
    certify: Path | None,
    as_json: bool,
    **dimensionless: float | None,
) -> None:
    """Follow a periodic orbit in a parameter, with all its bifurcations.

    The branch begins with the orbit on which the motion settles at --from. It is followed through
    folds, stable or not, and from word to word where an inequality of the word fails.

    In the JSON, "points" are the orbits in order, "bifurcations" those located exactly, each with
    "type", "line", "parameter", "value", "uncertainty", "word_before" and "word_after"; "ending"
    and "detail" say why the branch ends. --out writes branch.json, points.csv and
    bifurcations.csv.

    Exits with 3, and the reason, where there is no orbit at --from or the branch ends early.
    """
    from capsule_sym.orbits.records import bifurcation_rows, branch_record, point_rows
    from capsule_sym.records import dumps, table, write

    parameters, _ = chosen_parameters(file, dimensionless)
    found = _branch(parameters, parameter, begin, end, points, state)
    if out is not None:
        texts = {"branch.json": dumps(branch_record(found)) + "\n"}
        texts["points.csv"] = table(point_rows(found))
        columns = ("type", "line", "parameter", "value", "uncertainty")
        texts["bifurcations.csv"] = table(bifurcation_rows(found.bifurcations), columns)
        click.echo(f"wrote {', '.join(map(str, write(texts, out)))}", err=True)
    if as_json:
        click.echo(dumps(branch_record(found)))
    else:
        _print_branch(found)
    if certify is not None:
        _certify(certify, found.bifurcations)
    _tell_early_end(found)


def _tell_early_end(found: Branch) -> None:
    """Exit with 3, and the reason, where a branch ends before its parameter is there."""
    from capsule_sym.orbits.states import Ending

    if found.ending is not Ending.REACHED:
        click.echo(f"the branch ends ({found.ending.value}): {found.detail}", err=True)
        raise click.exceptions.Exit(3)


def _branch(
    parameters: Parameters,
    parameter: str,
    begin: float,
    end: float,
    points: int,
    state: Sequence[float],
) -> Branch:
    from capsule_sym.orbits.continuation import follow

    start = _settled(parameters.replace(**{parameter: begin}), state)
    return follow(start, parameter, end, points=points)


def _print_branch(found: Branch) -> None:
    console = make_console()
    console.print(f"{len(found.points)} points, {found.ending.value}: {found.detail}\n")
    table = make_table(
        found.parameter, "progression", "|multiplier|", "tightest inequality", "word"
    )
    shown = found.points[:: max(1, len(found.points) // 20)]
    for point in shown:
        word = point.orbit.word
        tightest = f"{float(point.admissibility.value):.3g} {point.admissibility.named(word)}"
        row = (f"{point.value:.6g}", f"{float(point.orbit.progression):.6g}")
        table.add_row(*row, f"{abs(point.multipliers[0]):.4f}", tightest, str(word))
    console.print(table)
    console.print()
    console.print(bifurcation_table(found.bifurcations))


def bifurcation_table(found: Sequence[Bifurcation]) -> Table:
    """Bifurcations as a table for the console."""
    table = make_table("type", "line", "value", "uncertainty", "word")
    for one in found:
        words = [one.word_before, one.word_after]
        names = [str(word or "none") for word in words]
        value = f"{one.parameter} = {one.value:.15g}"
        table.add_row(one.type, one.line, value, f"{one.uncertainty:.0e}", " → ".join(names))
    return table


@click.command("curve")
@parameter_options
@click.option(
    "--parameters",
    "names",
    nargs=2,
    required=True,
    metavar="FIRST SECOND",
    help="The two parameters, such as alpha gamma.",
)
@click.option(
    "--bifurcation",
    "kind",
    required=True,
    metavar="TYPE",
    help="Bifurcations with this in their type, such as grazing-sliding; all for all.",
)
@click.option(
    "--first", nargs=2, type=float, required=True, metavar="LOW HIGH", help="Range of the first."
)
@click.option(
    "--second", nargs=2, type=float, required=True, metavar="LOW HIGH", help="Range of the second."
)
@click.option("--points", type=int, default=50, show_default=True, help="Steps to a range, least.")
@_settling_option
@_out_option
@json_option
def curve(
    file: str | None,
    names: tuple[str, str],
    kind: str,
    first: tuple[float, float],
    second: tuple[float, float],
    points: int,
    state: tuple[float, float, float],
    out: Path | None,
    as_json: bool,
    **dimensionless: float | None,
) -> None:
    """Follow bifurcations in two parameters, with the points where two conditions meet.

    The bifurcations are those on the branch in the first parameter over its range, at the given
    value of the second, or in the middle of its range where only the default lies outside; each is
    followed both ways until a parameter leaves its range.

    In the JSON, "curves" has for each its "points", its "codimension_two" points, and why its two
    "endings" are. --out writes curves.json, points.csv and codimension_two.csv.

    Exits with 3, and the reason, where there is no orbit to begin with or a curve has no points.
    """
    from capsule_sym.orbits.curves import check, trace
    from capsule_sym.orbits.records import codimension_two_rows, curve_record, curve_rows
    from capsule_sym.records import dumps, table, write

    parameters, _ = chosen_parameters(file, dimensionless)
    check(parameters, names, (first, second))
    given = file is not None or dimensionless[names[1]] is not None
    inside = _within(parameters, names[1], second, given)
    found = _branch(inside, names[0], *first, points, state)
    chosen = [one for one in found.bifurcations if kind in ("all", one.type) or kind in one.type]
    if not found.bifurcations:
        _tell_early_end(found)
    if not chosen:
        types = sorted({one.type for one in found.bifurcations})
        low, high = (point.value for point in (found.points[0], found.points[-1]))
        over = f"{names[0]} from {low:g} to {high:g} at {names[1]} = {getattr(inside, names[1]):g}"
        allowed = f"in the type of one on the branch over {over}, which has {types or 'none'}"
        raise InvalidInput("bifurcation", kind, allowed)
    if inside is not parameters:
        middle = f"{names[1]} = {getattr(inside, names[1])!r}, the middle of its range"
        click.echo(f"bifurcations are sought at {middle}", err=True)
    curves = [trace(one, names[1], (first, second), points=points) for one in chosen]
    record = {"branch": found.ending.value, "curves": [curve_record(one) for one in curves]}
    if out is not None:
        texts = {"curves.json": dumps(record) + "\n"}
        texts["points.csv"] = table(curve_rows(curves), ("curve", "type", "line"))
        rows = codimension_two_rows(curves)
        texts["codimension_two.csv"] = table(rows, ("curve", "first", "second"))
        click.echo(f"wrote {', '.join(map(str, write(texts, out)))}", err=True)
    if as_json:
        click.echo(dumps(record))
    else:
        _print_curves(curves)
    lost = [(one, curve) for one, curve in zip(chosen, curves, strict=True) if not curve.points]
    for one, curve in lost:
        ending, detail = curve.endings[0]
        at = f"{one.type} at {one.parameter} = {one.value:.12g}"
        click.echo(f"no curve of {at} ({ending.value}): {detail}", err=True)
    if lost:
        raise click.exceptions.Exit(3)


def _within(
    parameters: Parameters, name: str, ends: tuple[float, float], given: bool
) -> Parameters:
    """The parameters with one of them in a range: where its default is not, in the middle."""
    (low, high), value = ends, getattr(parameters, name)
    if low <= value <= high:
        return parameters
    if given:
        raise InvalidInput(name, value, f"in the range --second {low:g} {high:g}")
    return parameters.replace(**{name: (low + high) / 2})


def _print_curves(curves: Sequence[Curve]) -> None:
    console = make_console()
    for number, one in enumerate(curves, 1):
        if not one.points:
            console.print(f"{number}  {one.type}: no points\n")
            continue
        begin, end = one.points[0], one.points[-1]
        ends = " to ".join(
            ", ".join(f"{n} = {v:.12g}" for n, v in zip(one.parameters, point.values, strict=True))
            for point in (begin, end)
        )
        console.print(f"{number}  {one.type}: {len(one.points)} points, {ends}")
        for ending, detail in one.endings:
            console.print(f"   {ending.value}: {detail}")
        for meeting in one.codimension_two:
            named = zip(one.parameters, meeting.values, strict=True)
            place = ", ".join(f"{name} = {value:.12g}" for name, value in named)
            console.print(f"   meets {meeting.types[1]} {meeting.lines[1]} at {place}")
        console.print()
