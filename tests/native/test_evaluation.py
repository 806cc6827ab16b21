"""States at any times: the core's one sorted pass against 50 digits, NumPy and an integrator."""

import pickle
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf
from numpy.typing import NDArray

from capsule_sym import InvalidInput, Parameters, simulate
from capsule_sym._map import evaluation, native
from capsule_sym._map.backend import MpmathBackend
from capsule_sym._map.segments import Segments, records_of
from capsule_sym._map.trajectory import Kept
from capsule_sym._native import core
from capsule_sym.results import Segment, Status, Trajectory
from tests.judges import dop853

needs_core = pytest.mark.skipif(core is None, reason="the C core was not compiled")
SIX = Parameters(alpha=1.5, gamma=3.0)  # a motion through all six fields
START = (0.1, -0.2, 0.3)
UNIT = 2.0**-53


@pytest.fixture(scope="module")
def run() -> Trajectory:
    return simulate(SIX, START, 1.25, 12)


def times_of(run: Trajectory, count: int, seed: int = 0) -> NDArray[np.float64]:
    """Random times of a run, in no order."""
    low, high = (i.period * run.parameters.period + i.phase for i in (run.origin[0], run.final[0]))
    return np.random.default_rng(seed).uniform(low, high, count)


def true_states(segments: Any, parameters: Parameters, times: Any) -> list[list[Any]]:
    """States with positions at times by the closed form in 50 digits, from segments' own starts."""
    numbers, found = MpmathBackend(), []
    with mp.workdps(60):
        period = 2 * mp.pi / mpf(parameters.omega)
        omega = mpf(parameters.omega)
        begins = [
            s.start.period * period + mpf(float(s.start.phase) * parameters.omega) / omega
            for s in segments
        ]
        for time in times:
            at = max(i for i, begin in enumerate(begins) if begin <= mpf(time))
            s, h = segments[at], mpf(time) - begins[at]
            c = numbers.constants(s.field, parameters)
            closed = type(s.closed)(*map(numbers.number, s.closed))
            x_r, v_r, *drift = numbers.kernels.flow(c, closed, numbers.number(h), True)
            v_c, x_c = drift if c.drift else (0, 0)
            at_start = [mpf(v) for v in (*s.start_state, s.position)]
            drifts = (at_start[2] + mpf(v_c)) if c.drift else mpf(0)
            found.append([at_start[0] + mpf(x_r), mpf(v_r), drifts, at_start[3] + mpf(x_c)])
    return found


REGIMES = {
    "case study": (SIX, START, 12),
    "undamped": (SIX.replace(zeta=0.0), START, 6),
    "at resonance": (Parameters(zeta=0.0, omega=1.0, alpha=0.8), START, 6),
    "overdamped": (Parameters(zeta=50.0, alpha=5.0), START, 3),
    "stiff": (Parameters(beta=1e6), START, 3),
    "slow": (Parameters(omega=1e-2, alpha=1.5), START, 1),
    "fast": (Parameters(omega=40.0, alpha=30.0), START, 60),
    "light capsule": (Parameters(gamma=1e-3), START, 3),
    "long ago": (Parameters(), (0.0, 0.0, 0.0), 2000),
}


@needs_core
@pytest.mark.parametrize("name", REGIMES)
def test_states_are_those_of_fifty_digits(name: str) -> None:
    """Within 16 units of what the terms of the motion and a rounding of the time amount to."""
    parameters, start, periods = REGIMES[name]
    run = simulate(parameters, start, periods=periods)
    segments = run.segments[-40:]
    begin = segments[0].start.period * parameters.period + segments[0].start.phase
    end = periods * parameters.period
    times = np.random.default_rng(5).uniform(begin, end, 60)
    found = run(times, position=True)
    true = np.array([[float(v) for v in row] for row in true_states(segments, parameters, times)])
    size = np.abs(run(np.linspace(begin, end, 500), position=True)).max(axis=0)
    rate = 1 + np.sqrt(1 + parameters.beta) + parameters.omega + 2 * parameters.zeta
    lasting = max(s.duration for s in segments)
    # Of each state as large as it gets; a duration is rounded, not the time; x_c is a sum as well.
    # v_r changes in a unit of time by the forces, which friction's and the forcing's add to.
    forces = 1 + parameters.alpha + rate * size[1] + rate**2 * size[0]
    allowed = np.array([size[0] + size[1] * lasting, size[1] + forces * lasting, 0, 0])
    allowed[2] = size[2] + forces * lasting * (1 + 1 / parameters.gamma)
    allowed[3] = size[3] + allowed[2] * lasting
    assert (np.abs(found - true) <= 16 * UNIT * allowed).all(), np.abs(found - true).max(axis=0)


