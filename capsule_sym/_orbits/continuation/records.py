"""Orbits, branches and curves as plain records and rows of tables, and points read from records."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from capsule_sym._errors import InvalidInput, check_one_of
from capsule_sym._files import read_json
from capsule_sym._map.backend import backend
from capsule_sym._map.expansion import Guard
from capsule_sym._map.result import plain
from capsule_sym._orbits.continuation import kinds
from capsule_sym._orbits.continuation.bifurcations import (
    Bifurcation,
    CodimensionTwoPoint,
    CurvePoint,
    sorted_multipliers,
)
from capsule_sym._orbits.continuation.branch import Branch, BranchPoint, ends
from capsule_sym._orbits.continuation.conditions import orbit_at
from capsule_sym._orbits.continuation.curve import Curve
from capsule_sym._orbits.continuation.kinds import NormalForm
from capsule_sym._orbits.continuation.parameter_paths import (
    Function,
    ParameterPath,
    chosen_path,
    parameter_path,
)
from capsule_sym._orbits.metrics.performance import performance, shown
from capsule_sym._orbits.shooting.admissibility import Inequality, tightest
from capsule_sym._orbits.shooting.equations import BY_ANGLE
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import CAPSULE, Scene, SceneDevice
from capsule_sym._parameters import scene as load_scene
from capsule_sym._records import add_si, in_si

#: Format of the result of `branch_record`; a changed format has another number.
FORMAT = 4

Record = Mapping[str, Any]
_WHAT = "JSON that `branch --out` or `curve --out` wrote"
_CLOSED = 1e-6  # residual below which a saved orbit is accepted


class Origin(NamedTuple):
    """Point of a branch from which branches start; `type` is empty at a regular point."""

    orbit: Orbit
    type: str = ""
    segment: int | None = None
    symmetry: str = ""
    itinerary_before: Itinerary | None = None

    @classmethod
    def of(cls, point: Any) -> Origin:
        """Origin at a bifurcation, or at another point of a branch."""
        return cls(**{name: getattr(point, name) for name in cls._fields if hasattr(point, name)})


def labelled_point(
    path: Path | str,
    label: str,
    parameter: str | None = None,
    ties: Mapping[str, Function | str] | None = None,
) -> tuple[ParameterPath, Origin]:
    """Path of a saved branch (`branch --out`), and its point with this label.

    `parameter` and `ties` replace those of the file, which cannot hold ties by Python functions. On
    a branch that was switched to at PD1, the label of point AS2 is "PD1/AS2". Raises InvalidInput
    for a file that is not a branch of this format or has no such label, and for other wrong values.
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
        return varying, _origin(varying.scene, {"scene": varying.scene.source, **named[label]})
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
        that is no parameter of the scene has the units of its ties, and `device` and `si` have SI
        units.

    Raises
    ------
    InvalidInput
        For a file that cannot be read, that `branch --out` did not write, or that is of another
        version of the format.

    See Also
    --------
    continue_from : branches from one point of the file.
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


def _origin(scene: Scene, record: Record) -> Origin:
    if "type" not in record:
        return Origin(_orbit(record))
    orbit = _orbit({"scene": scene.source, **record["orbit"]})
    segment = record["segment"]
    if segment is not None and not (type(segment) is int and 0 < segment <= len(orbit.itinerary)):
        raise ValueError(f"segment {segment} of {len(orbit.itinerary)}")
    # In the record segments are counted from the start of the cyclic itinerary.
    segment = None if segment is None else segment - 1
    before = None
    if record["type"] == kinds.HIGHER.type:  # elsewhere its period number may be another one
        before = _itinerary(record["itinerary_before"], orbit.itinerary.period_number, scene)
    return Origin(orbit, record["type"], segment, record["symmetry"] or "", before)


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
        The orbit with the given numbers, not corrected. Where a segment ends at an edge of the
        drive, whole turns of the phase are taken off.

    Raises
    ------
    InvalidInput
        For a record that lacks one of these or has another type of it, and for an itinerary or a
        scene that is not known.
    ValueError
        For values that are no numbers or of another shape, and if the equations of the orbit have
        a residual of 1e-6 or more.

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


# Attributes that are written under their own names.
_CONVERGENCE = ("residual", "iterations", "status", "success")
_ITINERARIES = ("itinerary_before", "itinerary_after")
_BIFURCATION = (
    *("label", "type", "line", "parameter", "value", "uncertainty"),
    *(*_CONVERGENCE, "interval", "failed", *_ITINERARIES, "multipliers", "multipliers_without"),
    *("multipliers_before", "multipliers_after", "symmetry", "normal_form"),
)


