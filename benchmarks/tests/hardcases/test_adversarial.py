"""The adversarial run: a small one with a fixed seed, its log, and that it sees what is wrong."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import pytest
from click.testing import CliRunner

from benchmarks.hardcases import adversarial, commands
from benchmarks.hardcases.adversarial import CHUNK, Tally, chunk, compare, run
from benchmarks.hardcases.lanes import LaneSwitch
from benchmarks.hardcases.reference import Start
from benchmarks.hardcases.starts import KINDS, RandomStart, random_start
from capsule_sym import Parameters
from capsule_sym._map.backend import Backend
from capsule_sym._native import core
from capsule_sym.results import Segment, Trajectory


def test_a_small_run_agrees_with_50_digits() -> None:
    tally = chunk(20190410, 0)
    assert tally.starts == CHUNK
    assert tally.disagreements == tally.inaccurate == []
    assert tally.undecided == 0
    assert set(tally.kinds) == set(KINDS)
    assert sum(tally.outcomes.values()) == CHUNK
    assert 0 < tally.worst <= 8.0
    # A start that 50 digits had to decide was as close to degenerate as double precision sees.
    assert tally.escalated
    for decade, (starts, escalated, undecided) in tally.distances.items():
        assert undecided <= escalated <= starts
        assert not escalated or float(decade) < 1e-13


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
def test_both_maps_are_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    monkeypatch.setattr(adversarial, "CHUNK", 16)
    tally = chunk(3, 0)
    lanes = [f"c, {width} lanes" for width in core.widths()]
    assert set(tally.backends) == {"c", "c, 106 bits", "numpy", *lanes}
    assert tally.backends["c"] == tally.backends["c, 106 bits"] == 8 * tally.backends["numpy"] == 16
    # A decision of the scalar path does not count for the lanes.
    assert all(tally.alone[name] < 16 for name in lanes)


@pytest.mark.skipif(core is None or not core.widths(), reason="no lanes here")
@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("duration", lambda duration: duration * (1 + 1e-9)),
        ("field", lambda field: field % 6 + 1),
        ("plane", lambda plane: 0),
    ],
)
def test_what_is_wrong_in_lanes_is_seen(
    monkeypatch: pytest.MonkeyPatch, part: str, change: Callable[[Any], Any]
) -> None:
    right = adversarial.first_switch

    def wrong(numbers: Backend, start: Start, lanes: int) -> LaneSwitch | None:
        switch = right(numbers, start, lanes)
        return switch and switch._replace(**{part: change(getattr(switch, part))})

    starts = [random_start(Random(number)) for number in range(8)]
    for problems in ("right", "wrong"):
        tally = Tally()
        for start in starts:
            tally.add(compare(start, (), core.widths()[:1]))
        assert bool(tally.disagreements + tally.inaccurate) == (problems == "wrong")
        monkeypatch.setattr(adversarial, "first_switch", wrong)


def test_starts_are_decided_by_the_seed() -> None:
    assert random_start(Random(5)) == random_start(Random(5))
    assert random_start(Random(5)) != random_start(Random(6))


def judged(backends: list[str]) -> Tally:
    """A few starts, checked."""
    tally = Tally()
    for number in range(20):
        tally.add(compare(random_start(Random(number)), backends))
    return tally


def changed(monkeypatch: pytest.MonkeyPatch, **changes: Callable[[Segment], Any]) -> None:
    """Change the first segment of every run."""
    run_of = Start.run

    def wrong(start: Start, backend: str) -> Trajectory:
        right = run_of(start, backend)
        segment, *others = right.segments
        new = {name: change(segment) for name, change in changes.items()}
        kept = replace(right.kept, segments=(replace(segment, **new), *others))
        return replace(right, kept=kept)

    monkeypatch.setattr(Start, "run", wrong)


@pytest.mark.parametrize(
    ("part", "change", "told"),
    [
        ("duration", lambda segment: segment.duration * (1 + 1e-9), ""),
        ("target", lambda segment: "", ": none, not "),
        ("field", lambda segment: segment.field % 6 + 1, " follows, not "),
    ],
)
def test_a_wrong_time_is_inaccurate_and_another_guard_or_field_a_disagreement(
    monkeypatch: pytest.MonkeyPatch, part: str, change: Callable[[Segment], Any], told: str
) -> None:
    changed(monkeypatch, **{part: change})
    tally = judged(["numpy"])
    if told:
        assert all(told in problem["problem"] for problem in tally.disagreements)
        assert len(tally.disagreements) >= (tally.starts if part == "field" else 1)
    else:
        assert tally.inaccurate
        assert tally.disagreements == []
        assert tally.worst > 8.0


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Chunks that cost nothing, and a list of those that were run."""
    done: list[int] = []

    class Pool:
        def __init__(self, *_: object) -> None: ...
        def submit(self, _: object, seed: int, number: int) -> Any:
            from concurrent.futures import Future

            done.append(number)
            future: Future[Tally] = Future()
            future.set_result(Tally(starts=CHUNK, escalated=number))
            return future

    monkeypatch.setattr(adversarial, "spawning", Pool)
    monkeypatch.setattr(adversarial, "end", lambda pool: None)
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
    assert sum(tally.escalated for tally in tallies) == 0 + 1 + 2 + 3
    assert sorted(quick) == sorted({3, json.loads(lines[-1])["chunk"]})
    assert [json.loads(line)["seed"] for line in log.read_text().splitlines()] == [3] * 4


