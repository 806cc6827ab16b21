"""Tables and grids of a terminal."""

from __future__ import annotations

import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from string import Formatter
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
    columns: Mapping[str, str] | Sequence[str],
    rows: Iterable[Any],
    right: Collection[str] = (),
    gap: int = 1,
    console: Console | None = None,
) -> None:
    """Print a table with a line below its head; the columns in `right` are right-aligned.

    Columns with templates such as "{0.value:.3g}" are formatted from the values of a row.
    """
    from rich import box
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD, show_edge=False, padding=(0, gap, 0, 0), pad_edge=False)
    for name in columns:
        side: Any = "right" if name in right else "left"
        made.add_column(name, justify=side, overflow="fold")
    for row in rows:
        if isinstance(columns, Mapping):
            row = [_CellTexts().vformat(text, row, {}) for text in columns.values()]
        made.add_row(*row)
    (console or make_console()).print(made)


class _CellTexts(Formatter):
    """Texts of the cells of a table: empty for None, yes and no."""

    def format_field(self, value: Any, spec: str) -> str:
        if value is None or isinstance(value, bool):
            return {None: "", True: "yes", False: "no"}[value]
        return format(value, spec)


def grid(rows: Iterable[Iterable[str]]) -> None:
    """Print rows in columns without a head, if there are any."""
    from rich.table import Column, Table

    if listed := [[*row] for row in rows]:
        made = Table.grid(*(Column(overflow="fold") for _ in listed[0]), padding=(0, 2))
        for row in listed:
            made.add_row(*row)
        make_console().print(made)