def _plain(value: Any) -> Any:
    """Value of a result for JSON; an empty text becomes null."""
    if isinstance(value, Itinerary):
        return list(value.cyclic.names)
    if isinstance(value, NormalForm):
        return value._asdict()
    return plain(value) if value != "" else None


def _fields(one: Any, names: Iterable[str]) -> dict[str, Any]:
    """Attributes of a result as plain values."""
    return {name: _plain(getattr(one, name)) for name in names}


def orbit_record(orbit: Orbit) -> dict[str, Any]:
    """Record of an orbit: itinerary, start, durations, multipliers, admissibility, metrics.

    Complex numbers are [real, imaginary]; a gradient is by the name of the parameter.
    """
    values, multipliers = performance(orbit), sorted_multipliers(orbit)
    metrics = {name: getattr(values, name) for name in shown(orbit.scene)}
    return {
        **_place(orbit),
        "multipliers": plain(multipliers),
        "stable": orbit.stable,
        "admissibility": _inequality(tightest(orbit), orbit.itinerary),
        **{
            name: {
                "value": float(metric.value),
                "gradient": {name: float(slope) for name, slope in metric.gradient.items()},
            }
            for name, metric in metrics.items()
        },
        "imbalance": float(values.imbalance),
    }


def branch_record(branch: Branch, switched: Iterable[Branch] = ()) -> dict[str, Any]:
    """Record of a branch: its points and bifurcations in order, and the reason for its end.

    `switched` are branches that leave it; `origin` of each is the label of its starting point.
    """
    return {
        "format": FORMAT,
        "origin": branch.origin or None,
        **branch.axis.path.scene.entry,
        "parameters": branch.points[0].orbit.parameters.to_dict() if branch.points else None,
        "parameter": branch.parameter,
        "ties": dict(branch.axis.path.texts),
        "points": [_branch_point(point) for point in branch.points],
        "bifurcations": [bifurcation_record(one) for one in branch.bifurcations],
        **_fields(branch, ("success", "status", "message")),
        "switched": [branch_record(one) for one in switched],
    }


def _branch_point(point: BranchPoint) -> dict[str, Any]:
    return {
        "value": point.value,
        **_place(point.orbit),
        "progression": float(point.orbit.progression),
        "average_velocity": float(point.orbit.average_velocity),
        "multipliers": plain(point.multipliers),
        "stable": point.orbit.stable,
        "admissibility": _inequality(point.admissibility, point.orbit.itinerary),
    }


def bifurcation_record(one: Bifurcation) -> dict[str, Any]:
    """Record of a bifurcation and its orbit.

    `segment` is the segment of duration 0, counted from 1 in the cyclic itinerary, or None.
    """
    itinerary, segment = one.orbit.itinerary, one.segment
    if segment is not None:
        segment = (segment - itinerary.first) % len(itinerary) + 1
    return {**_fields(one, _BIFURCATION), "segment": segment, "orbit": _place(one.orbit, ())}


def curve_record(curve: Curve) -> dict[str, Any]:
    """Record of a curve: its points, its codimension-two points, and the reasons for its ends."""
    return {
        **_fields(curve, ("type", "parameters")),
        "points": [_curve_point(curve, point) for point in curve.points],
        "codimension_two": [_codimension_two(curve, one) for one in curve.codimension_two],
        "endings": [{"status": end.value, "message": text} for end, text in curve.endings],
    }


def _values(curve: Curve, point: CurvePoint | CodimensionTwoPoint) -> dict[str, float]:
    return dict(zip(curve.parameters, point.values, strict=True))


def _curve_point(curve: Curve, point: CurvePoint) -> dict[str, Any]:
    return {
        **_values(curve, point),
        "itinerary": _plain(point.orbit.itinerary),
        **_fields(point, ("line", *_CONVERGENCE, "multipliers", "multipliers_without")),
        "admissibility": _inequality(point.admissibility, point.orbit.itinerary),
    }


def _codimension_two(curve: Curve, one: CodimensionTwoPoint) -> dict[str, Any]:
    names = ("types", "lines", "uncertainties", *_CONVERGENCE, "failed", *_ITINERARIES)
    return {**_values(curve, one), **_fields(one, names)}


def _row(record: Mapping[str, Any]) -> dict[str, Any]:
    """Entries of a record as cells of a table: numbers, texts, and lists of texts as one text."""
    row: dict[str, Any] = {}
    for name, value in record.items():
        if isinstance(value, list) and value and all(isinstance(one, str) for one in value):
            row[name] = " ".join(value)
        elif not isinstance(value, dict | list):
            row[name] = "" if value is None else value
    return row


