from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from capsule_sym import Parameters, continue_orbit, results, simulate, solve_orbit


@pytest.fixture(scope="session")
def settled() -> Callable[..., results.Trajectory]:
    """The run of the case study from rest at an amplitude, which ends in a steady motion."""

    @cache
    def run(alpha: float, gamma: float = 3.0, periods: int = 128) -> results.Trajectory:
        return simulate(Parameters(alpha=alpha, gamma=gamma), periods=periods)

    return run


@pytest.fixture(scope="session")
def branch() -> results.Branch:
    """The branch of the case study at gamma = 3."""
    return continue_orbit(solve_orbit(Parameters(alpha=0.005, gamma=3.0)), "alpha", 2.0, points=30)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
