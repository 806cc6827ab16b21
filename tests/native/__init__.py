"""The C library's sources, built by themselves."""

import ctypes
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
LIBRARY, KERNELS = ROOT / "capsule_sym" / "_native", ROOT / "generated" / "capsule" / "c"
EXAMPLE = ROOT / "docs" / "howto" / "example.c"


def structure(name: str, **fields: Any) -> Any:
    """A structure of C, with the types of its members."""
    return type(name, (ctypes.Structure,), {"_fields_": [*fields.items()]})


def place_of(text: str, directory: Path, name: str = "") -> Path:
    """The source in a directory that has a text, which must be there once in all."""
    sources = [path for path in directory.iterdir() if path.suffix in (".c", ".h")]
    found = {path: path.read_text().count(text) for path in sources}
    assert sum(found.values()) == 1, f"{name or text}: {sum(found.values())} places"
    return max(found, key=lambda path: found[path])


def built(
    directory: Path,
    program: str,
    *flags: str,
    change: tuple[str, str] | None = None,
    compiler: str = "cc",
) -> Path:
    """A program with the library, one text of whose sources is changed: (old, new)."""
    shutil.copytree(LIBRARY, directory, ignore=shutil.ignore_patterns("build", "__pycache__"))
    if change:
        place = place_of(change[0], directory)
        place.write_text(place.read_text().replace(*change))
    (directory / "program.c").write_text(program)
    sources = [file.name for file in directory.glob("*.c")]
    command = [compiler, "-std=c99", "-O1", "-ffp-contract=off", "-I.", f"-I{KERNELS}", *flags]
    command += [*sources, str(KERNELS / "capsule_kernels.c"), "-lm", "-o", "built"]
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return directory / "built"


def compile_in(place: Path, *words: object) -> None:
    """Runs the C compiler in a directory, with the library's headers and flags, and these words."""
    command = ["cc", "-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-w", "-DCAPSULE_LANES=1"]
    command += [f"-I{LIBRARY}", f"-I{KERNELS}", *map(str, words)]
    subprocess.run(command, cwd=place, check=True)


def changed_library(
    place: Path, objects: Path, names: Sequence[str], *changes: tuple[str, str]
) -> ctypes.CDLL:
    """The objects of a directory linked, texts of one of the named sources changed: (old, new)."""
    linked, changed = sorted(objects.glob("*.o")), []
    texts = {name: (LIBRARY / name).read_text() for name in names}
    for change in changes:
        (name,) = [name for name, text in texts.items() if change[0] in text]
        assert texts[name].count(change[0]) == 1, change
        texts[name] = texts[name].replace(*change)
        changed = [place / name]
        changed[0].write_text(texts[name])
        linked = [path for path in linked if path.stem != changed[0].stem]
    compile_in(place, "-shared", *changed, *linked, "-lm", "-o", "built.so")
    return ctypes.CDLL(str(place / "built.so"))
