"""The kept results: parts without overlap, shown in the picture, of which some are proved again."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import pytest

from capsule_sym._enclosures.case import ALPHA, GAMMA
from capsule_sym._enclosures.regions import attraction, patches
from capsule_sym._enclosures.regions.parts import AlphaPart, Patch
from capsule_sym._enclosures.regions.subdivision import FROM_REST, PLANE, Task, prove

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "benchmarks" / "kept"
TASKS = {"from-rest": FROM_REST, "regions": PLANE}


def records(name: str) -> list[dict]:
    lines = gzip.decompress((KEPT / f"{name}.jsonl.gz").read_bytes()).splitlines()[1:]
    return [one for one in map(json.loads, lines) if "itinerary" in one]


def share(name: str) -> float:
    return sum(TASKS[name].part(*one["part"]).area for one in records(name))


def drawn(bars: str) -> list[list[float]]:
    path = ROOT / "docs/theory/proved/parts.json"
    return json.loads(path.read_text(encoding="utf-8"))[bars]


@pytest.mark.parametrize(("name", "task"), TASKS.items())
def test_their_parts_are_those_of_the_subdivision(name: str, task: Task, tmp_path: Path) -> None:
    """Each is open after the halvings, so that none lies in another one."""
    kept = KEPT / f"{name}.jsonl.gz"
    plane = prove(tmp_path / "again.jsonl", 1e-9, workers=1, task=task, plan=kept)
    proved = [tuple(one["part"]) for one in records(name)]
    assert len({*proved}) == len(proved)
    assert {*proved} <= {tuple(part) for *_, part, _ in plane.open}
    assert plane.patches == 0


def test_the_picture_shows_the_share_from_rest() -> None:
    shown = sum(high - low for low, high, bottom, *_ in drawn("bars") if bottom < 2)
    assert shown / 2 / (ALPHA[1] - ALPHA[0]) == pytest.approx(share("from-rest"), abs=1e-4)


def test_the_picture_shows_the_share_of_the_plane() -> None:
    shown = sum((b - a) * (d - c) for a, b, c, d, _ in drawn("plane"))
    whole = (ALPHA[1] - ALPHA[0]) * (GAMMA[1] - GAMMA[0])
    assert shown / whole == pytest.approx(share("regions"), abs=1e-4)


@pytest.mark.parametrize("place", [0.2, 0.5, 0.8])
def test_a_part_from_rest_is_proved_again(place: float) -> None:
    one = records("from-rest")[int(place * len(records("from-rest")))]
    assert attraction.attempt(AlphaPart(*one["part"])).itinerary == one["itinerary"]


@pytest.mark.parametrize("place", [0.1, 0.3, 0.5, 0.7, 0.9])
@pytest.mark.parametrize("curve", [False, True])
def test_a_patch_of_the_plane_is_proved_again(place: float, curve: bool) -> None:
    """Its motion begins from rest here, and in the kept run from that of a larger patch."""
    chosen = [one for one in records("regions") if ("|" in one["itinerary"]) == curve]
    one = chosen[int(place * len(chosen))]
    assert patches.attempt(Patch(*one["part"]), (0.0, 0.0, 0.0)).itinerary == one["itinerary"]
