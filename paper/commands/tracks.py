"""Progress of figures, of which each computes its motions and branches step by step."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import click

from capsule_sym._texts import bars
from paper.study.motions import Track


@contextmanager
def tracking(lines: bool = False) -> Iterator[Track]:
    """Yields a `Track` with progress on stderr, in one line if nested.

    With `lines`, stderr has a line for each item of the outermost one if it is no terminal.
    """
    with bars.reporting("Drawing") as report:
        under_way: list[str] = []

        def track(
            items: Iterable[Any], text: str | Callable[[Any], str], total: float | None
        ) -> Iterator[Any]:
            under_way.append("")
            depth = len(under_way)
            try:
                for done, item in enumerate(items):
                    said = text if isinstance(text, str) else text(item)
                    count = f" ({done + 1} of {total:.0f})" if total else ""
                    under_way[-1] = f"{said}{count}"
                    report(", ".join(under_way))
                    if lines and depth == 1 and not sys.stderr.isatty():
                        click.echo(under_way[-1], err=True)
                    yield item
            finally:
                under_way.pop()

        yield track
