"""Progress bars on stderr if it is a terminal, and Ctrl-C while they are there."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, TypeVar

from capsule_sym._texts.tables import make_console

if TYPE_CHECKING:
    from rich.progress import Progress, ProgressColumn

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


def track(items: Iterable[_Item], text: str, total: float | None) -> Iterator[_Item]:
    """Items, with a progress bar."""
    with make_progress() as bars:
        yield from bars.track(items, total=total, description=text)


@contextmanager
def reporting(text: str, limit: Watch | None = None) -> Iterator[Callable[..., None]]:
    """One bar; yields the function that updates it: report(said), or report(done, total).

    With a limit the first Ctrl-C ends the work like a time limit, the next at once. The work uses
    the time left of it as its own limit.
    """
    import signal

    from capsule_sym._native.watch import TOLD, Watch

    # The library of bars is imported only for a terminal.
    with make_progress() if sys.stderr.isatty() else nullcontext() as bars:
        task = bars.add_task(text, total=None) if bars else None

        def report(said: str | float, total: float | None = None) -> None:
            if bars is None or task is None:
                return
            if isinstance(said, str):
                bars.update(task, description=f"{text}: {said}")
            else:
                bars.update(
                    task, completed=said, total=total, description=f"{text}: {said:,} of {total:,}"
                )

        def stop(*_: object) -> None:
            signal.signal(signal.SIGINT, before)
            Watch.interrupted = True
            limit.stop()  # type: ignore[union-attr]

        token, before = TOLD.set(report), signal.getsignal(signal.SIGINT)
        if limit is not None:
            signal.signal(signal.SIGINT, stop)
        try:
            yield report
        finally:
            TOLD.reset(token)
            if limit is not None:
                Watch.interrupted = False
                signal.signal(signal.SIGINT, before)
