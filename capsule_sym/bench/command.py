"""`capsule-sym bench`: the study as a table, JSON and a plot."""

from __future__ import annotations

import json
from pathlib import Path

import click

from capsule_sym.bench import study


@click.command()
@click.option("--repeats", default=3, show_default=True, help="Repeats of which the median counts.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write all rows here.")
@click.option(
    "--plot",
    type=click.Path(path_type=Path),
    help="Write error against time here, as PNG and SVG (suffix added).",
)
def bench(repeats: int, json_file: Path | None, plot: Path | None) -> None:
    """Measure speed against error, beside other tools."""
    rows = study.trajectories(repeats)
    sweep = study.growth(repeats)
    click.echo(f"{'tool':22} {'setting':20} {'us/period':>10} {'max error':>10} missed invented")
    for row in rows:
        click.echo(
            f"{row.tool:22} {row.setting:20} {row.us_per_period:10.3g} {row.max_error:10.1e} "
            f"{row.missed:6d} {row.invented:8d}"
        )
    for entry in sweep:
        click.echo(
            f"C sweep: {entry['alphas']} alphas x {entry['periods']} periods, "
            f"{entry['threads']} threads: {entry['us_per_period']:.3g} us/period of processor time"
        )
    if json_file:
        record = {
            "trajectory": [row._asdict() for row in rows],
            "sweep": sweep,
            "ratios": study.ratios(rows),
        }
        json_file.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    if plot:
        _draw(rows, plot)


def _draw(rows: list[study.Row], target: Path) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7, 5), layout="constrained")
    axes = figure.subplots()
    for tool in dict.fromkeys(row.tool for row in rows):
        points = [(r.us_per_period, max(r.max_error, 1e-17)) for r in rows if r.tool == tool]
        axes.loglog(*zip(*sorted(points), strict=True), marker="o", label=tool)
    axes.set_xlabel("processor time per excitation period (µs)")
    axes.set_ylabel(f"largest error of the state after {study.PERIODS} periods")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    for suffix in (".png", ".svg"):
        figure.savefig(target.with_suffix(suffix))
