"""`bench`: JSON, columns, ratios, goals, and bad input."""

import json
import math
import os
import subprocess
import sys
from importlib.util import find_spec

import pytest
from click.testing import CliRunner

from benchmarks.__main__ import group
from benchmarks.speed import goals, model, reference, roots, study, tools
from benchmarks.speed.commands import bench
from benchmarks.speed.compare import Row
from benchmarks.speed.peers import compiled, own
from benchmarks.speed.ratios import Ratio
from benchmarks.speed.scaling import Growth
from benchmarks.speed.study import Study
from benchmarks.speed.tools import ONE_ROW, OURS, OWN, WHOLE
from capsule_sym._cli import main
from capsule_sym._native import core
from tests.examples import ROOT

PARTS = ("trajectory", "tangencies", "sweep")

needs_cc = pytest.mark.skipif(compiled.compiler() is None, reason="there is no C compiler cc")
needs_core = pytest.mark.skipif(core is None, reason="the C core was not compiled")


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bench")
    only = "SciPy RK45" if compiled.compiler() is None else " in C"
    line = ("bench", "--quick", "--repeats", "1", "--only", only, "--out", "results/bench")
    process = subprocess.run(
        [sys.executable, "-m", "benchmarks", *line],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        encoding="utf-8",
    )
    assert process.returncode == 0, process.stderr
    return folder, process


@pytest.fixture(scope="module")
def record(done):
    return json.loads((done[0] / "results/bench/part.json").read_text("utf-8"))


def rows(record, part, tool):
    return {row["setting"]: row for row in record[part] if row["tool"] == tool}


KEYS = ["version", "machine", "versions", "repeats", "quick", "skipped", *PARTS, "ratios"]
KEYS += ["goals", "growth", "widths", "roots"]


def test_json_is_what_the_file_has(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Study, "turns", lambda study: {"trajectory": 1})
    ran = CliRunner().invoke(bench, ["--quick", "--repeats", "1", "--only", OURS, "--json"])
    assert ran.exit_code == 0, ran.output
    assert list(tmp_path.iterdir()) == []  # nothing is written unasked
    record = json.loads(ran.stdout)
    ran = CliRunner().invoke(bench, ["--quick", "--repeats", "1", "--only", OURS, "--out", "kept"])
    assert ran.exit_code == 0, ran.output
    assert json.loads((tmp_path / "kept/part.json").read_text("utf-8")).keys() == record.keys()
    assert list(record) == KEYS
    assert record["trajectory"]


def test_the_file_has_the_documented_keys(done, record) -> None:
    assert "wrote results/bench/part.json" in done[1].stderr
    assert list(record) == KEYS
    assert record["quick"] is True
    assert record["repeats"] == 1
    for part in PARTS:
        assert record[part]
        assert all(list(row) == list(Row._fields) for row in record[part])
        assert all(row["us_per_period"] > 0 for row in record[part])
    assert all(list(ratio) == list(Ratio._fields) for ratio in record["ratios"])
    assert all(list(row) == list(Growth._fields) for row in record["growth"])
    assert record["versions"]["numpy"]
    assert record["machine"]["processor"]


def test_peers_that_are_absent_are_named(record, done) -> None:
    absent = [name for name in ("heyoka", "sksundae") if find_spec(name) is None]
    for name in absent:
        assert any(f"{name} is not installed" in line for line in record["skipped"])
    assert [line for line in record["skipped"] if "not installed" in line] == [
        line for line in done[1].stderr.splitlines() if "not installed" in line
    ]
    assert sum("not installed" in line for line in record["skipped"]) == len(absent)


def test_a_compiler_that_fails_is_named(monkeypatch) -> None:
    def fail() -> None:
        raise OSError("cc: no such option")

    monkeypatch.setattr(compiled, "_library", fail)
    monkeypatch.setattr(compiled, "compiler", lambda: "cc")
    study = Study(1, "", quick=True)
    assert "DOP853 and RK4 in C is skipped: cc: no such option" in study.skipped