@needs_core
def test_the_time_is_taken_as_it_is_however_late(run: Trajectory) -> None:
    """A double's rounding of a late time is the caller's; none is added that grows with it."""
    late = simulate(Parameters(), periods=20_000, max_segments=10**6)
    last = late.segments[-6:]
    times = np.random.default_rng(2).uniform(19_999.2, 20_000, 20) * late.parameters.period
    true = np.array([[float(v) for v in row] for row in true_states(last, Parameters(), times)])
    assert np.abs(late(times) - true[:, :3]).max() < 1e-14
    naive = evaluation.by_numpy(Parameters(), late.records, times)
    assert np.abs(naive[:, :3] - true[:, :3]).max() > 1e-13


@pytest.mark.parametrize("periods", [1, 4])
def test_states_are_those_of_an_independent_integrator(run: Trajectory, periods: int) -> None:
    judged = dop853.run(SIX, START, 1.25, periods)
    found = run(1.25 + periods * SIX.period, position=True)
    np.testing.assert_allclose(found, judged.final, rtol=0, atol=1e-9)


@needs_core
def test_a_state_depends_on_nothing_but_its_time(run: Trajectory) -> None:
    """Not on the order, nor on other times: alone the search jumps, in a dense row it walks."""
    times = times_of(run, 3000)
    states, order = run(times, position=True), np.argsort(times)
    near = np.nextafter(times, 0)
    for other, expected in (
        (times[order], states[order]),
        (times[::-1], states[::-1]),
        (times[order][::50], states[order][::50]),
        (np.stack([times, near]), [states, run(near, position=True)]),
        (np.concatenate([times, times]), np.concatenate([states, states])),
    ):
        np.testing.assert_array_equal(run(other, position=True), expected)
    for i in range(0, 400, 7):
        np.testing.assert_array_equal(run(times[i], position=True), states[i])
    tiny = simulate(SIX, periods=1)(np.array([5e-324, 0.0]))
    np.testing.assert_allclose(tiny, 0.0, atol=1e-300)


@needs_core
def test_both_sides_of_every_switch(run: Trajectory) -> None:
    """A segment is left exactly where the next begins: the index of the pass is right."""
    for segment in run.segments[1:]:
        begin = segment.start.period * SIX.period + segment.start.phase
        around = np.array([begin - 1e-9, begin, begin + 1e-9])
        states = run(around, position=True)
        expected = (*segment.start_state, segment.position)
        np.testing.assert_allclose(states, np.tile(expected, (3, 1)), rtol=0, atol=2e-8)
        # v_r' is discontinuous nowhere, v_c' at each onset of slip: by the segment that it is in.
        assert (states[2, 2] == 0) == (segment.field in (2, 5))


@needs_core
def test_core_and_numpy_agree_and_a_wrong_index_in_the_pass_is_noticed(run: Trajectory) -> None:
    """The pass does not take the segment before, nor the one after."""
    times = np.sort(times_of(run, 2000))
    by_numpy = evaluation.by_numpy(SIX, run.records, times)
    np.testing.assert_allclose(run(times, position=True), by_numpy, rtol=0, atol=2e-13)
    for shift in (-1, 1):
        records = run.records.copy()
        for name in ("start", "gap", "margin", "cosine", "sine", "field", "position"):
            records[name] = np.roll(run.records[name], shift, axis=0)
        wrong = evaluation.by_core(SIX, records, times)
        assert np.abs(wrong - by_numpy).max() > 1e-3


