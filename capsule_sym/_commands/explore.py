"""`capsule-sym explore`: writes the explorer's page and opens it, or serves it locally."""

from __future__ import annotations

from pathlib import Path
from tempfile import gettempdir
from typing import Annotated

import click

from capsule_sym._commands import options, present
from capsule_sym._commands.signature import between, command, option
from capsule_sym._explorer import page
from capsule_sym._files import write_whole

_NAME = "capsule-sym-explorer.html"


@command()
def explore(
    *,
    out: Annotated[Path | None, options.written("FILE.html")] = None,
    port: Annotated[int | None, between(0, 65535, "--serve", metavar="PORT")] = None,
    opens: Annotated[bool, option("--open/--no-open")] = True,
    as_json: options.Json = False,
) -> None:
    """The exact map in a browser: motions, diagrams and charts on one page, without a network.

    By default the page is written to the directory of temporary files and opened.

    Parameters
    ----------
    out
        Write the page here, without opening it.
    port
        Serve it on this machine at a port (0: any free) until Ctrl-C, for browsers that allow no
        workers in a page from a file.
    opens
        Open the page in a browser.
    """
    options.check_beside("port", never=("out",))
    if port is not None:
        from capsule_sym._explorer.server import serve

        serve(port, page(), opens, as_json)
        return
    path = out or Path(gettempdir()) / _NAME
    write_whole(path, page(), "--out")
    if as_json:
        present.report_written(path, as_json=True)
    else:
        click.echo(path)
    if out is None and opens:
        import webbrowser

        webbrowser.open(path.resolve().as_uri())
