"""The C core against the reference map, independent truth, and its own ways of asking."""

import ctypes
import json
from importlib import import_module
from importlib.machinery import EXTENSION_SUFFIXES
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from capsule_sym import Parameters, results, scenes, simulate, simulate_many
from capsule_sym import _native as native
from capsule_sym._map.backend import NumpyBackend, default_backend
from capsule_sym._map.reference import Run
from capsule_sym._native import core
from capsule_sym._parameters import CAPSULE
from capsule_sym.generated.capsule import DIGEST
from capsule_sym.generated.interface import Precision
from tests.finals import final_states, parameter_rows
from tests.sampling import many, sampled

DATA = Path(__file__).parents[1] / "judges" / "data"

pytestmark = pytest.mark.skipif(core is None, reason="the C core was not compiled")


def itinerary(run: results.Trajectory) -> list[tuple[int, str, str, str]]:
    return [(s.field, s.source, s.target, s.outcome.value) for s in run.segments]


def numbers(run: results.Trajectory) -> np.ndarray:
    rows = [
        (*s.start_state, *s.end_state, s.duration, s.position, s.advance, s.end.phase)
        for s in run.segments
    ]
    return np.array(rows, dtype=float)


def test_the_core_is_live_and_was_built_from_these_kernels() -> None:
    assert default_backend() == "c"
    assert core.digest() == DIGEST


def test_a_library_that_is_not_the_core_of_these_kernels_is_refused(monkeypatch, tmp_path) -> None:
    """Structs differ after a parameter is added."""
    again = "install capsule-sym again"
    monkeypatch.setattr(type(CAPSULE), "digest", "0" * 16)
    with pytest.raises(native.StaleCore, match=f"has kernels {DIGEST}, .*{again}"):
        native.core_of.__wrapped__(CAPSULE)
    monkeypatch.setitem(vars(CAPSULE), "records", scenes.prototype.records)
    with pytest.raises(native.StaleCore, match=f"has structs of another layout than .*{again}"):
        native.core_of.__wrapped__(CAPSULE)
    binding, wrong = import_module("capsule_sym._native._binding"), tmp_path / "core.so.1"
    table = np.frombuffer((ctypes.c_char * 400)(), np.intc).copy()
    table[0] = 99
    with pytest.raises(ValueError, match="a table of version 99, not 1"):
        binding.Core(table.ctypes.data, CAPSULE.records, None)
    other = next(iter(np.__path__)) + "/linalg/_umath_linalg" + EXTENSION_SUFFIXES[0]
    cut = Path(core.library._name).read_bytes()[:-64]
    for content in (b"", b"no library", Path(other).read_bytes(), cut, cut[:40]):
        wrong.unlink(missing_ok=True)  # what is loaded stays as it is
        wrong.write_bytes(content)
        with pytest.raises(native.StaleCore, match=f"is no core for this machine .*{again}"):
            native._opened(binding, str(wrong), CAPSULE)


@pytest.mark.parametrize("phase", [0.0, 1.25])
@pytest.mark.parametrize("alpha", [0.0, 0.25, 1.2])
def test_a_short_call_gives_what_the_general_one_does(alpha: float, phase: float) -> None:
    for p in (Parameters(alpha=alpha), scenes.prototype.Parameters(alpha=alpha + 0.1)):
        for periods in (1, 12):
            short = simulate(p, (0.1, 0.2, 0.0), phase, periods)
            general = simulate(p, (0.1, 0.2, 0.0), phase, periods, progress=[].append)
            for name in ("records", "stroboscopic", "stroboscopic_periods"):
                one, other = getattr(short, name), getattr(general, name)
                np.testing.assert_array_equal(one, other)
                assert one.dtype == other.dtype
                assert not one.flags.writeable
            for name in ("origin", "final", "advance", "statistics", "status", "message"):
                assert getattr(short, name) == getattr(general, name)


