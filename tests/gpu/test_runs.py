"""Runs of the device source beside width 1 of the core: the same bits, whatever is beside them."""

from __future__ import annotations

from collections.abc import Iterator
from ctypes import c_int
from random import Random
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.hardcases.starts import random_start
from capsule_sym import InvalidInput, Outcome, simulate
from capsule_sym._native import Watch, core_of, on_card
from capsule_sym._native.on_card import OnCard
from capsule_sym._parameters import SHIPPED, as_scene
from tests.gpu.host import COMPILER, Host, on_host

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(COMPILER is None, reason="no C++ compiler here"),
    pytest.mark.skipif(core_of(as_scene("capsule")) is None, reason="no C core here"),
]
PERIODS = 12


class Found(NamedTuple):
    """Results of runs."""

    records: NDArray[Any]
    stops: NDArray[np.int8]
    strobe: NDArray[np.float64]


def bits(records: NDArray[Any]) -> bytes:
    """All bits of records but those between their numbers."""
    return b"".join(records[name].tobytes() for name in records.dtype.names or ())


def drawn(name: str, count: int, flows: int) -> tuple[Any, ...]:
    """Parameters as wide as in check.c, with so many linear flows, and starts on and off planes."""
    scene, draw = as_scene(name), np.random.default_rng(len(name))
    names, base = scene.facts.PARAMETERS, scene.Parameters().to_dict()
    rows = np.tile([*base.values()], (count, 1))
    wide = {"omega": np.exp(draw.uniform(-2, 2, flows)), "zeta": draw.uniform(0, 2, flows)}
    wide |= {"gamma": np.exp(draw.uniform(-2, 2, flows))}
    wide["zeta"][::3] = 0.0
    for name_, values in wide.items():
        rows[:, names.index(name_)] = np.resize(values, count)
    rows[:, names.index("alpha")] = draw.uniform(0, 3, count)
    states = draw.uniform(-1, 1, (count, 3))
    states[::2, 2] = 0.0
    front = names.index(scene.facts.STOPS[0][0])
    states[::7, 0] = rows[::7, front]
    phases = draw.uniform(0, 1, count) * 2 * np.pi / rows[:, names.index("omega")]
    return rows, states, phases


def run(binding: Any, given: tuple[Any, ...], watch: Watch | None = None, **how: Any) -> Found:
    rows, states, phases = given
    records, stops = np.empty(len(rows), binding.STATE), np.empty(len(rows), np.int8)
    strobe = np.zeros((len(rows), PERIODS + 1, 3))
    binding.start_many(rows, states, phases, records, Watch())
    binding.run_many(rows, records, PERIODS, stops, strobe, True, watch=watch, **how)
    return Found(records, stops, strobe)


def with_handed_back(device: OnCard, given: tuple[Any, ...]) -> tuple[Found, list[int]]:
    """Results, and the rows that the card hands back."""
    handed: list[int] = []
    go = device._continue

    def note(runs: Any, part: NDArray[np.intp]) -> None:
        handed.extend(part.tolist())
        go(runs, part)

    device._continue = note  # type: ignore[method-assign]
    return run(device, given), sorted(handed)


@pytest.mark.parametrize("name", SHIPPED)
def test_results_are_those_of_width_1_to_the_last_bit(name: str) -> None:
    """But for a run that rests for ever, whose end the core computes without fused sums."""
    given, device = drawn(name, 3000, 40), on_host(name)
    found, handed = with_handed_back(device, given)
    alone = run(device.binding, given, lanes=1)
    assert found.stops.tolist() == alone.stops.tolist()
    assert len(handed) < 150
    assert ended_otherwise(name, given, found, alone) - set(handed) == set()
    for part in ("x_r", "v_r", "v_c"):
        off = abs(found.records[part] - alone.records[part])
        assert off[found.stops == device.DONE].max() < 1e-9, part


