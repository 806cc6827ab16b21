"""Periodic motions and metrics by the device source beside the core's: the same bits."""

from __future__ import annotations

from ctypes import c_int
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from capsule_sym import Parameters, performance_many, simulate_many
from capsule_sym._native import Watch, core_of, on_card
from capsule_sym._native.device import source
from capsule_sym._native.on_card import OnCard
from capsule_sym._parameters import CAPSULE, SHIPPED, as_scene
from capsule_sym.generated.capsule.interface import OrbitStatus
from tests.gpu.host import COMPILER, Host, compiled, on_host
from tests.gpu.test_runs import drawn

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(COMPILER is None, reason="no C++ compiler here"),
    pytest.mark.skipif(core_of(as_scene("capsule")) is None, reason="no C core here"),
]
SETTLING, LAST = 200, 32


class Ends(NamedTuple):
    """Ends of runs by the core, with the states of the last periods."""

    rows: NDArray[np.float64]
    records: NDArray[Any]
    stops: NDArray[np.int8]
    strobe: NDArray[np.float64]


class Motions(NamedTuple):
    """Periodic motions at the ends of runs, and their orbits."""

    stops: NDArray[np.int8]
    motions: NDArray[Any]
    switches: NDArray[np.uint8]
    closed: NDArray[np.int8]
    orbits: NDArray[Any]
    fields: NDArray[np.uint8]


def ends_of(name: str, count: int, flows: int) -> Ends:
    binding = core_of(as_scene(name))
    assert binding is not None
    rows, states, phases = drawn(name, count, flows)
    records, stops = np.empty(count, binding.STATE), np.empty(count, np.int8)
    strobe = np.empty((count, LAST + 1, 3))
    binding.start_many(rows, states, phases, records, Watch())
    binding.run_many(rows, records, SETTLING, stops)
    records["period"] = 0
    binding.run_many(rows, records, LAST, stops, strobe)
    return Ends(rows, records, stops, strobe)


def motions_of(binding: Any, ends: Ends, watch: Watch | None = None) -> Motions:
    rows, records, stops, strobe = ends
    count, stops = len(rows), stops.copy()
    motions, switches = np.zeros(count, binding.MOTION), np.zeros((count, 512), np.uint8)
    binding.steady_many(rows, records, strobe, 1e-9, stops, motions, switches, watch)
    closed = np.where(motions["period_number"] > 0, 0, binding.REFUSED).astype(np.int8)
    states = np.stack([records[part] for part in ("x_r", "v_r", "v_c")], axis=-1)
    orbits, fields = np.zeros(count, binding.ORBIT), np.zeros((count, 256), np.uint8)
    of = rows, states, motions["period_number"].copy(), closed, orbits, fields, True, True
    binding.orbit_many(*of, watch=watch)
    return Motions(stops, motions, switches, closed, orbits, fields)


def differing(one: Motions, other: Motions) -> set[str]:
    """Names of results with other bits."""
    pairs = [(part, getattr(one, part), getattr(other, part)) for part in one._fields]
    numbers = [(part, a, b) for part, a, b in pairs if not a.dtype.names]
    for _, a, b in pairs:
        numbers += [(name, a[name], b[name]) for name in a.dtype.names or ()]
    return {name for name, a, b in numbers if a.tobytes() != b.tobytes()}


@pytest.mark.parametrize("name", SHIPPED)
def test_motions_and_metrics_are_those_of_the_core_to_the_last_bit(name: str) -> None:
    """But for the peak of the force: the core searches it without fused sums."""
    ends, device = ends_of(name, 2000, 40), on_host(name)
    found, alone = motions_of(device, ends), motions_of(device.binding, ends)
    assert differing(found, alone) <= {"peak_force"}
    peaks = found.orbits["peak_force"], alone.orbits["peak_force"]
    assert np.isclose(*peaks, 1e-14, 0.0, equal_nan=True).all()
    periodic = alone.motions["period_number"]
    assert (periodic > 0).sum() > 1000
    assert (alone.orbits["status"][periodic > 0] == OrbitStatus.CLOSED).sum() > 1000
    assert device.handed_back < 200
    if name == "capsule":
        assert len(set(periodic.tolist())) > 3


