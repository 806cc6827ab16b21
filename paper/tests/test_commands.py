"""The commands of `python -m paper`, and all of them in one go."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import click
import pytest

from paper.commands import everything
from paper.study import casestudy, thresholds


def test_json_is_one_object_and_what_is_written(inside_paper, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(casestudy, "PANELS", {"f": 0.7})
    monkeypatch.setattr(thresholds, "GAMMAS", (3.0,))
    monkeypatch.setattr(thresholds, "LAST", 0.05)
    done = inside_paper("case-study", "--json", "--out", "kept", cwd=tmp_path)
    assert done.returncode == 0
    record = json.loads(done.stdout)
    assert list(record) == ["version", "generated", "backend", "start", "cases", "bifurcations"]
    assert [case["parameters"]["gamma"] for case in record["cases"]] == [3.3, 3.0]
    assert (tmp_path / "kept/casestudy.json").read_text(encoding="utf-8") == done.stdout


def test_an_interrupt_is_one_line_and_leaves_nothing(tmp_path: Path) -> None:
    code = (
        "import sys\n"
        "from paper.__main__ import group, main\n"
        "from paper.study import casestudy\n"
        "run = casestudy.run\n"
        "def announced():\n"
        "    print('running', file=sys.stderr, flush=True)\n"
        "    yield from run()\n"
        "casestudy.run = announced\n"
        "main(['case-study', '--json'], group)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])},
    )
    assert process.stderr is not None
    assert process.stderr.readline() == "running\n"
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    assert (process.returncode, stdout, stderr) == (130, "", "error: interrupted\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("case-study --alpha 1", "--alpha"),
        (f"case-study --out {__file__}/new", "not a writable directory"),
        ("report --out taken/below.html", "taken is not a writable directory"),
        ("report --scene slope", "No such option '--scene'"),
        ("jog", "jog"),
    ],
)
def test_bad_input_is_one_line_and_status_2(line, told, inside_paper, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("")
    done = inside_paper(*line.split(), cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert told in done.stderr


@pytest.fixture
def begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Commands that were begun, in an empty folder; each writes or prints a little."""
    monkeypatch.chdir(tmp_path)
    commands: list[str] = []
    printed = {
        "claims": {"items": [{"id": "a", "status": "refuted"}]},
        "verify": {"items": [{"id": "a", "status": "proved"}, {"id": "b", "status": "proved"}]},
        "hardcases": {"cases": [1]},
    }
    written = {"case-study": "results/paper/casestudy.json", "report": "results/report.html"}

    def begin(*words: str, out: int | None = subprocess.PIPE) -> Any:
        commands.append(words[1])
        if words[1] in written:
            code = (
                "import pathlib, sys; path = pathlib.Path(sys.argv[1]);"
                "path.parent.mkdir(parents=True, exist_ok=True); path.write_text('{}')"
            )
            line = [sys.executable, "-c", code, written[words[1]]]
        else:
            line = [sys.executable, "-c", f"print({json.dumps(printed[words[1]])!r})"]
        return subprocess.Popen(line, stdout=out, text=True)

    monkeypatch.setattr(everything, "_begin", begin)
    return commands


def test_everything_is_written_once(begun: list[str]) -> None:
    everything.write_everything()
    assert begun == ["case-study", "claims", "verify", "hardcases", "report"]
    items = json.loads(Path("results/verify.json").read_text(encoding="utf-8"))["items"]
    assert [(one["id"], one["status"]) for one in items] == [("a", "refuted"), ("b", "proved")]
    assert json.loads(Path("results/hardcases.json").read_text(encoding="utf-8")) == {"cases": [1]}
    begun.clear()
    everything.write_everything()
    assert begun == []
    # A file older than its sources is made again, and so is what is made of it.
    Path("results/hardcases.json").unlink()
    everything.write_everything()
    assert begun == ["hardcases", "report"]
    os.utime("results/paper/casestudy.json", (0, 0))
    begun.clear()
    everything.write_everything()
    assert begun == ["case-study", "report"]


def test_a_command_that_fails_ends_everything(begun: list[str], monkeypatch) -> None:
    begin = everything._begin

    def fail(*words: str, **out: Any) -> Any:
        failing = [sys.executable, "-c", "raise SystemExit(3)"]
        ends = words[1] == "verify"
        return subprocess.Popen(failing, stdout=-1, text=True) if ends else begin(*words, **out)

    monkeypatch.setattr(everything, "_begin", fail)
    with pytest.raises(click.exceptions.Exit) as ended:
        everything.write_everything()
    assert ended.value.exit_code == 3
    assert not Path("results/verify.json").exists()
    assert not Path("results/report.html").exists()
