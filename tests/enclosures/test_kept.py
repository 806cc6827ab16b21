"""The kept results of motions from rest: parts without overlap, of which some are proved again."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import pytest

from capsule_sym._enclosures.case import ALPHA
from capsule_sym._enclosures.regions.attraction import attempt
from capsule_sym._enclosures.regions.parts import AlphaPart
from capsule_sym._enclosures.regions.subdivision import FROM_REST, prove

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "benchmarks" / "kept" / "from-rest.jsonl.gz"


def records() -> list[dict]:
    lines = gzip.decompress(KEPT.read_bytes()).splitlines()[1:]
    return [one for one in map(json.loads, lines) if "itinerary" in one]


def share() -> float:
    return sum(AlphaPart(*one["part"]).area for one in records())


def test_their_parts_are_those_of_the_subdivision(tmp_path: Path) -> None:
    """Each is open after the halvings, so that none lies in another one."""
    plane = prove(tmp_path / "again.jsonl", 1e-9, workers=1, task=FROM_REST, plan=KEPT)
    proved = [tuple(one["part"]) for one in records()]
    assert len({*proved}) == len(proved)
    assert {*proved} <= {tuple(part) for *_, part, _ in plane.open}
    assert plane.patches == 0


def test_the_picture_shows_the_share() -> None:
    drawn = json.loads((ROOT / "docs/theory/proved/parts.json").read_text(encoding="utf-8"))
    bars = [one for one in drawn["bars"] if one[2] < 2]
    shown = sum(high - low for low, high, *_ in bars) / 2 / (ALPHA[1] - ALPHA[0])
    assert shown == pytest.approx(share(), abs=1e-4)


@pytest.mark.parametrize("place", [0.2, 0.5, 0.8])
def test_a_part_is_proved_again(place: float) -> None:
    one = records()[int(place * len(records()))]
    assert attempt(AlphaPart(*one["part"])).itinerary == one["itinerary"]
