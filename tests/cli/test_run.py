"""`capsule-sym run`: what it prints, what its JSON holds, in which precision and units."""

import json
import math
import re
from decimal import Decimal
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest
from click.testing import CliRunner

import capsule_sym
from capsule_sym import Parameters
from capsule_sym._cli import group
from capsule_sym._map.backend import default_backend
from tests.cli.terminal import in_terminal

OPTIONS = ("--alpha", "--omega", "--delta", "--zeta", "--beta", "--gamma", "--f-b")


@pytest.fixture(scope="module")
def default():
    done = CliRunner().invoke(group, ["run", "--json"])
    assert (done.exit_code, done.stderr) == (0, "")
    return json.loads(done.stdout)


def test_json_has_the_documented_keys(default) -> None:
    keys = "parameters backend segments itinerary global_map period_number progression final"
    keys += " success status message"
    assert " ".join(default) == keys
    for segment in default["segments"]:
        assert " ".join(segment) == "field mode local_map source target start end outcome"
        assert list(segment["start"]) == list(segment["end"]) == ["period", "phase", "state"]
    assert list(default["final"]) == ["period", "phase", "state"]


def test_json_holds_the_case_study_by_default(default) -> None:
    assert default["parameters"] == Parameters().to_dict()
    assert default["backend"] == default_backend()
    # Section 4 at alpha = 0.7, panel (f) of Fig. 7.
    assert default["itinerary"] == ["F5", "F4", "F1", "F2"]
    assert default["global_map"] == ("P_{Σ5,F2,Σ2} ∘ P_{Σ2,F1,Σ8} ∘ P_{Σ8,F4,Σ4} ∘ P_{Σ4,F5,Σ5}")
    assert default["period_number"] == 1
    assert default["final"]["period"] == 100


def test_segments_are_those_of_the_whole_run_in_order(default) -> None:
    segments = default["segments"]
    first, last = segments[0], segments[-1]
    assert first["start"] == {"period": 0, "phase": 0.0, "state": [0.0, 0.0, 0.0]}
    assert first["source"] == "Σ2"
    assert (last["target"], last["local_map"], last["outcome"]) == (None, None, "end")
    assert last["end"] == default["final"]
    for segment, following in pairwise(segments):
        assert following["start"] == segment["end"]
        assert following["source"] == segment["target"]
        planes = f"{segment['target']},{segment['field']},{segment['source']}"
        assert segment["local_map"] == f"P_{{{planes}}}"
        assert 0 <= segment["start"]["phase"] < Parameters().period


def test_table_shows_what_json_holds(inside, default) -> None:
    done = inside("run")
    assert (done.returncode, done.stderr) == (0, "")
    assert f"global map     {default['global_map']}" in done.stdout
    assert f"progression    {default['progression']:.9g}" in done.stdout
    rows = re.findall(r"^F\d .*$", done.stdout, re.M)
    assert [row.split()[0] for row in rows] == default["itinerary"]
    last_period = {segment["local_map"]: segment for segment in default["segments"][-5:-1]}
    for row in rows:
        _, mode, local_map, source, target, *numbers = row.split()
        segment = last_period.pop(local_map)
        assert [mode, source, target] == [segment[key] for key in ("mode", "source", "target")]
        phase, _, *state = map(float, numbers)
        assert phase == pytest.approx(segment["start"]["phase"], abs=1e-5)
        assert state == pytest.approx(segment["start"]["state"], abs=1e-5)


def test_options_and_start_are_taken(inside) -> None:
    arguments = [text for option in OPTIONS for text in (option, "0.5")]
    start = ["--state", "-0.25", "0.125", "0.5", "--phase", "1.5", "--periods", "3"]
    record = json.loads(inside("run", *arguments, *start, "--json").stdout)
    assert set(record["parameters"].values()) == {0.5}
    begin = {"period": 0, "phase": 1.5, "state": [-0.25, 0.125, 0.5]}
    assert record["segments"][0]["start"] == begin
    assert record["segments"][0]["source"] is None
    assert record["final"]["period"] == 3


def test_help_names_the_defaults_of_the_parameters(inside) -> None:
    text = inside("run", "--help").stdout
    shown = [
        re.search(rf"{option}(?:, --f_b)? FLOAT .*\[default: (\S+)\]", text) for option in OPTIONS
    ]
    assert [float(match[1]) for match in shown] == list(Parameters().to_dict().values())


def test_a_run_that_has_not_settled_says_so(inside) -> None:
    done = inside("run", "--alpha", "0.3", "--periods", "4")
    assert done.returncode == 0
    assert re.search(
        r"not steady within 4 periods: .*capsule-sym orbit", " ".join(done.stdout.split())
    )
    assert "global map" not in done.stdout
    record = json.loads(inside("run", "--alpha", "0.3", "--periods", "4", "--json").stdout)
    for key in ("itinerary", "global_map", "period_number", "progression"):
        assert record[key] is None
    last_period = [s for s in record["segments"] if s["end"]["period"] >= 3]
    assert len(re.findall(r"^F\d .*$", done.stdout, re.M)) == len(last_period)


