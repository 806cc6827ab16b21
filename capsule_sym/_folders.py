"""Folders of generated scenes: their manifests, checked before any of their code runs."""

from __future__ import annotations

import hashlib
import os
import stat
import sys
from collections.abc import Iterable
from importlib.machinery import FileFinder, SourceFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, NoReturn

from capsule_sym._errors import InvalidInput
from capsule_sym._files import read_json

MANIFEST = "manifest.json"
_HERE = Path(__file__).parent
_LIKE = _HERE / "generated" / "slope" / MANIFEST
_sources: dict[str, bytes] = {}
"""Python sources of checked folders, by their paths."""


def digest_of(data: bytes) -> str:
    """Digest of a file's content in a manifest."""
    return hashlib.sha256(data).hexdigest()


def digest_of_sources(further: Iterable[str] = ()) -> str:
    """Digest of the C sources from which cores are compiled, and of those in further folders."""
    folders = (_HERE / "_native", *map(Path, further))
    paths = (path for folder in folders for path in sorted(folder.iterdir()))
    texts = (path.read_bytes() for path in paths if path.suffix in (".c", ".h"))
    return digest_of(b"\0".join(texts))


def files_in(folder: str | os.PathLike[str]) -> dict[str, Path]:
    """Files in a folder by their relative paths, without hidden ones and bytecode.

    A link stands for itself, whatever it leads to. Raises OSError for a folder that is unreadable.
    """
    found = {}
    for at, folders, names in os.walk(folder, onerror=_raised):
        folders[:] = [one for one in folders if one != "__pycache__" and one[0] != "."]
        links = (one for one in folders if os.path.islink(os.path.join(at, one)))
        for name in (*links, *(one for one in names if one[0] != ".")):
            path = Path(at, name)
            found[path.relative_to(folder).as_posix()] = path
    return found


def _raised(error: OSError) -> NoReturn:
    raise error


def imported(given: str, folder: str, name: str) -> None:
    """Import a folder's package under a name after a check of all its files.

    Only the sources that were checked run, no bytecode. Raises InvalidInput, which names the folder
    as `given`, if it is not as the generator wrote it.
    """
    try:
        if said := _problem(folder):
            raise InvalidInput("scene", given, f"a whole scene, but {said}")
    except OSError as error:
        said = f"readable ({error.filename}: {error.strerror})"
        raise InvalidInput("scene", given, said) from None
    # Submodules, which are imported on their first use, are found by this entry.
    sys.path_importer_cache[folder] = FileFinder(folder, (_Checked, [".py"]))
    path = os.path.join(folder, "__init__.py")
    loader = _Checked(name, path)
    spec = spec_from_file_location(name, path, loader=loader, submodule_search_locations=[folder])
    assert spec is not None
    sys.modules[name] = module = module_from_spec(spec)
    loader.exec_module(module)


class _Checked(SourceFileLoader):
    """Loader of the sources that were checked."""

    def get_data(self, path: str) -> bytes:
        return _sources[path]

    def path_stats(self, path: str) -> NoReturn:
        raise OSError("bytecode is neither read nor written")


def _problem(folder: str) -> str:
    """Reason why a folder is not as the generator and the compiler left it, and what to do; or "".

    Raises OSError for files that are unreadable.
    """
    again = "write it again: python -m capsule_sym.codegen --scene FILE --out FOLDER"
    path = os.path.join(folder, MANIFEST)
    if not os.path.lexists(path):
        return f"it has no {MANIFEST}; {again}"
    try:
        held, like = _manifest(path), _manifest(_LIKE)
        listed = {**held["files"], **held.get("core", {})}
        needed = {*listed, *like["files"]}
        if any(held[one] != like[one] for one in ("format", "generator")):
            return f"another version of the generator wrote it; {again}"
        if held.get("core_sources", now := digest_of_sources()) != now:
            return f"another version compiled its core; {again} --core"
    except (AttributeError, LookupError, TypeError, ValueError):
        return f"its {MANIFEST} is damaged; {again}"
    there = files_in(folder)
    for name in sorted({*needed, *there} - {MANIFEST}):
        if name not in there:
            return f"{name} is missing; {again}"
        if name not in needed:
            return f"{name} is not of it: remove that"
        if not stat.S_ISREG(there[name].lstat().st_mode):
            return f"{name} is a link or no file; {again}"
        data = there[name].read_bytes()
        if digest_of(data) != listed.get(name):
            return f"{name} was changed; {again}"
        if name.endswith(".py"):
            _sources[str(there[name])] = data
    return ""


def _manifest(path: str | os.PathLike[str]) -> Any:
    """Content of a manifest; raises ValueError for what is no file of JSON."""
    if not stat.S_ISREG(os.lstat(path).st_mode):
        raise ValueError(path)
    return read_json(path, "a manifest")
