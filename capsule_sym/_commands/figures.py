"""The command `figure`."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import argument, command, group, option
from capsule_sym._commands.values import Range
from capsule_sym._errors import InvalidInput
from capsule_sym._figures.catalogue import FIGURES, Study
from capsule_sym._figures.sizes import NARROWEST, PAGE, WIDEST
from capsule_sym._files import read_json
from capsule_sym._parameters import CAPSULE, scene_in
from capsule_sym._texts import bars
from capsule_sym._units import METRIC_UNITS

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem
    from matplotlib.figure import Figure


class _Subject(click.ParamType):  # type: ignore[type-arg]
    """The name of a figure, or the path of a result."""

    name = "figure"

    def convert(self, value: str, param: Any, ctx: Any) -> str:
        """The name, or the path, which exists."""
        store = os.path.exists(os.path.join(value, "results.zarr"))
        if store and value in FIGURES:
            self.fail(f"{value!r} is a figure and a sweep: write ./{value} for the sweep", param)
        if value not in FIGURES and not os.path.exists(value):
            names = ", ".join(FIGURES)
            self.fail(f"{value!r} is no file, no directory and none of {names}.", param)
        return value

    def shell_complete(self, ctx: Any, param: Any, incomplete: str) -> list[CompletionItem]:
        """The names that begin so, else files."""
        from click.shell_completion import CompletionItem

        names = [CompletionItem(name) for name in FIGURES if name.startswith(incomplete)]
        return names or [CompletionItem(incomplete, type="file")]


_SUBJECTS = argument(type=_Subject(), nargs=-1, required=True, metavar="NAME|RESULT...")
_WIDTHS = option(type=click.FloatRange(NARROWEST, WIDEST), metavar="INCHES")


def _list() -> str:
    width = max(map(len, FIGURES))
    lines = (f"  {name:{width}}  {entry.title}" for name, entry in FIGURES.items())
    return "\n".join(["\b", "Names, of any scene:", *lines])


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
    data
        Write what is drawn beside it as well, as CSV.
    """

    out: Annotated[Path, options.written("FILE")]
    width: Annotated[float, _WIDTHS] = PAGE
    dpi: float | None = None
    data: bool = False

    def check(self) -> None:
        """Raises InvalidInput for what no picture can have, before it is computed."""
        options.require("matplotlib")
        from capsule_sym._figures.style import check_ending, check_resolution

        check_ending(self.out)
        check_resolution(self.dpi)


Colours = Annotated[
    Literal["safe", "paper"],
    option(help="Colours of the segments: safe for colour-blind readers, or those of Fig. 7."),
]
_QUANTITIES = click.Choice(["x_r", "v_r", "v_c", *METRIC_UNITS, "lift", "lyapunov"])
_FILE = click.Path(path_type=Path, dir_okay=False)


@command(epilog=_list())
def figure(
    *,
    subjects: Annotated[tuple[str, ...], _SUBJECTS],
    picture: Annotated[Picture, group(Picture)],
    system: options.Chosen,
    colours: Colours = "safe",
    quantity: Annotated[str | None, option("--of", type=_QUANTITIES, metavar="NAME")] = None,
    xlim: Annotated[tuple[float, ...] | None, option(type=Range())] = None,
    ylim: Annotated[tuple[float, ...] | None, option(type=Range())] = None,
    kind: Annotated[Literal["chart", "basin", "pareto"] | None, option("--as")] = None,
    curves: Annotated[
        tuple[Path, ...], option("--curve", type=_FILE, multiple=True, metavar="FILE")
    ] = (),
    as_json: options.Json = False,
) -> None:
    """Draw a figure by its name, or results.

    A NAME is one of those below. The parameters are in the picture's metadata.

    A RESULT is a file that `branch --out` wrote, or several, a file of `curve --out`, or the
    directory of `sweep` or `basin`, of which --of draws a metric. Of branches, with those that
    leave theirs, a colour is a branch; stable orbits are solid, unstable ones dashed; every
    bifurcation has its label, and the key its type and value. Of curves a colour is a type of
    bifurcation; a circle is a point of codimension two.

    Parameters
    ----------
    quantity
        Of branches: stroboscopic x_r, v_r or v_c [default: x_r]. Of branches and sweeps: a metric,
        such as velocity or work.
    xlim
        Range of the horizontal axis that is drawn.
    ylim
        Range of the vertical axis, of a figure of one panel.
    kind
        Of a sweep without --of: itineraries over two axes, attractors over two starts, or speed
        against cost of transport. [default: what the sweep is]
    curves
        Of a sweep: a file of `curve --json` or --out, whose curves bound a chart's regions, or lie
        on a metric; any number.
    """
    first = subjects[0]
    picture.check()
    by_name, is_sweep = first in FIGURES, os.path.isdir(first)
    if (by_name or is_sweep) and len(subjects) > 1:
        raise click.UsageError(f"{first} is drawn alone: leave {subjects[1]} out")
    with _chosen_view(xlim, ylim):
        about: dict[str, Any]
        if by_name:
            _check_own(system, "figures by name", first)
            drawn, about = _of_name(first, picture, system, colours), {"figure": first}
        elif is_sweep:
            _check_own(system, "sweeps", first)
            drawn, about = _of_sweep(system, Path(first), quantity, kind, curves, picture.width)
        else:
            paths = [*map(Path, subjects)]
            drawn, about = _of_files(system, paths, quantity or "x_r", picture.width)
    capsule_sym.figures.save_figure(drawn, picture.out, dpi=picture.dpi, data=picture.data)
    files = (picture.out, picture.out.with_suffix(".csv")) if picture.data else (picture.out,)
    present.report_written(*files, as_json=as_json, **about)


