"""The neutral suite of hard events: its answers by an integration of its own, and its runner."""

import ast
import json
import subprocess
import sys
import types
from functools import cache

import pytest
from mpmath import mp, mpf

from benchmarks.events import run_events
from benchmarks.hardcases import cases, suite
from tests.examples import ROOT

FOLDER = ROOT / "benchmarks" / "events"
SUITE = run_events.load()
SAMPLE = ("graze from F1, 1e-12 past it", "slip of 1e-06", "two switches 1.0e-14 apart from F4")
DIGITS, SAMPLES = 90, 12


@cache
def evaluated(field, kind, values):
    """Rows of expressions as numbers of many digits."""
    names = dict(zip(SUITE["system"]["parameters"], map(mpf, values), strict=True))
    given = SUITE["system"]["fields"][field]
    rows = given["matrix"] if kind == "matrix" else [guard["row"] for guard in given["guards"]]
    return mp.matrix([[mpf(eval(x, {}, names)) for x in row] for row in rows])


def follow(case):
    """Checks the switches of a case by exponentials of the printed matrices, and yields offsets."""
    p = {name: mpf(value) for name, value in case["parameters"].items()}
    values = tuple(case["parameters"].values())
    t, field = mpf(case["start"]["t"]), case["start"]["field"]
    state = [mpf(x) for x in case["start"]["state"]]
    for switch in [*case["switches"], None]:
        angle = p["omega"] * t
        z = mp.matrix([*state, mp.cos(angle), mp.sin(angle), 1])
        matrix, guards = (evaluated(field, kind, values) for kind in ("matrix", "guards"))
        end = mpf(case["end"]) if switch is None else mpf(switch["t"])
        part = mp.expm(matrix * (end - t) / SAMPLES, method="taylor")
        for k in range(SAMPLES):
            z = part * z
            if k < SAMPLES - 1:
                assert min(guards * z) > 0, (case["name"], field)
        if switch is None:
            assert min(guards * z) > 0, (case["name"], field)
            return
        assert switch["from"] == field
        values_there, rates = guards * z, guards * (matrix * z)
        offsets = [abs(g / r) if r else mp.inf for g, r in zip(values_there, rates, strict=True)]
        fired = min(range(len(offsets)), key=offsets.__getitem__)
        assert rates[fired] < 0
        yield switch, offsets[fired]
        late = -values_there[fired] / rates[fired]
        t, state = end + late, list((z + matrix * z * late)[:3])
        name = SUITE["system"]["fields"][field]["guards"][fired]["name"]
        if name == "gap":
            state[0] = p["delta"]
        elif name == "drift":
            state[2] = mpf(0)
        after = SUITE["system"]["fields"][field]["next"][name]
        if isinstance(after, dict):
            pull = eval(after["pull"], {}, p | dict(zip(("x_r", "v_r", "v_c"), state, strict=True)))
            chosen = (
                "pull > f_b" if pull > p["f_b"] else "pull < -f_b" if pull < -p["f_b"] else "else"
            )
            after = after[chosen]
        assert after == switch["to"]
        field = after


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(one, id=one["name"], marks=() if one["name"] in SAMPLE else pytest.mark.long)
        for one in SUITE["cases"]
    ],
)
def test_switches_are_those_of_matrix_exponentials(case):
    with mp.workdps(DIGITS):
        for switch, off in follow(case):
            assert off < mpf(10) ** -40
            if switch["radius"] is not None:
                assert off < mpf(switch["radius"]) < mpf(10) ** -42


def test_the_file_is_what_the_generator_writes():
    held = {one["name"]: one for one in SUITE["cases"]}
    for kind in ("short segment", "exact tangency"):
        case = next(iter(suite._KINDS[kind][0]()))
        assert json.loads(json.dumps(suite.record(case, kind))) == held[case.name]
    assert SUITE["system"] == suite._system()
    assert SUITE["version"] == suite.VERSION
    names = [one.name for groups in suite._KINDS.values() for group in groups for one in group()]
    assert names == list(held)


@pytest.mark.long  # 12 s
def test_the_whole_file_is_what_the_generator_writes():
    assert (FOLDER / "events.json").read_text(encoding="utf-8") == suite.text()


