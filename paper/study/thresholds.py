"""Bifurcations of the case study: exact values of alpha beside the printed ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from capsule_sym import Parameters, continue_bifurcation, continue_orbit, solve_orbit
from capsule_sym._map.interface import Number, backend
from capsule_sym._orbits.interface import (
    PARAMETERS,
    ExtendedSystem,
    bifurcation_record,
    curve_record,
    curve_rows,
    refined,
)
from capsule_sym._records import table, write
from capsule_sym.inputs import ParameterPath
from capsule_sym.results import Bifurcation, CodimensionTwoPoint, Curve, Status
from paper import printed as paper
from paper.study.casestudy import GAMMAS

FIRST, LAST = 0.005, 2.0
GAMMA_RANGE = (2.5, 4.0)


PRINTED = paper.events(paper.read())
"""Events of Section 4 in the printed order."""


@dataclass(frozen=True)
class Threshold:
    """An exact bifurcation on the branch at one gamma, and the printed event it corresponds to."""

    gamma: float
    bifurcation: Bifurcation
    value: Number
    """alpha with 50 digits."""
    printed: paper.Event | None
    curve: Curve
    """Curve of the bifurcation in the plane of alpha and gamma."""
    gammas_as_printed: tuple[float, ...]
    """All gammas of the curve at which the exact alpha is the printed one."""

    @property
    def place(self) -> int | None:
        """Place of the event in the printed order, from 1."""
        return PRINTED.index(self.printed) + 1 if self.printed else None


def compute(report: Callable[[], object] = lambda: None) -> list[Threshold]:
    """All bifurcations between alpha = 0.005 and 2 at each gamma, in the order of the branch.

    `report` is called after each of them. Raises ArithmeticError if a branch ends early.
    """
    thresholds: list[Threshold] = []
    # The curve of an event, begun at one gamma, serves for the same event at the other.
    curves: dict[tuple[str, str], Curve] = {}
    for gamma in GAMMAS:
        for one in _branch(gamma):
            name = one.type, one.line
            if name not in curves:
                curves[name] = continue_bifurcation(
                    one, "gamma", ((FIRST / 2, LAST), GAMMA_RANGE), points=20
                )
            printed, exact = _printed(one), refined(one).orbit.values[0]
            as_printed = tuple(_gammas_as_printed(curves[name], printed))
            thresholds.append(Threshold(gamma, one, exact, printed, curves[name], as_printed))
            report()
    return thresholds


def _branch(gamma: float) -> tuple[Bifurcation, ...]:
    start = solve_orbit(Parameters(alpha=FIRST, gamma=gamma))
    if not start.success:
        raise ArithmeticError(start.message)
    branch = continue_orbit(start, "alpha", LAST)
    if branch.status is not Status.REACHED:
        raise ArithmeticError(branch.message)
    return branch.bifurcations


def _printed(one: Bifurcation) -> paper.Event | None:
    """Printed event of this type, on this line or part of it."""
    for printed in PRINTED:
        if printed.type == one.type and one.line.startswith(printed.line):
            return printed
    return None


def _gammas_as_printed(curve: Curve, printed: paper.Event | None) -> Iterator[float]:
    """Values of gamma at which a curve has the printed alpha, by Newton's method."""
    for point, after in pairwise(curve.points):
        if printed is None or point.segment is None:
            return
        alpha = float(printed.alpha)
        if (point.values[0] - alpha) * (after.values[0] - alpha) > 0:
            continue
        orbit = point.orbit
        values = (alpha, *orbit.values[1:])
        with backend("numpy") as numbers:
            free, segments = (ParameterPath("gamma"),), (point.segment,)
            system = ExtendedSystem(numbers, values, free, orbit.itinerary, segments)
            found = system.solve(orbit.z)
        if found is not None:
            yield float(found.orbit.values[PARAMETERS.index("gamma")])


_LAST_THREE = {event.type for event in PRINTED[-3:]}


