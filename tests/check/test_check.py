"""Switches of an integrator beside the exact ones: what is missed, invented, late, and why."""

import json
import math
import runpy
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from capsule_sym import InvalidInput, Parameters, check_switches, inputs, scenes, simulate
from capsule_sym._check.growth import growth_of_errors
from capsule_sym._check.matching import matched
from capsule_sym._cli import group
from tests.examples import ROOT

PERIODS = 3
CASE = Parameters(alpha=0.7)
CHAOTIC = Parameters(alpha=3, omega=1.2, delta=0.3, zeta=0.01, beta=20, gamma=1.5)


def switches(parameters, periods=PERIODS, state=(0.0, 0.0, 0.0)):
    """Times of a run in double precision, and the fields entered."""
    run = simulate(parameters, state, periods=periods)
    ends = [s.end.period * parameters.period + s.end.phase for s in run.segments[:-1]]
    return np.array(ends), [s.name for s in run.segments[1:]]


@pytest.mark.parametrize(
    ("true", "given", "expected"),
    [
        # A pair of switches is missed, and the next one of their kind is not taken for theirs.
        ([(1, "a"), (1.1, "b"), (1.3, "a"), (1.5, "b")], [(1.3, "a"), (1.5, "b")], "0. 1. 20 31"),
        ([(1, "a"), (2, "b")], [(1, "a"), (1.4, "b"), (1.5, "a"), (2, "b")], "00 .1 .2 13"),
        ([(1, "a")], [(1.49, "a")], "00"),  # late, and the same
        ([(1, "a")], [(1.51, "a")], "0. .0"),  # too late
        ([(1, "a")], [(0.9, "a"), (1.01, "a")], ".0 01"),  # only the nearer one is the same
        ([(1, "a"), (1.1, "b")], [(1, "b"), (1.1, "a")], "01 .0 1."),  # not in another order
        ([], [(1, "a")], ".0"),
        ([], [], ""),
    ],
)
def test_lists_are_matched_by_events_and_times(true, given, expected):
    def table(name, events):
        times, kinds = [time for time, _ in events], [kind for _, kind in events]
        return pd.DataFrame({name: np.array(times, float), "event": np.array(kinds, str)})

    def place(events, time):
        return "." if math.isnan(time) else str([at for at, _ in events].index(time))

    found = matched(table("exact", true), table("given", given), 0.5)
    pairs = zip(found["exact"], found["given"], strict=True)
    shown = [place(true, a) + place(given, b) for a, b in pairs]
    assert sorted(shown) == sorted(expected.split())


def ends_from(parameters, segment, state):
    """Times at which segments end of a run from a segment's start, and the field it begins in."""
    run = simulate(parameters, state, segment.start.phase, 4)
    before = segment.start.period * parameters.period
    ends = [before + s.end.period * parameters.period + s.end.phase for s in run.segments]
    return np.array(ends), [s.field for s in run.segments]


@pytest.mark.parametrize("name", ["capsule", "reaction", "slope"])
def test_growth_is_what_runs_from_states_beside_show(name):
    # Runs from every segment's start, moved into its own field, instead of derivatives.
    parameters, step = scenes.load(name).Parameters(), 1e-7
    run = simulate(parameters, periods=3)
    segments, facts = run.segments[:7], parameters.scene.facts
    count = len(segments)
    totals, exact = np.zeros(count), switches(parameters)[0][:count]
    for j, segment in enumerate(segments):
        by, fields = np.zeros((count, 3)), [s.field for s in segments[j:]]
        for axis in range(3 if facts.FIELDS[segment.field][1] else 2):
            for way in (step, -step):
                state = list(segment.start_state)
                state[axis] += way
                ends, passed = ends_from(parameters, segment, state)
                if passed[: count - j] == fields:
                    by[j:, axis] = (ends[: count - j] - exact[j:]) / step
                    break
            else:
                raise AssertionError(f"{name}: no start beside segment {j} along axis {axis}")
        totals += np.linalg.norm(by, axis=1)
    # The rest of `growth` is the error at the switch itself: of a position, over its velocity.
    besides = growth_of_errors(run)[:count] - totals
    for k, (segment, after) in enumerate(zip(segments, run.segments[1:], strict=False)):
        if facts.FIELDS[segment.field][0] != facts.FIELDS[after.field][0]:
            assert besides[k] == pytest.approx(1 / abs(segment.end_state[1]), rel=1e-3)
        else:
            assert besides[k] > 0.01 * totals[k]


