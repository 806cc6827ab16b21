"""Work in C stops at Ctrl-C and at a watch, keeps what it has, and needs no room that grows."""

import subprocess
import sys
import threading
import tracemalloc

import numpy as np
import pytest

from capsule_sym import Parameters, results, simulate
from capsule_sym._native import Watch, core
from tests.finals import final_states, parameter_rows

pytestmark = pytest.mark.skipif(core is None, reason="the C core was not compiled")

FOR_EVER = 10**12  # periods that would take days
GENEROUS = 60.0  # seconds until work that should have stopped counts as not stopped
ROWS = parameter_rows(Parameters(), alpha=np.linspace(0.5, 0.9, 21))

INTERRUPTED = """
import os, signal, threading
import numpy as np
from capsule_sym import Parameters, simulate, simulate_many

slow = [Parameters(omega=1e-6, beta=1e8)] * 4  # whose switches the reference map decides
rows = [Parameters(alpha=alpha) for alpha in np.linspace(0.5, 0.9, 21).tolist()]
apart = [Parameters(zeta=zeta) for zeta in np.linspace(0.05, 0.09, 21).tolist()]
many = np.tile([*Parameters().to_dict().values()], (300_000, 1))
many[:, 3] = np.linspace(0.05, 0.09, 300_000)
for call in (
    lambda: simulate(Parameters(), periods=10**12, max_segments=10**12),
    lambda: simulate(Parameters(), periods=10**12, keep="final"),
    lambda: simulate(Parameters(), periods=10**12, keep="stroboscopic", max_segments=10**12),
    lambda: simulate_many(rows, periods=10**12),
    lambda: simulate_many(apart, periods=10**12),
    lambda: simulate_many(rows, periods=10**12, threads=2),
    lambda: simulate_many(many, periods=1),
    lambda: simulate_many(rows, periods=10**12, max_segments=10**12, threads=2),
    lambda: simulate_many(slow, periods=10**12, max_segments=10**9, threads=2),
):
    threading.Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    try:
        call()
        print("ran to its end")
    except KeyboardInterrupt:
        print("interrupted")
"""


def test_ctrl_c_interrupts_every_call_whose_work_is_in_c() -> None:
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED],
        capture_output=True,
        text=True,
        check=False,
        timeout=10 * GENEROUS,
    )
    assert done.stdout.splitlines() == ["interrupted"] * 9, done.stderr


def test_a_watch_stops_runs_in_threads_and_they_go_on_from_where_they_were() -> None:
    watch = Watch()
    count = len(ROWS)
    records, stops = np.empty(count, core.records.STATE), np.full(count, -1, np.int8)
    core.start_many(ROWS, np.zeros((count, 3)), np.zeros(count), records, watch)
    given, how = (ROWS, records, FOR_EVER, stops), {"position": True, "watch": watch}
    work = threading.Thread(target=core.run_many, args=given, kwargs=how)
    work.start()
    work.join(0.1)
    watch.stop()
    work.join(GENEROUS)
    assert not work.is_alive()
    assert watch.over
    assert (stops == core.STOPPED).all()
    # On to the end of one period for all, as runs that nothing stopped come there.
    end = int(records["period"].max()) + 1
    core.run_many(ROWS, records, end, stops, None, True)
    assert (stops == core.DONE).all()
    finals = final_states(ROWS, periods=end)
    reached = np.stack([records[name] for name in ("x_r", "v_r", "v_c")], axis=-1)
    np.testing.assert_allclose(reached, finals.states, rtol=0, atol=1e-11)
    np.testing.assert_allclose(records["position"], finals.advances, rtol=1e-12, atol=1e-9)


