"""Ctrl-C in calls of libraries that drop it."""

import signal
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from scipy.stats import qmc

from capsule_sym import Axis, Parameters, attractors, fit, tolerances
from capsule_sym._map import labelled

SERIES = {"t": np.arange(9.0), "x_r": np.sin(np.arange(9.0))}


@pytest.mark.parametrize(
    ("place", "call"),
    [
        ((qmc, "Sobol"), lambda: Axis.sobol({"alpha": (0, 1)}, 8, 1)),
        ((qmc, "Sobol"), lambda: tolerances("velocity", {"beta": 0.1}, samples=64)),
        ((qmc, "Sobol"), lambda: fit(SERIES, Parameters(), ["alpha"], starts=8)),
        ((qmc, "Halton"), lambda: attractors(Parameters(), {"x_r": (-1, 1)}, count=8)),
        ((labelled, "import_module"), lambda: labelled.package("scipy.stats")),
    ],
)
def test_an_interrupt_that_a_library_drops_ends_the_call(
    place: Any, call: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    true = getattr(*place)

    def drops(*given: Any, **how: Any) -> Any:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        return true(*given, **how)

    monkeypatch.setattr(*place, drops)
    with pytest.raises(KeyboardInterrupt):
        call()