def test_a_run_that_stopped_early_says_why(inside, monkeypatch: pytest.MonkeyPatch) -> None:
    # Low enough to be reached, and after periods that are steady.
    short = partial(capsule_sym.simulate, max_segments=400)
    monkeypatch.setattr(capsule_sym, "simulate", short)
    shown = inside("run", "--periods", "200").stdout
    assert shown.endswith("segment-limit: the run stopped after 400 segments\n")
    assert "global map" not in shown
    record = json.loads(inside("run", "--periods", "200", "--json").stdout)
    assert record["message"] == "the run stopped after 400 segments"
    assert (record["itinerary"], len(record["segments"])) == (None, 400)


def test_mpmath_numbers_keep_their_fifty_digits(inside) -> None:
    start = ("run", "--periods", "2", "--json")
    digits = json.loads(inside(*start, "--backend", "mpmath").stdout, parse_float=Decimal)
    double = json.loads(inside(*start).stdout)
    assert digits["backend"] == "mpmath"
    assert [s["field"] for s in digits["segments"]] == [s["field"] for s in double["segments"]]
    assert max(len(value.as_tuple().digits) for value in digits["final"]["state"]) >= 48
    for value, near in zip(digits["final"]["state"], double["final"]["state"], strict=True):
        assert float(value) == pytest.approx(near, abs=1e-12)


def test_a_dimensionless_file_yields_to_options(inside, tmp_path: Path) -> None:
    file = tmp_path / "capsule.toml"
    file.write_text("alpha = 0.5\nzeta = 0.1\n")
    record = json.loads(
        inside("run", "--params", str(file), "--zeta", "0.2", "--periods", "1", "--json").stdout
    )
    assert record["parameters"] == Parameters(alpha=0.5, zeta=0.2).to_dict()
    assert "si" not in record


M_M, M_C, K1, MU, G = 0.5, 1.65, 50.0, 0.2, 10.0
FRICTION = MU * (M_M + M_C) * G
RATE = math.sqrt(K1 / M_M)
DEVICE = f"""
M_m = {M_M}
M_c = {M_C}
k1 = {K1}
k2 = {1.5 * K1}
c = {2 * 0.05 * M_M * RATE}
G = {0.02 * FRICTION / K1}
P_d = {0.7 * FRICTION}
Omega = {0.8 * RATE}
mu = {MU}
g = {G}
"""


def test_a_physical_file_gives_results_in_si_units(inside, tmp_path: Path, default) -> None:
    file = tmp_path / "device.toml"
    file.write_text(DEVICE)
    record = json.loads(inside("run", "--params", str(file), "--json").stdout)
    assert record["parameters"] == pytest.approx(default["parameters"], rel=1e-14)
    assert record["device"]["M_m"] == M_M
    advance = default["progression"] * FRICTION / K1
    velocity = advance * 0.8 * RATE / (2 * math.pi)
    expected = {"progression [m]": advance, "average_velocity [m/s]": velocity}
    assert record["si"] == pytest.approx(expected, rel=1e-9)
    table = inside("run", "--params", str(file)).stdout
    assert f"progression [m]         {record['si']['progression [m]']:.9g}" in table


STIFF = ("run", "--beta", "1e10", "--state", "0.02", "0", "0")


def test_a_run_stops_at_its_time_limit_with_what_it_found(inside) -> None:
    done = inside(*STIFF, "--max-seconds", "0.5", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    record = json.loads(done.stdout)
    assert record["message"] == "the run stopped at its time limit"
    assert record["segments"]
    assert "[default: 120.0; x>0]" in " ".join(inside("run", "--help").stdout.split())


def test_a_run_in_a_terminal_shows_its_progress_and_can_be_interrupted() -> None:
    program = ("-m", "capsule_sym", *STIFF)
    shown = in_terminal(*program, "--max-seconds", "0.5")
    assert shown.status == 0, shown.written
    assert "Running" in shown.written
    assert not [line for line in shown.lines if "Running" in line]
    # The screen may have scrolled: the last period of this run has many segments.
    assert "at its time limit" in shown.written
    shown = in_terminal(*program, interrupt_at="Running")
    assert shown.status == 130
    assert "error: interrupted: nothing is kept; with --max-" in shown.written
    assert shown.cursor


def test_a_run_of_which_nothing_was_computed_fails() -> None:
    line = ["run", "--backend", "mpmath", "--max-seconds", "1e-9"]
    done = CliRunner().invoke(group, line)
    assert (done.exit_code, done.stderr[:20]) == (3, "nothing was computed")
