"""`python -m capsule_sym.codegen`: write `generated/`, or check that it is up to date."""

from __future__ import annotations

import difflib
import sys
import time
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
    """The generated files of the model that was chosen: what derives them knows no other."""
    from capsule_sym.codegen._render import render

    return render()


def difference(expected: dict[str, str], present: dict[str, str]) -> str:
    """Unified diff from the files present to the files expected, empty if they agree."""
    lines: list[str] = []
    for path in sorted(expected.keys() | present.keys()):
        lines += difflib.unified_diff(
            present.get(path, "").splitlines(keepends=True),
            expected.get(path, "").splitlines(keepends=True),
            fromfile=f"present/{path}" if path in present else "/dev/null",
            tofile=f"expected/{path}" if path in expected else "/dev/null",
        )
    return "".join(lines)


@click.command()
@click.option("--check", is_flag=True, help="Write nothing; exit 1 with a diff if files differ.")
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=_GENERATED,
    help="Directory to write to or to check.  [default: generated/]",
)
@click.option(
    "--model",
    type=click.Path(dir_okay=False, path_type=Path),
    default=declaration.DEFAULT,
    help="File that declares the model.  [default: the capsule]",
)
def main(check: bool, out: Path, model: Path) -> None:
    """Derive the kernels of a model and write them as NumPy, mpmath, C and MATLAB code."""
    if not INPUTS.is_dir():
        click.echo(f"error: no generator inputs at {INPUTS}; run from a checkout", err=True)
        sys.exit(2)
    started = time.perf_counter()
    declaration.choose(model)
    try:
        expected = render()
    except declaration.BadDeclaration as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(2)
    if check:
        found = difference(expected, _present(out))
        if found:
            click.echo(found, nl=False)
            mend = COMMAND if out == _GENERATED else f"{COMMAND} --out {out}"
            click.echo(f"{out} is not what its inputs give. To mend it, run:\n\n    {mend}\n")
            sys.exit(1)
        click.echo(f"{out}: {len(expected)} files agree with their inputs.")
        return
    for path in _present(out).keys() - expected.keys():
        (out / path).unlink()
    for path, text in expected.items():
        (out / path).parent.mkdir(parents=True, exist_ok=True)
        (out / path).write_text(text, encoding="utf-8")
    elapsed = time.perf_counter() - started
    click.echo(f"wrote {len(expected)} files to {out} in {elapsed:.1f} s")


if __name__ == "__main__":
    main()