def test_what_is_stopped_before_it_begins_is_told_and_left_alone() -> None:
    watch, count = Watch(), 40_000
    watch.stop()
    finals = final_states(ROWS[:3], max_seconds=1e-9)
    assert not finals.success.any()
    np.testing.assert_array_equal(finals.states, np.zeros((3, 3)))
    # Maps of many flows: some starts are made before the watch is looked at, and no run takes on
    # those that are not.
    rows = parameter_rows(Parameters(), zeta=np.linspace(0.01, 1.0, count))
    records, stops = np.empty(count, core.records.STATE), np.empty(count, np.int8)
    core.start_many(rows, np.full((count, 3), 0.25), np.zeros(count), records, watch)
    made = np.isfinite(records["gap"])
    assert 0 < made.sum() < count
    np.testing.assert_array_equal(records["x_r"], 0.25)
    with pytest.raises(ValueError, match="no runs from some"):
        core.run_many(rows[~made][:3], records[~made][:3].copy(), 1, stops[:3])
    # ... nor is a motion looked for.
    motions, switches = np.zeros(count, core.records.MOTION), np.zeros((count, 64), np.uint8)
    stops[:] = core.DONE
    core.steady_many(rows, records, np.zeros((count, 3, 3)), 1e-9, stops, motions, switches, watch)
    assert 0 < (stops == core.DONE).sum() < 1000
    assert (stops == core.STOPPED).sum() > count - 1000


def test_a_time_limit_holds_for_a_batch() -> None:
    finals = final_states(ROWS, periods=FOR_EVER, threads=2, max_seconds=0.1)
    assert (finals.status == "time-limit").all()


def test_a_run_that_is_stopped_again_and_again_comes_to_the_same_end() -> None:
    """The time is over from the start: the core works only until its next check."""
    native, watch, periods = core.map(ROWS[0]), Watch(-1.0), 20_000
    record = native.state_at(0.0, 0.0, 0.0, 0.0)
    passed = [0]
    while native.run(record, periods, position=True, watch=watch)[0] == core.STOPPED:
        passed.append(int(record["period"]))
    assert len(passed) > 5
    assert 0 < max(np.diff(passed)) < 10_000
    whole = native.state_at(0.0, 0.0, 0.0, 0.0)
    assert native.run(whole, periods, position=True)[0] == core.DONE
    for name in ("x_r", "v_r", "v_c", "position"):
        assert record[name] == pytest.approx(whole[name], rel=1e-12, abs=1e-12)


def test_a_motion_at_rest_takes_no_room_for_its_periods() -> None:
    parameters, start = Parameters(alpha=0.005), (0.3, 0.2, 0.1)
    short = simulate(parameters, start, periods=400, backend="c")
    tracemalloc.start()
    run = simulate(parameters, start, periods=FOR_EVER, backend="c")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1e7
    assert len(run.segments) == len(short.segments) > 3
    assert run.segments[-1].outcome is results.Outcome.NEVER
    assert run.final[0] == (FOR_EVER, 0.0)
    assert run.steady() is not None
    # The states of the segments before it are those of a short run, and none of them is lost.
    period = run.segments[-1].start.period
    assert period > 2
    np.testing.assert_array_equal(run.stroboscopic[: period + 1], short.stroboscopic[: period + 1])
    assert period + 32 < len(run.stroboscopic) < 20_000
    reference = simulate(parameters, start, periods=FOR_EVER, backend="numpy")
    np.testing.assert_allclose(run.stroboscopic[-32:], reference.stroboscopic[-32:], atol=1e-15)


def test_all_states_of_a_run_of_many_periods_are_kept() -> None:
    periods = 20_000  # more than there are rows for at a time
    run = simulate(Parameters(), periods=periods, backend="c")
    native = core.map(ROWS[10])  # alpha = 0.7
    strobe = np.empty((periods + 1, 3))
    native.run(native.state_at(0.0, 0.0, 0.0, 0.0), periods, strobe=strobe)
    assert len(run.stroboscopic) == periods + 1
    strobe[0] = 0.0
    np.testing.assert_allclose(run.stroboscopic, strobe, rtol=0, atol=1e-11)


def test_a_long_run_stays_in_c() -> None:
    run = simulate(Parameters(), periods=FOR_EVER, max_segments=5)
    assert (run.backend, len(run.segments)) == ("c", 5)


@pytest.mark.parametrize("rows", [1, 100, 8191])
def test_too_few_rows_for_the_states_are_refused(rows: int) -> None:
    native = core.map(ROWS[0])
    record = native.state_at(0.0, 0.0, 0.0, 0.0)
    with pytest.raises(ValueError, match="strobe must have shape"):
        native.run(record, 10_000, strobe=np.empty((rows, 3)))
