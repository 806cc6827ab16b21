"""Presentation of results: JSON, tables, files and pictures; and ends without a result."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn

import click

import capsule_sym
from capsule_sym._errors import NotInstalled, counted

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

    from capsule_sym._enclosures.certificates.certify import Certified
    from capsule_sym._native import Watch
    from capsule_sym._parameters import SceneDevice


def result(
    record: Mapping[str, Any],
    as_json: bool,
    out: Path | None = None,
    files: Mapping[str, Any] = MappingProxyType({}),
    pictures: Mapping[str, Callable[[], Figure]] = MappingProxyType({}),
) -> None:
    """Write files and pictures by name to a folder, if there is one, and print a record.

    The record is printed as JSON on request, else as text. A file is a record, or a pair of the
    rows and the columns of a table. stderr names the written files, and the reason for a missing
    picture.
    """
    from capsule_sym._records import dumps, table, write

    if out is not None:
        texts = {
            name: table(*held) if isinstance(held, tuple) else dumps(held) + "\n"
            for name, held in files.items()
        }
        paths = write(texts, out)
        try:
            for name, draw in pictures.items():
                capsule_sym.figures.save_figure(draw(), out / name)
                paths.append(out / name)
        except NotInstalled as missing:
            click.echo(f"no picture: {missing}", err=True)
        click.echo(f"wrote {', '.join(map(str, paths))}", err=True)
    if as_json:
        click.echo(dumps(dict(record)))
    else:
        from capsule_sym._texts.records import show

        show(record)


def report(
    found: Any,
    name: str,
    out: Path | None,
    as_json: bool,
    extra: Mapping[str, Any] = MappingProxyType({}),
    *,
    device: SceneDevice | None = None,
    drawn: bool | None = None,
) -> None:
    """Present a result, with its record, table and picture as files.

    Rows of a dimensionless table have SI units too if there is a device. By default there is a
    picture if the table has rows; `drawn` overrides this.
    """
    from capsule_sym._map.result import plain
    from capsule_sym._records import in_si

    record = plain({**found.to_dict(), **extra})
    columns = {key: column.tolist() for key, column in getattr(found, "columns", {}).items()}
    each = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    table = ([row | in_si(device, row) for row in each], list(columns))
    files = {f"{name}.json": record} | ({f"{name}.csv": table} if columns else {})
    pictures = {f"{name}.svg": partial(capsule_sym.plot, found)}
    result(record, as_json, out, files, pictures if (each if drawn is None else drawn) else {})


def end(found: Any, limit: Watch | None = None) -> None:
    """Exit with 3, and the reason, if a result is partial or missing.

    Raises KeyboardInterrupt after Ctrl-C.
    """
    if limit is not None and limit.stopped:
        raise KeyboardInterrupt
    if not found.success:
        fail(f"{found.status.value}: {found.message}")


def certificates(path: Path | None, found: Sequence[Certified], limit: Watch) -> None:
    """Write the requested certificates; exits with 4 if something is not proved.

    The file is unchanged if nothing is proved, or nothing is found.
    """
    if path is None:
        return
    from capsule_sym._enclosures.certificates.certify import certificates, file_of
    from capsule_sym._files import write_whole
    from capsule_sym._records import dumps

    proved, failed = certificates(found, limit)
    if proved:
        write_whole(path, dumps(file_of(proved)) + "\n", "--certify")
        if any(one["kind"] == "run" for one in proved):
            claims = (
                f"{counted(sum(len(one['fields']) for one in proved), 'segment')}, switch by switch"
            )
        else:
            said = [("unstable", "stable")[one["stable"]] for one in proved if "stable" in one]
            kinds = "".join(f"; {said.count(kind)} {kind}" for kind in sorted({*said}))
            claims = f"existence, uniqueness, itinerary{kinds}"
        click.echo(f"proved {len(proved)} ({claims}), wrote {path}", err=True)
    if failed:
        fail(f"not proved: {'; '.join(failed)}", 4)
    if not proved:
        click.echo(f"nothing found to prove: {path} is not written", err=True)


def fail(message: str, status: int = 3) -> NoReturn:
    """Print on stderr the reason for a missing or partial result, and exit."""
    click.echo(message, err=True)
    raise click.exceptions.Exit(status)


def fail_early(what: str, found: Any) -> NoReturn:
    """Print on stderr why a search or a continuation ended early, and exit with 3."""
    fail(f"{what} ({found.status.value}): {found.message}")


def report_written(*paths: Path, as_json: bool, **more: Any) -> None:
    """Name written files on stderr, or with --json on stdout with their sizes in bytes."""
    if as_json:
        files = [{"path": str(path), "bytes": path.stat().st_size} for path in paths]
        click.echo(json.dumps({**more, "files": files}))
        return
    for path in paths:
        click.echo(f"wrote {path}", err=True)


def interrupted(file: Path | None) -> KeyboardInterrupt:
    """KeyboardInterrupt whose message names the file with the work so far, if there is one."""
    kept = f"finished work is kept in {file}; repeat the command to continue"
    return KeyboardInterrupt(*[kept] * (file is not None and file.exists()))
