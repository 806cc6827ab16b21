"""The C library's sources, built by themselves."""

import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIBRARY, KERNELS = ROOT / "capsule_sym" / "_native", ROOT / "generated" / "c"
EXAMPLE = ROOT / "docs" / "howto" / "example.c"


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