def test_kinds_and_proofs_are_as_the_readme_says():
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    for kind in suite._KINDS:
        count = sum(one["kind"] == kind for one in SUITE["cases"])
        assert f"| {kind} | {count} |" in text
    open_ones = [one["kind"] for one in SUITE["cases"] if not one["proved"]]
    assert {kind: open_ones.count(kind) for kind in set(open_ones)} == {
        "exact tangency": 2,
        "double root at the start": 1,
        "corner": 5,
        "twin crossings": 3,
    }
    assert f"now {SUITE['version']}" in text


def test_the_runner_and_the_adapters_know_nothing_of_the_package():
    for path in [FOLDER / "run_events.py", *(FOLDER / "adapters").glob("*.py")]:
        tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        names = {
            alias.name for node in tree if isinstance(node, ast.Import) for alias in node.names
        }
        tree = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        names |= {node.module for node in tree if isinstance(node, ast.ImportFrom)}
        known = {str(name).partition(".")[0] for name in names} & {"capsule_sym", "benchmarks"}
        assert known == ({"capsule_sym"} if path.name == "capsule_map.py" else set())


CASE = {
    "name": "made",
    "kind": "corner",
    "distance": None,
    "start": {"t": 0.0},
    "switches": [
        {"t": "1", "to": "F5"},
        {"t": "1.4", "to": "F2"},
        {"t": "1.4000000000001", "to": "F1"},
    ],
}


@pytest.mark.parametrize(
    ("found", "verdict"),
    [
        ([(1, "F5"), (1.4, "F1")], (0, 0, 0)),
        ([(1, "F5"), (1.4, "F4"), (1.4000000000002, "F1")], (0, 0, 0)),
        ([(1, "F5"), (1.45, "F1")], (0, 0, 0)),
        ([(1, "F5"), (1.51, "F1")], (0, 0, 1)),
        ([(1.11, "F5"), (1.4, "F1")], (0, 0, 1)),
        ([(1.4, "F1")], (1, 0, 0)),
        ([(1, "F5"), (1.2, "F3"), (1.4, "F1")], (0, 1, 0)),
        ([], (2, 0, 0)),
    ],
)
def test_switches_are_judged_by_the_fields_entered_and_by_near_times(found, verdict):
    judged = run_events.judge(CASE, found)
    assert tuple(judged[name] for name in ("missed", "invented", "late")) == verdict
    assert judged["right"] == (verdict == (0, 0, 0))


@pytest.mark.parametrize(
    ("found", "message"),
    [
        ([(float("nan"), "F5")], "time of a switch is nan"),
        ([(2, "F5"), (1, "F2")], "at 1.0 follows one at 2.0"),
        ([(1, "F9")], "'F9' is none of F1"),
    ],
)
def test_an_answer_that_is_no_list_of_switches_fails_with_its_reason(found, message, capsys):
    seen = []
    module = types.SimpleNamespace(switches=lambda case: seen.append(case) or found)
    verdicts = run_events.check(module, SUITE, SUITE["cases"][:1])
    assert not verdicts[0]["right"]
    assert message in verdicts[0]["failed"]
    assert "switches" not in seen[0]
    run_events.show(verdicts)
    assert message in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("import nothing_of_this_name", "does not load: ModuleNotFoundError"),
        ("def firstevent(): pass", "neither first_event nor switches"),
    ],
)
def test_a_file_that_is_no_adapter_is_refused_with_a_line(tmp_path, text, message):
    path = tmp_path / "wrong.py"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SystemExit, match=message):
        run_events.adapter(path)


@pytest.mark.parametrize(
    ("adapter", "only", "right"),
    [
        ("capsule_map", "graze from F2", "16 of 16"),
        pytest.param("solve_ivp", "graze from F2, 1e-02", "2 of 2", marks=pytest.mark.long),
        ("rk4", "start on S9", "1 of 1"),
    ],
)
def test_an_adapter_is_run_from_a_copy_of_the_folder(adapter, only, right):
    line = [sys.executable, "run_events.py", f"adapters/{adapter}.py", "--only", only]
    done = subprocess.run(line, cwd=FOLDER, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[2].split("  ")[0] == "all"
    assert right in done.stdout.splitlines()[2]


@pytest.mark.long
def test_the_whole_suite_is_right_by_the_map():
    module = run_events.adapter(FOLDER / "adapters" / "capsule_map.py")
    verdicts = run_events.check(module, SUITE, SUITE["cases"])
    assert [one["name"] for one in verdicts if not one["right"]] == []
    assert len(list(cases.cases())) > len(verdicts) == 163
