"""Microseconds a switch of each scene that ships, beside the capsule's in the same rounds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from statistics import median
from time import process_time
from typing import NamedTuple

import numpy as np

from capsule_sym import simulate, simulate_many
from capsule_sym._parameters import SHIPPED, scene
from capsule_sym.inputs import SceneParameters

GOAL = 1.3
"""Most of the capsule's time that another scene is to take."""

_FIRST = "capsule"
_DRAWN = {
    **{"alpha": (0.3, 2.0), "omega": (0.3, 2.5), "zeta": (0.01, 0.1), "gamma": (0.5, 5.0)},
    **{name: (0.02, 1.0) for name in ("delta", "delta_1", "delta_2")},
    **{name: (1.0, 30.0) for name in ("beta", "beta_1", "beta_2")},
    **{"D": (0.1, 0.9), "alpha_low": (0.0, 0.0)},
}


class Speed(NamedTuple):
    """A scene's times over one kind of runs, in microseconds of processor time a switch.

    `alone` is of runs one by one, `many` of all of them by one call; `ratio` and `many_ratio` are
    to the first scene, each the median of the rounds.
    """

    scene: str
    runs: str
    switches: float
    alone: float
    ratio: float
    many: float
    many_ratio: float


def how(rounds: int) -> str:
    """Method of the measurement, in one line."""
    return f"processor time, the median of {rounds} rounds through all scenes"


def speeds(quick: bool, rounds: int) -> Iterator[Speed]:
    """Speeds of all scenes over typical and over random runs; `switches` are those of a period."""
    count, periods = (20, 20) if quick else (200, 100)
    for runs in ("typical", "random"):
        kept = {name: _rows(name, runs, count) for name in SHIPPED}
        passed = {name: _switches(rows, periods) for name, rows in kept.items()}
        taken: dict[str, list[tuple[float, float]]] = {name: [] for name in SHIPPED}
        for _ in range(rounds):
            for name, rows in kept.items():
                alone = _time(partial(_alone, rows, periods))
                many = _time(partial(simulate_many, rows, periods=periods))
                taken[name].append((alone / passed[name] * 1e6, many / passed[name] * 1e6))
        for name, times in taken.items():
            both = [[round_[i] for round_ in times] for i in (0, 1)]
            firsts = [[round_[i] for round_ in taken[_FIRST]] for i in (0, 1)]
            ratios = [
                median(a / b for a, b in zip(own, first, strict=True))
                for own, first in zip(both, firsts, strict=True)
            ]
            each = passed[name] / count / periods
            alone, many = map(median, both)
            yield Speed(name, runs, each, alone, ratios[0], many, ratios[1])


def _rows(name: str, runs: str, count: int) -> list[SceneParameters]:
    """Parameter sets: the default ones about their drive, or others with the same bounds."""
    random, rows = np.random.default_rng(1), []
    default = scene(name).Parameters()
    for _ in range(count):
        if runs == "typical":
            drawn = {
                "alpha": default.alpha * random.uniform(0.7, 1.4),
                "omega": default.omega * random.uniform(0.8, 1.2),
            }
        else:
            names = [one for one in _DRAWN if hasattr(default, one)]
            drawn = {one: random.uniform(*_DRAWN[one]) for one in names}
        rows.append(default.replace(**drawn))
    return rows


def _alone(rows: list[SceneParameters], periods: int) -> None:
    for row in rows:
        simulate(row, periods=periods, keep="final")


def _switches(rows: list[SceneParameters], periods: int) -> int:
    """Switches of runs from rest, the drive's edges among them."""
    return sum(len(simulate(row, periods=periods).segments) for row in rows)


def _time(call: Callable[[], object]) -> float:
    begin = process_time()
    call()
    return process_time() - begin
