"""Many runs, sweeps, basins, their stores, and the measurement, with runs as on a card."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.speed import gpu
from capsule_sym import (
    Axis,
    InvalidInput,
    Parameters,
    Sweep,
    attractors,
    continue_attractors,
    open_results,
    refine_sweep,
    run_basin,
    run_sweep,
    simulate_many,
)
from capsule_sym._native import core
from capsule_sym._native.device import COMPILED
from capsule_sym._native.on_card import OnCard
from capsule_sym._parameters import SHIPPED, as_scene
from tests.gpu.host import COMPILER, on_host

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(COMPILER is None, reason="no C++ compiler here"),
    pytest.mark.skipif(core is None, reason="no C core here"),
]


@pytest.fixture(autouse=True)
def card(monkeypatch: pytest.MonkeyPatch) -> OnCard:
    """The host's memory and compiler in place of a card."""
    device = on_host()
    monkeypatch.setattr("capsule_sym._native.cuda.card_of", lambda scene, binding: device)
    return device


@pytest.mark.parametrize("keep", ["final", "stroboscopic"])
def test_many_runs_agree_with_those_of_the_processor(card: OnCard, keep: str) -> None:
    rows = [Parameters(alpha=alpha) for alpha in np.linspace(0.0, 2.0, 300)]
    given: Any = rows, (0.01, 0.2, 0.0), 0.3, 40
    here, there = (simulate_many(*given, keep=keep, device=device) for device in ("cpu", "gpu"))
    assert {name for name, _ in card.card.launches} >= {"capsule_runs"}  # type: ignore[attr-defined]
    assert here.status.tolist() == there.status.tolist()
    assert here.offsets.tolist() == there.offsets.tolist()
    assert here.kept.shape == there.kept.shape
    settled = np.linspace(0.0, 2.0, 300) < 1.0  # not chaotic
    assert abs(here.states - there.states)[settled].max() < 1e-10
    assert abs(here.advances - there.advances)[settled].max() < 1e-10


def test_a_limit_of_time_ends_many_runs_with_what_they_have() -> None:
    found = simulate_many([Parameters()] * 10, periods=50, device="gpu", max_seconds=1e-9)
    assert set(found.status.tolist()) == {"time-limit"}
    assert found.periods.tolist() == [0] * 10


def sweep() -> Sweep:
    alpha, gamma = np.linspace(0.02, 1.0, 12), np.linspace(1.0, 4.0, 6)
    axes = Axis.of("alpha", alpha), Axis.of("gamma", gamma)
    return Sweep(
        axes, periods=200, compute=("itinerary", "progression", "energies", "forces", "multipliers")
    )


def test_a_sweep_agrees_with_that_of_the_processor_and_its_store_names_the_card(
    tmp_path: Path, card: OnCard
) -> None:
    summaries = [
        run_sweep(sweep(), tmp_path / device, device=device, workers=2) for device in ("cpu", "gpu")
    ]
    assert summaries[0].outcomes == summaries[1].outcomes
    with open_results(tmp_path / "cpu") as here, open_results(tmp_path / "gpu") as there:
        assert there.attrs["core"] == "host"
        for name in ("itinerary", "outcome", "period_number"):
            assert (here[name].values == there[name].values).all(), name
        names = "progression", "work", "peak_force", "multipliers"
        for name in names:
            close = np.isclose(here[name].values, there[name].values, 1e-9, 1e-12, equal_nan=True)
            assert close.all(), name
    assert {name for name, _ in card.card.launches} >= {*COMPILED}  # type: ignore[attr-defined]
    with pytest.raises(InvalidInput, match="must be 'host'"):
        run_sweep(sweep(), tmp_path / "gpu", resume=True)
    again = run_sweep(sweep(), tmp_path / "gpu", resume=True, device="gpu")
    assert again.computed == 0


def test_other_executors_than_threads_are_refused_and_nothing_is_written(tmp_path: Path) -> None:
    with pytest.raises(InvalidInput, match="executor = 'processes': must be one of threads"):
        run_sweep(sweep(), tmp_path / "store", device="gpu", executor="processes")
    assert not (tmp_path / "store").exists()


def test_basins_and_refined_charts_are_computed_on_a_card(tmp_path: Path) -> None:
    starts = Axis.linear("x_r", -1.0, 0.5, 8), Axis.linear("v_r", -1.0, 1.0, 8)
    basin = Sweep(starts, Parameters(alpha=0.6), periods=150)
    found = [run_basin(basin, tmp_path / f"basin-{d}", device=d)[1] for d in ("cpu", "gpu")]
    assert found[0].numbers.tolist() == found[1].numbers.tolist()
    for device in ("cpu", "gpu"):
        refine_sweep(sweep(), tmp_path / f"chart-{device}", stride=4, device=device)
    with (
        open_results(tmp_path / "chart-cpu") as here,
        open_results(tmp_path / "chart-gpu") as there,
    ):
        assert there.attrs["core"] == "host"
        assert (here["itinerary"].values == there["itinerary"].values).all()


def test_attractors_and_their_fractions_are_computed_on_a_card(card: OnCard) -> None:
    system = Parameters(alpha=2.8, omega=0.4, zeta=0.01, beta=5.0, gamma=5.0)
    box = {"x_r": (-2.0, 2.0), "v_r": (-2.0, 2.0)}
    here, there = (attractors(system, box, count=100, device=d) for d in ("cpu", "gpu"))
    assert here.numbers.tolist() == there.numbers.tolist()
    assert [one.itinerary for one in here.attractors] == [one.itinerary for one in there.attractors]
    assert len(here.attractors) > 1
    assert {name for name, _ in card.card.launches} >= {"capsule_runs"}  # type: ignore[attr-defined]
    along = [
        continue_attractors(system, "alpha", [2.7, 2.8], box, count=50, device=device)
        for device in ("cpu", "gpu")
    ]
    counts = [[one.counts.tolist() for one in found.branches] for found in along]
    assert counts[0] == counts[1]


@pytest.mark.parametrize("name", SHIPPED)
def test_rows_share_a_flow_if_the_core_shares_its_tables(name: str) -> None:
    """The core makes no table again where the parameters of its flows are the same."""
    scene, device = as_scene(name), on_host(name)
    text = (files(scene.package) / "c" / "capsule_interface.h").read_text()
    said = text.partition("CAPSULE_FLOW_PARAMETERS(of)")[2].partition("#define")[0]
    names = re.findall(r"of\((\w+)\)", said)
    assert sorted(scene.facts.PARAMETERS[i] for i in device.flow) == sorted(names)


def test_the_measurement_counts_what_differs(monkeypatch: pytest.MonkeyPatch, card: OnCard) -> None:
    monkeypatch.setattr(gpu, "PERIODS", 20)
    rows = np.tile([*Parameters().to_dict().values()], (50, 1))

    def differing() -> list[float]:
        return [goal.value for goal in gpu.ends("runs", rows, 0.0, 0.0, 1.0)][1:]

    assert differing() == [0.0]
    rate, back, other = gpu.chart("chart", 20, gpu.METRICS, 1.0)
    assert (rate.unit, back.value, other.value) == ("million periods/s", 0.0, 0.0)
    begun = card.start_many

    def moved(rows: Any, states: Any, *others: Any) -> None:
        begun(rows, states + 0.1, *others)

    monkeypatch.setattr(card, "start_many", moved)
    assert differing() == [50.0]
