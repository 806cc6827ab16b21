"""How commands present what they find: JSON, tables, files, pictures, and progress meanwhile."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from string import Formatter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import click

import capsule_sym
from capsule_sym._errors import NotInstalled

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure
    from rich.console import Console
    from rich.progress import Progress, ProgressColumn

    from capsule_sym._enclosures.certificates.certify import Certified
    from capsule_sym._native import Watch
    from capsule_sym._study.data import Track


_Item = TypeVar("_Item")


def result(
    record: Callable[[], Mapping[str, Any]],
    show: Callable[[], object],
    as_json: bool,
    out: Path | None = None,
    files: Callable[[], Mapping[str, Any]] = dict,
    pictures: Mapping[str, Callable[[], Figure]] = MappingProxyType({}),
) -> None:
    """Write files and pictures by name to a folder, if there is one, and print the result.

    That is its record as JSON, or what `show` prints. A file is a record, or a pair of rows and the
    columns of a table without any. stderr says what was written, and why a picture is missing.
    """
    from capsule_sym._records import dumps, table, write

    if out is not None:
        texts = {
            name: table(*held) if isinstance(held, tuple) else dumps(held) + "\n"
            for name, held in files().items()
        }
        paths = write(texts, out)
        try:
            for name, draw in pictures.items():
                capsule_sym.save_figure(draw(), out / name)
                paths.append(out / name)
        except NotInstalled as missing:
            click.echo(f"no picture: {missing}", err=True)
        click.echo(f"wrote {', '.join(map(str, paths))}", err=True)
    if as_json:
        click.echo(dumps(dict(record())))
    else:
        show()


def certificates(path: Path | None, found: Sequence[Certified], limit: Watch) -> None:
    """Write the certificates of what was found, if wanted; exits with 4 if something is not proved.

    A file is left as it was where nothing is proved.
    """
    if path is None:
        return
    from capsule_sym._enclosures.certificates.certify import certificates
    from capsule_sym._files import write_whole
    from capsule_sym._records import dumps

    proved, failed = certificates(found, limit)
    if proved or not failed:
        write_whole(path, dumps({"certificates": proved}) + "\n", "--certify")
        if any(one["kind"] == "run" for one in proved):
            claims = f"{sum(len(one['fields']) for one in proved)} segments, switch by switch"
        else:
            stable = sum(bool(one["stable"]) for one in proved)
            claims = f"existence, uniqueness, itinerary; {stable} stable"
        click.echo(f"proved {len(proved)} ({claims}), wrote {path}", err=True)
    if failed:
        fail(f"not proved: {'; '.join(failed)}", 4)


def fail(message: str, status: int = 3) -> NoReturn:
    """Say on stderr why there is no result, or not the whole one, and exit."""
    click.echo(message, err=True)
    raise click.exceptions.Exit(status)


def fail_early(what: str, found: Any) -> NoReturn:
    """Say on stderr how a search or a continuation ended before its end, and exit with 3."""
    fail(f"{what} ({found.status.value}): {found.message}")


def tell_written(*paths: Path, as_json: bool, **more: Any) -> None:
    """Say on stderr which files were written, or with --json on stdout: each path and its size."""
    if as_json:
        import json

        files = [{"path": str(path), "bytes": path.stat().st_size} for path in paths]
        click.echo(json.dumps({**more, "files": files}))
        return
    for path in paths:
        click.echo(f"wrote {path}", err=True)


def make_console(stderr: bool = False, width: int = 110) -> Console:
    """A console on stdout or stderr, `width` columns wide where that is no terminal.

    Text is printed as it is: names of files may have brackets too. What has a style is a `Text`.
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
    """Print a table with a line below its head, the columns in `right` flush right.

    Columns with templates such as "{0.value:.3g}" take their texts from what is in a row.
    """
    from rich import box
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD, show_edge=False, padding=(0, gap, 0, 0), pad_edge=False)
    for name in columns:
        made.add_column(name, justify="right" if name in right else "left")
    for row in rows:
        if isinstance(columns, Mapping):
            row = [_Cells().vformat(text, row, {}) for text in columns.values()]
        made.add_row(*row)
    (console or make_console()).print(made)


class _Cells(Formatter):
    """Texts of the cells of a table: nothing for None, yes and no."""

    def format_field(self, value: Any, spec: str) -> str:
        if value is None or isinstance(value, bool):
            return {None: "", True: "yes", False: "no"}[value]
        return format(value, spec)


def grid(rows: Iterable[Iterable[str]]) -> None:
    """Print rows in columns without a head, if there are any."""
    from rich.table import Table

    made = Table.grid(padding=(0, 2))
    for row in rows:
        made.add_row(*row)
    if made.row_count:
        make_console().print(made)


@contextmanager
def progress(
    text: str, total: float | None = None, *columns: ProgressColumn
) -> Iterator[Callable[..., None]]:
    """One bar of `make_progress`; gives what updates it, as `completed` or `description`."""
    with make_progress(*columns) as bars:
        yield partial(bars.update, bars.add_task(text, total=total))


def make_progress(*columns: ProgressColumn) -> Progress:
    """Progress bars on stderr where that is a terminal, gone in the end."""
    from rich.constrain import Constrain
    from rich.progress import Progress

    from capsule_sym._processes import deferred

    console = make_console(stderr=True)

    class Bars(Progress):
        # Bars of which Ctrl-C left a part are not found again, and stay on the screen.
        def start(self) -> None:
            try:
                with deferred():
                    super().start()
            except KeyboardInterrupt:  # nobody else ends what did not begin
                self.stop()
                raise

        @deferred()
        def stop(self) -> None:
            super().stop()

        @deferred()
        def refresh(self) -> None:
            super().refresh()

        def get_renderables(self) -> Iterator[Constrain]:
            # The ^C that a terminal shows has room, lest it begins a line and the bars stay.
            yield Constrain(self.make_tasks_table(self.tasks), console.width - 3)

    return Bars(
        *columns,
        console=console,
        disable=not console.is_terminal,
        transient=True,
        # What is printed meanwhile goes above the bars if it goes to the terminal at all.
        redirect_stdout=sys.stdout.isatty(),
    )


@contextmanager
def tracking(lines: bool = False) -> Iterator[Track]:
    """Gives a `Track` with progress bars on stderr, one below another where it is nested.

    With `lines`, stderr has a line for each item of the outermost one where it is no terminal.
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
    """The items, with a progress bar on stderr where that is a terminal, gone in the end."""
    with tracking() as tracked:
        yield from tracked(items, text, total)


@contextmanager
def stoppable(limit: Watch, text: str) -> Iterator[None]:
    """Shows what work says of itself; Ctrl-C ends it as the end of its time does, a second at once.

    The limit is stopped then. The work has what is left of it for its own.
    """
    import signal

    from capsule_sym._native.watch import TOLD, Watch

    def stop(*_: object) -> None:
        signal.signal(signal.SIGINT, before)
        Watch.interrupted = True
        limit.stop()

    before = signal.signal(signal.SIGINT, stop)
    with progress(text) as update:
        told = TOLD.set(lambda said: update(description=f"{text} {said}"))
        try:
            yield
        finally:
            TOLD.reset(told)
            Watch.interrupted = False
            signal.signal(signal.SIGINT, before)


def interrupted(file: Path | None) -> KeyboardInterrupt:
    """Ctrl-C that says what is kept: the work so far, where a file has it."""
    kept = f"{file} has what is done, and the same command goes on from there"
    return KeyboardInterrupt(*[kept] * (file is not None and file.exists()))
