"""Progress bars on stderr if it is a terminal, and Ctrl-C while they are there."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import click

from capsule_sym._errors import counted
from capsule_sym._texts.tables import make_console

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn

    from capsule_sym._figures.catalogue import Track
    from capsule_sym._native import Watch


_Item = TypeVar("_Item")


def make_progress(*columns: ProgressColumn) -> Progress:
    """Progress bars on stderr if it is a terminal; they are removed at the end."""
    from rich.constrain import Constrain
    from rich.progress import Progress

    from capsule_sym._processes import deferred

    console = make_console(stderr=True)

    class Bars(Progress):
        # A bar that Ctrl-C has cut is not found again and would stay on the screen.
        def start(self) -> None:
            try:
                with deferred():
                    super().start()
            except KeyboardInterrupt:  # nothing else ends an unfinished start
                self.stop()
                raise

        @deferred()
        def stop(self) -> None:
            super().stop()

        @deferred()
        def refresh(self) -> None:
            super().refresh()

        def get_renderables(self) -> Iterator[Constrain]:
            # Room for the ^C of the terminal, which would otherwise start a line and keep the bars.
            yield Constrain(self.make_tasks_table(self.tasks), console.width - 3)

    return Bars(
        *columns,
        console=console,
        disable=not console.is_terminal,
        transient=True,
        # Printed lines go above the bars if they go to the terminal.
        redirect_stdout=sys.stdout.isatty(),
    )


@contextmanager
def progress(
    text: str, total: float | None = None, *columns: ProgressColumn
) -> Iterator[Callable[..., None]]:
    """One bar of `make_progress`; yields the function that updates it."""
    with make_progress(*columns) as bars:
        yield partial(bars.update, bars.add_task(text, total=total))


@contextmanager
def reporting(text: str) -> Iterator[Callable[[str], object]]:
    """Show progress texts of long work on stderr, if it is a terminal."""
    with progress(text) as update:
        yield lambda said: update(description=f"{text}: {said}".removeprefix(": "))


@contextmanager
def tracking(lines: bool = False) -> Iterator[Track]:
    """Yields a `Track` with progress bars on stderr, one below another if nested.

    With `lines`, stderr has a line for each item of the outermost one if it is no terminal.
    """
    with make_progress() as progress:
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


def track(items: Iterable[_Item], text: str, total: float | None) -> Iterator[_Item]:
    """Items, with a progress bar on stderr if it is a terminal."""
    with tracking() as tracked:
        yield from tracked(items, text, total)


@contextmanager
def stoppable(limit: Watch, text: str) -> Iterator[Callable[[str], object]]:
    """Show progress texts of work; the first Ctrl-C ends it like a time limit, the next at once.

    Ctrl-C stops the limit. The work uses the time left of it as its own limit. Gives the function
    that shows a text.
    """
    import signal

    from capsule_sym._native.watch import TOLD, Watch

    def stop(*_: object) -> None:
        signal.signal(signal.SIGINT, before)
        Watch.interrupted = True
        limit.stop()

    before = signal.signal(signal.SIGINT, stop)
    with progress(text) as update:
        token = TOLD.set(lambda said: update(description=f"{text} {said}"))
        try:
            yield TOLD.get()
        finally:
            TOLD.reset(token)
            Watch.interrupted = False
            signal.signal(signal.SIGINT, before)


@contextmanager
def counting() -> Iterator[Callable[[int, int], None]]:
    """Show the number of done cells, and their rate; yields the function that updates them."""
    from rich.progress import BarColumn, ProgressColumn, Task, TimeRemainingColumn
    from rich.text import Text

    class Count(ProgressColumn):
        def render(self, task: Task) -> Text:
            # The number of cells is known once the store is open.
            if task.total is None:
                return Text("starting")
            done = f"{task.completed:,.0f} of {counted(int(task.total), 'cell')}"
            # Before a second chunk there is no rate.
            return Text(f"{done}, {task.speed:,.0f} a second" if task.speed else done)

    with make_progress(Count(), BarColumn(bar_width=20), TimeRemainingColumn()) as bar:
        task = bar.add_task("", total=None)
        total = -1

        def show(done: int, of: int) -> None:
            nonlocal total
            if of != total:
                # Cells that a store held before do not count towards the rate.
                total = of
                bar.reset(task, total=of, completed=done)
            bar.update(task, completed=done)

        yield show