@needs_core
def test_what_is_no_segment_is_refused(run: Trajectory) -> None:
    native_map, times = core.map(np.array([*SIX.to_dict().values()])), np.array([3.0, 4.0])
    states = np.empty((2, 4))
    for field in (0, 7, -1):
        records = run.records.copy()
        records["field"] = field
        with pytest.raises(ValueError, match="a field that there is not"):
            native_map.evaluate(records, times, states)
    with pytest.raises(ValueError, match="states must have shape"):
        native_map.evaluate(run.records, times, states[:1])
    with pytest.raises(TypeError, match=r"an array of records \('start_period'"):
        native_map.evaluate(np.zeros(3), times, states)


def test_rest_for_ever_is_evaluated_late() -> None:
    run = simulate(Parameters(alpha=0.005), periods=10**12)
    assert (run.status, len(run.segments)) == (Status.FINISHED, 1)
    assert len(run.stroboscopic) < 20_000
    late = run(10**6 * run.parameters.period)
    np.testing.assert_allclose(late, run.stroboscopic[-1], rtol=0, atol=1e-10)


def test_runs_of_many_periods_take_the_memory_of_what_they_keep() -> None:
    run = simulate(Parameters(), periods=10**7, max_seconds=0.2)
    assert run.status is Status.TIME_LIMIT
    assert len(run.segments) > 100
    bytes_a_period = (run.records.nbytes + run.stroboscopic.nbytes) / len(run.stroboscopic)
    assert bytes_a_period < 900
    kept = simulate(Parameters(), periods=10**7, max_seconds=0.05, keep="final")
    assert kept.status is Status.TIME_LIMIT
    assert kept.final[0].period > 0


def test_segments_are_views_and_equal_tuples(run: Trajectory) -> None:
    segments = run.segments
    assert isinstance(segments, Segments)
    assert all(isinstance(segment, Segment) for segment in segments)
    assert isinstance(run.kept, Kept)
    whole = tuple(segments)
    assert segments == whole
    assert whole == tuple(segments[i] for i in range(len(segments)))
    assert segments[-1] == whole[-1]
    assert segments[3:9] == whole[3:9]
    assert segments[3:9][-2] == whole[7]
    assert segments[::-2] == whole[::-2]
    assert segments != whole[:-1]
    assert whole[4] in segments
    with pytest.raises(IndexError):
        segments[len(whole)]


@needs_core
def test_records_of_segments_give_the_records_back(run: Trajectory) -> None:
    records = records_of(tuple(run.segments), SIX.omega)
    # Several angles may give the same phase.
    assert Segments(records, SIX.omega) == run.segments
    for name in records.dtype.names:
        if "angle" in name:
            np.testing.assert_allclose(records[name], run.records[name], rtol=4 * UNIT)
        else:
            np.testing.assert_array_equal(records[name], run.records[name])


@needs_core
def test_what_the_reference_map_takes_over_is_kept_exactly(monkeypatch: pytest.MonkeyPatch) -> None:
    """If the core takes no segment at all, the columns are those of the reference map."""
    reference = simulate(SIX, START, 1.25, 3, backend="numpy")

    class Refused:
        def __init__(self, real: Any) -> None:
            self.state_at, self.evaluate = real.state_at, real.evaluate

        def run(self, *_: Any, **__: Any) -> tuple[int, int, str]:
            return core.OPEN, 0, "undecided"

        def short_run(self, *_: Any) -> None:
            return None

    monkeypatch.setattr(
        evaluation, "borrowed", lambda p: Refused(core.map(np.array([*p.to_dict().values()])))
    )
    monkeypatch.setattr(evaluation, "give_back", lambda *_: None)
    taken = simulate(SIX, START, 1.25, 3)
    assert taken.backend == "c"
    assert taken.segments == reference.segments
    np.testing.assert_array_equal(taken.stroboscopic, reference.stroboscopic)
    assert taken.final == reference.final
    assert native.core() is core


