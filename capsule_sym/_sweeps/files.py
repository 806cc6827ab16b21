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


def ending(path: Path) -> int:
    """Checksum of Zarr's codec crc32c at the end of a chunk's file; -1 without one."""
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            return -1
        with path.open("rb") as file:
            file.seek(-4, os.SEEK_END)
            return int.from_bytes(file.read(), "little")
    except OSError:  # of a file with fewer bytes, too
        return -1


def own_checksum(path: Path) -> int:
    """Checksum of a chunk's file, computed from its content; -1 if it does not end with it."""
    found = crc32c((read(path) or b"")[:-4])
    return found if found == ending(path) else -1


def checksums(folder: Path) -> dict[str, str]:
    """Checksum of every file in a folder, by its relative path."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): checksum(path) for path in files}


def place(data: bytes, path: Path, beside: Path) -> None:
    """Write a file in the folder `beside`, then move it to its place."""
    beside.mkdir(exist_ok=True)
    part = beside / f"{path.name}.part"
    part.write_bytes(data)
    make_folder(path.parent, beside.parent)
    os.replace(part, path)


def move(keys: Iterable[str], source: Path, target: Path) -> None:
    """Move files, by their relative paths, from one folder to another."""
    for key in keys:
        make_folder((target / key).parent, target.parent)
        os.replace(source / key, target / key)


def make_folder(path: Path, store: Path) -> None:
    """Make a folder of a store; raises InvalidInput as `check_inside` does."""
    check_inside(path, store)
    path.mkdir(parents=True, exist_ok=True)


def check_inside(path: Path, store: Path) -> None:
    """Raise InvalidInput for a link on the way to a folder of a store, which may lead out."""
    if Path(os.path.realpath(path)) != Path(os.path.realpath(store), path.relative_to(store)):
        raise InvalidInput("store", str(path), "a folder in the store, not a link: remove it")


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


def unsealed(path: Path, like: Any) -> Any:
    """Record of this kind (see `fits`) in a file; None unless it is as `sealed` wrote it."""
    data = read(path)
    if data is None:
        return None
    try:
        record = json.loads(data)
        if isinstance(record, dict):
            record.pop("sha256", None)
            if fits(record, like) and sealed(record) == data:
                return record
    except (ValueError, RecursionError):
        pass
    return None


def fits(value: Any, like: Any) -> bool:
    """True for a value of JSON that is like an example, whose types are the leaves.

    `[x]` is a list of any length, `(x, y)` a list of two, `{str: x}` has any names.
    """
    if isinstance(like, dict):
        if not isinstance(value, dict) or (str not in like and not value.keys() >= like.keys()):
            return False
        return all(fits(one, like.get(str, like.get(name, object))) for name, one in value.items())
    if isinstance(like, list):
        return isinstance(value, list) and all(fits(one, like[0]) for one in value)
    if isinstance(like, tuple):
        same = isinstance(value, list) and len(value) == len(like)
        return same and all(map(fits, value, like))
    return isinstance(value, like) and not isinstance(value, bool)


def _text(record: dict[str, Any]) -> str:
    return json.dumps(record, ensure_ascii=False, indent=1) + "\n"
