"""Reference values for tools, against independent integrators, and the comparison itself."""

import json
from importlib import resources
from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

from benchmarks.speed import tangencies
from benchmarks.speed.compare import wrong_switches
from benchmarks.speed.reference import ALPHAS, SWEEP_ALPHAS, cases, sweep
from tests.judges import taylor_events

PARTS = ("case study", "tangencies", "sweep")


def record(part):
    file = resources.files("benchmarks.speed").joinpath("reference.json")
    return json.loads(file.read_text("utf-8"))[part]


def distance(one, other) -> float:
    """Largest difference of the first three components; the fourth of the integrator is x_c."""
    with mp.workdps(50):
        return float(max(abs(mpf(a) - mpf(b)) for a, b in zip(one, other[:3], strict=True)))


def test_case_study_is_that_of_the_independent_judge() -> None:
    judged = json.loads(taylor_events.truth_file("3.3").read_text("utf-8"))
    runs = record("case study")["runs"]
    assert [run["alpha"] for run in runs] == list(ALPHAS)
    for ours, other in zip(runs, judged["runs"], strict=True):
        assert ours["itinerary"] == other["fields"]
        assert distance(ours["final"], other["final"]) < 1e-24


def confirm(case, run) -> None:
    judged = taylor_events.run(
        case.start.parameters, case.start.state, periods=case.start.periods, digits=40
    )
    assert run["itinerary"] == judged.fields
    assert distance(run["final"], judged.final) < 1e-20


@pytest.mark.long
def test_a_run_nearest_to_a_tangency_is_that_of_the_independent_judge() -> None:
    confirm(cases("tangencies")[21], record("tangencies")["runs"][21])


@pytest.mark.long
@pytest.mark.parametrize(("part", "stride"), [("tangencies", 5), ("sweep", 4)])
def test_runs_are_those_of_the_independent_judge(part, stride) -> None:
    runs = zip(cases(part), record(part)["runs"], strict=True)
    for case, run in list(runs)[::stride]:
        confirm(case, run)


def test_words_beside_a_tangency_differ_at_every_distance() -> None:
    found = cases("tangencies")
    assert len(found) == 2 * len(tangencies.EXPONENTS) * len(record("tangencies")["alphas"])
    for below, above in zip(found[::2], found[1::2], strict=True):
        assert below.start.parameters.alpha < above.start.parameters.alpha
        assert below.truth.itinerary != above.truth.itinerary
        assert (
            abs(len(below.truth.itinerary) - len(above.truth.itinerary)) > tangencies.PERIODS // 2
        )


def test_runs_beside_a_tangency_are_at_their_distances() -> None:
    alphas = record("tangencies")["alphas"].values()
    runs = iter(cases("tangencies"))
    for alpha in alphas:
        for k in tangencies.EXPONENTS:
            for side in (-1, 1):
                distance = next(runs).start.parameters.alpha / alpha - 1
                assert distance == pytest.approx(side * 10.0**-k, abs=3e-16)


def test_grazing_is_where_the_linear_amplitude_is_the_gap() -> None:
    amplitude = 0.02 * ((1 - 0.8**2) ** 2 + (2 * 0.05 * 0.8) ** 2) ** 0.5
    assert record("tangencies")["alphas"]["grazing of the gap"] == pytest.approx(amplitude, 1e-15)


@pytest.mark.long
def test_values_of_the_tangencies_are_found_again() -> None:
    for name, alpha in tangencies.values().items():
        assert alpha == pytest.approx(record("tangencies")["alphas"][name], rel=3e-13)


def test_the_sweep_has_its_sample() -> None:
    every = sweep()
    assert [case.start.parameters.alpha for case in every] == list(SWEEP_ALPHAS)
    known = {case.start: case.truth for case in every if case.truth}
    assert known == {case.start: case.truth for case in cases("sweep")}
    assert len(known) == 11


@pytest.mark.parametrize(
    ("itinerary", "true", "wrong"),
    [
        (b"2525", b"2525", (0, 0)),
        (b"2", b"252", (2, 0)),
        (b"25452", b"252", (0, 2)),
        (b"2412", b"2512", (1, 1)),
        (b"2", b"2", (0, 0)),
    ],
)
def test_wrong_switches_of_itineraries(itinerary, true, wrong) -> None:
    assert wrong_switches(itinerary, true) == wrong


@given(st.binary(max_size=8), st.binary(max_size=8))
def test_wrong_switches_are_the_fewest(itinerary, true) -> None:
    itinerary, true = (bytes(letter % 3 for letter in text) for text in (itinerary, true))
    subsequences = {bytes(chosen) for n in range(len(true) + 1) for chosen in combinations(true, n)}
    same = max(len(text) for text in subsequences if contained(text, itinerary))
    assert wrong_switches(b"2" + itinerary, b"2" + true) == (
        len(true) - same,
        len(itinerary) - same,
    )


def contained(text: bytes, itinerary: bytes) -> bool:
    letters = iter(itinerary)
    return all(letter in letters for letter in text)
