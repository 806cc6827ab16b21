"""The force's formula stands in one place, and what stands there reaches every target."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from capsule_sym._symbolic.model import declaration
from capsule_sym.scenes import SHIPPED

ROOT = Path(__file__).parents[2]
# The damper's or the second spring's part of P, however it is spelled: 2 zeta v, or kappa or beta
# times a gap.
PARTS = (
    r"\b2(\.0)?\s*\*\s*(\w+(\.|->))*zeta\b",
    r"\(2(\.0)?\s*\*\s*(\w+(\.|->))*zeta\)",
    r"\b(kappa|beta)\s*\*\s*\(?(abs\(|fabs\()?(\w+(\.|->))*(gap|x_r)\b",
    r"1(\.0)?\s*\+\s*(\w+(\.|->))*kappa\b",
)
# Independent by intention: other tools' integrators, the paper's own text, and the theory's proofs.
WITNESSES = ("generated", "_symbolic/proofs")
WITNESSES += tuple(f"_symbolic/{name}.py" for name in ("model/basis", "model/switching"))
LOSS = "_orbits/metrics/performance.py"  # 2 zeta v_r^2 is the damper's loss


# Friction, and how far a resting capsule is from slipping, with a sign. Sums of magnitudes may
# have f_b as a term.
FRICTION = (
    r"\*\s*(\w+(\.|->))*f_b\b",
    r"\bf_b\s*\*",
    r"-\s*(\w+(\.|->))*f_b\b",
    r"\bf_b\s*-(?!>)",
    r"\b(mad|mul|sub|over)\([^;]*\bf_b\b",
)


def places(parts: tuple[str, ...] = PARTS) -> list[str]:
    found = []
    houses = [ROOT / name for name in ("capsule_sym", "paper/study", "paper/figures")]
    for path in sorted(path for house in houses for path in house.rglob("*")):
        name = path.relative_to(ROOT).as_posix().removeprefix("capsule_sym/")
        if path.suffix not in (".py", ".c", ".h", ".pyx") or name.startswith((*WITNESSES, LOSS)):
            continue
        text = re.sub(r'""".*?"""|/\*.*?\*/', "", path.read_text(encoding="utf-8"), flags=re.S)
        found += [name for line in text.splitlines() if any(re.search(p, line) for p in parts)]
    return found


def test_the_generator_and_the_package_know_the_same_scenes() -> None:
    assert declaration.SHIPPED == SHIPPED


def test_the_force_stands_in_one_place() -> None:
    assert {*places()} == {f"_symbolic/scenes/{name}.py" for name in SHIPPED}


def test_what_runs_has_no_friction_of_its_own() -> None:
    runs = ("_native/", "_map/", "_orbits/shooting/")
    assert [name for name in places(FRICTION) if name.startswith(runs)] == []


@pytest.mark.long
def test_a_term_gone_from_the_model_changes_every_target(tmp_path: Path) -> None:
    for part in ("capsule_sym", "codegen", "generated"):
        shutil.copytree(ROOT / part, tmp_path / part, symlinks=True)
    model = tmp_path / "capsule_sym" / "_symbolic" / "scenes" / "capsule.py"
    text = model.read_text(encoding="utf-8")
    term = "P = model.interaction(x_r + 2 * zeta * v_r"
    assert text.count(term) == 1
    model.write_text(text.replace(term, term.replace("2 * zeta", "3 * zeta / 2")), encoding="utf-8")
    # Without `site`, which would import the package from where it is installed editable.
    command = [sys.executable, "-S", "-m", "capsule_sym.codegen", "--check", "--scene", "capsule"]
    packages = {**os.environ, "PYTHONPATH": sysconfig.get_path("purelib")}
    done = subprocess.run(
        command, cwd=tmp_path, env=packages, capture_output=True, text=True, check=False
    )
    assert done.returncode == 1, done.stderr
    for path in ("formulas.py", "kernels.py", "c/capsule_formulas.h", "c/capsule_kernels.c"):
        changed = done.stdout.partition(f"+++ expected/{path}")[2].partition("\n--- ")[0]
        assert re.search(r"^\+.*zeta", changed, re.M), path
