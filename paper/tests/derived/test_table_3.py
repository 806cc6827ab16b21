"""The run-time map stays inside the derived tables.

The successor field is whichever the guards' derivatives allow, and every local map visited must be
one of the derived Table 3.
"""

import random
from functools import cache
from typing import Any

import pytest

from capsule_sym import Parameters, results, simulate
from paper.derived.local_maps import local_maps


@cache
def _derived() -> set[tuple[str, int, str]]:
    return {(one.target, one.field, one.source) for one in local_maps()}


def _random_case(rng: random.Random, scenario: int) -> tuple[Parameters, Any, float]:
    parameters = Parameters(
        alpha=rng.choice([rng.uniform(0, 3), 10 ** rng.uniform(-3, 1.5)]),
        omega=10 ** rng.uniform(-1, 0.7),
        delta=(rng.uniform(0, 0.9), 1.0, rng.uniform(1.1, 3))[scenario],
        zeta=10 ** rng.uniform(-3, 0.7),
        beta=rng.choice([0.0, rng.uniform(0, 5), 10 ** rng.uniform(-1, 3)]),
        gamma=10 ** rng.uniform(-1.5, 1.5),
    )
    state = (rng.uniform(-2, 2), rng.uniform(-2, 2), rng.choice([0.0, rng.uniform(-1, 1)]))
    return parameters, state, rng.uniform(0, parameters.period * 0.999)


def _visited(count: int, seed: int) -> tuple[int, set[tuple[str, int, str]]]:
    rng, segments, visited = random.Random(seed), 0, set()
    while segments < count:
        for scenario in range(3):
            parameters, state, phase = _random_case(rng, scenario)
            run = simulate(parameters, state, phase, periods=6, max_segments=400)
            assert run.status is not results.Status.UNDECIDED, (parameters, state, phase)
            segments += len(run.segments)
            visited |= {
                (s.target, s.field, s.source) for s in run.segments if s.source and s.target
            }
    return segments, visited


def test_every_local_map_of_a_random_run_is_derived() -> None:
    _, visited = _visited(1_500, seed=1)
    assert visited <= _derived()
    assert len(visited) > 20


@pytest.mark.long
def test_every_local_map_of_a_hundred_thousand_segments_is_derived() -> None:
    segments, visited = _visited(100_000, seed=2)
    print(f"{segments} segments, {len(visited)} of {len(_derived())} local maps")
    assert visited <= _derived()


def test_a_map_missing_from_the_table_would_be_seen() -> None:
    _, visited = _visited(1_000, seed=3)
    assert not visited <= _derived() - {("Σ2", 1, "Σ8")}
