"""Every hard case by name: against 50 digits and an integrator of its own."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys

import pytest

from benchmarks.hardcases.cases import Case, cases
from benchmarks.hardcases.reference import check
from benchmarks.hardcases.table import rows
from capsule_sym._native import core
from tests.judges import taylor_events

CASES = {case.name: case for case in cases()}

BEYOND_THE_JUDGE = {
    # It subdivides at rational points, so at a tangency that is exact it has no answer.
    "exact graze",
    "exact sliding tangency",
    # Its steps follow the fastest rate: minutes of them.
    "zeta = 1000",
    "gamma = 1e-06",
    "omega = 0.0001",
    "omega = 1e-4, free oscillations",
    "omega = 1e-4, zeta = 1000",
    "10^6 periods of stick",
}


# The quick suite samples the cases; `make test-long` has all of them, and so has the command.
SAMPLED = [
    pytest.param(name, marks=[] if index % 20 == 0 else pytest.mark.long)
    for index, name in enumerate(CASES)
]


@pytest.mark.parametrize("name", SAMPLED)
def test_switches_are_those_of_50_digits_and_as_accurate_as_promised(name: str) -> None:
    checked = check(CASES[name].build())
    assert not checked.wrong
    assert checked.found == checked.true
    assert checked.error.amplitude <= 8.0


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(set(CASES) - BEYOND_THE_JUDGE))
def test_fields_are_those_of_the_independent_judge(name: str) -> None:
    start = CASES[name].build()
    truth = taylor_events.run(start.parameters, start.state, start.phase, start.periods)
    found = "".join(str(segment.field) for segment in start.run().segments)
    assert found == truth.fields[: start.max_segments]


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
@pytest.mark.parametrize("name", SAMPLED)
def test_the_core_switches_where_the_reference_map_does(name: str) -> None:
    start = CASES[name].build()
    passed = [
        [(segment.field, segment.target) for segment in start.run(backend).segments]
        for backend in ("c", "numpy")
    ]
    assert passed[0] == passed[1]


def test_names_are_unique() -> None:
    listed: list[Case] = list(cases())
    assert len({case.name for case in listed}) == len(listed)


def test_every_case_beyond_the_judge_is_a_case() -> None:
    assert set(CASES) >= BEYOND_THE_JUDGE


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="signals are not sent to one process there")
def test_the_processes_of_a_table_leave_ctrl_c_to_the_command() -> None:
    found = rows([*cases()][:6])
    next(found)
    for process in multiprocessing.active_children():
        assert process.pid is not None
        os.kill(process.pid, signal.SIGINT)
    assert len(list(found)) == 5
