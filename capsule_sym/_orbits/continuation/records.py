"""Orbits, branches and curves as plain records, and as rows of tables."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import zip_longest
from typing import Any

from capsule_sym._orbits.continuation.bifurcations import Bifurcation, sorted_multipliers
from capsule_sym._orbits.continuation.continuation import Branch, BranchPoint
from capsule_sym._orbits.continuation.curves import CodimensionTwoPoint, Curve, CurvePoint
from capsule_sym._orbits.continuation.normal_forms import NormalForm
from capsule_sym._orbits.metrics.performance import METRICS, Metric, performance
from capsule_sym._orbits.shooting.admissibility import Inequality, tightest
from capsule_sym._orbits.shooting.itinerary import Itinerary
from capsule_sym._orbits.shooting.orbit import Orbit, OrbitStatus

#: Of what `branch_record` gives; another number is another version of it.
FORMAT = 3


def orbit_record(orbit: Orbit) -> dict[str, Any]:
    """An orbit: itinerary, section point, multipliers, admissibility, figures of merit.

    Complex numbers are [real, imaginary]; a gradient is by the name of the parameter.
    """
    values = performance(orbit)
    return {
        "parameters": _parameters(orbit),
        **_place(orbit),
        **_convergence(orbit),
        "multipliers": _complex(sorted_multipliers(orbit)),
        "stable": abs(sorted_multipliers(orbit)[0]) < 1,
        "admissibility": _inequality(tightest(orbit), orbit.itinerary),
        **{name: _metric(getattr(values, name)) for name in METRICS},
        "imbalance": float(values.imbalance),
    }


def branch_record(branch: Branch, switched: Iterable[Branch] = ()) -> dict[str, Any]:
    """A branch: its points and bifurcations in order, and why it ends.

    `switched` are branches that leave it; each has its `origin`, the label where it does.
    """
    others = [branch_record(one) for one in switched]
    return {
        "format": FORMAT,
        "origin": branch.origin or None,
        "parameters": _parameters(branch.points[0].orbit) if branch.points else None,
        "parameter": branch.parameter,
        "ties": dict(branch.axis.path.texts),
        "points": [_branch_point(point) for point in branch.points],
        "bifurcations": [bifurcation_record(one) for one in branch.bifurcations],
        "success": branch.success,
        "status": branch.status.value,
        "message": branch.message,
        "switched": others,
    }


def _branch_point(point: BranchPoint) -> dict[str, Any]:
    multipliers = point.multipliers
    return {
        "value": point.value,
        "parameters": _parameters(point.orbit),
        **_place(point.orbit),
        **_convergence(point.orbit),
        "progression": float(point.orbit.progression),
        "average_velocity": float(point.orbit.average_velocity),
        "multipliers": _complex(multipliers),
        "stable": abs(multipliers[0]) < 1,
        "admissibility": _inequality(point.admissibility, point.orbit.itinerary),
    }


def bifurcation_record(one: Bifurcation) -> dict[str, Any]:
    """A bifurcation, with the orbit that undergoes it; `segment` is its segment of duration 0."""
    return {
        "label": one.label,
        "type": one.type,
        "line": one.line or None,
        "surfaces": list(one.surfaces),
        "parameter": one.parameter,
        "value": one.value,
        "uncertainty": one.uncertainty,
        **_convergence(one),
        "interval": list(one.interval),
        "failed": one.failed or None,
        "itinerary_before": _names(one.itinerary_before),
        "itinerary_after": _names(one.itinerary_after) if one.itinerary_after else None,
        "multipliers": _complex(one.multipliers),
        "multipliers_without": _complex(one.multipliers_without),
        "multipliers_before": _complex(one.multipliers_before),
        "multipliers_after": _complex(one.multipliers_after),
        "symmetry": one.symmetry or None,
        "normal_form": _normal_form(one.normal_form),
        "segment": None if one.segment is None else _number(one.orbit.itinerary, one.segment),
        "orbit": {"parameters": _parameters(one.orbit), **_place(one.orbit)},
    }


def _normal_form(form: NormalForm | None) -> dict[str, Any] | None:
    """The leading terms, as `NormalForm` has them, and the exponent."""
    return form and {**form._asdict(), "exponent": form.exponent}


def curve_record(curve: Curve) -> dict[str, Any]:
    """A curve of bifurcations: its points, its points of codimension two, and why it ends."""
    return {
        "type": curve.type,
        "origin": curve.origin or None,
        "parameters": list(curve.parameters),
        "points": [_curve_point(curve, point) for point in curve.points],
        "codimension_two": [_meeting(curve, one) for one in curve.codimension_two],
        "endings": [{"status": end.value, "message": text} for end, text in curve.endings],
    }


def _curve_point(curve: Curve, point: CurvePoint) -> dict[str, Any]:
    return {
        **dict(zip(curve.parameters, point.values, strict=True)),
        "line": point.line or None,
        "itinerary": _names(point.orbit.itinerary),
        **_convergence(point),
        "multipliers": _complex(point.multipliers),
        "multipliers_without": _complex(point.multipliers_without),
        "admissibility": _inequality(point.admissibility, point.orbit.itinerary),
    }


def _meeting(curve: Curve, one: CodimensionTwoPoint) -> dict[str, Any]:
    return {
        "types": list(one.types),
        "lines": [line or None for line in one.lines],
        **dict(zip(curve.parameters, one.values, strict=True)),
        "uncertainties": list(one.uncertainties),
        **_convergence(one),
        "failed": one.failed or None,
        "itinerary_before": _names(one.itinerary_before),
        "itinerary_after": _names(one.itinerary_after) if one.itinerary_after else None,
    }


def point_rows(branch: Branch) -> list[dict[str, Any]]:
    """The points of a branch as rows of a table."""
    rows = []
    for point in branch.points:
        record = _branch_point(point)
        x_r, v_r, v_c = record["state"]
        row = {
            "origin": branch.origin,
            branch.parameter: point.value,
            "itinerary": " ".join(record["itinerary"]),
        }
        row |= {name: record[name] for name in ("period_number", "progression")}
        row |= {"average_velocity": record["average_velocity"], "stable": record["stable"]}
        row |= _convergence(point.orbit)
        row |= {f"multiplier_{i}": abs(m) for i, m in enumerate(point.multipliers, 1)}
        row |= {
            "tightest": point.admissibility.named(point.orbit.itinerary),
            "by": float(point.admissibility.value),
        }
        rows.append(row | {"phase": record["phase"], "x_r": x_r, "v_r": v_r, "v_c": v_c})
    return rows


def bifurcation_rows(bifurcations: Iterable[Bifurcation]) -> list[dict[str, Any]]:
    """Bifurcations as rows of a table."""
    return [
        {
            "label": one.label,
            "type": one.type,
            "line": one.line,
            "parameter": one.parameter,
            "value": one.value,
            "uncertainty": one.uncertainty,
            **_convergence(one),
            "itinerary_before": str(one.itinerary_before),
            "itinerary_after": str(one.itinerary_after) if one.itinerary_after else "",
            "symmetry": one.symmetry,
            "failed": one.failed,
            **_normal_form_columns(one.normal_form),
        }
        for one in bifurcations
    ]


def _normal_form_columns(form: NormalForm | None) -> dict[str, Any]:
    """The columns of a table; empty where there is none."""
    found = _normal_form(form) or {}
    names = ("growth", "order", "coefficient", "exponent", "scenario")
    return {name: "" if found.get(name) is None else found[name] for name in names}


def curve_rows(curves: Iterable[Curve]) -> list[dict[str, Any]]:
    """The points of curves as rows of a table."""
    return [
        {
            "curve": number,
            "origin": curve.origin,
            "type": curve.type,
            "line": point.line,
            **dict(zip(curve.parameters, point.values, strict=True)),
            "itinerary": str(point.orbit.itinerary),
            **_convergence(point),
            **{
                f"multiplier_{i}": abs(one) if one is not None else ""
                for i, one in zip_longest((1, 2, 3), point.multipliers)
            },
        }
        for number, curve in enumerate(curves, 1)
        for point in curve.points
    ]


def codimension_two_rows(curves: Iterable[Curve]) -> list[dict[str, Any]]:
    """The points of codimension two of curves as rows of a table."""
    return [
        {
            "curve": number,
            "first": " ".join(filter(None, (one.types[0], one.lines[0]))),
            "second": " ".join(filter(None, (one.types[1], one.lines[1]))),
            **dict(zip(curve.parameters, one.values, strict=True)),
            **{
                f"uncertainty_{name}": error
                for name, error in zip(curve.parameters, one.uncertainties, strict=True)
            },
            **_convergence(one),
            "itinerary_before": str(one.itinerary_before),
            "itinerary_after": str(one.itinerary_after) if one.itinerary_after else "",
        }
        for number, curve in enumerate(curves, 1)
        for one in curve.codimension_two
    ]


def failure_record(found: Orbit) -> dict[str, Any]:
    """What is known where there is no orbit: why, and where Newton's method ended."""
    residual = float(found.residual)
    return {
        "success": found.success,
        "status": found.status.value,
        "message": found.message,
        "itinerary": _names(found.itinerary) if found.itinerary else None,
        "residual": residual if math.isfinite(residual) else None,
        "iterations": found.iterations,
    }


