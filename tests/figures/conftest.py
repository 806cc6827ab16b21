from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import pytest

from capsule_sym import Parameters, Trajectory, simulate
from capsule_sym._figures import store as kept
from capsule_sym._figures.store import Store


def untracked(items: Iterable[Any], text: str, total: int | None) -> Iterable[Any]:
    return items


@pytest.fixture(scope="session")
def store(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return Store(untracked, tmp_path_factory.mktemp("cache"))


@pytest.fixture(scope="session")
def settled() -> Callable[..., Trajectory]:
    """The run of the case study from rest at an amplitude, which ends in a steady motion."""

    def run(alpha: float, gamma: float = 3.0, periods: int = 128) -> Trajectory:
        return simulate(Parameters(alpha=alpha, gamma=gamma), periods=periods)

    return run


@pytest.fixture(scope="session")
def branch(store: Store) -> Any:
    """The branch of the case study at gamma = 3, as plain data."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kept, "_BRANCH_POINTS", 30)
        return store.branch(Parameters(gamma=3.0), "alpha", 0.005, 2.0)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path