@contextmanager
def _chosen_view(*ranges: tuple[float, ...] | None) -> Iterator[None]:
    """Draw these ranges of x and y."""
    from capsule_sym._figures.layout import VIEW

    for name, ends in zip(("--xlim", "--ylim"), ranges, strict=True):
        if ends and not (ends[0] < ends[1] and all(map(math.isfinite, ends))):
            raise InvalidInput(name, ":".join(f"{end:g}" for end in ends), "two numbers, ascending")
    token: Any = VIEW.set(ranges)  # type: ignore[arg-type]
    try:
        yield
    finally:
        VIEW.reset(token)


_OWN = {"branches": ("quantity",), "sweeps": ("quantity", "kind", "curves")}


def _check_own(system: options.System, what: str, subject: str) -> None:
    """Raises UsageError for an option that is for other subjects."""
    own = {"figures by name": (*system.names, "colours"), **_OWN}
    for other in (one for one in own if one != what):
        for name in filter(options.is_given, {*own[other]} - {*own.get(what, ())}):
            raise click.UsageError(f"{options.flag(name)} is for {other}, which {subject} is not")


def _of_name(name: str, picture: Picture, system: options.System, colours: Any) -> Figure:
    """A figure by its name."""
    from capsule_sym._figures.style import describe

    parameters, device = system.load()
    with bars.tracking() as track:
        study = Study(track, parameters, colours, picture.width, system.chosen, device)
        return describe(FIGURES[name].make(study), FIGURES[name].title)


def _of_files(
    system: options.System, paths: Sequence[Path], quantity: str, wide: float
) -> tuple[Figure, dict[str, Any]]:
    """The figure of one or more files of branches, or of one of curves."""
    from capsule_sym._figures.curves import plot_curves
    from capsule_sym._orbits.continuation.branches.saved import read_curves

    curves = read_curves(paths[0]) if len(paths) == 1 else None
    _check_own(system, "curves" if curves else "branches", str(paths[0]))
    if curves:
        return plot_curves(curves, width=wide), {"of": "curves"}
    records = [capsule_sym.results.read_branch(path) for path in paths]
    for path, record in zip(paths, records, strict=True):
        system.check_scene(scene_in(record) or CAPSULE, str(path))
    scene, own = scene_in(records[0]) or CAPSULE, records[0].get("device")
    same = own and all(record.get("device") == own for record in records)
    device = scene.PhysicalParameters(**own) if own and same else None
    drawn = capsule_sym.figures.plot_diagram(records, quantity, width=wide, device=device)
    return drawn, {"of": quantity}


def _of_sweep(
    system: options.System,
    store: Path,
    metric: str | None,
    kind: str | None,
    curves: Sequence[Path],
    wide: float,
) -> tuple[Figure, dict[str, Any]]:
    """The figure of the results of a sweep or a basin."""
    options.require("xarray", "zarr", "shapely")
    lines = [one for path in curves for one in _curves(path)]
    from capsule_sym._sweeps.results import damaged

    with capsule_sym.results.open_results(store) as results:
        try:
            results.load()
        except (ArithmeticError, MemoryError, OSError, RuntimeError, TypeError, ValueError):
            raise damaged(store, "a chunk") from None
        system.check_scene(scene_in(results.attrs) or CAPSULE, str(store))
        if metric is not None:
            if kind is not None:
                raise click.UsageError(f"--as {kind} draws no metric: leave --of out")
            return capsule_sym.figures.plot_metric(results, metric, lines, width=wide), {
                "of": metric
            }
        if kind is None:
            kind = "basin" if "attractor" in results else "chart"
        about = {"figure": kind}
        if kind == "chart":
            return capsule_sym.figures.plot_chart(results, lines, width=wide), about
        if lines:
            raise click.UsageError(f"--curve is for a chart, and this is {kind}")
        draw = (
            capsule_sym.figures.plot_basin if kind == "basin" else capsule_sym.figures.plot_pareto
        )
        return draw(results, width=wide), about


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
