"""`python -m capsule_sym.codegen`: write `generated/`, or check that it is up to date."""

from __future__ import annotations

import difflib
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import click

from capsule_sym._symbolic.model import declaration
from capsule_sym.codegen import COMMAND, INPUTS

_GENERATED = INPUTS.parent / "generated"
_MANAGED = {".py", ".json", ".c", ".h", ".pxi", ".ts"}


def _present(directory: Path) -> dict[str, str]:
    paths = (path for path in directory.rglob("*") if path.suffix in _MANAGED and path.is_file())
    return {
        path.relative_to(directory).as_posix(): path.read_text(encoding="utf-8") for path in paths
    }


def render() -> dict[str, str]:
    """Generated files of the chosen model; the process derives no other."""
    from capsule_sym.codegen._render import render

    return render()


def difference(expected: dict[str, str], present: dict[str, str]) -> str:
    """Unified diff from the present files to the expected files, empty if they agree."""
    lines: list[str] = []
    for path in sorted(expected.keys() | present.keys()):
        lines += difflib.unified_diff(
            present.get(path, "").splitlines(keepends=True),
            expected.get(path, "").splitlines(keepends=True),
            fromfile=f"present/{path}" if path in present else "/dev/null",
            tofile=f"expected/{path}" if path in expected else "/dev/null",
        )
    return "".join(lines)


def _update(target: Path, expected: dict[str, str], present: dict[str, str], mend: str) -> bool:
    """Write files to a folder, or compare them if a command to mend it is given; True if right."""
    if mend:
        found = difference(expected, present)
        told = f"{found}{target} is out of date. To update it, run:\n\n    {mend}\n"
        click.echo(told if found else f"{target}: {len(expected)} files agree with their inputs.")
        return not found
    for name in present.keys() - expected.keys():
        (target / name).unlink()
    for name, text in expected.items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        (target / name).write_text(text, encoding="utf-8")
    click.echo(f"wrote {len(expected)} files to {target}")
    return True


def _all(check: bool) -> bool:
    """Generate the files of all scenes, and each shipped scene in a process of its own.

    A process has one model; two run at a time. True if all is right.
    """
    from capsule_sym.codegen._render import render_shared

    command = [sys.executable, "-m", "capsule_sym.codegen", *(["--check"] if check else [])]

    def run(name: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*command, "--scene", name], capture_output=True, text=True)

    expected = render_shared()
    paths = {name: _GENERATED / name for name in expected}
    present = {name: path.read_text("utf-8") for name, path in paths.items() if path.is_file()}
    right = _update(_GENERATED, expected, present, COMMAND if check else "")
    with ThreadPoolExecutor(2) as pool:
        for done in pool.map(run, declaration.SHIPPED):
            click.echo(done.stdout, nl=False)
            click.echo(done.stderr, nl=False, err=True)
            right &= done.returncode == 0
    return right


@click.command()
@click.option("--check", is_flag=True, help="Write nothing; exit 1 with a diff if files differ.")
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Directory to write to or to check.  [default: generated/ and the scene's name; beside "
    "FILE]",
)
@click.option(
    "--scene",
    metavar="NAME|FILE",
    help=f"Scene: {', '.join(declaration.SHIPPED)}, or a file that declares one.  "
    "[default: all that ship]",
)
@click.option(
    "--core",
    is_flag=True,
    help="Also compile the C core, beside the code. `make core` does so for scenes that ship.",
)
def main(check: bool, out: Path | None, scene: str | None, core: bool) -> None:
    """Derive the kernels of scenes and write them as Python and C code."""
    if not INPUTS.is_dir():
        click.echo(f"error: no generator inputs at {INPUTS}; run from a checkout", err=True)
        sys.exit(2)
    if core and (check or (out is None and scene in (None, *declaration.SHIPPED))):
        click.echo("error: --core needs --scene FILE or --out, and no --check", err=True)
        sys.exit(2)
    if scene is None and out is None:
        sys.exit(not _all(check))
    path = declaration.home(scene or declaration.SHIPPED[0])
    declaration.choose(path)
    ships = path.parent == declaration.home(declaration.SHIPPED[0]).parent
    target = out or (_GENERATED / path.stem if ships else path.with_suffix(""))
    try:
        expected = render()
    except declaration.BadDeclaration as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(2)
    mend = COMMAND + (f" --scene {scene}" if scene else "") + (f" --out {out}" if out else "")
    if not _update(target, expected, _present(target), mend if check else ""):
        sys.exit(1)
    if core:
        _compile(target)


def _compile(target: Path) -> None:
    """Compile the core of the code in a folder; on failure exits with 1 and CMake's output."""
    from capsule_sym.codegen._compile import NotCompiled, compile_core

    started = time.perf_counter()
    try:
        compile_core(target)
    except NotCompiled as error:
        click.echo(f"error: the core was not compiled: {error}", err=True)
        sys.exit(1)
    click.echo(f"compiled the C core of {target} in {time.perf_counter() - started:.1f} s")


if __name__ == "__main__":
    main()
