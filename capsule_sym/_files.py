"""Files that are written whole or not at all, logs that grow by whole lines, and JSON."""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from secrets import token_hex
from typing import Any

from capsule_sym._errors import InvalidInput


@contextmanager
def whole(path: str | os.PathLike[str], field: str = "out") -> Iterator[Path]:
    """Path to write a file at, beside its place, to which it is moved once it is whole.

    If writing fails or is interrupted, the old file stays. A link is followed, the mode of a
    file is kept, folders are made; a device or a pipe is written directly. Raises InvalidInput,
    which names `field`, where the file cannot be written, as on a full disk.
    """
    with _refused(path, field):
        mode = mode_of(path)
        if mode is not None and not stat.S_ISREG(mode):
            yield Path(path)  # nothing can take its place, and a folder is refused by itself
            return
        target = Path(os.path.realpath(path))
        if mode is None:
            target.parent.mkdir(parents=True, exist_ok=True)
        else:
            os.close(os.open(target, os.O_WRONLY))  # refuses a file that may not be changed
        # Some writers choose the format by the ending.
        part = target.with_name(f".{token_hex(8)}{target.suffix}")
        try:
            yield part
            if mode is not None:
                part.chmod(stat.S_IMODE(mode))
            part.replace(target)
        finally:
            part.unlink(missing_ok=True)


def write_whole(path: str | os.PathLike[str], data: str | bytes, field: str = "out") -> None:
    """Write a file with this content by `whole`, a text in UTF-8."""
    with whole(path, field) as part:
        part.write_bytes(data.encode() if isinstance(data, str) else data)


def mode_of(path: str | os.PathLike[str]) -> int | None:
    """Mode of the file at a path, None if there is none; raises OSError if that is unknown."""
    try:
        return os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None


@contextmanager
def growing(path: Path, field: str, begin: str = "") -> Iterator[Callable[[str], None]]:
    """Function that appends whole lines to a log at once: they stay if the program is killed.

    Texts end with their newline. A last line without one is cut off, and an empty log begins with
    `begin`. Raises InvalidInput, which names `field`, where the log cannot be written.
    """
    with _refused(path, field):
        path.parent.mkdir(parents=True, exist_ok=True)
        file = path.open("ab+")
    try:
        file.seek(0)
        held = file.read().rfind(b"\n") + 1
        file.truncate(held)

        def add(text: str) -> None:
            with _refused(path, field):
                file.write(text.encode())
                file.flush()

        if not held:
            add(begin)
        yield add
    finally:
        with _refused(path, field):
            file.close()


def read_json(path: str | os.PathLike[str], what: str, field: str = "file") -> Any:
    """Content of a JSON file; raises InvalidInput if it is unreadable, or not JSON: not `what`."""
    import json

    try:
        return json.loads(Path(path).read_bytes())
    except OSError as error:
        raise InvalidInput(field, str(path), f"readable ({error.strerror or error})") from None
    except (ValueError, RecursionError):  # not JSON, or nested too deeply
        raise InvalidInput(field, str(path), what) from None


@contextmanager
def _refused(path: str | os.PathLike[str], field: str) -> Iterator[None]:
    """Raises InvalidInput for any OSError but BrokenPipeError, of a reader that left."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        allowed = f"writable ({error.strerror or error})"
        raise InvalidInput(field, str(path), allowed) from error


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Content of a TOML file; raises `InvalidInput` if it cannot be read or is not TOML."""
    try:
        import tomllib

        return tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise InvalidInput("file", str(path), f"readable ({error.strerror})") from error
    except (ValueError, RecursionError) as error:  # neither UTF-8 nor TOML, or nested too deeply
        raise InvalidInput("file", str(path), f"a TOML file ({error})") from None
