"""Labelled points of saved branches, from which a continuation can restart."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from capsule_sym._errors import InvalidInput, Status, check_one_of
from capsule_sym._files import read_json
from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.continuation.branches.branch import BranchPoint, ends
from capsule_sym._orbits.continuation.parameter_paths import (
    Function,
    ParameterPath,
    chosen_path,
    parameter_path,
)
from capsule_sym._orbits.continuation.points.bifurcation import Bifurcation
from capsule_sym._orbits.continuation.points.extended import orbit_at
from capsule_sym._orbits.shooting.admissibility import tightest
from capsule_sym._orbits.shooting.equations import BY_ANGLE
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import CAPSULE, Scene
from capsule_sym._parameters import scene as load_scene

#: Format of the result of `branch_record`; a changed format has another number.
FORMAT = 3

Record = Mapping[str, Any]
_WHAT = "JSON that `branch --out` or `curve --out` wrote"
_CLOSED = 1e-6  # residual below which a saved orbit is accepted


def labelled_point(
    path: Path | str,
    label: str,
    parameter: str | None = None,
    ties: Mapping[str, Function | str] | None = None,
) -> tuple[ParameterPath, Bifurcation | BranchPoint]:
    """Path of a saved branch (`branch --out`), and its point with this label.

    Parameters
    ----------
    path : str or path
        File branch.json that `branch --out` wrote.
    label : str
        Label of the point, such as "AS1"; "EP1" and "EP2" are the ends of the branch. On a branch
        that was switched to at PD1, the label of point AS2 is "PD1/AS2".
    parameter : str, default None
        Name of a parameter that replaces the varied one of the file.
    ties : mapping of str to callable or str, default None
        Ties that replace those of the file; see `parameter_path`. Without `parameter` they are
        functions of the varied parameter of the file. A file cannot hold ties by Python functions:
        they have to be given again.

    Returns
    -------
    path : ParameterPath
        Path of the varied parameter, dimensionless, or in the units of its ties.
    point : Bifurcation or BranchPoint
        The bifurcation, or an end of the branch; dimensionless.

    Raises
    ------
    InvalidInput
        For a file that cannot be read, is not a branch of this format, or has no such label. Also
        for an unknown parameter, and for ties that are not allowed.

    See Also
    --------
    continue_from : branches from the point, for a file or a branch.
    read_branch : whole record of the file.

    Examples
    --------
    >>> import subprocess, sys, tempfile
    >>> import capsule_sym as cs
    >>> command = [sys.executable, "-m", "capsule_sym", "branch", "--alpha", "0.9:1"]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = subprocess.run([*command, "--out", folder], check=True, capture_output=True)
    ...     path, point = cs.results.labelled_point(f"{folder}/branch.json", "AS1")
    >>> print(path.name, point.type, f"{point.value:.10f}")
    alpha adding-sliding 0.9409980034
    """
    record = read_branch(path)
    try:
        named = dict(_named(record, ""))
        for one in record["switched"]:
            named |= _named(one, f"{one['origin']}/")
        check_one_of("label", label, named)
        varying = chosen_path(
            record["parameter"], lambda: _path(record), parameter, ties, _scene(record)
        )
        return varying, _point(varying, {"scene": varying.scene.source, **named[label]})
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput("file", str(path), "an undamaged branch.json") from None


def _path(record: Record) -> ParameterPath:
    lost = [name for name, text in record["ties"].items() if text is None]
    if lost:
        raise InvalidInput("ties", lost, "given again, since a file holds no Python functions")
    return parameter_path(record["parameter"], record["ties"], _scene(record))


def _named(record: Record, origin: str) -> Iterator[tuple[str, Record]]:
    for one in record["bifurcations"]:
        yield origin + one["label"], one
    for label, one in ends(record["points"]).items():
        yield origin + label, one


def read_curves(path: Path | str) -> Record | None:
    """Record of a file that `curve --out` wrote; None if the file has another record.

    Raises InvalidInput for a file that cannot be read.
    """
    record = read_json(path, _WHAT)
    return record if isinstance(record, dict) and "curves" in record else None


def read_branch(path: Path | str) -> Record:
    """Record of a file that `branch --out` wrote.

    Parameters
    ----------
    path : str or path
        File branch.json.

    Returns
    -------
    dict
        Content of the file: `parameters`, the varied `parameter`, `ties`, `points`, `bifurcations`,
        `status`, `message`, and the branches `switched` to. Numbers are dimensionless, but a name
        that is no parameter of the scene has the units of its ties.

    Raises
    ------
    InvalidInput
        For a file that cannot be read, that `branch --out` did not write, or that is of another
        version of the format.

    See Also
    --------
    labelled_point : one point of the file.
    orbit_from_record : orbit of a point.

    Examples
    --------
    >>> import subprocess, sys, tempfile
    >>> import capsule_sym as cs
    >>> command = [sys.executable, "-m", "capsule_sym", "branch", "--alpha", "0.9:1"]
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = subprocess.run([*command, "--out", folder], check=True, capture_output=True)
    ...     record = cs.results.read_branch(f"{folder}/branch.json")
    >>> print(record["parameter"], record["status"])
    alpha reached
    >>> print([one["label"] for one in record["bifurcations"]])
    ['AS1']
    >>> print(cs.results.orbit_from_record(record["points"][0]).itinerary)
    F5 F4 F1 F2
    """
    record = read_json(path, _WHAT)
    if not isinstance(record, dict) or "bifurcations" not in record:
        raise InvalidInput("file", str(path), "a branch.json that `branch --out` wrote")
    if record.get("format") != FORMAT:
        had = record.get("format")
        raise InvalidInput("format", had, f"{FORMAT}: {path} is of another version")
    return record


def _point(path: ParameterPath, record: Record) -> Bifurcation | BranchPoint:
    if "type" not in record:
        orbit = _orbit(record)
        return BranchPoint(record["value"], orbit, tightest(orbit))
    scene = path.scene
    orbit = _orbit({"scene": scene.source, **record["orbit"]})
    segment, number = record["segment"], orbit.itinerary.period_number
    if segment is not None and not 0 < segment <= len(orbit.itinerary):
        raise ValueError(f"segment {segment} of {len(orbit.itinerary)}")
    read: dict[str, Callable[[Any], Any]] = {
        "str": lambda text: text or "",
        "tuple[str, ...]": tuple,
        "tuple[float, float]": tuple,
        "tuple[complex, ...]": lambda pairs: tuple(complex(*pair) for pair in pairs),
        "Itinerary": lambda names: _itinerary(names, number, scene),
        "Itinerary | None": lambda names: _itinerary(names, number, scene) if names else None,
        "Status": Status,
    }
    given = {
        field.name: read.get(str(field.type), lambda value: value)(record[field.name])
        for field in fields(Bifurcation)
        if field.name not in ("orbit", "path", "segment")
    }
    # In the record segments are counted from the start of the cyclic itinerary.
    segment = None if segment is None else segment - 1
    return Bifurcation(**given, orbit=orbit, path=path, segment=segment)


def orbit_from_record(record: Mapping[str, Any]) -> Orbit:
    """Orbit of a record with parameters, itinerary, phase, state and durations; dimensionless.

    The points of a file that `branch --out` wrote are such records.

    Parameters
    ----------
    record : mapping of str to object
        Values by name, all dimensionless:

        - `parameters`: mapping of all parameters of the scene to float;
        - `phase`: time in the excitation period at which the first segment starts;
        - `state`: (x_r, v_r, v_c) at this time, of shape (3,);
        - `durations`: durations of the n segments, of shape (n,);
        - `itinerary`: sequence of the n fields, such as ["F5", "F4", "F1", "F2"];
        - `period_number`: number of excitation periods of the orbit, int;
        - `scene`: name of the scene, str; without it the paper's.

        Other entries are ignored.

    Returns
    -------
    Orbit
        The orbit with the given numbers, not corrected.

    Raises
    ------
    InvalidInput
        For a record that lacks one of these or has another type of it, and for an itinerary or a
        scene that is not known.
    ValueError
        If the numbers do not solve the equations of the orbit, with a residual below 1e-6.

    See Also
    --------
    read_branch : record of a file.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> orbit = cs.solve_orbit(cs.Parameters(alpha=0.9))
    >>> p = orbit.parameters
    >>> record = {"parameters": p.to_dict(), "phase": orbit.z[3] / p.omega}
    >>> record |= {"state": orbit.z[:3], "durations": orbit.durations}
    >>> record |= {"itinerary": orbit.itinerary.names, "period_number": 1}
    >>> again = cs.results.orbit_from_record(record)
    >>> print(again.status, again.itinerary)
    converged F5 F4 F1 F2
    """
    needed = ("parameters", "phase", "state", "durations", "itinerary", "period_number")
    given = record if isinstance(record, Mapping) else {}
    lost = [name for name in needed if name not in given]
    if not lost and isinstance(record["parameters"], Mapping):
        known = _scene(record).facts.PARAMETERS
        lost = [f"parameters.{one}" for one in known if one not in record["parameters"]]
    if lost:
        raise InvalidInput("record", record, f"of an orbit, with {', '.join(lost)}")
    try:
        return _orbit(record)
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:
        raise InvalidInput("record", record, f"of an orbit, whole: {error}") from error


def _orbit(record: Record) -> Orbit:
    scene = _scene(record)
    values = tuple(float(record["parameters"][name]) for name in scene.facts.PARAMETERS)
    angle = record["phase"] * float(record["parameters"]["omega"])
    z = np.array([*record["state"], angle, *record["durations"]])
    itinerary = _itinerary(record["itinerary"], record["period_number"], scene)
    with backend("numpy", scene) as numbers, np.errstate(all="ignore"):
        orbit = orbit_at(numbers, values, itinerary, z)
        edges = [i for i, one in enumerate(itinerary.segments) if one.guard is Guard.EDGE]
        turns = round(orbit.system.residual[edges[0]] / numbers.full_turn) if edges else 0
        if turns:  # at the start, a phase of one period and 0 are the same edge
            z[BY_ANGLE] -= turns * numbers.full_turn
            orbit = orbit_at(numbers, values, itinerary, z)
    if not abs(orbit.residual) < _CLOSED:
        raise ValueError("no orbit")
    return orbit


def _scene(record: Record) -> Scene:
    """Scene named in a record; the paper's if none is named."""
    return load_scene(str(record.get("scene", CAPSULE.source)))


def _itinerary(names: list[str], period_number: int, scene: Scene) -> Itinerary:
    return Itinerary.parse(" ".join(names), period_number, scene)
