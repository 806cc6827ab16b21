"""Orbits, branches and curves as plain records, and as rows of tables."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from capsule_sym._map.result import plain
from capsule_sym._orbits.continuation.branches.branch import Branch, BranchPoint
from capsule_sym._orbits.continuation.branches.saved import FORMAT
from capsule_sym._orbits.continuation.curves.curve import Curve
from capsule_sym._orbits.continuation.points.bifurcation import (
    Bifurcation,
    CodimensionTwoPoint,
    CurvePoint,
    sorted_multipliers,
)
from capsule_sym._orbits.continuation.points.normal_forms import NormalForm
from capsule_sym._orbits.metrics.performance import performance, shown
from capsule_sym._orbits.shooting.admissibility import Inequality, tightest
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit
from capsule_sym._parameters import SceneDevice
from capsule_sym._records import add_si, in_si

# Attributes that are written under their own names.
_CONVERGENCE = ("residual", "iterations", "status", "success")
_ITINERARIES = ("itinerary_before", "itinerary_after")
_BIFURCATION = (
    *("label", "type", "line", "surfaces", "parameter", "value", "uncertainty"),
    *(*_CONVERGENCE, "interval", "failed", *_ITINERARIES, "multipliers", "multipliers_without"),
    *("multipliers_before", "multipliers_after", "symmetry", "normal_form"),
)
_NORMAL_FORM = ("growth", "order", "coefficient", "exponent", "scenario")


def _plain(value: Any) -> Any:
    """Value of a result for JSON; an empty text becomes null."""
    if isinstance(value, Itinerary):
        return list(value.cyclic.names)
    if isinstance(value, NormalForm):
        return {**value._asdict(), "exponent": value.exponent}
    return plain(value) if value != "" else None


def _fields(one: Any, names: Iterable[str]) -> dict[str, Any]:
    """Attributes of a result as plain values."""
    return {name: _plain(getattr(one, name)) for name in names}


def orbit_record(orbit: Orbit) -> dict[str, Any]:
    """Record of an orbit: itinerary, section point, multipliers, admissibility, metrics.

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
    """Record of a bifurcation and its orbit; `segment` is the segment of duration 0."""
    itinerary, segment = one.orbit.itinerary, one.segment
    if segment is not None:  # counted from 1, from the start of the cyclic itinerary
        segment = (segment - itinerary.first) % len(itinerary) + 1
    return {**_fields(one, _BIFURCATION), "segment": segment, "orbit": _place(one.orbit, ())}


def curve_record(curve: Curve) -> dict[str, Any]:
    """Record of a curve: its points, its codimension-two points, and the reasons for its ends."""
    return {
        **_fields(curve, ("type", "origin", "parameters")),
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


def _cells(record: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """Entries of a record as cells of a table; null becomes empty."""
    cells = {}
    for name in names:
        value = record[name]
        cells[name] = "" if value is None else " ".join(value) if isinstance(value, list) else value
    return cells


def _sizes(multipliers: Iterable[complex]) -> dict[str, float]:
    return {f"multiplier_{number}": abs(one) for number, one in enumerate(multipliers, 1)}


def point_rows(branch: Branch) -> list[dict[str, Any]]:
    """Points of a branch as rows of a table."""
    rows = []
    for point in branch.points:
        record, itinerary = _branch_point(point), point.orbit.itinerary
        names = ("itinerary", "period_number", "progression", "average_velocity", "stable")
        row = {
            "origin": branch.origin,
            branch.parameter: point.value,
            **_cells(record, (*names, *_CONVERGENCE)),
            **_sizes(point.multipliers),
            "tightest": point.admissibility.named(itinerary),
            "by": float(point.admissibility.value),
            "phase": record["phase"],
        }
        rows.append(row | dict(zip(("x_r", "v_r", "v_c"), record["state"], strict=True)))
    return rows


def bifurcation_rows(bifurcations: Iterable[Bifurcation]) -> list[dict[str, Any]]:
    """Bifurcations as rows of a table."""
    names = ("label", "type", "line", "parameter", "value", "uncertainty", *_CONVERGENCE)
    rows = []
    for one in bifurcations:
        record = bifurcation_record(one)
        form = record["normal_form"] or dict.fromkeys(_NORMAL_FORM)
        cells = _cells(record, (*names, *_ITINERARIES, "symmetry", "failed"))
        rows.append(cells | _cells(form, _NORMAL_FORM))
    return rows


def curve_rows(curves: Iterable[Curve]) -> list[dict[str, Any]]:
    """Points of curves as rows of a table."""
    return [
        {
            "curve": number,
            **_cells(_fields(curve, ("origin", "type")), ("origin", "type")),
            "line": point.line,
            **_values(curve, point),
            "itinerary": str(point.orbit.itinerary),
            **_fields(point, _CONVERGENCE),
            **_sizes(point.multipliers),
        }
        for number, curve in enumerate(curves, 1)
        for point in curve.points
    ]


def codimension_two_rows(curves: Iterable[Curve]) -> list[dict[str, Any]]:
    """Codimension-two points of curves as rows of a table."""
    rows = []
    for number, curve in enumerate(curves, 1):
        for one in curve.codimension_two:
            first, second = (
                " ".join(filter(None, pair)) for pair in zip(one.types, one.lines, strict=True)
            )
            names = (f"uncertainty_{name}" for name in curve.parameters)
            rows.append(
                {
                    "curve": number,
                    "first": first,
                    "second": second,
                    **_values(curve, one),
                    **dict(zip(names, one.uncertainties, strict=True)),
                    **_cells(_codimension_two(curve, one), (*_CONVERGENCE, *_ITINERARIES)),
                }
            )
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
    """Record of curves, with SI units if there is a device."""
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
    """Record of a failed search: its reason, and the last state of Newton's method."""
    names = ("success", "status", "message", "itinerary", "iterations")
    residual = float(found.residual)
    return {**_fields(found, names), "residual": residual if math.isfinite(residual) else None}


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
