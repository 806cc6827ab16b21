"""`scenes`: its figures, of every scene that ships."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks.speed import scenes
from benchmarks.speed.commands import scenes as command
from capsule_sym._native import core
from capsule_sym._parameters import SHIPPED


def test_the_command_prints_every_scene(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = [scenes.Speed("slope", "random", 4.5, 0.25, 1.06, 0.24, 1.01)]
    monkeypatch.setattr(scenes, "speeds", lambda quick, rounds: iter(found))
    printed = CliRunner().invoke(command, ["--quick"])
    assert printed.exit_code == 0
    for word in ("slope", "random", "4.50", "0.250", "1.06", "1.01", "median of 9 rounds", "1.3"):
        assert word in printed.stdout
    kept = CliRunner().invoke(command, ["--json", "--out", str(tmp_path / "kept")])
    assert (tmp_path / "kept/scenes.json").read_text(encoding="utf-8") == kept.stdout
    assert json.loads(kept.stdout)["scenes"] == [found[0]._asdict()]


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
def test_a_ratio_is_of_the_same_round(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rounds take 1, 2, 3, ... seconds on a machine that becomes slow: ratios stay about one."""
    taken = iter([1.0 + n // 20 for n in range(10**4)])  # all scenes' calls of a round alike
    monkeypatch.setattr(scenes, "_time", lambda call: next(taken))
    monkeypatch.setattr(scenes, "_switches", lambda rows, periods: len(rows))
    found = list(scenes.speeds(quick=True, rounds=4))
    assert [one.scene for one in found] == [*SHIPPED, *SHIPPED]
    assert {one.ratio for one in found} == {one.many_ratio for one in found} == {1.0}
