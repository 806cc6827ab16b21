"""The adversarial run: a small one with a fixed seed, its log, and that it sees what is wrong."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random
from typing import Any

import pytest

from capsule_sym.hardcases import adversarial
from capsule_sym.hardcases.adversarial import CHUNK, Tally, chunk, compare, run
from capsule_sym.hardcases.starts import KINDS, random_start
from capsule_sym.map.location import Switch


def test_a_small_run_agrees_with_50_digits() -> None:
    tally = chunk(20190410, 0)
    assert tally.starts == CHUNK
    assert tally.disagreements == []
    assert tally.undecided == 0
    assert set(tally.kinds) == set(KINDS)
    assert sum(tally.outcomes.values()) == CHUNK
    assert 0 < tally.worst <= 8.0


def test_starts_are_decided_by_the_seed() -> None:
    assert random_start(Random(5)) == random_start(Random(5))
    assert random_start(Random(5)) != random_start(Random(6))


def test_a_switch_at_a_wrong_time_is_a_disagreement(monkeypatch: pytest.MonkeyPatch) -> None:
    locate = adversarial._Run._locate

    def late(self: Any, *arguments: Any) -> tuple[Any, Switch]:
        flow, switch = locate(self, *arguments)
        if self.numbers.name == "numpy":
            object.__setattr__(switch, "duration", switch.duration * (1 + 1e-9))
        return flow, switch

    monkeypatch.setattr(adversarial._Run, "_locate", late)
    problems = [
        problem["problem"]
        for number in range(20)
        for problem in compare(*random_start(Random(number))).disagreements
    ]
    assert problems
    assert all("off by" in problem for problem in problems)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Chunks that cost nothing, and a list of those that were run."""
    done: list[int] = []

    class Pool:
        def __init__(self, *_: object) -> None: ...
        def __enter__(self) -> Pool:
            return self

        def __exit__(self, *_: object) -> None: ...
        def shutdown(self, **_: object) -> None: ...
        def submit(self, _: object, seed: int, number: int) -> Any:
            from concurrent.futures import Future

            done.append(number)
            future: Future[Tally] = Future()
            future.set_result(Tally(starts=CHUNK, settled=number))
            return future

    monkeypatch.setattr(adversarial, "ProcessPoolExecutor", Pool)
    return done


def test_an_interrupted_run_goes_on_where_it_stopped(tmp_path: Path, quick: list[int]) -> None:
    log = tmp_path / "results" / "seed-3.jsonl"
    assert len(list(run(3 * CHUNK, 3, log))) == 3
    assert sorted(quick) == [0, 1, 2]
    text = log.read_text()
    lines = text.splitlines()
    assert {json.loads(line)["chunk"] for line in lines} == {0, 1, 2}
    # Killed in the middle of its last line.
    log.write_text(text[:-20])
    quick.clear()
    tallies = list(run(4 * CHUNK, 3, log))
    assert len(tallies) == 4
    assert sum(tally.settled for tally in tallies) == 0 + 1 + 2 + 3
    assert sorted(quick) == sorted({3, json.loads(lines[-1])["chunk"]})
    assert [json.loads(line)["seed"] for line in log.read_text().splitlines()] == [3] * 4


def test_another_seed_or_another_kernel_is_not_counted(tmp_path: Path, quick: list[int]) -> None:
    log = tmp_path / "seed.jsonl"
    list(run(CHUNK, 3, log))
    record = json.loads(log.read_text())
    log.write_text(json.dumps(record | {"digest": "older"}) + "\n")
    list(run(CHUNK, 4, log))
    list(run(CHUNK, 3, log))
    assert quick == [0, 0, 0]
