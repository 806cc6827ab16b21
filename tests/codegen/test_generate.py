"""The generator: the same text every time, and nothing in generated/ that it would not write."""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import sympy as sp
from click.testing import CliRunner, Result

from capsule_sym.codegen import COMMAND
from capsule_sym.codegen import __main__ as command
from capsule_sym.codegen._lower import lower
from capsule_sym.codegen._render import digest, render
from capsule_sym.generated import capsule as generated

Run = Callable[..., Result]

GENERATED = Path(__file__).parents[2] / "generated" / "capsule"


@pytest.fixture(scope="module")
def derived() -> dict[str, str]:
    """Output of the derivation, in half a minute."""
    return render()


@pytest.fixture
def rendered() -> dict[str, str]:
    """Committed output of the derivation; `make check-generated` and a long test check it."""
    return files(GENERATED)


def files(directory: Path) -> dict[str, str]:
    paths = [path for path in directory.rglob("*") if path.is_file()]
    return {
        path.relative_to(directory).as_posix(): path.read_text(encoding="utf-8")
        for path in paths
        if "__pycache__" not in path.parts
    }


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return Path(shutil.copytree(GENERATED, tmp_path / "copy"))


@pytest.fixture
def run(rendered: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> Run:
    """The command, where the derivation gives what is there."""
    monkeypatch.setattr(command, "render", lambda: rendered)

    def invoke(*arguments: str) -> Result:
        return CliRunner().invoke(command.main, arguments)

    return invoke


def written_under(seed: int, out: Path) -> dict[str, str]:
    environment = {**os.environ, "PYTHONHASHSEED": str(seed)}
    subprocess.run(
        [sys.executable, "-m", "capsule_sym.codegen", "--out", out], env=environment, check=True
    )
    return files(out)


@pytest.mark.long
def test_the_tree_is_what_is_derived(derived: dict[str, str]) -> None:
    assert files(GENERATED) == derived


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, 12345])
def test_text_does_not_depend_on_the_hash_seed(seed, derived, tmp_path) -> None:
    assert written_under(seed, tmp_path / "out") == derived


def test_check_passes_where_nothing_differs(run: Run) -> None:
    result = run("--scene", "capsule", "--check")
    assert result.exit_code == 0, result.output


def test_hand_edit_is_found(run: Run, copy: Path) -> None:
    kernels = copy / "kernels.py"
    text = kernels.read_text(encoding="utf-8")
    kernels.write_text(text.replace("2*sigma", "3*sigma", 1), encoding="utf-8")
    result = run("--check", "--out", str(copy))
    assert result.exit_code == 1
    lines = result.output.splitlines()
    assert "--- present/kernels.py" in lines
    assert "+++ expected/kernels.py" in lines
    assert any(re.match(r"@@ -\d+,\d+ \+\d+,\d+ @@", line) for line in lines)
    assert [line for line in lines if line.startswith("-") and "3*sigma" in line]
    assert [line for line in lines if line.startswith("+") and "2*sigma" in line]
    assert COMMAND in result.output
    assert kernels.read_text(encoding="utf-8") != text  # checking writes nothing


def test_missing_and_surplus_files_are_found_and_mended(run: Run, copy: Path) -> None:
    (copy / "c" / "capsule_kernels.h").unlink()
    (copy / "c" / "stray.h").write_text("#define X\n", encoding="utf-8")
    result = run("--check", "--out", str(copy))
    assert result.exit_code == 1
    assert "--- /dev/null\n+++ expected/c/capsule_kernels.h" in result.output
    assert "--- present/c/stray.h\n+++ /dev/null" in result.output
    assert run("--out", str(copy)).exit_code == 0
    assert run("--check", "--out", str(copy)).exit_code == 0
    assert not (copy / "c" / "stray.h").exists()


def test_command_printed_is_the_one_for_the_directory_checked(run: Run, copy: Path) -> None:
    (copy / "manifest.json").write_text("{}\n", encoding="utf-8")
    result = run("--check", "--out", str(copy))
    assert f"{COMMAND} --out {copy}" in result.output


def test_out_writes_the_whole_tree(run: Run, rendered: dict[str, str], tmp_path: Path) -> None:
    result = run("--out", str(tmp_path / "new"))
    assert result.exit_code == 0, result.output
    assert files(tmp_path / "new") == rendered


def test_without_inputs_the_command_says_so(run, monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(command, "INPUTS", tmp_path / "nowhere")
    result = run("--scene", "capsule", "--check")
    assert result.exit_code == 2
    assert str(tmp_path / "nowhere") in result.output


def test_digest_is_one_everywhere() -> None:
    manifest = json.loads((GENERATED / "manifest.json").read_text(encoding="utf-8"))
    header = (GENERATED / "c" / "capsule_kernels.h").read_text(encoding="utf-8")
    stamped = re.findall(r'#define CAPSULE_DIGEST "(\w+)"', header)
    assert stamped == [digest()]
    assert manifest["digest"] == generated.DIGEST == digest()
    assert manifest["sympy"] == sp.__version__


def test_manifest_lists_every_file_with_its_hash() -> None:
    manifest = json.loads((GENERATED / "manifest.json").read_text(encoding="utf-8"))
    texts = files(GENERATED)
    del texts["manifest.json"]
    assert manifest["files"] == {
        path: hashlib.sha256(text.encode()).hexdigest() for path, text in texts.items()
    }


def test_every_source_says_that_it_is_generated() -> None:
    for path, text in files(GENERATED).items():
        if path != "manifest.json":
            assert f"Generated by `{COMMAND}`" in text[:200], path
            assert f"digest {digest()}" in text[:300], path


def test_unknown_symbol_is_refused() -> None:
    x, unknown, y = sp.symbols("x unknown y")
    with pytest.raises(ValueError, match=r"kernel k: unknown symbols \['unknown'\]"):
        lower("k", "", [(y, x + unknown)], ("x",), ("y",), frozenset({"K"}))


def test_result_that_the_block_does_not_give_is_refused() -> None:
    x, y = sp.symbols("x y")
    with pytest.raises(ValueError, match="does not give"):
        lower("k", "", [(y, x)], ("x",), ("z",), frozenset())


def test_kernel_keeps_only_what_its_results_need() -> None:
    x, y, z, constant = sp.symbols("x y z K")
    kernel = lower(
        "k", "", [(y, x * constant), (z, sp.Symbol("unused"))], ("x",), ("y",), frozenset({"K"})
    )
    assert kernel.constants == ("K",)
    assert [name for name, _ in kernel.steps] == ["y"]


def test_result_named_as_an_argument_does_not_replace_it_midway() -> None:
    """Of (G, H) -> (2 G, G + H) the second result uses the argument G, not the first result."""
    first, second = sp.symbols("G H")
    kernel = lower(
        "k", "", [(first, 2 * first), (second, first + second)], ("G", "H"), ("G", "H"), frozenset()
    )
    assert kernel.results == (2 * first, first + second)
