"""The command `curve`."""

from __future__ import annotations

from typing import Annotated

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.branch import fail_if_early, followed
from capsule_sym._commands.signature import command, option
from capsule_sym._errors import InvalidInput
from capsule_sym._texts import bars


@command()
def curve(
    *,
    system: options.Ranged,
    kind: Annotated[str, option("--bifurcation", metavar="TYPE|LABEL")],
    at: float | None = None,
    points: int = 50,
    state: options.State = (0.0, 0.0, 0.0),
    out: options.Folder = None,
    max_seconds: options.TimeLimit = 600.0,
    certify: options.Certificate = None,
    as_json: options.Json = False,
) -> None:
    """Continue bifurcations in two parameters, with their codimension-two points.

    Two parameters have ranges, such as --alpha 1.5:1.65 --gamma 3:3.3, or, of a device in SI units,
    --P-d 0.8:1.1 --Omega 5:8; points and tables then have SI units too. The bifurcations are those
    on the branch in the first parameter. The second one has the value of --at, of the file or its
    default; if the default is outside its range, the middle of the range. Each bifurcation is
    continued both ways until a parameter leaves its range.

    In the JSON, each of "curves" has its "points", its "codimension_two" points, and the reasons
    for its two "endings". --out writes curves.json, points.csv and codimension_two.csv.

    With --certify alpha is solved for at every point; the other parameters are exact. Exits with 3,
    and the reason, if there is no orbit to begin with, if a curve has no points, or at the time
    limit; exits with 4 if --certify does not prove all.

    Parameters
    ----------
    kind
        Bifurcations of this type (or part of its name), such as grazing-sliding; or a label of
        `branch`, such as GR1; or all.
    at
        Value of the second parameter for the search of bifurcations.
    points
        Least number of steps over each range.
    certify
        Prove the points in ball arithmetic, and write their certificates here.
    """
    from capsule_sym._native import Watch
    from capsule_sym._orbits.continuation.continue_orbits import check
    from capsule_sym._orbits.continuation.problem import check_points
    from capsule_sym._orbits.continuation.records import curve_files, curves_record

    over = options.ranges()
    if len(over) != 2:
        raise click.UsageError("give two ranges, such as --alpha 1.5:2 --gamma 3:3.3")
    parameters, device = system.load()
    (name, first, _), (other, second, scale) = (_scaled(device, *one) for one in over.items())
    names = name, other
    if at is not None:
        parameters = parameters.replace(**{other: at * scale})
    check(parameters, names, (first, second))
    check_points(points)
    inside = _within(parameters, other, second, system.file is not None or at is not None)
    limit = Watch(max_seconds)
    found = followed(inside, name, *first, points, state, limit)
    if limit.stopped:
        raise KeyboardInterrupt
    chosen = _of_kind(kind, found, f"{other} = {getattr(inside, other):g}")
    if inside is not parameters:
        middle = f"{other} = {getattr(inside, other)!r}, the middle of its range"
        click.echo(f"bifurcations are sought at {middle}", err=True)
    both = first, second
    with bars.reporting("Following", limit):
        curves = [
            capsule_sym.continue_bifurcation(
                one, other, both, points=points, max_seconds=limit.left
            )
            for one in chosen
        ]
    files = curve_files(found, curves, device) if out else {}
    present.result(curves_record(found, curves, device), as_json, out, files)
    lost = [(one, curve) for one, curve in zip(chosen, curves, strict=True) if not curve.points]
    for one, curve in lost:
        ending, detail = curve.endings[0]
        event = f"{one.type} at {one.parameter} = {one.value:.12g}"
        click.echo(f"no curve of {event} ({ending.value}): {detail}", err=True)
    limited = capsule_sym.results.Status.TIME_LIMIT
    late = [one for one in curves if one.status is limited and one.points]
    for ended in late:
        click.echo(
            f"a curve of {ended.type} ends ({ended.status.value}): {ended.message}", err=True
        )
    present.certificates(certify, [point for one in curves for point in one.points], limit)
    if limit.stopped:
        raise KeyboardInterrupt
    if lost or late:
        raise click.exceptions.Exit(3)


def _of_kind(
    kind: str, found: capsule_sym.results.Branch, where: str
) -> list[capsule_sym.results.Bifurcation]:
    """Bifurcations of a branch with this label or type; raises InvalidInput for none.

    Exits with 3 instead if the branch ended early, without bifurcations or at the time limit.
    """
    chosen = [one for one in found.bifurcations if kind in ("all", one.label) or kind in one.type]
    if not found.bifurcations or (
        not chosen and found.status is capsule_sym.results.Status.TIME_LIMIT
    ):
        fail_if_early(found)
    if not chosen:
        types = sorted({one.type for one in found.bifurcations})
        low, high = (point.value for point in (found.points[0], found.points[-1]))
        over = f"{found.parameter} from {low:g} to {high:g} at {where}"
        beside = f"on the branch over {over}, which has {types or 'none'}"
        allowed = f"type or label of a bifurcation {beside}"
        raise InvalidInput("bifurcation", kind, allowed)
    return chosen


def _scaled(
    device: options.Device, name: str, ends: tuple[float, ...]
) -> tuple[str, tuple[float, float], float]:
    """Parameter with its range, scaled to the dimensionless one for a device, and the factor."""
    low, high, *_ = ends
    if device is None or name not in device.scene.facts.DRIVEN:
        return name, (low, high), 1.0
    tied, factor = device.tie(name)
    return tied, (low * factor, high * factor), factor


def _within(
    parameters: capsule_sym.inputs.SceneParameters,
    name: str,
    ends: tuple[float, float],
    given: bool,
) -> capsule_sym.inputs.SceneParameters:
    """Parameters with one of them in its range: the middle if the default is outside.

    Raises InvalidInput if the value outside is a given one.
    """
    (low, high), value = ends, getattr(parameters, name)
    if low <= value <= high:
        return parameters
    if given:
        raise InvalidInput(name, value, f"in its range {low:g}:{high:g}")
    return parameters.replace(**{name: (low + high) / 2})