def test_nothing_is_written_unasked(tmp_path: Path, quick: list[int], monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    for more, written in ([], []), (["--out", "kept"], ["kept", "kept/seed-1.jsonl"]):
        done = CliRunner().invoke(commands.adversarial, ["--count", "1", "--json", *more])
        assert done.exit_code == 0, done.output
        assert sorted(str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")) == written


def test_another_seed_or_other_code_is_not_counted(tmp_path: Path, quick: list[int]) -> None:
    log = tmp_path / "seed.jsonl"
    list(run(CHUNK, 3, log))
    record = json.loads(log.read_text())
    log.write_text(json.dumps(record | {"code": "older"}) + "\n")
    list(run(CHUNK, 4, log))
    list(run(CHUNK, 3, log))
    assert quick == [0, 0, 0]


FAR = """
8.005517636947882 0.16340338027608456 0.5697086193703286 0.019245256635518446 \
976.6609388293903 0.8790428784972293 1.0 0.5697086193703453 \
-1.4115187024955196e-12 -0.733062493831002 36.46196353599948
1.042430998385064 0.10373509837140561 0.055252177425937875 2.0363454664489904 \
2.6950342664405182 0.20477939919751378 1.0 -1.4630867729750057 \
-1.246769137548014 -0.2052432337030519 21.826620829329507
0.6331799372135704 0.15284797209001058 0.001126831664791005 2.0329537369335324 \
481.2351831259979 28.37490364300683 1.0 0.0017492481204302948 \
-5.9462091599294346e-05 0.0 32.10533702043459
"""
"""Parameters, state and phase of starts many expansions before their switch.

The first is a slow forcing in a stiff contact: the impulse of the forcing is a small difference.
The second has two hundred expansions: each adds to the angle and to the duration.
"""


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
@pytest.mark.parametrize("line", FAR.strip().splitlines())
def test_the_core_is_as_accurate_where_a_switch_is_many_expansions_away(line: str) -> None:
    values = [*map(float, line.split())]
    x_r, v_r, v_c, phase = values[7:]
    start = Start(Parameters(*values[:7]), (x_r, v_r, v_c), phase, periods=2, max_segments=1)
    tally = compare(RandomStart("anywhere", 1.0, start), ["c"])
    assert tally.disagreements == tally.inaccurate == []
    assert 0 < tally.worst <= 8.0


def test_only_what_a_verdict_depends_on_counts_as_other_code(tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    texts = (
        '"""One."""\n\ndef f(x):\n    """Two."""\n    return x + 1\n',
        '"""Other."""\n# A comment.\ndef f(x):\n    return x + 1\n',
        '"""One."""\n\ndef f(x):\n    """Two."""\n    return x + 2\n',
    )
    meanings = []
    for text in texts:
        module.write_text(text)
        meanings.append(adversarial._meaning(module))
    assert meanings[0] == meanings[1] != meanings[2]
