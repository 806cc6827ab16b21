"""The command `branch`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.certify import certify_found
from capsule_sym._commands.orbit import checked, settling_option, tables_option
from capsule_sym._errors import InvalidInput
from capsule_sym.generated.facts import DEFAULTS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from capsule_sym._native import Watch
    from capsule_sym._orbits.continuation.branches.branch import Branch
    from capsule_sym._orbits.continuation.points.bifurcation import Bifurcation
    from capsule_sym._parameters import Parameters, PhysicalParameters


_SAME_SIZE = 1e-6  # entries of a term that differ by a smaller share are as large


@click.command("branch")
@options.ranged_parameter_options()
@click.option(
    "--parameter",
    callback=lambda context, option, name: name and name.replace("-", "_"),
    help="What varies with --from and --to where it has no option: a name of --with.",
)
@click.option("--from", "begin", type=float, help="Its value at the begin.")
@click.option("--to", "end", type=float, help="Its value at the end.")
@options.count_option("--points", 100, "Least number of steps.")
@click.option(
    "--restart",
    nargs=2,
    metavar="FILE LABEL",
    help="Begin at a labelled point, such as PD1, of a branch.json, in place of --from.",
)
@options.count_option(
    "--cascade",
    0,
    "Follow the branches of doubled orbits too, and those that leave them.",
    0,
    metavar="DEPTH",
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
@options.max_seconds_option()
@options.certify_option("the bifurcations")
@options.json_option
def branch(
    system: options.System,
    parameter: str | None,
    begin: float | None,
    end: float | None,
    points: int,
    restart: tuple[str, str] | None,
    cascade: int,
    ties: tuple[str, ...],
    state: tuple[float, float, float],
    out: Path | None,
    max_seconds: float,
    certify: Path | None,
    as_json: bool,
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
    from capsule_sym._orbits.continuation.branches.switching import (
        continue_from,
        period_doubling_cascade,
    )
    from capsule_sym._orbits.continuation.families.states import Ending
    from capsule_sym._orbits.continuation.settings import check_points

    for name in (*DEFAULTS, *options.ranges(), "file", "begin", "state"):
        options.check_beside(name, never=("restart",))
    device, limit = None, Watch(max_seconds)
    for name, (low, high, *_) in options.ranges().items():
        if parameter is not None or begin is not None or end is not None:
            raise InvalidInput(name, f"{low:g}:{high:g}", "the only thing that varies")
        parameter, begin, end = name, low, high
    if parameter in DEFAULTS:
        options.check_beside(parameter, never=("begin",))
    check_points(points)
    if end is None:
        beside = ", or --to beside --restart" if restart else ", or --parameter, --from and --to"
        raise click.UsageError(f"give a range of what varies, such as --alpha 0.1:2{beside}")
    if restart is not None:
        found = continue_from(
            *restart,
            end,
            parameter=parameter,
            points=points,
            ties=_ties(ties) or None,
            max_seconds=limit.left,
        )
    else:
        if parameter is None or begin is None:
            raise click.UsageError("--to needs --parameter and --from, or --restart in their place")
        parameters, device = system.load()
        tied = _ties(ties)
        if device is not None and not tied and parameter not in parameters.to_dict():
            from capsule_sym._orbits.continuation.parameter_paths import device_path

            tied = device_path(device, parameter)
        found = (followed(parameters, parameter, begin, end, points, state, limit, tied),)
    if certify is not None and found[0].axis.path.ties:
        raise InvalidInput("certify", str(certify), "absent where several parameters vary")
    for one in found:
        found += period_doubling_cascade(one, cascade, points=points, max_seconds=limit.left)

    def show() -> None:
        for one in found:
            _print_branch(one)

    present.result(
        lambda: _record(found, device), show, as_json, out, lambda: _texts(found, device)
    )
    if certify is not None:
        certify_found(certify, [one for branch in found for one in branch.bifurcations], limit)
    tell_early_end(next((one for one in found if one.status is Ending.TIME_LIMIT), found[0]))


def _record(found: Sequence[Branch], device: PhysicalParameters | None) -> dict[str, Any]:
    from capsule_sym._orbits.continuation.records import branch_record
    from capsule_sym._records import in_si

    first, *others = found
    record = branch_record(first, others)
    if device is not None:
        for one in (record, *record["switched"]):
            for point in one["points"]:
                point["si"] = in_si(device, point)
    return record


def _texts(found: Sequence[Branch], device: PhysicalParameters | None) -> dict[str, str]:
    from capsule_sym._orbits.continuation.records import bifurcation_rows, point_rows
    from capsule_sym._records import dumps, in_si, table

    points = [row | in_si(device, row) for one in found for row in point_rows(one)]
    rows = [
        {"origin": one.origin, **row} for one in found for row in bifurcation_rows(one.bifurcations)
    ]
    columns = ("origin", "label", "type", "line", "parameter", "value", "uncertainty")
    return {
        "branch.json": dumps(_record(found, device)) + "\n",
        "points.csv": table(points),
        "bifurcations.csv": table(rows, columns),
    }


def _ties(given: Sequence[str]) -> dict[str, str]:
    """Formulas by the name of the parameter, from NAME=FORMULA."""
    found = {}
    for text in given:
        name, equals, formula = text.partition("=")
        if not equals:
            raise InvalidInput("with", text, "NAME=FORMULA, such as alpha=0.5*omega**2")
        found[name.strip()] = formula
    return found


def tell_early_end(found: Branch) -> None:
    """Exit with 3, and the reason, where a branch ends before its parameter is there."""
    from capsule_sym._orbits.continuation.families.states import Ending

    if found.status is not Ending.REACHED:
        present.fail(f"the branch ends ({found.status.value}): {found.message}")


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
    from capsule_sym._orbits.shooting.search import solve_orbit
    from capsule_sym._parameters import Parameters

    path = parameter_path(parameter, ties)
    path.check(parameters, begin, end)
    placed = path.placed([*parameters.to_dict().values()], begin)
    start = checked(solve_orbit(Parameters(*placed), state, max_seconds=limit.left))
    return continue_orbit(start, parameter, end, points=points, ties=ties, max_seconds=limit.left)


def _print_branch(found: Branch) -> None:
    from capsule_sym._map.steady import shown_progression

    console = present.make_console()
    if found.origin:
        console.print(f"\nfrom {found.origin}")
    console.print(f"{len(found.points)} points, {found.status.value}: {found.message}\n")
    rows = (
        (
            f"{point.value:.6g}",
            f"{shown_progression(point.orbit.motion):.6g}",
            f"{abs(point.multipliers[0]):.4f}",
            f"{float(point.admissibility.value):.3g} "
            f"{point.admissibility.named(point.orbit.itinerary)}",
            str(point.orbit.itinerary),
        )
        for point in found.points[:: max(1, len(found.points) // 20)]
    )
    names = (found.parameter, "progression", "|multiplier|", "tightest inequality", "itinerary")
    present.table(names, rows)
    console.print()
    _print_bifurcations(found.bifurcations)
    if found.bifurcations:
        console.print()
        _print_normal_forms(found.bifurcations)


def _print_bifurcations(found: Sequence[Bifurcation]) -> None:
    parameters = sorted({one.parameter for one in found})
    rows = (
        (
            one.label,
            one.type,
            one.line,
            f"{one.parameter} = " * (len(parameters) > 1) + f"{one.value:.15g}",
            f"{one.uncertainty:.0e}",
            f"{one.itinerary_before or 'none'} → {one.itinerary_after or 'none'}",
        )
        for one in found
    )
    present.table(("", "type", "line", " or ".join(parameters), "uncertainty", "itinerary"), rows)


def _print_normal_forms(found: Sequence[Bifurcation]) -> None:
    """How the parameter grows with the amplitude s."""
    rows = []
    for one in found:
        form = one.normal_form
        if form is None:
            continue
        term = f"{form.coefficient or 0:.4g} s^{form.power}"
        if form.discontinuity is not None:
            largest = largest_entry(form.discontinuity)
            term = f"{largest:.4g} s^{form.power}, distance^{form.exponent:g}"
        growth = f"{form.growth:.6g} s^{form.order}".removesuffix("^1")
        rows.append((one.label, growth, term, form.scenario))
    present.table(("", "change of parameter", "leading term", "scenario"), rows)


def largest_entry(entries: Sequence[float]) -> float:
    """The largest entry by size; of those that differ by rounding alone, as v_r and v_c, the first.

    Their signs differ: rounding does not decide which is shown.
    """
    size = (1 - _SAME_SIZE) * max(map(abs, entries))
    return next(one for one in entries if abs(one) >= size)