def test_pickles(run: Trajectory) -> None:
    again = pickle.loads(pickle.dumps(run))
    times = times_of(run, 50)
    np.testing.assert_array_equal(again(times), run(times))
    assert again.segments == run.segments
    assert (again.status, again.statistics, again.final) == (run.status, run.statistics, run.final)
    exact = simulate(SIX, START, 1.25, 1, backend="mpmath")
    assert pickle.loads(pickle.dumps(exact)).segments == exact.segments


def test_threads_evaluate_side_by_side(run: Trajectory) -> None:
    times = times_of(run, 5000)
    states = run(times)
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(run, [times] * 12):
            np.testing.assert_array_equal(found, states)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_what_a_run_keeps_is_what_the_whole_one_has(backend: str) -> None:
    if backend == "c" and core is None:
        pytest.skip("the C core was not compiled")
    whole = simulate(SIX, START, 1.25, 12, backend=backend)
    runs = {
        keep: simulate(SIX, START, 1.25, 12, backend=backend, keep=keep)
        for keep in ("final", "stroboscopic")
    }
    for found in runs.values():
        for name in ("final", "advance", "status", "statistics"):
            assert getattr(found, name) == getattr(whole, name)
    np.testing.assert_array_equal(runs["stroboscopic"].stroboscopic, whole.stroboscopic)
    switches = [(s.end.period, s.field, int(s.target[1:])) for s in whole.segments if s.target]
    assert whole.switches[["period", "field", "plane"]].tolist() == switches


def test_what_was_not_kept_is_refused_in_a_line() -> None:
    run = simulate(Parameters(), periods=2, keep="final")
    for name in ("segments", "stroboscopic", "switches", "columns"):
        with pytest.raises(InvalidInput, match=r"keep = 'final': must be '\w+' for this"):
            getattr(run, name)
    with pytest.raises(InvalidInput, match="keep = 'final'"):
        run(1.0)
    run = simulate(SIX, periods=2, keep="stroboscopic")
    with pytest.raises(InvalidInput, match="keep = 'stroboscopic': must be 'segments'"):
        run.steady()


@pytest.mark.parametrize(
    "keep", ["all", "", None, "switches", ["a"], [1.0], 1j, True, ["x"] * 2000]
)
def test_what_cannot_be_kept_is_refused(keep: Any) -> None:
    with pytest.raises(InvalidInput, match=r"^keep = .*must be") as caught:
        simulate(Parameters(), periods=2, keep=keep)
    assert len(str(caught.value)) < 500


def test_a_run_says_how_it_went() -> None:
    run = simulate(Parameters(), periods=3)
    assert (run.success, run.status, run.message) == (True, "finished", "the run came to its end")
    assert run.statistics.segments == len(run.segments)
    assert run.statistics.evaluations == sum(s.evaluations for s in run.segments)
    assert run.statistics.escalations == 0
    cut = simulate(Parameters(), periods=3, max_segments=2)
    assert (cut.success, cut.message) == (False, "the run stopped after 2 segments")


def test_columns_are_the_segments(run: Trajectory) -> None:
    columns = run.columns
    for i, segment in enumerate(run.segments):
        row = {name: column[i] for name, column in columns.items()}
        for name in ("source", "target", "outcome", "duration", "advance"):
            assert row[name] == getattr(segment, name)
        assert (row["field"], row["x_c"]) == (segment.name, segment.position)
        assert (row["period"], row["phase"]) == segment.start
        assert (row["x_r"], row["v_r"], row["v_c"]) == segment.start_state


def test_tables_of_pandas(run: Trajectory) -> None:
    pytest.importorskip("pandas")
    frame = run.to_dataframe()
    assert len(frame) == len(run.segments)
    assert frame["field"].tolist() == [s.name for s in run.segments]
    assert frame["duration"].sum() == pytest.approx(12 * SIX.period - 1.25)
    assert frame["outcome"].tolist() == [str(s.outcome) for s in run.segments]


