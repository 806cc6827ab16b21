"""The command `branch`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.orbit import settled
from capsule_sym._commands.signature import between, command, option
from capsule_sym._errors import InvalidInput
from capsule_sym._parameters import CAPSULE, scene_in
from capsule_sym._texts import bars

if TYPE_CHECKING:
    from pathlib import Path

    from capsule_sym._native import Watch


_Range = tuple[str, tuple[float, float]]
_TARGET = option(type=options.Named(click.FLOAT, optional="name"))
_FORMULA = options.Named(click.STRING, "alpha=0.5*omega**2")
_TIES = options.by_name(_FORMULA, "--with", metavar="NAME=FORMULA")


@command()
def branch(
    *,
    system: options.Ranged,
    along: Annotated[_Range | None, option(type=options.Named(example="s=0.1:2"))] = None,
    points: int = 100,
    restart: Annotated[tuple[str, str] | None, option(metavar="FILE LABEL")] = None,
    to: Annotated[tuple[str | None, float] | None, _TARGET] = None,
    cascade: Annotated[int, between(0, metavar="DEPTH")] = 0,
    ties: Annotated[dict[str, Any], _TIES],
    state: options.State = (0.0, 0.0, 0.0),
    out: options.Folder = None,
    max_seconds: options.TimeLimit = 600.0,
    certify: options.Certificate = None,
    as_json: options.Json = False,
) -> None:
    """Continue a periodic orbit in a parameter, with all its bifurcations.

    The varied parameter has a range, such as --alpha 0.1:2 or, downwards, --alpha 2:0.1. The branch
    begins with the orbit on which the motion settles at the start of the range, or at a labelled
    point of a branch that --out wrote. It passes folds, contains stable and unstable orbits, and
    changes its itinerary where an inequality fails. With --restart all branches are continued that
    leave the point towards --to, at a period doubling also that of the doubled orbits. --along may
    name a new quantity of which a parameter of --with is an affine function.

    In the JSON, "points" are the orbits in order, "bifurcations" those located exactly, each with
    "label", "type", "line", "parameter", "value", "uncertainty", "itinerary_before",
    "itinerary_after" and "normal_form"; "status" and "message" give the reason for the branch's
    end; "switched" are the other branches, each with its "origin". If --params is a device, "si" of
    a point has SI units, as have columns of points.csv. --out writes branch.json, points.csv and
    bifurcations.csv.

    Exits with 3, and the reason, if there is no orbit to begin with, if the first branch ends
    early, or any one at the time limit; exits with 4 if --certify does not prove all. After Ctrl-C,
    as at the time limit, the results so far are shown and written.

    Parameters
    ----------
    along
        Varied name of --with that has no option of its own, with its range.
    points
        Least number of steps.
    restart
        Start at a labelled point, such as PD1, of a branch.json or its directory.
    to
        With --restart: final value, with NAME= for another parameter.
    cascade
        Continue branches of doubled orbits too, to this depth.
    ties
        A parameter tied to the varied one, such as alpha=0.5*omega**2. Repeatable.
    certify
        Prove the border collisions of a branch in alpha by ball arithmetic, and write their
        certificates here. Other bifurcations count as not proved.
    """
    from capsule_sym._native import Watch
    from capsule_sym._orbits.continuation.problem import check_points
    from capsule_sym._orbits.continuation.records import branch_files, branches_record

    for name in (*system.names, *options.ranges(), "along", "state"):
        options.check_beside(name, never=("restart",))
    options.check_beside("to", needs=("restart",))
    device, limit = None, Watch(max_seconds)
    check_points(points)
    if restart is not None:
        if to is None:
            raise click.UsageError("--restart needs --to VALUE")
        end, file = to[1], options.file_of(restart[0])
        record = capsule_sym.results.read_branch(file)
        system.check_scene(scene_in(record) or CAPSULE, file)
        _check_untied(certify, ties or (to[0] is None and record.get("ties")))
        with bars.reporting("Following", limit):
            found = capsule_sym.continue_from(
                file,
                restart[1],
                end,
                parameter=to[0],
                points=points,
                ties=ties or None,
                max_seconds=limit.left,
            )
    else:
        parameter, begin, end = _range(along)
        parameters, device = system.load()
        if device is not None and not ties and parameter not in parameters.to_dict():
            ties = capsule_sym.inputs.device_path(device, parameter)
        _check_untied(certify, ties)
        found = (followed(parameters, parameter, begin, end, points, state, limit, ties),)
    for one in found:
        with bars.reporting("Following", limit):
            found += capsule_sym.orbits.period_doubling_cascade(
                one, cascade, points=points, max_seconds=limit.left
            )
    files = branch_files(found, device) if out else {}
    present.result(branches_record(found, device), as_json, out, files)
    events = [one for branch in found for one in branch.bifurcations]
    present.certificates(certify, events, limit)
    late = (one for one in found if one.status is capsule_sym.results.Status.TIME_LIMIT)
    ended = next(late, found[0])
    if limit.stopped:
        raise KeyboardInterrupt(_goes_on(ended, out, end))
    fail_if_early(ended)


def _range(along: _Range | None) -> tuple[str, float, float]:
    """Name and both ends of the range of the varied parameter, of its own option or of --along.

    Raises UsageError if both options are given, or none.
    """
    for name in (along[0], *options.ranges()) if along else ():
        options.check_beside(name, never=("along",))
    if not (given := options.only_range() or along):
        raise click.UsageError("give a range of a parameter, such as --alpha 0.1:2")
    name, (begin, end, *_) = given
    return name, begin, end


def _check_untied(certify: Path | None, ties: Any) -> None:
    """Raises InvalidInput for a certificate of a branch with tied parameters."""
    if certify is not None and ties:
        raise InvalidInput("certify", str(certify), "absent if several parameters vary")


def _goes_on(ended: capsule_sym.results.Branch, out: Path | None, end: float) -> str:
    """Sentence with the options that continue a branch after Ctrl-C, or advice without a file."""
    if out is None or len(ended.points) < 2:
        return "with --out the branch can be continued"
    label, file = f"{ended.origin}/EP2".lstrip("/"), out / "branch.json"
    return f"--restart {file} {label} --to {end:g} continues this branch"


def fail_if_early(found: capsule_sym.results.Branch) -> None:
    """Exit with 3, and the reason, if a branch ends before its final value."""
    if found.status is not capsule_sym.results.Status.REACHED:
        present.fail_early("the branch ends", found)


def followed(
    parameters: capsule_sym.inputs.SceneParameters,
    parameter: str,
    begin: float,
    end: float,
    points: int,
    state: Sequence[float],
    limit: Watch,
    ties: Mapping[str, str] | None = None,
) -> capsule_sym.results.Branch:
    """Branch of the motion that settles from a state; exits with 3 if none does."""
    path = capsule_sym.inputs.parameter_path(parameter, ties, parameters.scene)
    path.check(parameters, begin, end)
    placed = type(parameters)(*path.placed([*parameters.to_dict().values()], begin))
    start = settled(placed, state, limit)
    with bars.reporting("Following", limit):
        return capsule_sym.continue_orbit(
            start, parameter, end, points=points, ties=ties, max_seconds=limit.left
        )
