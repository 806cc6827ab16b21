"""Optima against brute force that shares no code with the optimiser."""

import math
from dataclasses import replace

import pytest

from benchmarks.experiments.optima.answers import WORSE, answered, forced, judged, wrong
from benchmarks.experiments.optima.problems import Problem, problem
from capsule_sym import Parameters, optimise
from capsule_sym.results import Status

# With a margin and a start of its own, and with two limits.
SMALL = 1, 2
LARGE = range(11)


@pytest.mark.long
@pytest.mark.parametrize("number", SMALL)
def test_brute_force_finds_nothing_better(number: int) -> None:
    known, found = forced(number, 256), answered(number, 0)
    assert found["wrong"] == []
    assert found["status"].startswith("optimal")
    assert judged(known, found)["miss"] <= WORSE
    worse = found["value"] + (-1e-4 if problem(number).maximise else 1e-4)
    assert judged(known, found | {"value": worse})["miss"] > WORSE


def test_what_the_starts_do_not_lead_to_is_told() -> None:
    base = Parameters()
    given = Problem("speed", {"alpha": (0.6, 0.8)}, base, limits=(("work", "<=", 9.0),))
    found = optimise("speed", given.over, base, samples=8)
    assert wrong(given, found) == []
    (told,) = wrong(given, replace(found, value=1.001 * found.value))
    assert told.startswith("the starts lead to")
    (told,) = wrong(replace(given, limits=(("work", "<=", 0.1),)), found)
    assert told.startswith("beyond a limit")
    assert wrong(given, replace(found, status=Status.NO_MOTION)) == []


@pytest.mark.long
@pytest.mark.parametrize("number", LARGE)
def test_brute_force_of_many_cells_finds_nothing_better(number: int) -> None:
    known, found = forced(number, 8192), answered(number, 0)
    assert found["wrong"] == []
    assert judged(known, found)["miss"] <= WORSE


@pytest.mark.long
def test_an_optimum_on_a_border_is_judged_beside_it() -> None:
    # There each period of a run has a switch that the core leaves to the reference map.
    given = problem(161)
    found = optimise(given.metric, given.over, given.base, max_seconds=math.inf, **given.options)
    assert wrong(given, found) == []
    assert found.status is Status.OPTIMAL_AT_BORDER
    assert found.border is not None
    assert found.residual < 1e-9
