"""Arguments of the core are checked: arrays that it would overrun are refused."""

import math

import numpy as np
import pytest

from capsule_sym import InvalidInput, Parameters
from capsule_sym._native import core
from tests.finals import final_states, parameter_rows

pytestmark = pytest.mark.skipif(core is None, reason="the C core was not compiled")

ROWS = parameter_rows(Parameters(), alpha=np.linspace(0.5, 0.9, 9))
NONE = [("plane", 10**6), ("plane", -1), ("bound", 7), ("period", -(10**6)), ("position", math.nan)]
NONE += [("angle", -1e308), ("angle", 6.3), ("angle_rest", 1e300), ("x_r", math.nan)]
NONE += [("gap", math.inf), ("v_r", -math.inf), ("v_c", math.nan)]


@pytest.mark.parametrize(("name", "value"), NONE)
def test_a_record_that_is_no_state_is_refused(name: str, value: float) -> None:
    native = core.map(ROWS[0])
    record, strobe = native.state_at(0.0, 0.0, 0.0, 0.0), np.zeros((6, 3))
    record[name] = value
    with pytest.raises(ValueError, match="no run from"):
        native.run(record, 5, strobe=strobe)
    assert not strobe.any()
    records = np.stack([native.state_at(0.0, 0.0, 0.0, 0.0)] * len(ROWS))
    records[3] = record
    stops, marks = np.zeros(len(ROWS), np.int8), np.zeros((len(ROWS), 6, 3))
    with pytest.raises(ValueError, match="no runs from some"):
        core.run_many(ROWS, records, 5, stops, marks)
    assert stops[3] == core.REFUSED
    assert not marks[3].any()
    assert (np.delete(stops, 3) == core.DONE).all()
    stops[:], motions = core.DONE, np.zeros(len(ROWS), core.records.MOTION)
    switches = np.zeros((len(ROWS), 64), np.uint8)
    core.steady_many(ROWS, records, marks, 1e-9, stops, motions, switches)
    # The motion is counted from the end of the run on.
    assert (stops[3] == core.REFUSED) == (name != "period")


@pytest.mark.parametrize("place", range(7))
@pytest.mark.parametrize("value", [-1.0, math.nan, math.inf])
def test_parameters_that_are_none_are_refused(place: int, value: float) -> None:
    row = ROWS[0].copy()
    row[place] = value
    native = core.map(row)
    for phase in (0.0, -1e308):
        with pytest.raises(ValueError, match="no run from"):
            native.run(native.state_at(0.0, 0.0, 0.0, phase), 5, strobe=np.empty((6, 3)))
        with pytest.raises(ValueError, match="no run from"):
            native.end_of_run(0.0, 0.0, 0.0, phase, 5, 0)


def test_arrays_of_other_sizes_are_refused() -> None:
    count = len(ROWS)
    records, stops = np.empty(count, core.records.STATE), np.zeros(count, np.int8)
    starts, phases = np.zeros((count, 3)), np.zeros(count)
    motions, switches = np.zeros(count, core.records.MOTION), np.zeros((count, 64), np.uint8)
    marks = np.zeros((count, 6, 3))
    core.start_many(ROWS, starts, phases, records)
    for call in (
        lambda: core.start_many(ROWS[1:], starts, phases, records),
        lambda: core.start_many(ROWS[:, :6].copy(), starts, phases, records),
        lambda: core.start_many(ROWS, starts[1:], phases, records),
        lambda: core.start_many(ROWS, starts[:, :2].copy(), phases, records),
        lambda: core.start_many(ROWS, starts, phases[1:], records),
        lambda: core.start_many(ROWS, starts, phases, np.empty(count)),
        lambda: core.run_many(ROWS[1:], records, 5, stops),
        lambda: core.run_many(ROWS, records[1:], 5, stops),
        lambda: core.run_many(ROWS, records, 5, stops[1:]),
        lambda: core.run_many(ROWS, records, 5, stops, marks[1:]),
        lambda: core.run_many(ROWS, records, 6, stops, marks),
        lambda: core.run_many(ROWS, records, 5, stops, stride=0),
        lambda: core.run_many(ROWS, motions, 5, stops),
        lambda: core.steady_many(ROWS[1:], records, marks, 1e-9, stops, motions, switches),
        lambda: core.steady_many(ROWS, records, marks[1:], 1e-9, stops, motions, switches),
        lambda: core.steady_many(ROWS, records, marks[:, :1], 1e-9, stops, motions, switches),
        lambda: core.steady_many(ROWS, records, marks, 1e-9, stops[1:], motions, switches),
        lambda: core.steady_many(ROWS, records, marks, 1e-9, stops, motions[1:], switches),
        lambda: core.steady_many(ROWS, records, marks, 1e-9, stops, records, switches),
        lambda: core.steady_many(ROWS, records, marks, 1e-9, stops, motions, switches[1:]),
        lambda: core.map(ROWS[0]).run(np.zeros(()), 5),
        lambda: core.map(ROWS[0]).run(records[0], 5, strobe=np.zeros((5, 3))),
        lambda: core.map(ROWS[0][:6]),
    ):
        with pytest.raises((ValueError, TypeError)):
            call()


@pytest.mark.parametrize("value", [1.01e20, -1e300, math.inf, math.nan])
def test_states_that_simulate_refuses_are_refused_side_by_side(value: float) -> None:
    states = np.zeros((len(ROWS), 3))
    states[4, 1] = value
    with pytest.raises(InvalidInput, match=r"states = .* must be numbers of size at most 1e\+20"):
        final_states(ROWS, states)
