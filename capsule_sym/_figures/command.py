"""The commands `figure` and `report`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from capsule_sym._errors import InvalidInput
from capsule_sym._figures.catalogue import FIGURES, Study
from capsule_sym._options import tracking

_REPORT = Path("results/report.html")
_colours_option = click.option(
    "--colours",
    type=click.Choice(["safe", "paper"]),
    default="safe",
    show_default=True,
    help="Colours of the segments: for eyes of all kinds, or those of Fig. 7.",
)

_out_option = click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    metavar="FILE",
    help="File to write; its ending .png, .svg or .pdf decides the format.",
)


def _list() -> str:
    width = max(map(len, FIGURES))
    lines = [f"  {name:{width}}  {entry.title}" for name, entry in FIGURES.items()]
    return "\b\nNames:\n" + "\n".join(lines)


@click.command("figure", epilog=_list())
@click.argument("name", type=click.Choice(list(FIGURES)), metavar="NAME")
@_out_option
@click.option("--gamma", type=float, default=3.3, show_default=True, help="Mass ratio.")
@_colours_option
def figure(name: str, out: Path, gamma: float, colours: Any) -> None:
    """Draw a figure of the case study: the paper's, or one that it could not draw.

    What is computed for it is kept in the user's cache directory, so that drawing it again takes a
    second.
    """
    from capsule_sym._figures.style import check_ending, save
    from capsule_sym._parameters import Parameters
    from capsule_sym._study.data import Store

    check_ending(out)
    Parameters(gamma=gamma)
    with _needs_plotting(), tracking() as track:
        save(FIGURES[name].make(Study(Store(track), gamma, colours)), out)
    click.echo(f"wrote {out}", err=True)


@click.command("diagram")
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE")
@_out_option
@click.option(
    "--of",
    "quantity",
    type=click.Choice(["x_r", "v_r", "v_c", "velocity"]),
    default="x_r",
    show_default=True,
    help="Stroboscopic x_r, v_r or v_c, or the average velocity.",
)
def diagram(file: Path, out: Path, quantity: str) -> None:
    """Draw a branch.json that `branch --out` wrote, with the branches that leave it.

    A colour is a branch; stable orbits are solid, unstable ones dashed; every bifurcation has its
    label.
    """
    from capsule_sym._figures.diagram import diagram as draw
    from capsule_sym._figures.style import check_ending, save
    from capsule_sym._orbits.continuation.saved import read

    check_ending(out)
    record = read(file)
    with _needs_plotting():
        try:
            drawn = draw(record, quantity)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            whole = "a whole branch.json, which this is not"
            raise InvalidInput("file", str(file), whole) from error
        save(drawn, out)
    click.echo(f"wrote {out}", err=True)


@click.command("report")
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    default=_REPORT,
    show_default=True,
    metavar="FILE",
    help="HTML file to write.",
)
@_colours_option
def report(out: Path, colours: Any) -> None:
    """Write the whole case study as one page of HTML that opens without a network.

    The explorer, to which it links, is written beside it as explorer.html.

    Figures are drawn for it; tables come from the files that `paper`, `verify`, `hardcases` and
    `bench` leave in results, and a section whose file is missing says how to make it.
    """
    from capsule_sym._figures.report import write

    with _needs_plotting(), tracking(lines=True) as track:
        write(out, colours, track)
    click.echo(f"wrote {out}", err=True)


@contextmanager
def _needs_plotting() -> Iterator[None]:
    from capsule_sym._errors import NotInstalled

    try:
        yield
    except NotInstalled as missing:
        raise click.ClickException(str(missing)) from missing
