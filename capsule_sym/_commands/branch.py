"""The command `branch`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from capsule_sym._commands.options import (
    certify_option,
    check_beside,
    chosen_parameters,
    json_option,
    make_console,
    make_table,
    max_seconds_option,
    ranged_parameter_options,
    ranges,
)
from capsule_sym._commands.orbit import certify_found, settled, settling_option, tables_option
from capsule_sym._errors import InvalidInput

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.table import Table

    from capsule_sym._native import Watch
    from capsule_sym._orbits.continuation.branches.branch import Branch
    from capsule_sym._orbits.continuation.points.bifurcation import Bifurcation
    from capsule_sym._parameters import Parameters


@click.command("branch")
@ranged_parameter_options()
@click.option(
    "--parameter",
    callback=lambda context, option, name: name and name.replace("-", "_"),
    help="What varies with --from and --to where it has no option: a name of --with.",
)
@click.option("--from", "begin", type=float, help="Its value at the begin.")
@click.option("--to", "end", type=float, help="Its value at the end.")
@click.option("--points", type=int, default=100, show_default=True, help="Least number of steps.")
@click.option(
    "--restart",
    nargs=2,
    metavar="FILE LABEL",
    help="Begin at a labelled point, such as PD1, of a branch.json, in place of --from.",
)
@click.option(
    "--cascade",
    "depth",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    metavar="DEPTH",
    help="Follow the branches of doubled orbits too, and those that leave them.",
)
@click.option(
    "--with",
    "ties",
    multiple=True,
    metavar="NAME=FORMULA",
    help="A parameter that varies too, such as alpha=0.5*omega**2; may be repeated.",
)
@settling_option
@tables_option
@max_seconds_option()
@certify_option("the bifurcations")
@json_option
def branch(
    file: str | None,
    parameter: str | None,
    begin: float | None,
    end: float | None,
    points: int,
    restart: tuple[str, str] | None,
    depth: int,
    ties: tuple[str, ...],
    state: tuple[float, float, float],
    out: Path | None,
    max_seconds: float,
    certify: Path | None,
    as_json: bool,
    **dimensionless: float | None,
) -> None:
    """Follow a periodic orbit in a parameter, with all its bifurcations.

    The parameter varies that is given a range, such as --alpha 0.1:2 or, downwards, --alpha 2:0.1.
    The branch begins with the orbit on which the motion settles there, or at a labelled point
    of a branch that --out wrote. It is followed through folds, stable or not, and from itinerary to
    itinerary where an inequality of the itinerary fails. With --restart all branches are followed
    that leave the point towards --to: at a period doubling the doubled one too. With --with the
    parameter may also be a name of one's own, of which one of the parameters given so is an affine
    function, or P_d, Omega, G, c or k2 of a device in SI units.

    In the JSON, "points" are the orbits in order, "bifurcations" those located exactly, each with
    "label", "type", "line", "parameter", "value", "uncertainty", "itinerary_before",
    "itinerary_after" and "normal_form"; "status" and "message" say why the branch ends; "switched"
    are the branches beside it, each with its "origin". Where --params is a device, "si" of a point
    has it in SI units, as have columns of points.csv. --out writes branch.json, points.csv and
    bifurcations.csv.

    Exits with 3, and the reason, where there is no orbit to begin with or the branch ends early.
    """
    from capsule_sym._native import Watch
    from capsule_sym._orbits.continuation.branches.continuing import check_points
    from capsule_sym._orbits.continuation.families.states import Ending
    from capsule_sym._orbits.continuation.records import bifurcation_rows, branch_record, point_rows
    from capsule_sym._records import dumps, in_si, table, write

    for name in (*dimensionless, *ranges(), "file", "begin", "state"):
        check_beside(name, never=("restart",))
    device, limit = None, Watch(max_seconds)
    for name, (low, high, *_) in ranges().items():
        if parameter is not None or begin is not None or end is not None:
            raise InvalidInput(name, f"{low:g}:{high:g}", "the only thing that varies")
        parameter, begin, end = name, low, high
    if parameter in dimensionless:
        check_beside(parameter, never=("begin",))
    check_points(points)
    if end is None:
        beside = ", or --to beside --restart" if restart else ", or --parameter, --from and --to"
        raise click.UsageError(f"give a range of what varies, such as --alpha 0.1:2{beside}")
    if restart is not None:
        found = _restarted(*restart, parameter, end, points, _ties(ties) or None, limit)
    else:
        if parameter is None or begin is None:
            raise click.UsageError("--to needs --parameter and --from, or --restart in their place")
        parameters, device = chosen_parameters(file, dimensionless)
        tied = _ties(ties)
        if device is not None and not tied and parameter not in parameters.to_dict():
            from capsule_sym._orbits.continuation.parameter_paths import device_path

            tied = device_path(device, parameter)
        found = (followed(parameters, parameter, begin, end, points, state, limit, tied),)
    if certify is not None and found[0].axis.path.ties:
        raise InvalidInput("certify", str(certify), "absent where several parameters vary")
    found += _cascade(found, depth, points, limit)
    first, *others = found
    record = branch_record(first, others)
    if device is not None:
        for one in (record, *record["switched"]):
            for point in one["points"]:
                point["si"] = in_si(device, point)
    if out is not None:
        texts = {"branch.json": dumps(record) + "\n"}
        points_of = [row for one in found for row in point_rows(one)]
        texts["points.csv"] = table([row | in_si(device, row) for row in points_of])
        columns = ("origin", "label", "type", "line", "parameter", "value", "uncertainty")
        rows = [
            {"origin": one.origin, **row}
            for one in found
            for row in bifurcation_rows(one.bifurcations)
        ]
        texts["bifurcations.csv"] = table(rows, columns)
        click.echo(f"wrote {', '.join(map(str, write(texts, out)))}", err=True)
    if as_json:
        click.echo(dumps(record))
    else:
        for one in found:
            _print_branch(one)
    if certify is not None:
        certify_found(certify, [one for branch in found for one in branch.bifurcations], limit)
    tell_early_end(next((one for one in found if one.status is Ending.TIME_LIMIT), first))


def _restarted(
    file: str,
    label: str,
    parameter: str | None,
    end: float,
    points: int,
    ties: dict[str, str] | None,
    limit: Watch,
) -> tuple[Branch, ...]:
    from capsule_sym._orbits.continuation.branches.switching import continue_from

    return continue_from(
        file, label, end, parameter=parameter, points=points, ties=ties, max_seconds=limit.left
    )


def _ties(given: Sequence[str]) -> dict[str, str]:
    """Formulas by the name of the parameter, from NAME=FORMULA."""
    found = {}
    for text in given:
        name, equals, formula = text.partition("=")
        if not equals:
            raise InvalidInput("with", text, "NAME=FORMULA, such as alpha=0.5*omega**2")
        found[name.strip()] = formula
    return found


def _cascade(
    found: tuple[Branch, ...], depth: int, points: int, limit: Watch
) -> tuple[Branch, ...]:
    from capsule_sym._orbits.continuation.branches.switching import period_doubling_cascade

    def doubled(one: Branch) -> tuple[Branch, ...]:
        return period_doubling_cascade(one, depth, points=points, max_seconds=limit.left)

    return tuple(new for one in found for new in doubled(one))


def tell_early_end(found: Branch) -> None:
    """Exit with 3, and the reason, where a branch ends before its parameter is there."""
    from capsule_sym._orbits.continuation.families.states import Ending

    if found.status is not Ending.REACHED:
        click.echo(f"the branch ends ({found.status.value}): {found.message}", err=True)
        raise click.exceptions.Exit(3)


def followed(
    parameters: Parameters,
    parameter: str,
    begin: float,
    end: float,
    points: int,
    state: Sequence[float],
    limit: Watch,
    ties: Mapping[str, str] | None = None,
) -> Branch:
    """The branch of the motion that settles from a state; exits with 3 where none does."""
    from capsule_sym._orbits.continuation.branches.continuing import continue_orbit
    from capsule_sym._orbits.continuation.parameter_paths import parameter_path
    from capsule_sym._parameters import Parameters

    path = parameter_path(parameter, ties)
    path.check(parameters, begin, end)
    placed = path.placed([*parameters.to_dict().values()], begin)
    start = settled(Parameters(*placed), state, limit.left)
    return continue_orbit(start, parameter, end, points=points, ties=ties, max_seconds=limit.left)


def _print_branch(found: Branch) -> None:
    from capsule_sym._map.steady import shown_progression

    console = make_console()
    if found.origin:
        console.print(f"\nfrom {found.origin}")
    console.print(f"{len(found.points)} points, {found.status.value}: {found.message}\n")
    table = make_table(
        found.parameter, "progression", "|multiplier|", "tightest inequality", "itinerary"
    )
    shown = found.points[:: max(1, len(found.points) // 20)]
    for point in shown:
        itinerary = point.orbit.itinerary
        tightest = f"{float(point.admissibility.value):.3g} {point.admissibility.named(itinerary)}"
        row = (f"{point.value:.6g}", f"{shown_progression(point.orbit.motion):.6g}")
        table.add_row(*row, f"{abs(point.multipliers[0]):.4f}", tightest, str(itinerary))
    console.print(table)
    console.print()
    console.print(bifurcation_table(found.bifurcations))
    if found.bifurcations:
        console.print()
        console.print(normal_form_table(found.bifurcations))


def bifurcation_table(found: Sequence[Bifurcation]) -> Table:
    """Bifurcations as a table for the console."""
    parameters = {one.parameter for one in found}
    table = make_table(
        "", "type", "line", " or ".join(sorted(parameters)), "uncertainty", "itinerary"
    )
    for one in found:
        itineraries = [one.itinerary_before, one.itinerary_after]
        names = [str(itinerary or "none") for itinerary in itineraries]
        value = f"{one.parameter} = " * (len(parameters) > 1) + f"{one.value:.15g}"
        error = f"{one.uncertainty:.0e}"
        table.add_row(one.label, one.type, one.line, value, error, " → ".join(names))
    return table


def normal_form_table(found: Sequence[Bifurcation]) -> Table:
    """Normal forms as a table for the console: how the parameter grows with the amplitude s."""
    table = make_table("", "change of parameter", "leading term", "scenario")
    for one in found:
        form = one.normal_form
        if form is None:
            continue
        term = f"{form.coefficient or 0:.4g} s^{form.power}"
        if form.discontinuity is not None:
            largest = max(form.discontinuity, key=abs)
            term = f"{largest:.4g} s^{form.power}, distance^{form.exponent:g}"
        growth = f"{form.growth:.6g} s^{form.order}".removesuffix("^1")
        table.add_row(one.label, growth, term, form.scenario)
    return table
