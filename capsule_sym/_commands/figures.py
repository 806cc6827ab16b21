"""The command `figure`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import argument, command, group, option
from capsule_sym._errors import InvalidInput
from capsule_sym._figures.sizes import NARROWEST, PAGE, WIDEST
from capsule_sym._files import read_json
from capsule_sym._parameters import CAPSULE, scene_in
from capsule_sym._units import METRIC_UNITS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PATH = click.Path(exists=True, path_type=Path)
_RESULTS = argument(type=_PATH, nargs=-1, required=True, metavar="RESULT...")
_CURVES = option("--curve", type=_PATH, multiple=True, metavar="FILE")
_WIDTHS = option(type=click.FloatRange(NARROWEST, WIDEST), metavar="INCHES")
_QUANTITIES = click.Choice(["x_r", "v_r", "v_c", *METRIC_UNITS, "lift", "lyapunov"])


class Picture(NamedTuple):
    """The file of a picture, and its look.

    Parameters
    ----------
    out
        File to write; its ending .png, .svg or .pdf decides the format.
    width
        Width of the picture; its type has the same size at any width.
    dpi
        Resolution of a PNG, and of dots in the others. [default: 300]
    """

    out: Annotated[Path, options.written("FILE")]
    width: Annotated[float, _WIDTHS] = PAGE
    dpi: float | None = None

    def check(self) -> None:
        """Raises InvalidInput for an ending or a resolution that no picture can have.

        Raises NotInstalled without Matplotlib.
        """
        options.require("matplotlib")
        from capsule_sym._figures.style import check_ending, check_resolution

        check_ending(self.out)
        check_resolution(self.dpi)


@command()
def figure(
    *,
    subjects: Annotated[tuple[Path, ...], _RESULTS],
    picture: Annotated[Picture, group(Picture)],
    scene: options.ForeignScene = None,
    quantity: Annotated[str | None, option("--of", type=_QUANTITIES, metavar="NAME")] = None,
    curves: Annotated[tuple[Path, ...], _CURVES] = (),
    as_json: options.Json = False,
) -> None:
    """Draw results that other commands wrote.

    A RESULT is a directory that `branch`, `curve`, `sweep` or `basin` wrote, or a branch.json or
    curves.json; several branches can be given. Of branches, with those that leave theirs, a colour
    is a branch; stable orbits are solid, unstable ones dashed; bifurcations have their labels, and
    the key their types and values. Of curves a colour is a type of bifurcation; a circle is a point
    of codimension two. Of a sweep over two parameters a colour is an itinerary, of a basin an
    attractor. With --out other commands draw their results, if they have a figure.

    Parameters
    ----------
    quantity
        Of branches: stroboscopic x_r, v_r or v_c [default: x_r]. Of branches and sweeps: a metric,
        such as velocity or work.
    curves
        Of a sweep: a file of `curve --json` or --out, whose curves are drawn on top; any number.
    """
    picture.check()
    subjects, curves = (
        tuple(Path(options.file_of(str(one))) for one in some) for some in (subjects, curves)
    )
    if folders := [one for one in subjects if os.path.isdir(one)]:
        if len(subjects) > 1:
            other = next(one for one in subjects if one != folders[0])
            raise click.UsageError(f"{folders[0]} is drawn alone: leave {other} out")
        drawn = _of_sweep(folders[0], quantity, curves, picture.width)
    else:
        if curves:
            raise click.UsageError(f"--curve is for sweeps, which {subjects[0]} is not")
        drawn = _of_files(subjects, quantity, picture.width)
    capsule_sym.figures.save_figure(drawn, picture.out, dpi=picture.dpi)
    present.report_written(picture.out, as_json=as_json)


def _of_files(paths: Sequence[Path], quantity: str | None, width: float) -> Figure:
    """The figure of one or more files of branches, or of one of curves."""
    from capsule_sym._figures.curves import plot_curves
    from capsule_sym._orbits.continuation.records import read_curves

    if len(paths) == 1 and (curves := read_curves(paths[0])):
        if quantity:
            raise click.UsageError(f"--of is for branches and sweeps, which {paths[0]} is not")
        return plot_curves(curves, width=width)
    records = [capsule_sym.results.read_branch(path) for path in paths]
    scene, own = scene_in(records[0]) or CAPSULE, records[0].get("device")
    same = own and all(record.get("device") == own for record in records)
    device = scene.PhysicalParameters(**own) if own and same else None
    return capsule_sym.figures.plot_diagram(records, quantity or "x_r", width=width, device=device)


def _of_sweep(store: Path, metric: str | None, curves: Sequence[Path], width: float) -> Figure:
    """The figure of the results of a sweep or a basin."""
    options.require("xarray", "zarr")
    from capsule_sym._sweeps.results import SWEEP, undamaged

    if not (store / SWEEP).is_file():
        allowed = "a directory that `branch`, `curve`, `sweep` or `basin` wrote"
        raise InvalidInput("RESULT", str(store), allowed)
    lines = [one for path in curves for one in _curves(path)]
    with capsule_sym.results.open_results(store) as results:
        with undamaged(store):
            results.load()
        results = results.squeeze()  # an axis of one value is none
        if curves and ("attractor" in results or results["outcome"].ndim < 2):
            raise click.UsageError(f"--curve is for sweeps over two parameters, not {store}")
        chart = results["outcome"].ndim > 1 and {"attractor", "itinerary"} & {*results}
        if metric is None and chart:
            more: dict[str, Any] = {} if "attractor" in results else {"curves": lines}
            return capsule_sym.plot(results, width=width, **more)
        try:
            return capsule_sym.figures.plot_metric(results, metric or "", lines, width=width)
        except InvalidInput as error:
            if metric is None and error.field == "metric":
                raise click.UsageError(f"give --of, {error.allowed}") from error
            error.field = error.field.replace("metric", "--of")
            raise


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
