"""Switching times of the core beside 50 digits, along ordinary motions."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hardcases.reference import CONTRACT, error
from capsule_sym import Parameters
from capsule_sym._map.backend import NumpyBackend, backend
from capsule_sym._map.course import Course, SegmentStart
from capsule_sym._map.location import End, locate
from capsule_sym._map.reference import Run
from capsule_sym._map.transitions import State, start_at
from capsule_sym._native import core
from tests.finals import parameter_rows

pytestmark = pytest.mark.skipif(core is None, reason="the C core was not compiled")


class CheckedRun(Run):
    """A run every switch of which the core and 50 digits find too, from the same doubles."""

    worst = 0.0

    def first_switch(self, state: State, begin: SegmentStart, limit: float) -> tuple[Course, End]:
        known = self.exact is None
        with backend("mpmath") as digits:
            given = self.exactly(digits, state)
        flow, switch = super().first_switch(state, begin, limit)
        if not (known and switch.guards):
            return flow, switch
        record, segments = np.zeros((), core.records.STATE), np.empty(1, core.records.SEGMENT)
        record[...] = (*state[:5], state.angle_rest, 0.0, 0, state.bound, 0, 0)
        native = core.map(parameter_rows(self.parameters)[0])
        assert native.run(record, 10**6, segments=segments)[1] == 1
        with backend("mpmath") as digits:
            c = digits.constants(begin.field, self.parameters)
            start = start_at(c, given)._replace(zeros=begin.start.zeros)
            true = locate(Course(digits, c, replace(begin, start=start)), digits.number(limit))
            duration = float(segments[0]["duration"])
            off = error(digits, self.parameters, begin, duration, true)
        self.worst = max(self.worst, off.amplitude)
        return flow, switch


@pytest.mark.parametrize("alpha", [0.3, 0.939, 1.5, 1.6148])
def test_switching_times_keep_the_accuracy_contract(alpha: float) -> None:
    run = CheckedRun(NumpyBackend(), Parameters(alpha=alpha), escalate=True)
    run.go((0.0, 0.0, 0.0), 0.0, 3, 100)
    assert 0 < run.worst <= CONTRACT


@pytest.mark.long
def test_switching_times_of_random_motions_keep_the_accuracy_contract() -> None:
    random = np.random.default_rng(5)
    for _ in range(120):
        alpha, omega = random.uniform(0, 3), random.uniform(0.3, 6)
        delta, zeta = random.choice([0.0, 0.02, 0.3]), random.choice([0.02, 0.2, 1.0, 2.5])
        others = random.uniform((0, 0.2, 0.2), (30, 8, 2)).tolist()
        parameters = Parameters(alpha, omega, delta, zeta, *others)
        run = CheckedRun(NumpyBackend(), parameters, escalate=True)
        run.go(tuple(random.uniform(-0.5, 0.5, 3).tolist()), 0.0, 1, 8)
        assert run.worst <= CONTRACT, parameters