@pytest.mark.parametrize("gamma", ["3.3", "3.0"])
def test_final_states_have_all_digits_of_independent_truth(gamma: str) -> None:
    truth = json.loads((DATA / f"reference_gamma{gamma.replace('.', '')}.json").read_text())
    runs = truth["runs"]
    rows = parameter_rows(
        Parameters(gamma=float(gamma)), alpha=[float(run["alpha"]) for run in runs]
    )
    finals = final_states(rows, periods=truth["periods"])
    exact = np.array([[float(value) for value in run["final"]] for run in runs])
    assert np.abs(finals.states - exact[:, :3]).max() < 1e-13
    assert np.abs(finals.advances - exact[:, 3]).max() < 1e-12
    for run in runs:
        parameters = Parameters(alpha=float(run["alpha"]), gamma=float(gamma))
        found = simulate(parameters, periods=truth["periods"]).switches
        assert "".join(map(str, found["field"])) == run["fields"][: len(found)]
        assert len(found) in (len(run["fields"]), len(run["fields"]) - 1)


def zero_or(low: float, high: float) -> st.SearchStrategy[float]:
    return st.one_of(st.just(0.0), st.floats(low, high))


@settings(max_examples=30)
@given(
    parameters=st.builds(
        Parameters, zero_or(1e-6, 3.0), st.floats(0.3, 6.0), zero_or(1e-6, 1.0),
        st.floats(0.02, 2.5), zero_or(1e-6, 30.0), st.floats(0.2, 8.0), st.floats(0.2, 2.0),
    ),
    state=st.tuples(*[st.one_of(zero_or(-1.0, -1e-6), st.floats(1e-6, 1.0))] * 3),
    part=st.floats(0.0, 0.99),
)  # fmt: skip
def test_random_motions_agree_segment_by_segment(parameters, state, part) -> None:
    phase = part * parameters.period
    fast, reference = (
        simulate(parameters, state, phase, 3, backend=name, max_segments=60)
        for name in ("c", "numpy")
    )
    # If both escalate different switches, rounding decided.
    assume(fast.statistics.escalations == reference.statistics.escalations)
    assert itinerary(fast) == itinerary(reference)
    np.testing.assert_allclose(numbers(fast), numbers(reference), rtol=1e-9, atol=1e-10)


def test_every_way_of_asking_gives_the_same_run() -> None:
    rows = parameter_rows(Parameters(), alpha=np.linspace(0.01, 2.0, 23))
    strobed = simulate_many(rows, periods=30, keep="stroboscopic")
    finals = final_states(rows, periods=30)
    threaded = final_states(rows, periods=30, threads=2)
    assert np.array_equal(finals.states, threaded.states)
    assert np.array_equal(finals.advances, threaded.advances)
    assert finals.success.all()
    for i in range(0, 23, 4):
        run = simulate(Parameters(*rows[i]), periods=30, backend="c")
        # Runs side by side round differently from one alone.
        np.testing.assert_allclose(strobed[i], run.stroboscopic, rtol=0, atol=2e-13)
        assert np.array_equal(strobed[i][-1], finals.states[i])
        np.testing.assert_allclose(finals.advances[i], run.advance, rtol=0, atol=1e-12)
        found = simulate(Parameters(*rows[i]), periods=30).switches
        ended = [s for s in run.segments if s.target]
        assert found["field"].tolist() == [s.field for s in ended]
        assert found["plane"].tolist() == [int(s.target[1:]) for s in ended]
        assert all(a["period"] <= b["period"] for a, b in pairwise(found))
        one = final_states(rows[i : i + 1], periods=30)
        alone = simulate(Parameters(*rows[i]), periods=30, keep="final")
        assert one.states[0].tolist() == list(alone.final[1])
        assert one.advances[0] == alone.advance
        watched = final_states(rows[i : i + 1], periods=30, max_seconds=3600.0)
        assert np.array_equal(watched.states, one.states)


def test_tables_kept_between_calls_are_those_of_the_flows_asked_for() -> None:
    rows = parameter_rows(Parameters(), beta=np.repeat([0.5, 1.5, 0.5, 3.0], 6))
    rows[:, 0] = np.tile(np.linspace(0.3, 1.9, 6), 4)
    together = final_states(rows, periods=10).states
    for chosen in (slice(18, 24), slice(6, 12), slice(0, 6), slice(12, 18)):
        assert np.array_equal(final_states(rows[chosen], periods=10).states, together[chosen])


def test_a_long_run_of_finals_needs_no_memory_that_grows() -> None:
    import tracemalloc

    for rows in (parameter_rows(Parameters()), parameter_rows(Parameters(), alpha=[0.6, 0.7])):
        peaks = []
        for periods in (9_000, 90_000):
            tracemalloc.start()
            final_states(rows, periods=periods)
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
        assert peaks[1] < peaks[0] + 10_000