def test_exact_switches_are_right():
    times, entered = switches(CASE)
    found = check_switches(times, entered, CASE)
    assert found.success
    assert found.message == f"all {len(times)} switches are right"
    assert np.nanmax(abs(found.errors)) < 1e-13
    assert found.segment_error < 1e-15
    assert found.horizon == math.inf


def test_late_switches_are_told_apart_from_what_the_motion_makes_of_errors():
    # Of a run that begins 1e-7 beside the start all errors are that one, grown.
    times, entered = switches(CASE, state=(1e-7, 0.0, 0.0))
    found = check_switches(times, entered, CASE)
    assert found.success
    assert 1e-9 < found.segment_error < 1e-7
    latest = found.switches.iloc[np.argmax(abs(found.errors))]
    assert latest["growth"] == growth_of_errors(simulate(CASE, periods=3)).max()
    assert latest["exact"] == pytest.approx(times[np.argmax(abs(found.errors))], abs=1e-4)


def test_missed_switches_of_exact_times_are_the_searchs():
    times, entered = switches(CASE)
    kept = [k for k in range(len(times)) if k not in (8, 9)]
    found = check_switches(times[kept], [entered[k] for k in kept], CASE)
    (one,) = found.differences
    assert [event.event for event in one.missed] == entered[8:10]
    assert (one.invented, one.cause) == ((), "search")
    assert one.gap == pytest.approx(times[9] - times[8])
    growth = growth_of_errors(simulate(CASE, periods=3))
    assert one.needed == pytest.approx(one.gap / (4 * growth[8:10].max()))
    loose = check_switches(times[kept], [entered[k] for k in kept], CASE, tolerance=10 * one.needed)
    assert loose.differences[0].cause == "tolerance"
    assert loose.tolerance == pytest.approx(one.needed)
    other = check_switches(times, entered, CASE.replace(gamma=1.5 * CASE.gamma), tolerance=1e-12)
    assert (other.differences[0].cause, other.tolerance) == ("set-up", None)


def test_a_switch_after_the_end_does_not_part_the_last_ones():
    # The motion's next switch is after the end, and within the slack: only two are after the pair.
    times, entered = switches(CASE)
    kept, end = [0, 1, 2, 3, 4, 5, 8, 9], float(times[10]) - 0.3
    found = check_switches(times[kept], [entered[k] for k in kept], CASE, end=end)
    (one,) = found.differences
    assert [event.event for event in one.missed] == entered[6:8]
    assert one.invented == ()
    record = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert record["horizon"] is None  # infinite
    assert [row["event"] for row in record["switches"] if row["given"] is None] == entered[6:8]
    assert [row["event"] for row in record["differences"][0]["missed"]] == entered[6:8]


def test_a_switch_found_again_at_the_restart_is_invented():
    times, entered = switches(CASE)
    twice = np.insert(times, 5, times[4] + 1e-13)
    found = check_switches(twice, [*entered[:5], entered[3], *entered[5:]], CASE)
    (one,) = found.differences
    assert (len(one.missed), len(one.invented), one.cause) == (0, 1, "tolerance")


