"""Presets of the explorer's page, which come from the case study."""

import json
import runpy
from pathlib import Path

import pytest

EXPLORER = Path(__file__).parents[2] / "explorer"


def test_presets_of_the_explorer_are_the_case_study() -> None:
    kept = json.loads((EXPLORER / "presets.json").read_text(encoding="utf-8"))
    made = runpy.run_path(str(EXPLORER / "presets.py"))["presets"]()
    exact = [(one.pop("alpha"), two.pop("alpha")) for one, two in both(made, kept)]
    assert made == kept
    assert [one for one, _ in exact] == pytest.approx([two for _, two in exact], rel=1e-13)


def both(made: dict, kept: dict) -> list[tuple[dict, dict]]:
    return list(zip(made["bifurcations"], kept["bifurcations"], strict=True))