def ended_otherwise(name: str, given: tuple[Any, ...], one: Found, other: Found) -> set[int]:
    """Rows with other bits, and not because they rest for ever."""
    differ = [
        i
        for i in range(len(one.stops))
        if bits(one.records[i : i + 1]) != bits(other.records[i : i + 1])
        or one.strobe[i].tobytes() != other.strobe[i].tobytes()
    ]
    found = set()
    for i in differ:
        row, state, phase = (part[i].tolist() for part in given)
        last = simulate(as_scene(name).Parameters(*row), tuple(state), phase, PERIODS).segments[-1]
        if last.outcome is not Outcome.NEVER:
            found.add(i)
    return found


@pytest.fixture(scope="module")
def hard() -> tuple[Any, ...]:
    """Starts that lead close to a tangency or a corner, or begin close to one."""
    random = Random("a card")
    starts = [random_start(random).start for _ in range(5000)]
    rows = np.array([[*s.parameters.to_dict().values()] for s in starts])
    return rows, np.array([s.state for s in starts]), np.array([s.phase for s in starts])


def test_what_is_left_open_is_handed_back_and_nothing_is_dropped(hard: tuple[Any, ...]) -> None:
    """Each run stops as with width 1 alone, whose decisions others judge by 50 digits."""
    device = on_host()
    found, handed = with_handed_back(device, hard)
    alone = run(device.binding, hard, lanes=1)
    assert 0 < len(handed) < len(hard[0]) // 4  # most begin within 1e-9 of degenerate
    assert found.stops.tolist() == alone.stops.tolist()
    assert ended_otherwise("capsule", hard, found, alone) - set(handed) == set()


def test_runs_of_very_many_expansions_are_handed_back() -> None:
    given, device = drawn("capsule", 400, 5), on_host(most_expansions=1)
    found, handed = with_handed_back(device, given)
    alone = run(device.binding, given, lanes=1)
    assert len(handed) > 300
    assert found.stops.tolist() == alone.stops.tolist()
    for part in ("x_r", "v_r", "v_c", "position"):
        assert abs(found.records[part] - alone.records[part]).max() < 1e-6, part
    assert found.records["period"].tolist() == alone.records["period"].tolist()
    assert abs(found.strobe - alone.strobe).max() < 1e-6


@pytest.fixture(scope="module")
def as_given(hard: tuple[Any, ...]) -> tuple[tuple[Any, ...], Found]:
    given = tuple(np.concatenate(both) for both in zip(drawn("capsule", 900, 7), hard, strict=True))
    given = tuple(np.ascontiguousarray(part[:2000]) for part in given)
    return given, run(on_host(), given)


def same(one: Found, other: Found) -> bool:
    return bits(one.records) == bits(other.records) and all(
        a.tobytes() == b.tobytes() for a, b in zip(one[1:], other[1:], strict=True)
    )


def ways() -> Iterator[tuple[str, OnCard]]:
    yield "blocks of 32", on_host(block=32)
    backwards = on_host()
    yield "backwards", backwards
    chunks = on_host()
    chunks.card.room = 2**20  # type: ignore[attr-defined]
    yield "chunks", chunks


def test_results_do_not_depend_on_block_order_chunk_or_neighbours(
    as_given: tuple[tuple[Any, ...], Found],
) -> None:
    given, whole = as_given
    for way, device in ways():
        assert isinstance(device.card, Host)
        backwards = c_int.in_dll(device.card.library.runs, "shim_backwards")
        backwards.value = way == "backwards"
        assert same(run(device, given), whole), way
        backwards.value = 0
        if way == "chunks":
            assert sum(name == "capsule_tables" for name, _ in device.card.launches) > 4
    few = tuple(np.ascontiguousarray(part[5:1500:7]) for part in given)
    assert same(run(on_host(), few), Found(*(part[5:1500:7] for part in whole)))


def test_results_do_not_depend_on_pauses(
    as_given: tuple[tuple[Any, ...], Found], monkeypatch: pytest.MonkeyPatch
) -> None:
    given, whole = as_given
    monkeypatch.setattr(on_card, "_FIRST", 1)
    monkeypatch.setattr(on_card, "_LEAST", 0.0)  # no launch becomes longer
    device = on_host()
    assert same(run(device, given), whole)
    assert isinstance(device.card, Host)
    assert sum(name == "capsule_runs" for name, _ in device.card.launches) > 20


