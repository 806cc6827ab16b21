"""Tables and grids of a terminal."""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console


def make_console(stderr: bool = False, width: int = 110) -> Console:
    """Console on stdout or stderr, `width` columns wide if it is no terminal.

    Text is printed as it is, since names of files may have brackets. Styled text is a `Text`.
    """
    from rich.console import Console

    file = sys.stderr if stderr else sys.stdout
    columns = None if file.isatty() else width
    return Console(file=file, width=columns, highlight=False, markup=False, emoji=False)


def table(
    columns: Iterable[str],
    rows: Iterable[Iterable[Any]],
    right: Collection[str] = (),
    gap: int = 1,
    console: Console | None = None,
) -> None:
    """Print texts as a table with a line below its head; columns in `right` are right-aligned.

    A word or a number is never divided: a table of long ones is wider than its terminal.
    """
    from rich import box
    from rich.cells import cell_len
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD, show_edge=False, padding=(0, gap, 0, 0), pad_edge=False)
    names, cells = [*columns], [[*row] for row in rows]
    for name, *column in zip(names, *cells, strict=True):
        side: Any = "right" if name in right else "left"
        words = (word for cell in (name, *column) for word in str(cell).split())
        least = max(map(cell_len, words), default=0)
        made.add_column(name, justify=side, overflow="fold", min_width=least)
    for row in cells:
        made.add_row(*row)
    (console or make_console()).print(made, crop=False)


def grid(rows: Iterable[tuple[str, str]]) -> None:
    """Print pairs in two columns without a head, if there are any."""
    from rich.table import Column, Table

    made = Table.grid(Column(overflow="fold"), Column(overflow="fold"), padding=(0, 2))
    for row in rows:
        made.add_row(*row)
    if made.row_count:
        make_console().print(made)
