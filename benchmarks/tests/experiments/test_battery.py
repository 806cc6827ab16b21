"""Samples of the batteries: random motions are found, branches are those of brute force."""

from pathlib import Path

import pytest

from benchmarks.experiments import branches, motions


@pytest.mark.parametrize("number", range(0, 1000, 50))
def test_a_random_periodic_motion_is_found(number: int) -> None:
    one = motions.judged(number)
    assert one["found"] or one["periods"] is None, one


@pytest.mark.parametrize("number", [11, 20, pytest.param(0, marks=pytest.mark.long)])
def test_a_branch_has_the_events_of_brute_force(number: int) -> None:
    # The branch 0 is of doubled orbits; its parameter turns back within the step over their end.
    one = branches.judged(number)
    assert one["wrong"] == []
    assert one["agreed"] > 10
    assert (one["status"] == "period-halved") == (number == 0)


def test_a_battery_goes_on_where_it_ended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked: list[int] = []

    def judged(number: int) -> dict[str, object]:
        asked.append(number)
        return {"number": number, "periods": 1, "found": number != 2, "message": "x", "seconds": 0}

    monkeypatch.setattr(motions, "judged", judged)
    path = tmp_path / "motions.jsonl"
    assert motions.check(2, path) == 0
    assert motions.check(3, path) == 1
    assert asked == [0, 1, 2]
    assert "2: 1 periods, not found: x" in capsys.readouterr().out
