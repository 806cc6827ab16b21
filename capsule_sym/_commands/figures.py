"""The commands `figure` and `report`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import argument, command, option, several
from capsule_sym._errors import InvalidInput
from capsule_sym._figures.catalogue import FIGURES, Study
from capsule_sym._figures.sizes import MOVING, NARROWEST, PAGE, WIDEST
from capsule_sym._files import read_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def _list() -> str:
    width = max(map(len, FIGURES))
    lines = {True: "Names, of any scene:", False: "Of the paper's capsule alone:"}
    for name, entry in FIGURES.items():
        lines[entry.general] += f"\n  {name:{width}}  {entry.title}"
    return "\n\n".join(f"\b\n{part}" for part in lines.values())


class Picture:
    """The file of a picture, its width and its resolution, which may be None for a usual one."""

    def __init__(self, out: Path, width: float | None, dpi: float | None) -> None:
        self.out, self.width, self.dpi = out, width, dpi

    def check(self, moving: bool = False) -> float:
        """The width; raises InvalidInput for what no picture can have, before it is computed."""
        options.require("plot", "matplotlib")
        from capsule_sym._figures.style import check_ending, check_resolution

        check_ending(self.out.with_suffix(".png") if moving else self.out)
        check_resolution(self.dpi)
        if self.width is not None and not NARROWEST <= self.width <= WIDEST:
            raise InvalidInput("width", self.width, f"from {NARROWEST:g} to {WIDEST:g} inches")
        return PAGE if self.width is None else self.width

    def save(self, drawn: Figure, as_json: bool, **more: Any) -> None:
        """Write the picture and say so."""
        capsule_sym.save_figure(drawn, self.out, dpi=self.dpi)
        present.tell_written(self.out, as_json=as_json, **more)


_picture = several(
    Picture,
    out=options.out(
        "File to write; its ending .png, .svg or .pdf decides the format.", "FILE", required=True
    ),
    width=option(
        f"Width of the picture, from {NARROWEST}, its type always of 7 points.  "
        f"[default: {PAGE}, a page]",
        type=float,
        metavar="INCHES",
    ),
    dpi=option("Resolution of a PNG, and of dots in the others.  [default: 300]", type=float),
)
_colours = option(
    "Colours of the segments: for eyes of all kinds, or those of Fig. 7.",
    type=click.Choice(["safe", "paper"]),
    default="safe",
    show_default=True,
)


@command(epilog=_list())
def figure(
    name: str = argument(type=click.Choice(list(FIGURES)), metavar="NAME"),
    picture: Picture = _picture,
    system: options.System = options.parameters(),
    colours: Any = _colours,
    as_json: bool = options.as_json,
) -> None:
    """Draw a figure of the case study, or the same of another system.

    The paper's figures and those that it could not draw. `figure motion` with a file name that
    ends in .gif or .mp4 gives an animation. What is computed is kept in the user's cache
    directory, so that drawing it again takes a second; the parameters are in the picture's
    metadata.
    """
    moving = name == "motion" and picture.out.suffix.lower() in MOVING
    wide = picture.check(moving)
    from capsule_sym._figures.style import describe
    from capsule_sym._study.data import Store

    parameters, device = system.load()
    with present.tracking() as track:
        study = Study(Store(track), parameters, colours, wide, system.chosen, device)
        if not moving:
            drawn = describe(FIGURES[name].drawn(study), FIGURES[name].title)
            picture.save(drawn, as_json, figure=name)
            return
        (motion,) = study.store.motions([parameters])
        look: Any = {"colours": colours, "width": wide, "dpi": picture.dpi or 100.0}
        capsule_sym.animate(motion, picture.out, device=device, **look)
    present.tell_written(picture.out, as_json=as_json, figure=name)


@command()
def diagram(
    paths: tuple[Path, ...] = argument(
        type=click.Path(path_type=Path, dir_okay=False),
        nargs=-1,
        required=True,
        metavar="FILE...",
    ),
    picture: Picture = _picture,
    quantity: str = option(
        "Stroboscopic x_r, v_r or v_c, average velocity, or progression in a period.",
        "--of",
        type=click.Choice(["x_r", "v_r", "v_c", "velocity", "progression"]),
        default="x_r",
        show_default=True,
    ),
    as_json: bool = options.as_json,
) -> None:
    """Draw files that `branch --out` or `curve --out` wrote.

    Of branches, with those that leave theirs, a colour is a branch; stable orbits are solid,
    unstable ones dashed; every bifurcation has its label. Of the curves of one curves.json a colour
    is a type of bifurcation; a circle is a point of codimension two.
    """
    wide = picture.check()
    from capsule_sym._figures.curves import plot_curves
    from capsule_sym._orbits.continuation.branches.saved import read_curves

    curves = read_curves(paths[0]) if len(paths) == 1 else None
    if curves and options.is_given("quantity"):
        raise click.UsageError(f"--of is for branches, and {paths[0]} has curves")
    records = [] if curves else [capsule_sym.read_branch(path) for path in paths]
    try:
        if curves:
            drawn = plot_curves(curves, width=wide)
        else:
            drawn = capsule_sym.plot_diagram(records, quantity, width=wide)
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        whole = "a whole branch.json or curves.json, which this is not"
        raise InvalidInput("file", ", ".join(map(str, paths)), whole) from error
    picture.save(drawn, as_json, of=quantity)


@command()
def sweep_figure(
    store: Path = argument(type=click.Path(path_type=Path, exists=False), metavar="STORE"),
    picture: Picture = _picture,
    kind: str | None = option(
        "Itineraries over two axes, attractors over two starts, or speed against cost of "
        "transport.  [default: what the sweep is]",
        "--as",
        type=click.Choice(["chart", "basin", "pareto"]),
    ),
    curves: tuple[Path, ...] = option(
        "A file of `curve --json` or --out, whose curves bound a chart's regions; any number.",
        "--curve",
        type=click.Path(path_type=Path, dir_okay=False),
        multiple=True,
        metavar="FILE",
    ),
    as_json: bool = options.as_json,
) -> None:
    """Draw the results of `sweep` or `basin`.

    A chart of itineraries, basins of attraction, or the Pareto front of a sweep with energies.
    """
    wide = picture.check()
    options.require("sweep", "xarray", "zarr")
    lines = [one for path in curves for one in _curves(path)]
    with capsule_sym.open_results(store) as results:
        if kind is None:
            kind = "basin" if "attractor" in results else "chart"
        if lines and kind != "chart":
            raise click.UsageError(f"--curve is for a chart, and this is {kind}")
        if kind == "chart":
            drawn = capsule_sym.plot_chart(results, lines, width=wide)
        else:
            draw = capsule_sym.plot_basin if kind == "basin" else capsule_sym.plot_pareto
            drawn = draw(results, width=wide)
        picture.save(drawn, as_json, figure=kind)


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


@command(further=options.paper_alone)
def report(
    out: Path = options.out(
        "HTML file to write.", "FILE", default="results/report.html", show_default=True
    ),
    colours: Any = _colours,
    as_json: bool = options.as_json,
) -> None:
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
