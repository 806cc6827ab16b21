"""Table of the goals reached, from the records."""

from __future__ import annotations

import copy
import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from benchmarks import reached
from benchmarks.reached import (
    ATTRACTION,
    ENCLOSED,
    FASTEST,
    HORSESHOE,
    MUTATIONS,
    REGIONS,
    TAMPERING,
    WEAKENINGS,
    rows,
)
from capsule_sym._symbolic import verify
from capsule_sym._symbolic.proofs.items import Result
from paper.claims import frozen

SECTION = {
    "thresholds": [{"radius": 1e-92, "coefficient": "0.5"}] * 8,
    "unproved": 3e-12,
    "failed": "",
}
GOOD: dict[Path, Any] = {
    MUTATIONS: {"changes": 1562, "survive": 0},
    ENCLOSED: {"sections": [SECTION, SECTION], "orbit_seconds": 0.1, "seconds": 150.0},
    REGIONS: {"share": 0.99951, "work": 14000.0},
    ATTRACTION: {"share": 1 - 4e-10, "work": 4000.0},
    FASTEST: {"share": 0.3, "work": 100.0},
    WEAKENINGS: {"weakenings": 486, "survive": 0},
    TAMPERING: {"kinds": 120, "trials": 2000, "accepted": 0},
    HORSESHOE: {"entropy": 0.3222},
}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write(records: dict[Path, Any]) -> None:
    for path, held in records.items():
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps(held) + "\n")


@cache
def results() -> list[Result]:
    item = verify.SECTIONS["Table 2 as derived"]()[0]
    return [Result(item, item.verdict, {}, 0.0)]


@pytest.mark.usefixtures("here")
def test_without_records_nothing_is_said_to_be_reached() -> None:
    own, *others = rows(results(), 100.0)
    assert own.met
    assert [row.met for row in others] == [None] * 12
    assert all(row.source.startswith("make ") for row in others)


@pytest.mark.usefixtures("here")
def test_goals_are_met_by_good_records() -> None:
    write(GOOD)
    told = rows(results(), 100.0)
    assert [row.met for row in told] == [True] * 13
    assert told[6].reached.startswith("99.95%")


BAD = {
    "a change survives": (MUTATIONS, lambda held: held.update(survive=1), 2),
    "too few changes": (MUTATIONS, lambda held: held.update(changes=149), 2),
    "a bifurcation is missing": (
        ENCLOSED,
        lambda held: held["sections"][0]["thresholds"].pop(),
        3,
    ),
    "one is wide": (
        ENCLOSED,
        lambda held: held["sections"][1].update(
            thresholds=[{"radius": 1e-29, "coefficient": "1"}] * 8
        ),
        3,
    ),
    "a gap is left": (ENCLOSED, lambda held: held["sections"][1].update(unproved=1e-10), 5),
    "an interval failed": (ENCLOSED, lambda held: held["sections"][0].update(failed="gluing"), 5),
    "a patch is missing": (REGIONS, lambda held: held.update(share=0.9989), 6),
    "it took too long": (REGIONS, lambda held: held.update(work=14401.0), 6),
    "slow": (ENCLOSED, lambda held: held.update(orbit_seconds=0.21), 7),
    "too many begin elsewhere": (ATTRACTION, lambda held: held.update(share=1 - 6e-10), 8),
    "no drive is proved": (FASTEST, lambda held: held.update(share=0.0), 9),
    "a weakening survives": (WEAKENINGS, lambda held: held.update(survive=1), 10),
    "too few weakenings": (WEAKENINGS, lambda held: held.update(weakenings=96), 10),
    "one tampered is accepted": (TAMPERING, lambda held: held.update(accepted=1), 11),
    "too few kinds": (TAMPERING, lambda held: held.update(kinds=99), 11),
    "no entropy": (HORSESHOE, lambda held: held.update(entropy=0.0), 12),
    "long": (ENCLOSED, lambda held: held.update(seconds=201.0), 1),
    "a coefficient is missing": (
        ENCLOSED,
        lambda held: held["sections"][1].update(
            thresholds=[{"radius": 1e-92, "coefficient": None}] * 8
        ),
        4,
    ),
}


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("name", BAD)
def test_each_goal_is_missed_by_a_worse_record(name: str) -> None:
    path, spoil, place = BAD[name]
    records = copy.deepcopy(GOOD)
    spoil(records[path])
    write(records)
    told = rows(results(), 100.0)
    assert told[place].met is False
    assert sum(row.met is not True for row in told) == 1


@pytest.mark.usefixtures("here")
def test_statements_that_fail_or_take_long_miss_their_goal() -> None:
    (good,) = results()
    assert not rows([Result(good.item, "failed", {}, 0.0)], 100.0)[0].met
    write(GOOD)
    assert rows([good], 151.0)[1].met is False


@pytest.mark.usefixtures("here")
def test_a_damaged_record_is_said_to_be_unreadable() -> None:
    write(GOOD)
    ENCLOSED.write_text("{")
    told = rows(results(), 100.0)
    assert [row.met for row in told] == [
        *(True, None, True, None, None, None, True, None),
        *[True] * 5,
    ]
    assert told[3].reached == "unreadable record"


@pytest.mark.usefixtures("here")
def test_the_command_proves_and_shows_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    write(GOOD)
    (one,) = results()
    monkeypatch.setattr(verify, "items", lambda: {"one": (one.item,)})
    expected = frozen.Expected({one.item.id: one.status}, {})
    monkeypatch.setattr(frozen, "expected", lambda: expected)
    found = CliRunner().invoke(reached.verify)
    assert found.exit_code == 0
    assert one.item.id.startswith("table2.")
    assert one.item.statement in found.stdout
    assert "1 of 1" in found.stderr
    assert "16 of 16, within 1e-92" in found.stderr