def test_a_peer_that_is_absent_has_no_rows_but_a_line(monkeypatch) -> None:
    monkeypatch.setattr(tools, "_is_there", lambda package: False)
    monkeypatch.setattr(compiled, "compiler", lambda: None)
    study = Study(1, "", quick=True)
    names = {tool.name for tool in study.single + study.many}
    assert not [n for n in names if n.startswith(("heyoka", "CVODE")) or n.endswith(" in C")]
    assert "SciPy DOP853" in names
    lines = study.skipped
    assert (
        "CVODE is skipped: sksundae is not installed (python -m pip install --group peers)" in lines
    )
    assert "DOP853 and RK4 in C is skipped: there is no C compiler cc" in lines


@needs_core
@pytest.mark.parametrize("part", PARTS)
def test_this_map_has_no_wrong_switch_and_full_accuracy(record, part) -> None:
    (row,) = rows(record, part, OURS).values()
    assert (row["missed"], row["invented"], row["locked"]) == (0, 0, 0)
    assert row["max_error"] < 1e-12
    assert row["compared"] == row["runs"] > 0


@needs_cc
def test_a_loose_tool_shows_its_errors_and_wrong_switches(record) -> None:
    found = rows(record, "tangencies", "RK4 in C")
    assert found["100 steps a period"]["missed"] > 0
    assert found["100 steps a period"]["max_error"] > 1e-3
    sharp = rows(record, "tangencies", "DOP853 in C")
    assert sharp["1e-06, ends of steps"]["missed"] > sharp["1e-13, inside steps"]["missed"]


@needs_cc
def test_an_independent_integrator_confirms_the_truth(record) -> None:
    for part in ("trajectory", "sweep"):
        row = rows(record, part, "DOP853 in C")["1e-13, inside steps"]
        assert (row["missed"], row["invented"], row["locked"]) == (0, 0, 0)
        assert row["max_error"] < 1e-11


@needs_core
@needs_cc
def test_ratios_follow_from_the_rows(record) -> None:
    by_part = {part: [r for r in record["ratios"] if r["part"] == part] for part in PARTS}
    assert not by_part["tangencies"]
    for part in ("trajectory", "sweep"):
        ours = rows(record, part, OURS)["double"]["us_per_period"]
        for ratio in by_part[part]:
            of_tool = rows(record, part, ratio["tool"])
            assert ratio["ratio"] == of_tool[ratio["setting"]]["us_per_period"] / ours
            if ratio["max_error"] is not None:
                kept = [r for r in of_tool.values() if r["max_error"] <= ratio["max_error"]]
                fastest = min(kept, key=lambda r: r["us_per_period"])
                assert ratio["setting"] == fastest["setting"]
                assert ratio["wanted"] is None
    named = [(r["tool"], r["setting"], r["wanted"]) for r in record["ratios"] if r["wanted"]]
    assert ("DOP853 in C", "1e-13, inside steps", 10.0) in named
    threads = {
        g["value"]: g["us_per_period"] for g in record["growth"] if g["against"] == "threads"
    }
    (two,) = (r for r in record["ratios"] if r["part"] == "threads")
    assert (two["ratio"], two["wanted"]) == (threads[1] / threads[2], 1.8)


@needs_core
@needs_cc
def test_goals_follow_from_the_rows(record) -> None:
    by_what = {goal["what"]: goal for goal in record["goals"]}
    sharp = rows(record, "trajectory", "DOP853 in C")["1e-13, inside steps"]["us_per_period"]
    for tool, what, goal in (
        (OURS, "20 periods from rest, one call a run", 20),
        (WHOLE, "the same, all segments kept", 6),
        (ONE_ROW, "the same by simulate_many, one row a call", 12),
    ):
        (ours,) = rows(record, "trajectory", tool).values()
        assert by_what[what]["value"] == sharp / ours["us_per_period"]
        assert by_what[what]["goal"] == goal
    (near,) = rows(record, "tangencies", OURS).values()
    assert by_what["beside tangencies"]["value"] == near["us_per_period"]
    for goal in record["goals"]:
        more = goal["value"] - goal["goal"]
        assert goal["met"] == (more >= 0 if goal["relation"] == ">=" else more <= 0)
    assert {"wrong, double", "wrong, 106 bits"} <= by_what.keys()
    assert all(goal["met"] for what, goal in by_what.items() if what.startswith("wrong"))


