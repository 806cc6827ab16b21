"""Progress of figures, of which each computes its motions and branches step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import click

from capsule_sym._texts import bars
from paper.study.motions import Track


@contextmanager
def tracking(lines: bool = False) -> Iterator[Track]:
    """Yields a `Track` with progress bars on stderr, one below another if nested.

    With `lines`, stderr has a line for each item of the outermost one if it is no terminal.
    """
    with bars.make_progress() as progress:
        depth = 0

        def track(
            items: Iterable[Any], text: str | Callable[[Any], str], total: float | None
        ) -> Iterator[Any]:
            nonlocal depth
            first = text if isinstance(text, str) else ""
            task = progress.add_task(first, total=total)
            depth += 1
            try:
                for done, item in enumerate(items):
                    said = text if isinstance(text, str) else text(item)
                    progress.update(task, description=said, completed=done)
                    if lines and depth == 1 and progress.disable:
                        count = f" ({done + 1} of {total:.0f})" if total else ""
                        click.echo(f"{said}{count}", err=True)
                    yield item
            finally:
                depth -= 1
                progress.remove_task(task)

        yield track
