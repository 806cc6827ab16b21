"""A declaration that cannot be derived from is refused with its file and line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from capsule_sym._symbolic.model.declaration import DEFAULT, BadDeclaration, load

TEXT = DEFAULT.read_text(encoding="utf-8")

WRONG = {
    "a symbol that Python does not know": (
        "2 * zeta * v_r",
        "2 * zetta * v_r",
        "name 'zetta' is not defined",
    ),
    "a symbol that is not declared": (
        "model.mass(alpha * cos(omega * tau) - P)",
        "model.mass(alpha * cos(omega * tau) - P - Symbol('q'))",
        "unknown symbol q",
    ),
    "a guard that is not affine": (
        'model.region("C", x_r > delta,',
        'model.region("C", x_r**2 > delta,',
        "not affine in x_r, v_r, v_c",
    ),
    "a gap between two regions": (
        'model.region("C", x_r > delta,',
        'model.region("C", x_r > delta + 1,',
        "no way from NC to C",
    ),
    "rest that ends where no drift begins": (
        'model.rest("S", P < f_b,',
        'model.rest("S", P < 2 * f_b,',
        "no way from S to FD or BD",
    ),
    "a parameter without a range": (
        '"zeta", 0.05, (0, 1e4),',
        '"zeta", 0.05,',
        "parameter zeta has no range",
    ),
    "a default out of its range": (
        '"zeta", 0.05, (0, 1e4),',
        '"zeta", -0.05, (0, 1e4),',
        "zeta = -0.05 is not in [0, 10000]",
    ),
    "a force that no closed form holds": (
        "2 * zeta * v_r",
        "2 * zeta * v_r**2",
        "the interaction force is linear in x_r and v_r",
    ),
    "a mode left out": (
        'model.drift("BD", v_c < 0, against=f_b)\n',
        "\n",
        "rest and drift backward",
    ),
}


def declared(folder: Path, old: str, new: str) -> tuple[Path, int]:
    """A declaration with a text changed, and the line of that."""
    text = TEXT.replace("from sympy import cos", "from sympy import Symbol, cos  # noqa: F401")
    assert text.count(old) == 1
    path = folder / "model.py"
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path, text[: text.index(old)].count("\n") + 1


def test_the_capsule_is_accepted() -> None:
    assert [one.name for one in load(DEFAULT).parameters][-1] == "f_b"


@pytest.mark.parametrize(("old", "new", "said"), WRONG.values(), ids=WRONG)
def test_a_wrong_declaration_is_refused_with_its_line(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    path, line = declared(tmp_path, old, new)
    with pytest.raises(BadDeclaration) as refused:
        load(path)
    text = str(refused.value)
    assert said in text
    assert "\n" not in text
    place, number, _ = text.split(":", 2)
    assert place == str(path)
    assert abs(int(number) - line) <= 1


def test_the_generator_says_it_in_one_line_and_writes_nothing(tmp_path: Path) -> None:
    path, line = declared(tmp_path, "2 * zeta * v_r", "2 * zetta * v_r")
    command = [sys.executable, "-m", "capsule_sym.codegen", "--model", path]
    done = subprocess.run(
        [*command, "--out", tmp_path / "out"], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"error: {path}:{line}: name 'zetta' is not defined\n"
    assert not (tmp_path / "out").exists()
