"""Files with checksums, written whole or not at all."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import stat
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from google_crc32c import value as crc32c

from capsule_sym._errors import InvalidInput


def read(path: Path) -> bytes | None:
    """Bytes of a file; None if it does not exist, or is a link or a device.

    Raises InvalidInput for a folder of this name, which is never removed, and for an unreadable
    file.
    """
    try:
        mode = path.lstat().st_mode
        if stat.S_ISDIR(mode):
            raise InvalidInput("store", str(path), "a file, not a folder")
        return path.read_bytes() if stat.S_ISREG(mode) else None
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InvalidInput("store", str(path), f"readable ({error.strerror})") from error


def checksum(path: Path) -> str:
    """SHA-256 of a file, empty if `read` returns None."""
    data = read(path)
    return "" if data is None else hashlib.sha256(data).hexdigest()


def sound(path: Path) -> bool:
    """True for the file of a chunk that ends with the checksum of Zarr's codec crc32c."""
    data = read(path) or b""
    return len(data) > 4 and crc32c(data[:-4]) == int.from_bytes(data[-4:], "little")


def checksums(folder: Path) -> dict[str, str]:
    """Checksum of every file in a folder, by its relative path."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): checksum(path) for path in files}


def place(data: bytes, path: Path, beside: Path) -> None:
    """Write a file in the folder `beside`, then move it to its place."""
    beside.mkdir(exist_ok=True)
    part = beside / f"{path.name}.part"
    part.write_bytes(data)
    path.parent.mkdir(parents=True, exist_ok=True)
    os.replace(part, path)


def move(keys: Iterable[str], source: Path, target: Path) -> None:
    """Move files, by their relative paths, from one folder to another."""
    for key in keys:
        (target / key).parent.mkdir(parents=True, exist_ok=True)
        os.replace(source / key, target / key)


def remove(path: Path) -> None:
    """Remove a file, a link (but not its target) or a folder."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def sealed(record: dict[str, Any]) -> bytes:
    """Record as JSON with its own checksum."""
    seal = hashlib.sha256(_text(record).encode()).hexdigest()
    return _text({"sha256": seal, **record}).encode()


def unsealed(path: Path, keys: Iterable[str]) -> dict[str, Any] | None:
    """Record with these keys in a file; None unless it is as `sealed` wrote it."""
    data = read(path)
    if data is None:
        return None
    try:
        record = json.loads(data)
        if isinstance(record, dict):
            record.pop("sha256", None)
            if set(record) == set(keys) and sealed(record) == data:
                return record
    except (ValueError, RecursionError):
        pass
    return None


def _text(record: dict[str, Any]) -> str:
    return json.dumps(record, ensure_ascii=False, indent=1) + "\n"
