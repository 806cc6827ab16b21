"""The compiled core of a scene of one's own, by one command."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

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


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_a_scene_of_ones_own_runs_in_its_compiled_core(tmp_path: Path) -> None:
    folder = tmp_path / "two stops"
    declared = ROOT / "tests" / "scenes" / "two_stops.py"
    generator = [sys.executable, "-m", "capsule_sym.codegen", "--scene", str(declared)]
    subprocess.run([*generator, "--out", str(folder), "--core"], check=True)
    subprocess.run([sys.executable, "-c", RUN.format(folder=str(folder))], check=True)
    assert {path.suffix for path in folder.iterdir()} <= {"", ".py", ".json", ".1", ".dll"}