def _table(result: Branch | Curve, **first: Any) -> list[dict[str, Any]]:
    """Columns of a result as rows of a table, after other cells."""
    columns = {name: values.tolist() for name, values in result.columns.items()}
    return [
        first | dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)
    ]


def point_rows(branch: Branch) -> list[dict[str, Any]]:
    """Points of a branch as rows of a table."""
    return _table(branch, origin=branch.origin)


def bifurcation_rows(bifurcations: Iterable[Bifurcation]) -> list[dict[str, Any]]:
    """Bifurcations as rows of a table."""
    records = map(bifurcation_record, bifurcations)
    none = dict.fromkeys(NormalForm._fields)
    return [_row(one) | _row(one["normal_form"] or none) for one in records]


def curve_rows(curves: Iterable[Curve]) -> list[dict[str, Any]]:
    """Points of curves as rows of a table."""
    tables = (_table(one, curve=number, type=one.type) for number, one in enumerate(curves, 1))
    return list(chain.from_iterable(tables))


def codimension_two_rows(curves: Iterable[Curve]) -> list[dict[str, Any]]:
    """Codimension-two points of curves as rows of a table."""
    rows = []
    for number, curve in enumerate(curves, 1):
        names = [f"uncertainty_{name}" for name in curve.parameters]
        for one in curve.codimension_two:
            record = _codimension_two(curve, one)
            both = zip(record.pop("types"), record.pop("lines"), strict=True)
            met = dict(
                zip(("first", "second"), (" ".join(pair).strip() for pair in both), strict=True)
            )
            row = {"curve": number, **met, **_row(record)}
            rows.append(row | dict(zip(names, one.uncertainties, strict=True)))
    return rows


def branches_record(found: Sequence[Branch], device: SceneDevice | None) -> dict[str, Any]:
    """Record of a branch and those that leave it, with SI units if there is a device."""
    first, *others = found
    record = branch_record(first, others) | ({"device": device.to_dict()} if device else {})
    for one in (record, *record["switched"]):
        add_si(device, one["points"])
    return record


def branch_files(found: Sequence[Branch], device: SceneDevice | None) -> dict[str, Any]:
    """Record and tables of branches, by the names of their files."""
    points = [row | in_si(device, row) for one in found for row in point_rows(one)]
    rows = [
        {"origin": one.origin, **row} for one in found for row in bifurcation_rows(one.bifurcations)
    ]
    columns = ("origin", "label", "type", "line", "parameter", "value", "uncertainty")
    return {
        "branch.json": branches_record(found, device),
        "points.csv": (points,),
        "bifurcations.csv": (rows, columns),
    }


def curves_record(
    found: Branch, curves: Sequence[Curve], device: SceneDevice | None
) -> dict[str, Any]:
    """Record of curves and the status of their branch, with SI units if there is a device."""
    kept = [curve_record(one) for one in curves]
    for written in kept:
        add_si(device, (*written["points"], *written["codimension_two"]))
    return {"branch": found.status.value, "curves": kept}


def curve_files(
    found: Branch, curves: Sequence[Curve], device: SceneDevice | None
) -> dict[str, Any]:
    """Record and tables of curves, by the names of their files."""
    points = [row | in_si(device, row) for row in curve_rows(curves)]
    meetings = [row | in_si(device, row) for row in codimension_two_rows(curves)]
    return {
        "curves.json": curves_record(found, curves, device),
        "points.csv": (points, ("curve", "type", "line")),
        "codimension_two.csv": (meetings, ("curve", "first", "second")),
    }


def failure_record(found: Orbit) -> dict[str, Any]:
    """Record of a failed search: its reason, the itinerary, and Newton's steps and residual."""
    names = ("success", "status", "message", "itinerary", "iterations")
    return {**_fields(found, names), "residual": plain(float(found.residual))}


def _place(orbit: Orbit, convergence: Iterable[str] = _CONVERGENCE) -> dict[str, Any]:
    """Parameters, itinerary, phase and state at the start of its first segment, and durations."""
    first, durations = orbit.itinerary.first, orbit.durations.tolist()
    flow, parameters = orbit.system.flows[first], orbit.parameters
    return {
        **orbit.scene.entry,
        "parameters": parameters.to_dict(),
        "itinerary": _plain(orbit.itinerary),
        "period_number": orbit.itinerary.period_number,
        "phase": float(flow.angle) / parameters.omega % parameters.period,
        "state": [float(value) for value in flow.start],
        "durations": [float(h) for h in (*durations[first:], *durations[:first])],
        **_fields(orbit, convergence),
    }


def _inequality(one: Inequality, itinerary: Itinerary) -> dict[str, Any]:
    return {"inequality": one.named(itinerary), "value": float(one.value)}