def test_what_the_core_leaves_open_is_settled_behind_it() -> None:
    """From a tangency to f_b at the start: P = f_b and P' = 0 to the last digit."""
    parameters = Parameters(alpha=0.0, zeta=0.0, delta=2.0)
    state = (1.0, 0.0, 0.0)
    record = core.map(parameter_rows(parameters)[0]).state_at(*state, 0.0)
    assert core.map(parameter_rows(parameters)[0]).run(record, 1)[0] == core.OPEN
    fast = simulate(parameters, state, periods=1, backend="c")
    reference = simulate(parameters, state, periods=1, backend="numpy")
    assert itinerary(fast) == itinerary(reference)
    assert fast.statistics.escalations == reference.statistics.escalations > 0
    finals = final_states(parameter_rows(parameters), state, periods=1)
    np.testing.assert_allclose(finals.states[0], fast.final[1], atol=1e-13)
    pair = final_states(parameter_rows(parameters, alpha=[0.0, 0.0]), state, periods=1)
    np.testing.assert_allclose(pair.states[0], fast.final[1], atol=1e-13)


def test_switches_found_by_more_digits_have_their_angles() -> None:
    """A start that all but grazes: double precision cannot decide its first switch."""
    parameters = Parameters(
        *(0.04994727037814717, 2.9303608550896656, 0.007097380007022424, 0.022939879501777064),
        *(312.110062316957, 25.924490273736783),
    )
    state = (-0.0034319350101247492, 0.01843567543633385, -1.5488089627794381)
    phase = 0.045770434012766245
    native = core.map(parameter_rows(parameters)[0])
    start = native.state_at(*state, phase)
    assert native.run(start, 2, precision=Precision.DOUBLE)[0] == core.OPEN
    found = simulate(parameters, state, phase, periods=2).switches
    reference = simulate(parameters, state, phase, periods=2, backend="mpmath").segments
    ended = [float(s.end.phase * parameters.omega) for s in reference if s.target]
    assert len(ended) == 2
    np.testing.assert_allclose(found["angle"], ended, rtol=0, atol=1e-14)


def test_a_run_that_stops_undecided_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """The core leaves this start open, and here nothing behind it decides either."""
    monkeypatch.setattr(Run, "next_segment", lambda *_: None)
    parameters, state = Parameters(alpha=0.0, zeta=0.0, delta=2.0), (1.0, 0.0, 0.0)
    for count in (1, 2):
        rows = parameter_rows(parameters, alpha=np.zeros(count))
        assert final_states(rows, state, periods=2).status.tolist() == count * ["undecided"]
    assert not simulate(parameters, state, periods=2).success


def test_an_itinerary_of_a_run_ends_where_the_run_does() -> None:
    parameters = Parameters(alpha=1.5)
    segments = [s for s in simulate(parameters, periods=12, backend="c").segments if s.target][3:]
    while segments[-1].field != segments[0].field:
        segments.pop()
    segments.pop()
    first = segments[0]
    z = [*first.start_state, first.start.phase * parameters.omega, *(s.duration for s in segments)]
    fields = np.array([s.field for s in segments], np.int32)
    found = core.fields(parameter_rows(parameters)[0]).evaluate_itinerary(
        fields, 9, False, np.array(z)
    )
    flows = found[0]
    np.testing.assert_allclose(flows["end"], [s.end_state for s in segments], rtol=0, atol=1e-12)
    np.testing.assert_allclose(flows["moved"][:, 2], [s.advance for s in segments], atol=1e-12)
    assert flows["duration"].tolist() == z[4:]
    assert found[5] == pytest.approx(sum(s.advance for s in segments), abs=1e-12)


