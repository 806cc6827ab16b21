"""`python -m paper case-study`: what it shows, what it writes, and whether that is true."""

import csv
import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import capsule_sym
from capsule_sym import Parameters, simulate
from capsule_sym.generated.capsule import DIGEST
from paper.study import casestudy
from tests.examples import MAIN_JOB, ROOT, Page

TUTORIAL = Page(ROOT / "paper" / "pages" / "index.md")
JUDGES = ROOT / "tests" / "judges" / "data"


# One test for one run, which takes most of the time of all tests here.
@pytest.mark.long
def test_the_case_study(inside_paper, tmp_path: Path) -> None:
    results = tmp_path / "results" / "paper"
    results.mkdir(parents=True)
    (results / "cases.csv").write_text("older results\n")
    done = inside_paper("case-study", "--out", "results/paper", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("wrote results/paper/casestudy.json")
    assert_every_panel_is_shown(done.stdout)
    TUTORIAL.assert_shown(MAIN_JOB, done.stdout)

    result = json.loads((results / "casestudy.json").read_text(encoding="utf-8"))
    assert result["version"] == capsule_sym.__version__
    assert result["generated"] == DIGEST
    cases = result["cases"]
    assert [(case["parameters"]["gamma"], case["panel"]) for case in cases] == [
        (gamma, panel) for gamma in (3.3, 3.0) for panel in "abcdefghijklmnop"
    ]
    for case in cases:
        assert_is_a_steady_motion(case)
    assert_tables_hold_the_same(cases, results)
    assert {path.name for path in results.iterdir()} == {
        "casestudy.json",
        "cases.csv",
        "segments.csv",
        "thresholds.csv",
        "curves.csv",
    }
    assert_thresholds_are_true(result["bifurcations"], results, done.stdout)
    for gamma, truth in ((3.3, "reference_gamma33.json"), (3.0, "reference_gamma30.json")):
        assert_words_are_those_of_independent_integration(cases, gamma, JUDGES / truth)


def assert_one_percentage_is_told(thresholds: list[dict[str, Any]], output: str) -> None:
    """Relative errors of the printed values, as in the tutorial."""
    off = {
        gamma: max(
            abs(one["printed"] - one["exact"]) / one["exact"]
            for one in thresholds
            if one["gamma"] == gamma
        )
        for gamma in (3.3, 3.0)
    }
    for gamma, share in off.items():
        told = f"up to {100 * share:.2f} % off at γ = {gamma}"
        assert f"Relative to the exact values, the printed ones are {told}" in " ".join(
            output.split()
        )
    told_there = " ".join(TUTORIAL.text.split())
    assert f"up to {100 * off[3.3]:.2f} % off, relative to the exact ones" in told_there
    assert f"printed order, and up to {100 * off[3.0]:.2f} %" in told_there


def assert_thresholds_are_true(found: dict[str, Any], results: Path, output: str) -> None:
    thresholds = found["thresholds"]
    assert [one["gamma"] for one in thresholds] == 8 * [3.3] + 8 * [3.0]
    for one in thresholds:
        assert abs(one["exact"] - one["value"]) <= one["uncertainty"]
        assert f"{one['exact']:.12f}" in output
        # A run of the map on either side settles on the itineraries of the two sides.
        for side, itinerary in ((-1e-4, one["itinerary_before"]), (1e-4, one["itinerary_after"])):
            parameters = Parameters(alpha=one["exact"] + side, gamma=one["gamma"])
            settled = simulate(parameters, periods=1490, keep="final").final[1]
            run = simulate(parameters, settled, periods=10)
            fields = [segment.name for segment in run.segments[-2 * len(itinerary) - 1 : -1]]
            assert (
                len(itinerary) == 1
                or fields == (3 * itinerary)[_offset(fields, itinerary) :][: len(fields)]
            )
    # The printed order is that of gamma = 3.0; at 3.3 the last three come in another one.
    assert [one["printed_place"] for one in thresholds] == [*range(1, 6), 7, 8, 6, *range(1, 9)]
    crossing, grazing = (one["gamma"] for one in found["order_changes"])
    assert 3.0 < crossing < grazing < 3.3
    assert f"change their order at γ = {crossing:.10g}" in " ".join(output.split())
    assert_one_percentage_is_told(thresholds, output)
    with (results / "thresholds.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["exact"]) for row in rows] == [round(one["exact"], 12) for one in thresholds]
    with (results / "curves.csv").open(encoding="utf-8", newline="") as file:
        assert {row["type"] for row in csv.DictReader(file)} == {one["type"] for one in thresholds}


def _offset(fields: list[str], itinerary: list[str]) -> int:
    """Index in the repeated itinerary at which the fields begin; 0 if they are not in it."""
    places = [i for i in range(len(itinerary)) if (3 * itinerary)[i:][: len(fields)] == fields]
    return places[0] if places else 0


def assert_every_panel_is_shown(output: str) -> None:
    for panel, alpha in casestudy.PANELS.items():
        rows = re.findall(rf"^{panel} +{alpha}\*? .*(?:agree|differ) *$", output, re.M)
        assert len(rows) == 2
    assert [line for line in output.splitlines() if line.startswith("γ =")] == [
        "γ = 3.3",
        "γ = 3.0",
    ]


def assert_is_a_steady_motion(case: dict[str, Any]) -> None:
    gamma, alpha = case["parameters"]["gamma"], casestudy.PANELS[case["panel"]]
    assert case["parameters"] == Parameters(alpha=alpha, gamma=gamma).to_dict()
    assert [segment["field"] for segment in case["segments"]] == case["itinerary"]
    assert case["agrees"] == casestudy.same_motion(case["global_map"], case["printed_global_map"])
    for segment, following in pairwise([*case["segments"], case["segments"][0]]):
        assert segment["target"] == following["source"]
        assert segment["end"]["phase"] == pytest.approx(following["start"]["phase"], abs=1e-7)
        assert segment["end"]["state"] == pytest.approx(following["start"]["state"], abs=1e-7)


def assert_tables_hold_the_same(cases: list[dict[str, Any]], results: Path) -> None:
    with (results / "cases.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["global_map"] for row in rows] == [case["global_map"] for case in cases]
    assert [float(row["progression"]) for row in rows] == [case["progression"] for case in cases]
    with (results / "segments.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    states = [segment["start"]["state"] for case in cases for segment in case["segments"]]
    columns = ("start_x_r", "start_v_r", "start_v_c")
    assert [[float(row[column]) for column in columns] for row in rows] == states


def assert_words_are_those_of_independent_integration(
    cases: list[dict[str, Any]], gamma: float, truth: Path
) -> None:
    itineraries = {
        case["parameters"]["alpha"]: "".join(field[1] for field in case["itinerary"])
        for case in cases
        if case["parameters"]["gamma"] == gamma
    }
    compared = 0
    for run in json.loads(truth.read_text())["runs"]:
        itinerary = itineraries.get(float(run["alpha"]))
        if itinerary is not None:
            # The twenty periods of the reference from rest end in the same cycle of fields, three
            # times.
            assert run["fields"][-3 * len(itinerary) :] in 4 * itinerary, run["alpha"]
            compared += 1
    assert compared >= 7
