"""Proofs about any scene, shipped or not; no mutation survives."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from capsule_sym import InvalidInput
from capsule_sym._commands.verify import _theory
from capsule_sym._symbolic import verify
from capsule_sym._symbolic.model import declaration
from tests.sampling import sampled, some
from tests.symbolic.broken import FURTHER, MUTATIONS, survivors

_ROOT = Path(__file__).parents[2]
_ANY_SCENE = ("cells", "basis", "flow", "graph", "saltation", "energy")


def _verify(scene: str, *options: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-m", "capsule_sym", "verify", "--scene", scene, *options]
    return subprocess.run(line, capture_output=True, text=True, timeout=600, cwd=_ROOT, check=False)


@sampled
@pytest.mark.parametrize("name", some(MUTATIONS, 6))
def test_mutations_are_noticed(name: str) -> None:
    assert survivors(MUTATIONS[name]) == []


@pytest.mark.long
def test_unchanged_derivation_is_not_noticed() -> None:
    """The run can fail: what is not changed is proved."""
    same = replace(MUTATIONS["a Jacobian"], value=MUTATIONS["a Jacobian"].owner._rows)
    assert survivors(same) == ["jacobian"]


@pytest.mark.long
def test_mutations_of_two_stops_and_pulses_are_noticed() -> None:
    names = [*FURTHER, "a guard is missing", "a spring pulls", "the ratio of a landing"]
    line = [sys.executable, "-m", "tests.symbolic.broken", "prototype", *names]
    told = subprocess.run(line, capture_output=True, text=True, cwd=_ROOT, check=True, timeout=600)
    assert json.loads(told.stdout) == {name: [] for name in (*names, "changed claims")}


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    [
        *declaration.SHIPPED,
        "tests/scenes/two_stops.py",
        "tests/scenes/pulsed.py",
        "tests/secondmodel/biased.py",
    ],
)
def test_every_scene_is_proved(name: str) -> None:
    result = _verify(name, "--json")
    assert result.returncode == 0, result.stderr
    items = json.loads(result.stdout)["items"]
    statuses = {(one["id"].partition(".")[0], one["status"]) for one in items}
    groups = {group: one.families.split() for group, one in verify.GROUPS.items()}
    general = {family for group in _ANY_SCENE for family in groups[group]}
    assert {status for family, status in statuses if family in general} == {"proved"}
    own = groups if name == "capsule" else _ANY_SCENE
    assert {family for family, _ in statuses} == {family for one in own for family in groups[one]}


def test_a_scene_is_proved_in_a_process_of_its_own(tmp_path: Path) -> None:
    path = tmp_path / "report.md"
    result = _verify("tests/scenes/pulsed.py", "--only", "flow.F12.field", "--out", str(path))
    assert result.returncode == 0, result.stderr
    *lines, heads, _, row = result.stdout.strip().splitlines()
    assert all(line.startswith("proved") for line in lines)
    assert heads.split() == ["group", "about", "proved", "failed", "s"]
    assert row.split()[0] == "flow"
    report = path.read_text(encoding="utf-8")
    assert "of the scene pulsed" in report
    assert "`flow.F12.field.guard1`" in report


def test_wrong_lines_are_refused_in_one_line(tmp_path: Path) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("model = 1\n", encoding="utf-8")
    result = _verify(str(broken))
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1
    with pytest.raises(InvalidInput, match=r"nothing.*capsule, slope"):
        _theory("nothing")
