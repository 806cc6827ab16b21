"""The printed data of Section 4, and the job that computes the exact ones."""

import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from capsule_sym import InvalidInput, Parameters, simulate
from paper import printed as paper
from paper.study import casestudy

PRINTED = paper.section_4(paper.read())
LOCAL_MAP = re.compile(r"P_\{Σ(10|[1-9]),F([1-6]),Σ(10|[1-9])\}")
# The field that holds in the subspace which each switching plane belongs to or leads into.
FIELD_AFTER = {1: "1", 2: "2", 3: "3", 4: "4", 5: "5", 6: "6", 7: "4", 8: "1", 9: "6", 10: "3"}


@pytest.mark.parametrize("row", PRINTED[1:], ids=lambda row: row.high)
def test_a_printed_map_is_a_cycle_of_local_maps(row: paper.Row) -> None:
    segments = [LOCAL_MAP.fullmatch(part) for part in casestudy.local_maps(row.map)]
    planes = [(int(segment[3]), segment[2], int(segment[1])) for segment in segments if segment]
    assert len(planes) == len(segments) >= 2
    for source, field, _ in planes:
        assert FIELD_AFTER[source] == field
    for (_, _, target), (source, _, _) in pairwise([*planes, planes[0]]):
        assert target == source


def test_the_first_printed_map_is_the_identity() -> None:
    assert PRINTED[0].map == "Id_{Σ2,F2,Σ2}"


def test_the_printed_intervals_follow_one_another_up_to_2() -> None:
    for row, following in pairwise(PRINTED):
        # One value of alpha belongs to one row: an open end is closed by a map of its own.
        assert float(following.high) > float(row.high) or (following.closed and not row.closed)
    assert float(PRINTED[-1].high) == 2
    assert PRINTED[-1].closed


# Fields in order of time, as the captions and the text around Fig. 7 describe the panels.
IN_WORDS = {
    "a": "2",
    "b": "52",
    "c": "52",
    "d": "5452",
    "e": "542",
    "f": "5412",
    "g": "5412",
    "h": "541232",
    "i": "54123",
    "j": "541236",
    "k": "541236",
    "l": "41236",
    "m": "41236",
    "n": "413236",
    "o": "413236",
    "p": "4136",
}


@pytest.mark.parametrize(("panel", "fields"), IN_WORDS.items())
def test_each_panel_has_its_printed_map(panel: str, fields: str) -> None:
    maps = casestudy.local_maps(paper.row_at(paper.read(), casestudy.PANELS[panel]).map)
    assert "".join(part.split(",")[1][1] for part in maps) == fields


@pytest.mark.parametrize("alpha", [0.0, -0.1, 2.0000001, float("nan")])
def test_nothing_is_printed_outside_the_interval(alpha: float) -> None:
    with pytest.raises(InvalidInput, match=r"alpha = .*: must be in \(0, 2\]"):
        paper.row_at(paper.read(), alpha)


def test_a_motion_has_no_first_local_map() -> None:
    a, b, c = "P_{Σ2,F5,Σ5}", "P_{Σ3,F2,Σ2}", "P_{Σ5,F3,Σ3}"
    assert casestudy.same_motion(f"{c} ∘ {b} ∘ {a}", f"{b} ∘ {a} ∘ {c}")
    assert not casestudy.same_motion(f"{c} ∘ {b} ∘ {a}", f"{a} ∘ {b} ∘ {c}")
    assert not casestudy.same_motion(f"{b} ∘ {a}", f"{b} ∘ {a} ∘ {b} ∘ {a}")


def test_a_motion_that_does_not_settle_is_said_not_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(casestudy, "_BLOCK", 1)
    monkeypatch.setattr(casestudy, "_MOST_PERIODS", 3)
    case = next(casestudy.run())
    assert (case.periods, case.motion, case.agrees) == (3, None, False)
    [row] = casestudy.record([case])["cases"]
    assert (row["global_map"], row["segments"], row["agrees"]) == (None, [], False)


@pytest.fixture(scope="module")
def small() -> dict[str, Any]:
    motion = simulate(Parameters(), periods=64).steady()
    return casestudy.record([casestudy.Case("f", Parameters(), 64, motion)])


def test_an_interrupted_write_leaves_the_older_file_whole(
    small: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    casestudy.write(small, tmp_path)
    before = {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()}

    def interrupted(self: Path, target: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        casestudy.write(small | {"version": "another"}, tmp_path)
    assert {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == before


def test_results_that_cannot_be_written_are_refused(small: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "results").write_text("a file, not a directory")
    with pytest.raises(InvalidInput, match=r"out = '.*paper/.*': must be writable"):
        casestudy.write(small, tmp_path / "results" / "paper")