def test_launches_take_a_fraction_of_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock advances by a millisecond for each expansion that a launch may take."""
    device, now = on_host(), [0.0]
    host, asked = device.card, list[int]()
    launch = host.launch

    def slowly(kernel: str, count: int, *arguments: Any) -> None:
        launch(kernel, count, *arguments)
        if kernel == "capsule_runs":
            asked.append(int(arguments[-2]))
            now[0] += 1e-3 * asked[-1]

    monkeypatch.setattr(host, "launch", slowly)
    monkeypatch.setattr(on_card, "perf_counter", lambda: now[0])
    monkeypatch.setattr(on_card, "_FIRST", 4096)
    run(device, drawn("capsule", 50, 1))
    assert asked[0] == 4096
    monkeypatch.setattr(on_card, "_FIRST", 1)
    asked.clear()
    run(device, drawn("capsule", 50, 1))
    assert max(asked) <= 128  # 0.2 seconds at most
    assert asked[:6] == [1, 2, 4, 8, 16, 32]


def test_an_interrupt_ends_a_run_and_what_goes_on_beside_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    device, watch = on_host(), Watch()
    launch, launched = device.card.launch, list[str]()

    def interrupted(kernel: str, count: int, *arguments: Any) -> None:
        launched.append(kernel)
        if launched.count("capsule_runs") == 2:
            raise KeyboardInterrupt
        launch(kernel, count, *arguments)

    monkeypatch.setattr(device.card, "launch", interrupted)
    monkeypatch.setattr(on_card, "_FIRST", 1)
    with pytest.raises(KeyboardInterrupt):
        run(device, drawn("capsule", 50, 1), watch)
    assert watch.stopped


def test_an_error_of_one_chunk_does_not_stop_those_beside_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Chunks of a sweep have one watch: stopped, they would hide the reason."""
    device, watch = on_host(), Watch()

    def full(size: int) -> None:
        raise InvalidInput("device", "gpu", "cpu here: the memory is full")

    begun = run(device, drawn("capsule", 5, 1), watch)
    monkeypatch.setattr(device.card, "blank", full)
    with pytest.raises(InvalidInput, match="the memory is full"):
        device.run_many(drawn("capsule", 5, 1)[0], begun.records, 2, begun.stops, watch=watch)
    assert not watch.over


def test_a_stopped_run_goes_on_where_it_stopped() -> None:
    device, given = on_host(), drawn("capsule", 300, 3)
    rows, states, phases = given
    records, stops = np.empty(300, device.STATE), np.empty(300, np.int8)
    device.start_many(rows, states, phases, records, Watch())
    over = Watch()
    over.stop()
    assert device.run_many(rows, records, PERIODS, stops, watch=over) == 0
    assert set(stops.tolist()) == {device.STOPPED}
    device.run_many(rows, records, PERIODS, stops, watch=Watch())
    whole = run(device, given)
    assert stops.tolist() == whole.stops.tolist()
    assert records["x_r"].tobytes() == whole.records["x_r"].tobytes()


def test_a_state_that_is_no_start_is_refused() -> None:
    device, (rows, states, phases) = on_host(), drawn("capsule", 5, 1)
    records, stops = np.empty(5, device.STATE), np.empty(5, np.int8)
    device.start_many(rows, states, phases, records, Watch())
    records["gap"][3] = np.nan
    with pytest.raises(ValueError, match="no runs from some of the states"):
        device.run_many(rows, records, PERIODS, stops)


def test_no_runs_are_no_work() -> None:
    device, (rows, states, phases) = on_host(), drawn("capsule", 1, 1)
    records, stops = np.empty(0, device.STATE), np.empty(0, np.int8)
    device.start_many(rows[:0], states[:0], phases[:0], records, Watch())
    assert device.run_many(rows[:0], records, PERIODS, stops) == 0