@needs_core
def test_a_width_that_misses_a_switch_is_counted(monkeypatch) -> None:
    cases = reference.cases("case study")[:2]
    assert all(width.wrong == 0 for width in goals.widths(cases))
    monkeypatch.setattr(
        own,
        "simulated_wide",
        lambda starts: [model.Result(c.truth.itinerary[2:], None) for c in cases],
    )
    monkeypatch.setattr(own, "side_by_side", lambda starts, lanes: [(0.1, 0.0, math.nan)] * 2)
    assert next(width.wrong for width in goals.widths(cases)) == 4
    assert all(width.wrong == 2 for width in goals.widths(cases)[1:])


def test_newton_and_brent_find_the_same_switches(record) -> None:
    found = {(root["method"], root["tolerance"]): root for root in record["roots"]}
    for tolerance in roots.TOLERANCES:
        for method in ("Brent", "Newton"):
            assert found[method, tolerance]["max_error"] < 4 * max(tolerance, 1e-15)
        newton, brent = (found[name, tolerance]["evaluations"] for name in ("Newton", "Brent"))
        assert 1 <= newton <= brent


@pytest.mark.parametrize(
    ("arguments", "named"),
    [(("--repeats", "0"), "--repeats"), (("--only", "nothing"), "nothing"), (("--bad",), "--bad")],
)
def test_bad_input_exits_with_2(tmp_path, monkeypatch, capsys, arguments, named) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stopped:
        main(("bench", *arguments), group)
    assert stopped.value.code == 2
    written = capsys.readouterr()
    assert named in written.err
    assert "Traceback" not in written.err
    assert written.out == ""


@needs_core
def test_an_interrupted_study_leaves_the_parts_that_were_done(tmp_path) -> None:
    study = Study(repeats=1, only=OURS, quick=True)
    turns = []
    study.run("trajectory", lambda: turns.append(1))
    assert len(turns) == study.turns()["trajectory"]
    study.write(tmp_path / "bench.json")

    def interrupt() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        study.run("tangencies", interrupt)
    kept = json.loads((tmp_path / "bench.json").read_text("utf-8"))
    assert [row["tool"] for row in kept["trajectory"]] == [*OWN]
    assert kept["tangencies"] == kept["sweep"] == kept["growth"] == kept["roots"] == []


@needs_cc
def test_tables_show_the_rows(done, record) -> None:
    for row in (*record["trajectory"], *record["tangencies"], *record["sweep"]):
        shown = [line.split() for line in done[1].stdout.splitlines() if row["tool"] in line]
        wanted = [str(row[name]) for name in ("missed", "invented", "locked", "runs", "compared")]
        us = f"{row['us_per_period']:.3g}"
        assert any(us in cells and cells[-6:-1] == wanted for cells in shown)


def test_a_quick_study_makes_one_run_of_a_slow_tool(monkeypatch) -> None:
    runs = []

    def count(chosen, cases, repeats, advance, long):
        runs.extend((tool, len(cases(tool)), long) for tool in chosen)
        return []

    monkeypatch.setattr(study, "compare", count)
    chosen = Study(repeats=3, only="SciPy", quick=True)
    for part in PARTS:
        chosen.run(part, lambda: None)
    assert {n for tool, n, _ in runs if tool.slow} == {1}
    assert {n for tool, n, _ in runs if not tool.slow} <= {2, 3, 28}
    # Calls that take long are not repeated.
    assert {long for *_, long in runs} == {0.1}