def _convergence(found: Orbit | Bifurcation | CurvePoint | CodimensionTwoPoint) -> dict[str, Any]:
    """How well the equations are solved, as found there."""
    return {
        "residual": float(found.residual),
        "iterations": found.iterations,
        "status": found.status.value,
        "success": found.status is OrbitStatus.CONVERGED,
    }


def _names(itinerary: Itinerary) -> list[str]:
    """Names of the fields, begun where a steady motion's itinerary begins."""
    return list(itinerary.cyclic.names)


def _number(itinerary: Itinerary, segment: int) -> int:
    """Number of a segment, from 1, counted from where the itinerary is begun."""
    return (segment - itinerary.first) % len(itinerary) + 1


def _place(orbit: Orbit) -> dict[str, Any]:
    """Itinerary, phase and state at the start of its first segment, and durations of segments."""
    first, durations = orbit.itinerary.first, orbit.durations.tolist()
    flow, parameters = orbit.system.flows[first], orbit.parameters
    return {
        "itinerary": _names(orbit.itinerary),
        "period_number": orbit.itinerary.period_number,
        "phase": float(flow.angle) / parameters.omega % parameters.period,
        "state": [float(value) for value in flow.start],
        "durations": [float(h) for h in (*durations[first:], *durations[:first])],
    }


def _parameters(orbit: Orbit) -> dict[str, float]:
    return orbit.parameters.to_dict()


def _inequality(one: Inequality, itinerary: Itinerary) -> dict[str, Any]:
    return {"inequality": one.named(itinerary), "value": float(one.value)}


def _metric(metric: Metric) -> dict[str, Any]:
    gradient = {name: float(slope) for name, slope in metric.gradient.items()}
    return {"value": float(metric.value), "gradient": gradient}


def _complex(values: Iterable[complex]) -> list[list[float]]:
    return [[value.real, value.imag] for value in values]
