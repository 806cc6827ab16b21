"""The compiled core of a scene of one's own, by one command."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from capsule_sym._compile import CORE, compiler, kept
from capsule_sym._folders import MANIFEST, digest_of
from capsule_sym._native import core
from capsule_sym.codegen import __main__ as command

ROOT = Path(__file__).parents[2]
RUN = """
from capsule_sym import scenes, simulate
from capsule_sym._native import live
scene = scenes.load({folder!r})
assert live(scene).startswith("c-"), live(scene)
for alpha in (0.7, 1.6):
    p = scene.Parameters(alpha=alpha)
    compiled, numpy = (simulate(p, periods=5, backend=b).final for b in ("c", "numpy"))
    assert compiled[0].period == numpy[0].period == 5
    assert max(abs(a - b) for a, b in zip(compiled[1], numpy[1])) < 1e-11
"""


@pytest.mark.parametrize(
    "given", [[], ["--scene", "slope"], ["--scene", "slope", "--out", "here", "--check"]]
)
def test_a_core_of_its_own_is_beside_code_of_its_own(given: list[str]) -> None:
    done = CliRunner().invoke(command.main, ["--core", *given])
    assert done.exit_code == 2
    assert done.output == "error: --core needs --scene FILE or --out, and no --check\n"


@pytest.mark.skipif(core is None or sys.platform == "win32", reason="no core, or no shell")
def test_a_core_that_ships_is_compiled_once_and_anew_where_it_cannot_be_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    fake = tmp_path / "cc"
    fake.write_text(f'#!/bin/sh\nfor out; do :; done\ncp {core.library._name} "$out"\n')
    fake.chmod(0o755)
    monkeypatch.setenv("CC", str(fake))

    def tried(home: Path, said: str) -> str:
        monkeypatch.setenv("XDG_CACHE_HOME", str(home))
        path = kept("slope", str(ROOT / "generated" / "slope" / "c"))
        told = capfd.readouterr().err
        assert said in told if said else not told
        return path

    once, first, second = "compiling the C core of scene slope", tmp_path / "1", tmp_path / "2"
    path = tried(first, once)
    assert tried(first, "") == path
    cut = second / Path(path).relative_to(first)
    cut.parent.mkdir(parents=True)
    cut.write_bytes(b"cut")
    assert tried(second, once) == str(cut)
    assert cut.read_bytes() == Path(core.library._name).read_bytes()
    assert tried(fake, "cannot be written") == ""
    fake.write_text("#!/bin/sh\necho 'a.c:1: error: wrong' >&2\nkill -9 $$\n")
    assert tried(tmp_path / "3", "cc: a.c:1: error: wrong") == ""
    assert not [*(tmp_path / "3").rglob("*.*")]


@pytest.mark.skipif(core is None or sys.platform == "win32", reason="no core, or no shell")
def test_two_processes_that_compile_a_core_at_once_both_have_a_whole_one(tmp_path: Path) -> None:
    """Both are in the compiler before either continues."""
    fake, met, slope = tmp_path / "cc", tmp_path / "met", ROOT / "generated" / "slope" / "c"
    met.mkdir()
    wait = f'touch {met}/$PPID\nuntil [ "$(ls {met} | wc -l)" -eq 2 ]; do sleep .01; done'
    copy = f'for out; do :; done\ncp {core.library._name} "$out"'
    fake.write_text(f"#!/bin/sh\n{wait}\n{copy}\n")
    fake.chmod(0o755)
    call = f"from capsule_sym._compile import kept; print(kept('slope', {str(slope)!r}))"
    named = {**os.environ, "CC": str(fake), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    how: dict[str, Any] = {"env": named, "stdout": subprocess.PIPE, "text": True}
    both = [subprocess.Popen([sys.executable, "-c", call], **how) for _ in range(2)]
    (path,) = {Path(one.communicate()[0].strip()) for one in both}
    assert path.read_bytes() == Path(core.library._name).read_bytes()
    assert [*path.parent.iterdir()] == [path]


def test_a_core_that_is_lost_or_another_one_leaves_the_manifest(tmp_path: Path) -> None:
    """Written again, the folder is a scene without a compiled core."""
    binary, code = tmp_path / CORE, "d" * 16
    binary.write_bytes(b"core")
    entries = {"core": {CORE: digest_of(b"core")}, "core_sources": "e" * 16}
    (tmp_path / MANIFEST).write_text(json.dumps({"digest": code, **entries}))
    assert command._of_core(tmp_path, code) == entries
    assert command._of_core(tmp_path, "f" * 16) == {}
    binary.write_bytes(b"another")
    assert command._of_core(tmp_path, code) == {}
    binary.unlink()
    assert command._of_core(tmp_path, code) == {}


def test_a_compiler_that_cannot_be_read_is_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("CC", "gcc 'no end")
    assert compiler() == []
    (tmp_path / "clang").touch(0o755)
    assert compiler() == ["clang"]


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_a_scene_of_ones_own_runs_in_its_compiled_core(tmp_path: Path) -> None:
    folder = tmp_path / "two stops"
    declared = ROOT / "tests" / "scenes" / "two_stops.py"
    generator = [sys.executable, "-m", "capsule_sym.codegen", "--scene", str(declared)]
    subprocess.run([*generator, "--out", str(folder), "--core"], check=True)
    subprocess.run([sys.executable, "-c", RUN.format(folder=str(folder))], check=True)
    assert {path.suffix for path in folder.iterdir()} <= {"", ".py", ".json", ".1", ".dll"}
