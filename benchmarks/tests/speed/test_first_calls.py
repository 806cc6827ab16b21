"""`first-calls`: its figures, and that the tools beside it give the same motion."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks.speed import first_calls
from benchmarks.speed.commands import first_calls as command
from capsule_sym import Parameters, simulate


@pytest.mark.parametrize(
    "build", [first_calls._scipy, first_calls._heyoka], ids=["scipy", "heyoka"]
)
def test_the_others_integrate_the_same_motion(build: Any) -> None:
    if build is first_calls._heyoka and find_spec("heyoka") is None:
        assert first_calls.lacking()[0].startswith("heyoka.py is skipped")
        pytest.skip("heyoka.py is not installed")
    run = simulate(Parameters(alpha=1.5, gamma=3.0), periods=3)
    times = np.linspace(0, 3 * run.parameters.period, 500)
    evaluate = build(run)
    np.testing.assert_allclose(evaluate(times), run(times, position=True), rtol=0, atol=1e-9)


def test_a_fit_takes_other_parameters_each_time() -> None:
    one, other = first_calls._fit(), first_calls._fit()
    assert one.shape == other.shape == (2000, 3)
    assert 0 < np.abs(one - other).max() < 1e-3


def test_the_command_prints_every_figure(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    found = [first_calls.Figure("runs", "this map", 2.5, "us", 4.0, None)]
    found += [first_calls.Figure("states", "SciPy", 300.0, "ms", None, 1e-12)]
    monkeypatch.setattr(first_calls, "figures", lambda quick, repeats: iter(found))
    printed = CliRunner().invoke(command, ["--quick"])
    assert printed.exit_code == 0
    for word in ("runs", "2.5", "us", "states", "300", "1e-12", "SciPy", "the least of 3 rounds"):
        assert word in printed.stdout
    kept = CliRunner().invoke(command, ["--json", "--out", str(tmp_path / "kept")])
    record = json.loads(kept.stdout)
    assert (tmp_path / "kept/first-calls.json").read_text(encoding="utf-8") == kept.stdout
    assert record["measured"] == first_calls.how(3)
    assert record["first-calls"] == [figure._asdict() for figure in found]


def test_figures_name_their_goals(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of them in one pass, but for processes and the others' integrations."""
    started = []
    monkeypatch.setattr(first_calls, "_process", lambda *words: started.append(words))
    monkeypatch.setattr(first_calls, "_scipy", lambda run: lambda times: run(times, position=True))
    monkeypatch.setattr(first_calls, "lacking", lambda: ["heyoka.py is skipped"])
    found = list(first_calls.figures(quick=True, repeats=1))
    goals = {figure.unit: figure.goal for figure in found if figure.goal}
    assert set(goals) == {"us", "bytes", "ms"}
    assert [f.error for f in found if f.error is not None] == [0.0]
    assert sum(figure.what.startswith("capsule-sym") for figure in found) == len(
        first_calls._COMMANDS
    )
    assert len(set(started)) == len(first_calls._COMMANDS) + 3
    memory = next(figure for figure in found if figure.unit == "bytes")
    assert 0 < memory.value <= 900


def test_times_are_the_least_of_rounds_through_all_calls(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a machine that is twice as slow in its first round, nobody's time is of that round."""
    now, made = [0.0], []
    monkeypatch.setattr(first_calls, "perf_counter", lambda: now[0])

    def call(name: str, seconds: float) -> None:
        now[0] += seconds * (2 if len(made) < 4 else 1)
        made.append(name)

    calls = {"ours": lambda: call("ours", 1.0), "theirs": lambda: call("theirs", 8.0)}
    assert first_calls._least(calls, 2, {"ours": 3}) == {"ours": 1.0, "theirs": 8.0}
    assert made == 2 * ["ours", "ours", "ours", "theirs"]
