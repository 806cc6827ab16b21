"""The texts of branches, of their bifurcations and of curves."""

from __future__ import annotations

from collections.abc import Sequence

import capsule_sym
from capsule_sym._errors import counted
from capsule_sym._parameters import SceneDevice
from capsule_sym._texts import tables

_SAME_SIZE = 1e-6  # relative difference below which entries of a term count as equal


def show_branches(found: Sequence[capsule_sym.results.Branch]) -> None:
    """Print branches with their bifurcations and normal forms."""
    from capsule_sym._map.steady import shown_progression

    console = tables.make_console()
    for one in found:
        if one.origin:
            console.print(f"\nfrom {one.origin}")
        console.print(f"{counted(len(one.points), 'point')}, {one.status.value}: {one.message}\n")
        columns = {
            one.parameter: "{0.value:.6g}",
            "progression": "{1:.6g}",
            "|multiplier|": "{2:.4f}",
            "tightest inequality": "{3:.3g} {4}",
            "itinerary": "{0.orbit.itinerary}",
        }
        rows = (
            (
                point,
                shown_progression(point.orbit.motion),
                abs(point.multipliers[0]),
                float(point.admissibility.value),
                point.admissibility.named(point.orbit.itinerary),
            )
            for point in one.points[:: max(1, len(one.points) // 20)]
        )
        tables.table(columns, rows)
        console.print("" if one.bifurcations else "\nno bifurcations")
        if one.bifurcations:
            _print_bifurcations(one.bifurcations)
            console.print()
            _print_normal_forms(one.bifurcations)


def _print_bifurcations(found: Sequence[capsule_sym.results.Bifurcation]) -> None:
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
    tables.table(("", "type", "line", " or ".join(parameters), "uncertainty", "itinerary"), rows)


def _print_normal_forms(found: Sequence[capsule_sym.results.Bifurcation]) -> None:
    """Print the change of the parameter with the amplitude s."""
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
    tables.table(("", "change of parameter", "leading term", "scenario"), rows)


def largest_entry(entries: Sequence[float]) -> float:
    """Entry of the largest size; of entries that differ by rounding alone the first.

    v_r and v_c may be such entries, with different signs: rounding must not decide between them.
    """
    size = (1 - _SAME_SIZE) * max(map(abs, entries))
    return next(one for one in entries if abs(one) >= size)


def show_curves(curves: Sequence[capsule_sym.results.Curve], device: SceneDevice | None) -> None:
    """Print the ends of curves and their codimension-two points."""
    from capsule_sym._records import in_si

    console = tables.make_console()
    for number, one in enumerate(curves, 1):
        if not one.points:
            console.print(f"{number}  {one.type}: no points\n")
            continue
        begin, end = one.points[0], one.points[-1]
        origin = f", from {one.origin}" if one.origin else ""
        met = f" {begin.line}" * (one.type == "edge")
        console.print(f"{number}  {one.type}{met}: {counted(len(one.points), 'point')}{origin}")
        for itinerary, point in (("from", begin), ("to", end)):
            named = [*zip(one.parameters, point.values, strict=True)]
            named = [*named, *in_si(device, dict(named)).items()]
            place = ", ".join(f"{name} = {value:.12g}" for name, value in named)
            console.print(f"   {itinerary} {place}")
        for ending, detail in one.endings:
            console.print(f"   {ending.value}: {detail}")
        for meeting in one.codimension_two:
            balls = zip(one.parameters, meeting.values, meeting.uncertainties, strict=True)
            place = ", ".join(f"{name} = {value:.15g} ± {by:.0e}" for name, value, by in balls)
            console.print(f"   meets {meeting.types[1]} {meeting.lines[1]} at {place}")
        console.print()
