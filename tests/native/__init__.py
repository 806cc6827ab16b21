"""The C library's sources, built by themselves."""

import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIBRARY, KERNELS = ROOT / "capsule_sym" / "_native", ROOT / "generated" / "c"
EXAMPLE = ROOT / "docs" / "howto" / "example.c"


def built(directory: Path, program: str, *flags: str, change: tuple[str, str, str] | None) -> Path:
    """A program with the library, one text of whose sources is changed: (file, old, new)."""
    shutil.copytree(LIBRARY, directory, ignore=shutil.ignore_patterns("build", "__pycache__"))
    if change:
        name, old, new = change
        text = (directory / name).read_text()
        assert old in text
        (directory / name).write_text(text.replace(old, new))
    (directory / "program.c").write_text(program)
    sources = [file.name for file in directory.glob("*.c")]
    command = ["cc", "-std=c99", "-O1", "-ffp-contract=off", "-I.", f"-I{KERNELS}", *flags]
    command += [*sources, str(KERNELS / "capsule_kernels.c"), "-lm", "-o", "built"]
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return directory / "built"
