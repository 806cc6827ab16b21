"""Certificates of what a command found."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from capsule_sym._commands import present

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from capsule_sym._enclosures.certificates.certify import Certified
    from capsule_sym._native import Watch


def certify_found(path: Path, found: Sequence[Certified], limit: Watch) -> None:
    """Write the certificates of what was found; exits with 4 where something is not proved.

    A file is left as it was where nothing is proved.
    """
    from capsule_sym._enclosures.certificates.certify import certificates

    proved, failed = certificates(found, limit)
    if proved or not failed:
        _write_certificates(path, proved)
    if failed:
        present.fail(f"not proved: {'; '.join(failed)}", 4)


def _write_certificates(path: Path, proved: Sequence[dict[str, Any]]) -> None:
    from capsule_sym._files import write_whole
    from capsule_sym._records import dumps

    write_whole(path, dumps({"certificates": list(proved)}) + "\n", "--certify")
    claims = "existence, uniqueness, itinerary"
    if any(one["kind"] == "run" for one in proved):
        claims = f"{sum(len(one['fields']) for one in proved)} segments, switch by switch"
    else:
        claims += f"; {sum(bool(one['stable']) for one in proved)} stable"
    click.echo(f"proved {len(proved)} ({claims}), wrote {path}", err=True)
