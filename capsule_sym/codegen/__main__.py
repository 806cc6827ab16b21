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
_MANAGED = {".py", ".json", ".c", ".h", ".m", ".pxi", ".ts"}


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


def _all(check: bool) -> int:
    """Generate each shipped scene in its own process (a process has one model), two at a time."""
    command = [sys.executable, "-m", "capsule_sym.codegen", *(["--check"] if check else [])]

    def run(name: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([*command, "--scene", name], capture_output=True, text=True)

    codes = [0]
    with ThreadPoolExecutor(2) as pool:
        for done in pool.map(run, declaration.SHIPPED):
            click.echo(done.stdout, nl=False)
            click.echo(done.stderr, nl=False, err=True)
            codes.append(done.returncode)
    return max(map(abs, codes))


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
    """Derive the kernels of scenes and write them as NumPy, mpmath, C and MATLAB code."""
    if not INPUTS.is_dir():
        click.echo(f"error: no generator inputs at {INPUTS}; run from a checkout", err=True)
        sys.exit(2)
    if core and (check or (out is None and scene in (None, *declaration.SHIPPED))):
        click.echo("error: --core needs --scene FILE or --out, and no --check", err=True)
        sys.exit(2)
    if scene is None and out is None:
        sys.exit(_all(check))
    started = time.perf_counter()
    path = declaration.home(scene or declaration.SHIPPED[0])
    declaration.choose(path)
    ships = path.parent == declaration.home(declaration.SHIPPED[0]).parent
    target = out or (_GENERATED / path.stem if ships else path.with_suffix(""))
    try:
        expected = render()
    except declaration.BadDeclaration as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(2)
    if check:
        found = difference(expected, _present(target))
        if found:
            click.echo(found, nl=False)
            mend = (
                COMMAND + (f" --scene {scene}" if scene else "") + (f" --out {out}" if out else "")
            )
            click.echo(f"{target} is out of date. To update it, run:\n\n    {mend}\n")
            sys.exit(1)
        click.echo(f"{target}: {len(expected)} files agree with their inputs.")
        return
    for name in _present(target).keys() - expected.keys():
        (target / name).unlink()
    for name, text in expected.items():
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        (target / name).write_text(text, encoding="utf-8")
    elapsed = time.perf_counter() - started
    click.echo(f"wrote {len(expected)} files to {target} in {elapsed:.1f} s")
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
