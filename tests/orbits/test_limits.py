"""Limits of time and of counts: what was found until then, and what is refused."""

import itertools
import math
import pickle
from collections.abc import Callable
from functools import lru_cache
from time import perf_counter
from typing import Any

import pytest

import capsule_sym as cs
from capsule_sym._cli import main
from capsule_sym._native import Watch, check_time, present, watch

DOUBLED = cs.Parameters(alpha=0.04, zeta=0.005)
PLANE = (0.1, 2.0), (3.0, 3.4)


@pytest.fixture
def ticks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A clock that advances by a second at each reading, and only then."""
    clock = itertools.count(perf_counter())
    monkeypatch.setattr(watch, "perf_counter", lambda: next(clock))


@lru_cache
def orbit() -> cs.results.Orbit:
    return cs.solve_orbit(cs.Parameters())


@lru_cache
def branch() -> cs.results.Branch:
    return cs.continue_orbit(orbit(), "alpha", 0.3, points=10)


@lru_cache
def doubling() -> cs.results.Branch:
    return cs.continue_orbit(cs.solve_orbit(DOUBLED), "alpha", 0.046, points=6)


@lru_cache
def curve() -> cs.results.Curve:
    high = cs.continue_orbit(cs.solve_orbit(cs.Parameters(alpha=1.5)), "alpha", 1.55, points=5)
    return cs.continue_bifurcation(high.bifurcations[0], "gamma", PLANE, points=5)


Call = Callable[..., Any]
CALLS: dict[str, Call] = {
    "solve_orbit": lambda **k: cs.solve_orbit(cs.Parameters(), **k),
    "search_orbits": lambda **k: cs.search_orbits(cs.Parameters(), 3, **k),
    "continue_orbit": lambda **k: cs.continue_orbit(orbit(), "alpha", 0.3, points=10, **k),
    "continue_both_ways": lambda **k: cs.continue_both_ways(orbit(), "alpha", (0.6, 0.8), **k),
    "continue_from": lambda **k: cs.continue_from(branch(), "EP2", 0.2, **k),
    "period_doubling_cascade": lambda **k: cs.orbits.period_doubling_cascade(
        doubling(), 1, points=6, **k
    ),
    "continue_bifurcation": lambda **k: cs.continue_bifurcation(
        branch().bifurcations[0], "gamma", PLANE, points=5, **k
    ),
}


def results(found: Any) -> list[Any]:
    """Results with a status: the result itself, or its parts."""
    return [found] if hasattr(found, "status") else list(found)


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("seconds", [2, 4])
def test_work_ends_at_its_limit_with_what_was_found(name: str, seconds: int, ticks: None) -> None:
    _ = branch(), doubling(), curve()
    found = results(CALLS[name](max_seconds=seconds))
    assert found[-1].status == "time-limit"
    assert not found[-1].success
    assert "time limit" in found[-1].message
    assert present().deadline == math.inf


@pytest.mark.parametrize("name", CALLS)
def test_a_limit_that_is_no_time_is_refused(name: str) -> None:
    for seconds, needed in (
        (0, "a number > 0"),
        (-1.0, "a number > 0"),
        (math.nan, "a number"),
        ("1", "a number"),
        (None, "a number"),
    ):
        with pytest.raises(cs.InvalidInput, match=f"max_seconds = .* must be {needed}$"):
            CALLS[name](max_seconds=seconds)


def test_a_branch_keeps_the_points_before_its_limit(ticks: None) -> None:
    whole = cs.continue_orbit(orbit(), "alpha", 0.3, points=10)
    part = cs.continue_orbit(orbit(), "alpha", 0.3, points=10, max_seconds=60)
    assert whole.status is cs.results.Status.REACHED
    assert part.status is cs.results.Status.TIME_LIMIT
    count = len(part.points)
    assert 1 < count < len(whole.points)
    assert [one.value for one in part.points] == [one.value for one in whole.points[:count]]


def test_a_search_keeps_the_orbits_before_its_limit(ticks: None) -> None:
    whole = cs.search_orbits(cs.Parameters(), 3)
    assert (whole.status, whole.searched, whole.starts) == ("finished", 3, 3)
    copy = pickle.loads(pickle.dumps(whole))
    assert (len(copy), copy.status, copy.message) == (len(whole), whole.status, whole.message)
    # However often the clock is looked at: the first limit after which a state was searched.
    parts = (
        cs.search_orbits(cs.Parameters(), 3, max_seconds=limit) for limit in range(50, 1000, 50)
    )
    part = next(one for one in parts if one.searched)
    assert part.status == "time-limit"
    assert 0 < part.searched < 3
    assert {str(one.itinerary) for one in part} <= {str(one.itinerary) for one in whole}


def test_the_tighter_of_two_limits_ends_what_is_within_both() -> None:
    with Watch(5.0) as wide:
        with Watch(1e3):
            assert present() is wide
        wide.stop()
        with Watch(1e3):
            check_time()
            pytest.fail("the work goes on")
        pytest.fail("what is around it goes on")
    assert wide.over


BAD: list[tuple[Call, dict[str, Any], str]] = [
    (cs.search_orbits, {"starts": -1}, "starts"),
    (cs.search_orbits, {"starts": 10**12}, "starts"),
    (cs.search_orbits, {"starts": 2.5}, "starts"),
    (cs.search_orbits, {"starts": 1, "box": (-1, 1, 1)}, "box"),
    (cs.search_orbits, {"starts": 1, "box": (1, math.nan, 1)}, "box"),
    (cs.search_orbits, {"starts": 1, "box": (1, 1)}, "box"),
    (cs.search_orbits, {"starts": 1, "box": (1, 1, 1e21)}, "box"),
    (cs.search_orbits, {"starts": 1, "period_numbers": (0,)}, "period_numbers"),
    (cs.search_orbits, {"starts": 1, "period_numbers": (10**9,)}, "period_numbers"),
    (cs.search_orbits, {"starts": 1, "period_numbers": 3}, "period_numbers"),
    (cs.search_orbits, {"starts": 1, "transient": 0}, "transient"),
    (cs.search_orbits, {"starts": 1, "seed": -1}, "seed"),
    (cs.solve_orbit, {"periods": 0}, "periods"),
    (cs.solve_orbit, {"periods": 1.5}, "periods"),
]


@pytest.mark.parametrize(("call", "given", "field"), BAD)
def test_counts_and_boxes_without_sense_are_refused(call, given, field) -> None:
    with pytest.raises(cs.InvalidInput) as caught:
        call(cs.Parameters(), **given)
    assert caught.value.field == field


@pytest.mark.parametrize(
    ("depth", "needed"),
    [(-1, "from 0 to 16"), (17, "from 0 to 16"), (1.0, "a whole number"), (True, "a whole number")],
)
def test_a_depth_without_sense_is_refused(depth: Any, needed: str) -> None:
    with pytest.raises(cs.InvalidInput, match=f"depth = {depth}: .*{needed}"):
        cs.orbits.period_doubling_cascade(doubling(), depth)


@pytest.mark.parametrize(
    "line",
    [
        "orbit",
        "orbit --starts 3",
        "branch --alpha 0.1:2",
        "curve --alpha 0.1:2 --gamma 3:3.3 --bifurcation all",
    ],
)
def test_commands_end_at_their_limit(line, ticks, capsys) -> None:
    with pytest.raises(SystemExit) as stopped:
        main([*line.split(), "--max-seconds", "5"])
    shown, told = capsys.readouterr()
    assert stopped.value.code == 3
    assert "(time-limit)" in told.splitlines()[-1]
    assert "from 3 random states" not in shown