def order_changes(thresholds: list[Threshold]) -> list[CodimensionTwoPoint]:
    """Points in the plane at which two of the last three events change their order, by gamma."""
    found: dict[frozenset[str], CodimensionTwoPoint] = {}
    for threshold in thresholds:
        for one in threshold.curve.codimension_two:
            types = frozenset(one.types)
            if types <= _LAST_THREE and len(types) == 2:
                found.setdefault(types, one)
    return sorted(found.values(), key=lambda one: one.values[1])


def conclusion(thresholds: list[Threshold]) -> str:
    """Conclusion on the printed values, as sentences with numbers."""
    order = [event.type for event in PRINTED[-3:]]
    sentences = []
    for gamma in GAMMAS:
        types = [one.bifurcation.type for one in thresholds if one.gamma == gamma][-3:]
        same = "as printed" if types == order else f"where {', '.join(order)} is printed"
        sentences.append(f"At γ = {gamma} the last three events are {', '.join(types)}, {same}.")
    for point in order_changes(thresholds):
        (first, second), (alpha, gamma) = sorted(point.types, key=order.index), point.values
        sentences.append(
            f"{first.capitalize()} and {second} change their order at γ = {gamma:.10g} "
            f"(α = {alpha:.10g})."
        )
    for gamma in GAMMAS:
        chosen = [one for one in thresholds if one.gamma == gamma]
        off = max(
            abs(float(one.printed.alpha) / float(one.value) - 1) for one in chosen if one.printed
        )
        sentences.append(
            f"Relative to the exact values, the printed ones are up to {100 * off:.2f} % off "
            f"at γ = {gamma}."
        )
    low, high = GAMMA_RANGE
    listed = [
        f"for {_name(one)} at γ = {' and '.join(f'{gamma:.3f}' for gamma in one.gammas_as_printed)}"
        for one in chosen
        if one.gammas_as_printed
    ]
    fixed = " and ".join(_name(one) for one in chosen if _independent(one.curve))
    sentences.append(
        f"Between γ = {low} and {high} the exact value is the printed one {'; '.join(listed)}. "
        f"The values of {fixed} do not depend on γ."
    )
    return " ".join(sentences)


def _name(one: Threshold) -> str:
    return f"{one.bifurcation.type} on {one.bifurcation.line}"


def _independent(curve: Curve) -> bool:
    """True if alpha is constant along a curve, but for rounding."""
    values = [point.values[0] for point in curve.points]
    return max(values) - min(values) < 1e-12


def record(thresholds: list[Threshold]) -> dict[str, Any]:
    """All thresholds with their curves, ready for JSON."""
    return {
        "conclusion": conclusion(thresholds),
        "order_changes": [
            {"types": sorted(one.types), **dict(zip(("alpha", "gamma"), one.values, strict=True))}
            for one in order_changes(thresholds)
        ],
        "thresholds": [
            {
                "gamma": one.gamma,
                "exact": one.value,
                "printed": float(one.printed.alpha) if one.printed else None,
                "printed_place": one.place,
                "gammas_as_printed": list(one.gammas_as_printed),
                **bifurcation_record(one.bifurcation),
            }
            for one in thresholds
        ],
        "curves": [curve_record(curve) for curve in _curves(thresholds)],
    }


def _curves(thresholds: list[Threshold]) -> list[Curve]:
    return list({id(one.curve): one.curve for one in thresholds}.values())


def save(thresholds: list[Threshold], directory: Path) -> list[Path]:
    """Write thresholds.csv and curves.csv; returns their paths.

    Files are written whole or not at all. Raises InvalidInput if they cannot be written.
    """
    rows = [
        {
            "gamma": one.gamma,
            "type": one.bifurcation.type,
            "line": one.bifurcation.line,
            "exact": f"{float(one.value):.12f}",
            "uncertainty": one.bifurcation.uncertainty,
            "printed": float(one.printed.alpha) if one.printed else None,
            "printed_place": one.place,
            "gammas_as_printed": " ".join(map(repr, one.gammas_as_printed)),
        }
        for one in thresholds
    ]
    curves = curve_rows(_curves(thresholds))
    return write({"thresholds.csv": table(rows), "curves.csv": table(curves)}, directory)
