"""Results kept by digest: computed once, found again, recomputed when anything differs."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest

from capsule_sym import InvalidInput, Parameters
from capsule_sym._figures import store as kept
from capsule_sym._figures.arcs import cycle
from capsule_sym._figures.store import Store, from_rest, orbit_of, settled


def count_items(items: Iterable[Any], text: str, total: int | None) -> Iterable[Any]:
    count_items.seen += total or 1
    return items


@pytest.fixture
def counting(tmp_path: Path) -> Store:
    count_items.seen = 0
    return Store(count_items, tmp_path / "cache")


def test_a_result_is_computed_once(counting: Store) -> None:
    calls = []

    def compute() -> dict[str, float]:
        calls.append(1)
        return {"value": 0.1 + 0.2}

    assert counting.get("sum", [1, 2], compute) == {"value": 0.1 + 0.2}
    assert counting.get("sum", [1, 2], compute) == {"value": 0.1 + 0.2}
    assert len(calls) == 1
    counting.get("sum", [2, 1], compute)
    counting.get("other", [1, 2], compute)
    assert len(calls) == 3
    names = sorted(path.name for path in counting.directory.iterdir())
    assert [name.split("-")[0] for name in names] == ["other", "sum", "sum"]


@pytest.mark.parametrize("text", ["", "{", "[1]", '{"inputs": 1}', "\udcff"])
def test_a_damaged_file_is_computed_again(counting: Store, text: str) -> None:
    counting.get("sum", 1, lambda: 1)
    (path,) = counting.directory.iterdir()
    path.write_text(text, errors="surrogateescape")
    assert counting.get("sum", 1, lambda: 2) == 2
    assert counting.get("sum", 1, lambda: 3) == 2


def test_nothing_is_kept_where_nothing_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    store = Store(count_items, tmp_path / "file" / "cache")
    assert [store.get("sum", 1, lambda n=n: n) for n in (1, 2)] == [1, 2]


def test_another_version_computes_again(counting: Store, monkeypatch) -> None:
    counting.get("sum", 1, lambda: 1)
    now = kept._provenance(__file__)
    monkeypatch.setattr(kept, "_provenance", lambda _: now | {"code": "changed"})
    assert counting.get("sum", 1, lambda: 2) == 2


def test_a_file_says_what_it_was_computed_from(counting: Store) -> None:
    counting.get("sum", {"a": 1}, lambda: 1)
    (path,) = counting.directory.iterdir()
    content = json.loads(path.read_text(encoding="utf-8"))
    assert set(content) == {"version", "generated", "code", "inputs", "result"}
    assert content["inputs"] == {"a": 1}


def test_a_computation_that_fails_keeps_nothing(counting: Store) -> None:
    def fail() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        counting.get("sum", 1, fail)
    assert not counting.directory.exists()


def test_motions_are_settled_once_and_are_steady_again(counting: Store) -> None:
    wanted = [Parameters(alpha=alpha, gamma=3.0) for alpha in (0.7, 1.2)]
    first, second = counting.motions(wanted), counting.motions(wanted)
    assert count_items.seen == 2
    for motion, again, parameters in zip(first, second, wanted, strict=True):
        assert motion.parameters == parameters
        assert motion.steady().itinerary == again.steady().itinerary
        assert motion.final == again.final
        assert motion.final[0].period == 4


SLOW = Parameters(alpha=0.405, zeta=0.02)  # a run from rest needs more than 4,096 periods
DOUBLED = Parameters(alpha=0.4, zeta=0.01)  # a motion of two excitation periods
RESTLESS = Parameters(alpha=0.0074, zeta=0.0)  # without damping nothing fades


def test_a_slow_motion_is_closed_by_newton(counting: Store) -> None:
    _, last, unsettled = from_rest(SLOW)
    assert unsettled is None
    (motion,) = counting.motions([SLOW])
    # The drawn motion repeats, and lies at the end of the run from rest.
    assert motion.steady().itinerary == ("F5", "F4", "F5", "F2")
    assert motion.final[1] == pytest.approx(motion.stroboscopic[0], abs=1e-12)
    assert motion.final[1] == pytest.approx(last.final[1], abs=1e-3)


def test_a_motion_of_two_periods_is_steady_when_it_is_drawn(counting: Store) -> None:
    (motion,) = counting.motions([DOUBLED])
    assert motion.steady().period_number == 2


def test_a_motion_that_is_not_periodic_is_kept_as_it_is(counting: Store) -> None:
    (motion,) = counting.motions([RESTLESS])
    assert motion.success
    assert motion.steady() is None
    assert motion.final[0].period >= 16


def test_orbits_come_back_from_the_record(branch) -> None:
    one = branch["bifurcations"][4]
    orbit = orbit_of(json.loads(json.dumps(one)))
    assert orbit.residual < 1e-12
    assert orbit.average_velocity == pytest.approx(one["average_velocity"], rel=1e-12)
    assert list(orbit.itinerary.names) == one["orbit"]["itinerary"]
    begin, end = cycle(orbit)[0], cycle(orbit)[-1]
    assert begin.x_r[0] == pytest.approx(end.x_r[-1], abs=1e-12)


@pytest.mark.long
def test_a_branch_begins_where_a_run_from_rest_becomes_periodic(counting, monkeypatch) -> None:
    store = counting
    monkeypatch.setattr(kept, "_BRANCH_POINTS", 10)
    # Without damping a small excitation leaves a free oscillation for ever, without contact, that
    # repeats with the forcing after 77 periods; a large one does not.
    system = Parameters(zeta=0, omega=0.77)
    values = [p["value"] for p in store.branch(system, "alpha", 0.002, 2.0)["points"]]
    assert (values[0], values[-1]) == (2.0, 0.002)
    named = r"either end \(alpha = 0.002: .*; alpha = 0.003: .*\)"
    with pytest.raises(InvalidInput, match=named):
        store.branch(system, "alpha", 0.002, 0.003)


def test_stroboscopic_states_of_a_branch_are_those_of_its_motions(branch) -> None:
    store = Store(count_items, Path("unused"))
    point = min(branch["points"], key=lambda one: abs(one["value"] - 1.2))
    parameters = Parameters(alpha=point["value"], gamma=3.0)
    assert point["stroboscopic"][0] == pytest.approx(settled(parameters)["state"], abs=1e-8)
    assert not store.directory.exists()
