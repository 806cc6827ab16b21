"""The texts of optima, fronts, fits and tolerances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import click

import capsule_sym
from capsule_sym._errors import counted
from capsule_sym._texts import tables


def show_optimum(found: capsule_sym.results.Optimum) -> None:
    """Print an optimum, if there is one."""
    if not found.over:
        return
    units = tables.units_of(found.system)
    kind = "greatest" if found.maximised else "least"
    rows = [(f"{kind} {found.metric}", tables.with_unit(found.value, units.get(found.metric, "")))]
    for name, value in found.over.items():
        held = f"  (at bound: {found.bounds[name]:.4g} per unit)" if name in found.bounds else ""
        rows.append((name, f"{value:.9g} {units.get(name, '')}".rstrip() + held))
    if found.itinerary:  # else a cell of the survey, found before the time limit
        rows.append(("itinerary", " ".join(found.itinerary)))
        for name, value in found.metrics.items():
            rows.append((name.replace("_", " "), tables.with_unit(value, units.get(name, ""))))
        for one in found.constraints:
            held = f"active, {one.multiplier:.4g} per unit"
            state = held if one.active else f"{one.slack:.4g} left"
            rows.append(("constraint", f"{one.text}: {state}"))
        if found.border is not None:
            rows.append(("on a border", " | ".join(found.border)))
        near = found.tightest
        rows += [
            ("largest multiplier", f"{found.multiplier:.6g}"),
            ("next change", f"{near.inequality}: {near.distance:.3g} of the bounds away"),
            *((f"by {name}", f"{slope + 0.0:.6g}") for name, slope in found.slopes.items()),
            ("residual", f"{found.residual:.1e}"),
        ]
    tables.grid(rows)


def show_front(found: capsule_sym.results.Front) -> None:
    """Print a front as a table."""
    if not found.points:
        return
    units = tables.units_of(found.points[0].system)
    heads = [
        f"{name} ({unit})" if (unit := units.get(name, "")) else name
        for name in (*found.metrics, *found.points[0].over)
    ]
    rows = (
        (
            *(f"{number:.6g}" for number in (value, cost, *point.over.values())),
            " ".join(point.itinerary),
        )
        for value, cost, point in zip(found.values, found.costs, found.points, strict=True)
    )
    tables.table((*heads, "itinerary"), rows, right=heads, gap=2)


_CORRELATED = 0.2  # correlation of residuals above which errors are reported as too small


def show_fit(
    found: capsule_sym.results.Fit, ranges: Mapping[str, tuple[float, float]], read: Sequence[str]
) -> None:
    """Print what was read, the values of the unknowns, and how far to trust them."""
    for line in read:
        click.echo(line)
    units = tables.units_of(found.system)
    rows = (
        (
            name,
            f"{value:.9g} {units.get(name.rpartition('.')[2], '')}".rstrip(),
            f"{found.standard_errors[name]:.2g}",
            *([f"{ranges[name][0]:.6g} to {ranges[name][1]:.6g}"] if ranges else []),
        )
        for name, value in found.values.items()
    )
    heads = ["unknown", "value", "error", *["95 %"] * bool(ranges)]
    tables.table(heads, rows, gap=2)
    console = tables.make_console()
    console.print(f"{found.status.value}: {found.message}")
    noise = ", ".join(f"{by:.3g} of {name}" for name, by in found.noise_by_column.items())
    runs = counted(found.evaluations, "run")
    console.print(f"noise over spread: {noise}; {runs}", soft_wrap=True)
    if found.autocorrelation > _CORRELATED:
        console.print(
            f"successive residuals are correlated by {found.autocorrelation:.2f}: errors are too "
            "small: fit every k-th value"
        )
    for one in found.open_combinations:
        named = {name: by for name, by in one.items() if abs(by) >= 0.005}
        mixed = "  ".join(f"{name} {by:+.2f}" for name, by in named.items())
        console.print(f"not identifiable, in relative changes: {mixed}")
    if found.border:
        console.print(
            f"within the error of {found.border} the itinerary changes: errors are not to be "
            "trusted there"
        )


def show_tolerances(found: capsule_sym.results.Tolerances) -> None:
    """Print the spread of each metric, its indices, and the probabilities of other motions."""
    if not found.metrics:
        return
    units = tables.units_of(found.system)
    heads = ("metric", "nominal", "mean", "deviation", "2.5 %", "97.5 %")
    rows = []
    for one in found.metrics:
        ends = one.quantiles[:1] + one.quantiles[-1:]
        texts = (
            tables.with_unit(value, units.get(one.metric, ""))
            for value in (one.nominal, one.mean, one.deviation, *ends)
        )
        rows.append((one.metric.replace("_", " "), *texts))
    tables.table(heads, rows, right=heads[1:], gap=2)
    click.echo()
    heads = ("metric", "parameter", "first order", "95 %", "total", "95 %")
    columns = zip(*found.columns.values(), strict=True)
    rows = [
        (
            metric.replace("_", " "),
            name,
            *(f"{first:.3f}", f"{low:.3f} to {high:.3f}"),
            *(f"{total:.3f}", f"{least:.3f} to {most:.3f}"),
        )
        for metric, name, first, low, high, total, least, most in columns
    ]
    tables.table(heads, rows, right=heads[2:], gap=2)
    click.echo()
    risks = {
        "periodic motion": found.periodic,
        "another itinerary": found.changed,
        "another attractor": found.elsewhere,
        "the motion is lost": found.lost,
    }
    tables.grid(
        (name, f"{one.value:.4g} ({one.low:.4g} to {one.high:.4g})") for name, one in risks.items()
    )