def test_optional_packages_are_imported_when_they_are_needed() -> None:
    script = """
import sys
import capsule_sym
from capsule_sym import Parameters, simulate
run = simulate(Parameters(), periods=2)
run([1.0, 2.0]), run.segments[0], run.columns, repr(run), run.steady()
found = {"pandas", "matplotlib", "sympy"} & set(sys.modules)
assert not found, found
calls = {"matplotlib": lambda: capsule_sym.plot(run)}
calls |= {"zarr": lambda: capsule_sym.run_sweep, "flint": lambda: capsule_sym.certify_run}
for name, call in calls.items():
    sys.modules[name] = None
    try:
        call()
    except ImportError as error:
        assert str(error).count("python -m pip install '.[") == 1 and "\\n" not in str(error), error
    else:
        raise AssertionError(name)
"""
    subprocess.run([sys.executable, "-c", script], check=True, timeout=120)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_a_run_begins_at_the_phase_given(backend: str) -> None:
    if backend == "c" and core is None:
        pytest.skip("the C core was not compiled")
    p, phase = Parameters(omega=0.8), 6.916160903474577
    assert phase * 0.8 / 0.8 != phase
    run = simulate(p, (0.1, 0.0, 0.0), phase, 2, backend=backend)
    np.testing.assert_allclose(run(phase), (0.1, 0.0, 0.0), rtol=0, atol=1e-14)


@needs_core
def test_the_final_state_does_not_depend_on_what_is_kept() -> None:
    p, start = Parameters(omega=1000.0, alpha=0.8, zeta=0.0, f_b=50.0), (3.0, 0.5, 0.0)
    finals = {
        simulate(p, start, periods=12_000, keep=keep).final
        for keep in ("segments", "final", "stroboscopic")
    }
    assert len(finals) == 1


def test_stroboscopic_states_have_their_periods() -> None:
    for backend in ("numpy", "c") if core else ("numpy",):
        rest = simulate(Parameters(alpha=0.005), periods=100, backend=backend)
        assert len(rest.stroboscopic) == len(rest.stroboscopic_periods)
        assert rest.stroboscopic_periods[-1] == 100
        period = rest.parameters.period
        for k, state in zip(rest.stroboscopic_periods, rest.stroboscopic, strict=True):
            np.testing.assert_allclose(rest(k * period), state, rtol=0, atol=1e-12)
    late = simulate(Parameters(), (0.0, 0.0, 0.0), 1.0, periods=5)
    assert late.stroboscopic_periods.tolist() == [1, 2, 3, 4, 5]


def test_a_run_without_segments_is_its_start() -> None:
    run = simulate(Parameters(), (0.1, 0.0, 0.0), periods=2, backend="numpy", max_seconds=1e-9)
    assert len(run.segments) == 0
    np.testing.assert_array_equal(run(0.0), (0.1, 0.0, 0.0))
    with pytest.raises(InvalidInput, match=r"t = 1\.0"):
        run(1.0)


@needs_core
def test_the_end_is_the_final_state(run: Trajectory) -> None:
    native_map, end = core.map(np.array([*SIX.to_dict().values()])), np.empty((1, 4))
    native_map.evaluate(run.records, np.array([12 * SIX.period + 1e-9]), end)
    assert tuple(end[0]) == (*run.final[1], run.advance)


@needs_core
@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer here")
def test_an_interrupt_ends_an_evaluation(run: Trajectory) -> None:
    """Also where all times are on one expansion of one segment."""
    native_map, count = core.map(np.array([*SIX.to_dict().values()])), 4_000_000
    times, states = np.full(count, 1.26), np.full((count, 4), np.nan)

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, stop)
    try:
        with pytest.raises(KeyboardInterrupt):  # noqa: PT012
            signal.setitimer(signal.ITIMER_REAL, 1e-3)
            native_map.evaluate(run.records, times, states)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert np.isnan(states[-1]).all()


def test_other_kinds_of_input_are_refused_or_taken(run: Trajectory) -> None:
    for bad in (1j, "a", None, True, [[1.0], [1.0, 2.0]]):
        with pytest.raises(InvalidInput, match=r"^t = "):
            run(bad)
    assert simulate(SIX, periods=np.int64(2)).final == simulate(SIX, periods=2).final