def test_what_is_no_itinerary_is_refused() -> None:
    fields = core.fields(parameter_rows(Parameters())[0])
    for numbers in ((0,), (7,), (1,), (1, 5), (1, 1), (2, 1, 2, 3, 3)):
        z = np.ones(4 + len(numbers))
        for solve in (fields.evaluate_itinerary, fields.solve_itinerary):
            with pytest.raises(ValueError, match="fields 1 to 6"):
                solve(np.array(numbers, np.int32), 1, False, z)
    for periods, numbers, size in ((0, (5, 2), 6), (1, (5, 2), 5), (1, (), 4)):
        with pytest.raises(ValueError, match=r"fields 1 to 6|one duration a field"):
            fields.solve_itinerary(np.array(numbers, np.int32), periods, False, np.ones(size))
    for held, direction in ((6, np.ones(7)), (-1, np.ones(7))):
        with pytest.raises(ValueError, match="fields 1 to 6"):
            fields.solve_itinerary(
                np.array([5, 2], np.int32), 1, False, np.ones(6), direction, held
            )
    for field in (0, 7):
        with pytest.raises(ValueError, match="1 to 6"):
            fields.constants(field)
        with pytest.raises(ValueError, match="1 to 6"):
            fields.extrema(field, (0.0,) * 7, 0, 0, 1.0)


@pytest.mark.parametrize("field", range(1, 7))
def test_constants_are_those_of_the_generated_kernels(field: int) -> None:
    parameters = Parameters(alpha=1.5, zeta=0.7)
    constants = core.map(parameter_rows(parameters)[0]).constants(field)
    expected = NumpyBackend().constants(field, parameters)
    assert constants == pytest.approx([*map(float, expected)], rel=1e-15, abs=0)


@sampled
@pytest.mark.parametrize("seed", range(many(6, 2)))
def test_runs_side_by_side_are_those_of_the_reference(seed: int) -> None:
    """Forty runs that share their flows, from hard starts: at rest, on the impact surface, moving.

    Each run is checked as far as rounding is not magnified: by the separation of a neighbour.
    """
    random = np.random.default_rng(seed)
    count, periods = 40, 4
    base = Parameters(
        omega=random.uniform(0.4, 3.0),
        zeta=random.choice([0.0, 0.05, 0.4, 1.5]),
        beta=random.choice([0.0, 1.5, 20.0]),
        gamma=random.uniform(0.3, 6.0),
    )
    rows = parameter_rows(
        base,
        alpha=random.uniform(0.0, 3.0, count),
        delta=random.choice([0.0, 0.02, 0.3], count),
        f_b=random.uniform(0.3, 1.5, count),
    )
    starts = random.uniform(-0.5, 0.5, (count, 3))
    starts[::3, 2] = 0.0
    starts[1::3, 0] = rows[1::3, 2]
    phases = random.uniform(0.0, base.period, count)
    strobed = simulate_many(rows, starts, phases, periods, keep="stroboscopic")
    finals = final_states(rows, starts, phases, periods)
    moved = final_states(rows, starts + 1e-9, phases, periods)
    growth = np.abs(moved.states - finals.states).max(axis=1) / 1e-9
    for i in np.flatnonzero(growth < 1e3):
        run = simulate(Parameters(*rows[i]), starts[i], phases[i], periods, backend="numpy")
        np.testing.assert_allclose(finals.states[i], run.final[1], rtol=0, atol=1e-11)
        np.testing.assert_allclose(finals.advances[i], run.advance, rtol=0, atol=1e-10)
        np.testing.assert_allclose(strobed[i], run.stroboscopic, rtol=0, atol=1e-11)
    assert (growth < 1e3).sum() > count / 2


def test_a_rest_that_is_settled_by_more_digits_is_recorded_at_every_end_of_a_period() -> None:
    # A graze so close that the core cannot decide it; no field drives the capsule after it.
    parameters = Parameters(alpha=0.00737463)
    start, phase, periods = (0.02, 7e-19, 0.0), 0.2733361823424281, 400
    run = simulate(parameters, start, phase, periods, backend="c")
    reference = simulate(parameters, start, phase, periods, backend="numpy")
    assert len(reference.stroboscopic) < len(run.stroboscopic) == periods
    marks = np.array(run.stroboscopic)
    expected = np.array(reference.stroboscopic)
    assert np.abs(marks[-len(expected) :] - expected).max() < 1e-15
    rows = parameter_rows(parameters, alpha=[parameters.alpha] * 2)
    many = simulate_many(rows, start, phase, periods, keep="stroboscopic")
    for strobe in (many[0], many[1]):
        assert len(strobe) == periods
        assert np.abs(strobe[-len(expected) :] - expected).max() < 1e-15
