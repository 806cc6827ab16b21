"""The commands `figure` and `report`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.figures import Picture
from capsule_sym._commands.signature import argument, command, group
from capsule_sym.figures import save_figure
from paper.commands.tracks import tracking
from paper.figures.catalogue import FIGURES
from paper.study.motions import Study


def _list() -> str:
    width = max(map(len, FIGURES))
    lines = (f"  {name:{width}}  {entry.title}" for name, entry in FIGURES.items())
    return "\n".join(["\b", "Names:", *lines])


@command(epilog=_list())
def figure(
    *,
    name: Annotated[str, argument(type=click.Choice([*FIGURES]), metavar="NAME")],
    picture: Annotated[Picture, group(Picture)],
    system: options.Chosen,
    as_json: options.Json = False,
) -> None:
    """Draw a figure of the paper or of the report by its name, of the paper's system or another.

    The parameters are in the picture's metadata.
    """
    picture.check()
    from capsule_sym._figures.interface import describe

    parameters, device = system.load()
    with tracking() as track:
        study = Study(track, parameters, picture.width, system.chosen, device)
        drawn = describe(FIGURES[name].drawn(study), FIGURES[name].title)
    save_figure(drawn, picture.out, dpi=picture.dpi)
    present.report_written(picture.out, as_json=as_json, figure=name)


@command()
def report(
    *,
    out: Annotated[Path, options.written("FILE")] = Path("results/report.html"),
    as_json: options.Json = False,
) -> None:
    """Write the whole case study as one page of HTML that opens without a network.

    The explorer, to which it links, is written beside it as explorer.html.

    Figures are drawn for it; tables come from the files that `python -m paper` and the bench leave
    in results, and a section without its file names the command that makes it.

    Parameters
    ----------
    out
        HTML file to write.
    """
    options.require("matplotlib", "jinja2")
    from capsule_sym._processes import processors
    from paper.figures.report import EXPLORER, write

    with tracking(lines=True) as track:
        write(out, track, processors())
    files = (out, out.parent / EXPLORER) if as_json else (out,)
    present.report_written(*files, as_json=as_json)