@pytest.mark.long  # 17 s
def test_nothing_is_judged_where_no_double_can_follow():
    # The capsule's core and the reference map part, as any two programs do.
    times, entered = switches(CHAOTIC, 250)
    found = check_switches(times, entered, CHAOTIC)
    assert found.success
    assert 500 < found.horizon < times[-1] - 100
    assert "where no double can follow" in found.message


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=() if n == "prototype" else pytest.mark.long) for n in scenes.SHIPPED],
)
def test_switches_are_named_by_mode_or_number_in_every_scene(name):
    parameters = scenes.load(name).Parameters()
    run = simulate(parameters, periods=2)
    times = [s.end.period * parameters.period + s.end.phase for s in run.segments[:-1]]
    entered = run.segments[1:]
    for events in ([s.mode for s in entered], [s.field for s in entered]):
        assert check_switches(times, events, parameters).success


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"times": [2, 1]}, "time in row 2"),
        ({"times": [1, math.nan]}, "time in row 2"),
        ({"times": [-1, 1]}, "time in row 1"),
        ({"events": ["F2"]}, "events"),
        ({"events": ["F2", "F7"]}, "entered in row 2"),
        ({"end": 1.5}, "end"),
        ({"resolution": -1}, "resolution"),
        ({"tolerance": 0}, "tolerance"),
    ],
)
def test_bad_input_is_named(values, field):
    given = {"times": [1, 2], "events": ["F5", "F2"], **values}
    with pytest.raises(InvalidInput) as raised:
        check_switches(given.pop("times"), given.pop("events"), CASE, **given)
    assert raised.value.field == field


def test_a_file_has_switches_and_what_they_are_of(tmp_path):
    file = tmp_path / "switches.csv"
    file.write_text(
        "# by my code\n# alpha = 0.7\n# state = 0 0 0\nx_r, time, entered\n0.02,0.2410,F2\n"
    )
    found = inputs.read_switches(file)
    assert found == ((0.241,), ("F2",), 0.5e-4, {"alpha": (0.7,), "state": (0.0,) * 3})


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "a table with time and entered"),
        ("time\n1\n", "time and entered, each once"),
        ("time,entered,entered\n", "each once"),
        ("time,entered\n1\n", "row 1"),
        ("time,entered\n1,2,F5\n", "row 1 = '1': must be the first of 2 cells"),
        ("time,entered\n1,F5\n1,2,F5\n", "Expected 2 fields in line 3, saw 3"),
        ("time,entered\none,F5\n", "time in row 1 = 'one': must be a number"),
        ("time,entered\n1e400,F5\n", "time in row 1 = '1e400': must be finite"),
        ("# alpha = 1e400\ntime,entered\n", "# alpha = '1e400': must be finite"),
        ("time,entered\n1,F5\n2,F9\n", "entered in row 2"),
        ("# alhpa = 1\ntime,entered\n", "# name = 'alhpa'"),
        ("# state = 1\ntime,entered\n", "three numbers"),
        ("# tolerance = -1\ntime,entered\n", "tolerance"),
    ],
)
def test_a_bad_file_is_one_line(text, said, tmp_path):
    file = tmp_path / "switches.csv"
    file.write_text(text)
    done = CliRunner().invoke(group, ["check", str(file)])
    assert isinstance(done.exception, InvalidInput)
    assert said in str(done.exception)


@pytest.mark.parametrize(
    ("tolerance", "missed", "code"),
    [("1e-3", 2, 1), pytest.param("1e-9", 0, 0, marks=pytest.mark.long)],
)
def test_scipys_example_is_checked(tolerance, missed, code, tmp_path, monkeypatch):
    pytest.importorskip("scipy")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", ["solve_ivp.py", tolerance, "3"])
    runpy.run_path(str(ROOT / "docs/howto/check/solve_ivp.py"), run_name="__main__")
    done = CliRunner().invoke(group, ["check", "switches.csv", "--json"])
    assert done.exit_code == code
    record = json.loads(done.stdout)
    assert record["success"] is (code == 0)
    assert sum(len(one["missed"]) for one in record["differences"]) == missed
    assert record["parameters"]["alpha"] == 0.7
    lines = Path("switches.csv").read_text().splitlines()
    given = [one["given"] for one in record["switches"] if one["given"] is not None]
    assert given == [float(line.split(",")[0]) for line in lines[4:]]
    shown = CliRunner().invoke(group, ["check", "switches.csv"])
    assert record["message"] in shown.stdout
