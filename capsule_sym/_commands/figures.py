"""The commands `figure` and `report`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from capsule_sym._commands import options, present
from capsule_sym._errors import InvalidInput
from capsule_sym._figures.catalogue import FIGURES, Study
from capsule_sym._figures.sizes import MOVING, NARROWEST, PAGE, WIDEST
from capsule_sym._files import read_json

_colours_option = click.option(
    "--colours",
    type=click.Choice(["safe", "paper"]),
    default="safe",
    show_default=True,
    help="Colours of the segments: for eyes of all kinds, or those of Fig. 7.",
)

_out_option = options.out_option(
    "File to write; its ending .png, .svg or .pdf decides the format.", "FILE", required=True
)


def _list() -> str:
    width = max(map(len, FIGURES))
    lines = [f"  {name:{width}}  {entry.title}" for name, entry in FIGURES.items()]
    return "\b\nNames:\n" + "\n".join(lines)


_width_option = click.option(
    "--width",
    type=float,
    metavar="INCHES",
    help=f"Width of the picture, from {NARROWEST}, its type always of 7 points.  "
    f"[default: {PAGE}, a page]",
)
_dpi_option = click.option(
    "--dpi", type=float, help="Resolution of a PNG, and of dots in the others.  [default: 300]"
)


def _check_picture(out: Path, width: float | None, dpi: float | None) -> float:
    """The width; raises InvalidInput for what no picture can have, before anything is computed."""
    from capsule_sym._figures.style import check_ending, check_resolution

    options.require("plot", "matplotlib")
    check_ending(out)
    check_resolution(dpi)
    if width is not None and not NARROWEST <= width <= WIDEST:
        raise InvalidInput("width", width, f"from {NARROWEST:g} to {WIDEST:g} inches")
    return PAGE if width is None else width


@click.command("figure", epilog=_list())
@click.argument("name", type=click.Choice(list(FIGURES)), metavar="NAME")
@_out_option
@options.parameter_options
@_width_option
@_dpi_option
@_colours_option
@options.json_option
def figure(
    name: str,
    out: Path,
    system: options.System,
    width: float | None,
    dpi: float | None,
    colours: Any,
    as_json: bool,
) -> None:
    """Draw a figure of the case study, or the same of another system.

    The paper's figures and those that it could not draw. `figure motion` with a file name that
    ends in .gif or .mp4 gives an animation. What is computed is kept in the user's cache
    directory, so that drawing it again takes a second; the parameters are in the picture's
    metadata.
    """
    from capsule_sym._figures.style import describe, save_figure
    from capsule_sym._study.data import Store

    moving = name == "motion" and out.suffix.lower() in MOVING
    wide = _check_picture(out.with_suffix(".png") if moving else out, width, dpi)
    parameters, device = system.load()
    with present.tracking() as track:
        study = Study(Store(track), parameters, colours, wide, system.chosen, device)
        if moving:
            from capsule_sym._figures.device import animate

            (motion,) = study.store.motions([parameters])
            animate(motion, out, colours=colours, width=wide, dpi=dpi or 100.0, device=device)
        else:
            save_figure(describe(FIGURES[name].drawn(study), FIGURES[name].title), out, dpi=dpi)
    present.tell_written(out, as_json=as_json, figure=name)


@click.command("diagram")
@click.argument(
    "paths",
    type=click.Path(path_type=Path, dir_okay=False),
    nargs=-1,
    required=True,
    metavar="FILE...",
)
@_out_option
@click.option(
    "--of",
    "quantity",
    type=click.Choice(["x_r", "v_r", "v_c", "velocity", "progression"]),
    default="x_r",
    show_default=True,
    help="Stroboscopic x_r, v_r or v_c, average velocity, or progression in a period.",
)
@_width_option
@_dpi_option
@options.json_option
def diagram(
    paths: tuple[Path, ...],
    out: Path,
    quantity: str,
    width: float | None,
    dpi: float | None,
    as_json: bool,
) -> None:
    """Draw files that `branch --out` or `curve --out` wrote.

    Of branches, with those that leave theirs, a colour is a branch; stable orbits are solid,
    unstable ones dashed; every bifurcation has its label. Of the curves of one curves.json a colour
    is a type of bifurcation; a circle is a point of codimension two.
    """
    from capsule_sym._figures.curves import plot_curves
    from capsule_sym._figures.diagrams import plot_diagram as draw
    from capsule_sym._figures.style import save_figure
    from capsule_sym._orbits.continuation.branches.saved import read_branch, read_curves

    wide = _check_picture(out, width, dpi)
    curves = read_curves(paths[0]) if len(paths) == 1 else None
    if curves and options.is_given("quantity"):
        raise click.UsageError(f"--of is for branches, and {paths[0]} has curves")
    records = [] if curves else [read_branch(path) for path in paths]
    try:
        drawn = plot_curves(curves, width=wide) if curves else draw(records, quantity, width=wide)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        whole = "a whole branch.json or curves.json, which this is not"
        raise InvalidInput("file", ", ".join(map(str, paths)), whole) from error
    save_figure(drawn, out, dpi=dpi)
    present.tell_written(out, as_json=as_json, of=quantity)


@click.command("sweep-figure")
@click.argument("store", type=click.Path(path_type=Path, exists=False), metavar="STORE")
@_out_option
@click.option(
    "--as",
    "kind",
    type=click.Choice(["chart", "basin", "pareto"]),
    help="Itineraries over two axes, attractors over two starts, or speed against cost of "
    "transport.  [default: what the sweep is]",
)
@click.option(
    "--curve",
    "curves",
    type=click.Path(path_type=Path, dir_okay=False),
    multiple=True,
    metavar="FILE",
    help="A file of `curve --json` or --out, whose curves bound a chart's regions; any number.",
)
@_width_option
@_dpi_option
@options.json_option
def sweep_figure(
    store: Path,
    out: Path,
    kind: str | None,
    curves: tuple[Path, ...],
    width: float | None,
    dpi: float | None,
    as_json: bool,
) -> None:
    """Draw the results of `sweep` or `basin`.

    A chart of itineraries, basins of attraction, or the Pareto front of a sweep with energies.
    """
    wide = _check_picture(out, width, dpi)
    options.require("sweep", "xarray", "zarr")
    from capsule_sym._figures import charts, sweeps
    from capsule_sym._figures.style import save_figure
    from capsule_sym._sweeps.results import open_results

    lines = [one for path in curves for one in _curves(path)]
    with open_results(store) as results:
        if kind is None:
            kind = "basin" if "attractor" in results else "chart"
        if lines and kind != "chart":
            raise click.UsageError(f"--curve is for a chart, and this is {kind}")
        if kind == "chart":
            drawn = charts.plot_chart(results, lines, width=wide)
        else:
            drawn = {"basin": sweeps.plot_basin, "pareto": sweeps.plot_pareto}[kind](
                results, width=wide
            )
        save_figure(drawn, out, dpi=dpi)
    present.tell_written(out, as_json=as_json, figure=kind)


def _curves(path: Path) -> list[Any]:
    """The curves of a file of `curve`, or one of them by itself; raises InvalidInput for others."""
    record = read_json(path, "a file of `curve --json`", "--curve")
    try:
        found = [*record["curves"]] if "curves" in record else [record]
        for one in found:  # what a chart reads of it
            _ = [dict(point) for point in one["points"]], one["codimension_two"], one["type"]
    except (ValueError, LookupError, TypeError) as error:
        raise InvalidInput("--curve", str(path), "a file of `curve --json`") from error
    return found


@click.command("report")
@options.out_option("HTML file to write.", "FILE", default="results/report.html", show_default=True)
@_colours_option
@options.json_option
def report(out: Path, colours: Any, as_json: bool) -> None:
    """Write the whole case study as one page of HTML that opens without a network.

    The explorer, to which it links, is written beside it as explorer.html.

    Figures are drawn for it; tables come from the files that `paper`, `verify`, `bench` and
    `make paper` leave in results, and a section whose file is missing says how to make it.
    """
    options.require("plot", "matplotlib", "jinja2")
    from capsule_sym._figures.report import EXPLORER, write
    from capsule_sym._processes import processors

    with present.tracking(lines=True) as track:
        write(out, colours, track, processors())
    files = (out, out.parent / EXPLORER) if as_json else (out,)
    present.tell_written(*files, as_json=as_json)