def test_without_work_or_room_the_core_computes_all(monkeypatch: pytest.MonkeyPatch) -> None:
    ends, device = ends_of("capsule", 300, 5), on_host()
    alone = motions_of(device.binding, ends)
    tasks = len(ends.rows) + (alone.motions["period_number"] > 0).sum()
    for name, least in (("_WORK", tasks), ("_SEGMENTS", 100), ("_EVENTS", 100)):
        with monkeypatch.context() as patch:
            patch.setattr(on_card, name, 1)
            before = device.handed_back
            found = motions_of(device, ends)
        assert device.handed_back - before >= least, name
        assert differing(found, alone) <= {"peak_force"}, name


def test_results_do_not_depend_on_block_order_or_chunk() -> None:
    ends = ends_of("capsule", 500, 7)
    whole = motions_of(on_host(), ends)
    for way in ("blocks of 32", "backwards", "chunks"):
        device = on_host(block=32) if way == "blocks of 32" else on_host()
        card = device.card
        assert isinstance(card, Host)
        assert card.library.orbits is not None
        backwards = c_int.in_dll(card.library.orbits, "shim_backwards")
        backwards.value = way == "backwards"
        card.room = 2**20 if way == "chunks" else card.room
        assert differing(motions_of(device, ends), whole) == set(), way
        backwards.value = 0
        if way == "chunks":
            assert sum(name == "capsule_orbits" for name, _ in card.launches) > 4


def test_what_is_not_finished_is_left_alone_and_a_watch_stops_the_rest() -> None:
    ends, device, over = ends_of("capsule", 100, 3), on_host(), Watch()
    ends.stops[::2] = device.OPEN
    found, alone = motions_of(device, ends), motions_of(device.binding, ends)
    assert found.stops.tolist() == alone.stops.tolist()
    assert set(found.stops[::2].tolist()) == {device.OPEN}
    over.stop()
    stopped = motions_of(device, ends, over)
    assert set(stopped.stops[1::2].tolist()) == {device.STOPPED}


def test_gradients_are_those_of_the_core(monkeypatch: pytest.MonkeyPatch) -> None:
    device = on_host()
    monkeypatch.setattr("capsule_sym._native.cuda.card_of", lambda scene, binding: device)
    rows = [[*Parameters(alpha=alpha).to_dict().values()] for alpha in (0.5, 1.0)]
    given = rows, simulate_many(np.array(rows), periods=300).states
    here, there = (performance_many(*given, gradients=True, device=d) for d in ("cpu", "gpu"))
    assert here.closed.all()
    assert here.records.tobytes() == there.records.tobytes()


def test_a_weakened_metric_is_noticed() -> None:
    """Another weight of the damper's loss in the device source, and no other."""
    text, term = source(CAPSULE), "*loss += weight * damper_power(c, v_r);"
    assert text.count(term) == 1
    other = text.replace(term, "*loss += 0.999 * weight * damper_power(c, v_r);")
    wrong = compiled(other, "-DBLOCK=1")
    device, ends = on_host(), ends_of("capsule", 100, 3)
    changed = OnCard(device.binding, CAPSULE, Host(wrong))
    seen = differing(motions_of(changed, ends), motions_of(device, ends))
    assert seen == {"damper_loss", "work"}


def test_the_core_beside_a_card_has_a_watch(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that an interrupt stops it too, where the caller has none."""
    ends, device, watches = ends_of("capsule", 50, 2), on_host(), list[Any]()
    core = device.binding

    def steady(*given: Any) -> None:
        watches.append(given[-1])
        core.steady_many(*given)

    def orbit(*given: Any) -> None:
        watches.append(given[-1])
        core.orbit_many(*given)

    beside = SimpleNamespace(**vars(core) | {"steady_many": steady, "orbit_many": orbit})
    monkeypatch.setattr(device, "binding", beside)
    monkeypatch.setattr(on_card, "_WORK", 1)
    motions_of(device, ends)
    assert len(watches) == 2
    assert all(isinstance(one, Watch) for one in watches)
