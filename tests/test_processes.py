"""Ctrl-C in calls of libraries that drop it, and limits of searches."""

import inspect
import math
import signal
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

import capsule_sym
from capsule_sym import Parameters, attractors, fit, inputs, results, simulate_many, tolerances
from capsule_sym._map import labelled, many
from capsule_sym._native import core

SERIES = {"t": np.arange(9.0), "x_r": np.sin(np.arange(9.0))}


@pytest.mark.parametrize(
    ("place", "call"),
    [
        ((qmc, "Sobol"), lambda: inputs.Axis.sobol({"alpha": (0, 1)}, 8, 1)),
        ((qmc, "Sobol"), lambda: tolerances("velocity", {"beta": 0.1}, samples=64)),
        ((qmc, "Sobol"), lambda: fit(SERIES, Parameters(), ["alpha"], starts=8)),
        ((qmc, "Halton"), lambda: attractors(Parameters(), {"x_r": (-1, 1)}, count=8)),
        ((labelled, "import_module"), lambda: labelled.package("scipy.stats")),
    ],
)
def test_an_interrupt_that_a_library_drops_ends_the_call(place, call, monkeypatch) -> None:
    true = getattr(*place)

    def drops(*given: Any, **how: Any) -> Any:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        return true(*given, **how)

    monkeypatch.setattr(*place, drops)
    with pytest.raises(KeyboardInterrupt):
        call()


SEARCHES = ["attractors", "continue_attractors", "fit", "minimal_shock", "optimise"]
SEARCHES += ["pareto", "run_sweep", "search_orbits", "switch_by_pulse", "tolerances"]


@pytest.mark.parametrize("name", SEARCHES)
def test_a_search_ends_by_itself(name: str) -> None:
    limit = inspect.signature(getattr(capsule_sym, name)).parameters["max_seconds"].default
    assert 60 <= limit < math.inf


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
def test_a_run_that_the_core_leaves_open_is_bounded() -> None:
    found = simulate_many([Parameters()] * 2, [(0.02, 0.0, 1e-300), (0.0, 0.0, 0.0)], max_open=0)
    assert found.status.tolist() == ["segment-limit", "finished"]


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
def test_runs_that_the_core_leaves_open_are_not_begun_after_the_limit(monkeypatch) -> None:
    begun: list[Any] = []

    def finish(run: Any, *_: Any) -> results.Status:
        begun.append(run.watch.stop())
        return results.Status.TIME_LIMIT

    monkeypatch.setattr(many, "_finish", finish)
    found = simulate_many([Parameters()] * 9, (0.02, 0.0, 1e-300), periods=1)
    assert (len(begun), set(found.status.tolist())) == (1, {"time-limit"})
