"""Many runs at once give what single runs give, one after another, with their offsets."""

from typing import Any

import numpy as np
import pytest

from capsule_sym import InvalidInput, Parameters, results, simulate, simulate_many
from capsule_sym._map import keep as keeping
from capsule_sym._map.keep import CHOICES
from capsule_sym._native import watch

SETS = [Parameters(alpha=a, omega=w) for a, w in ((0.7, 0.8), (1.2, 0.9), (0.005, 0.8), (1.5, 0.7))]
STARTS = np.array([[0.0, 0.0, 0.0], [0.1, -0.2, 0.3], [0.01, 0.0, 0.0], [-0.4, 0.2, -0.1]])
PHASES = np.array([0.0, 1.0, 0.0, 2.5])


def single(i: int, keep: Any, periods: int = 9) -> Any:
    return simulate(SETS[i], STARTS[i].tolist(), float(PHASES[i]), periods, keep=keep)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("keep", ["stroboscopic", "final"])
def test_each_run_is_as_if_alone(keep: Any, threads: int) -> None:
    found = simulate_many(SETS, STARTS, PHASES, 9, keep=keep, threads=threads)
    assert isinstance(found, results.Trajectories)
    assert len(found) == 4
    assert found.success.all()
    assert found.offsets[0] == 0
    assert found.offsets[-1] == len(found.kept)
    for i in range(4):
        alone = single(i, keep)
        np.testing.assert_allclose(found.states[i], alone.final[1], rtol=0, atol=1e-12)
        assert found.advances[i] == pytest.approx(alone.advance, abs=1e-12)
        assert (found.periods[i], found.status[i]) == (9, "finished")
        part = found[i]
        if keep == "stroboscopic":
            assert len(part) == 9 + (PHASES[i] == 0)
            np.testing.assert_allclose(part, alone.stroboscopic, rtol=0, atol=1e-12)
        else:
            assert len(part) == 0


def test_rows_and_one_start_for_all() -> None:
    rows = np.array([[*p.to_dict().values()] for p in SETS])
    found = simulate_many(rows, (0.1, 0.0, 0.0), periods=5)
    for i, parameters in enumerate(SETS):
        alone = simulate(parameters, (0.1, 0.0, 0.0), periods=5).final[1]
        np.testing.assert_allclose(found.states[i], alone, rtol=0, atol=1e-12)
    assert repr(found) == "<Trajectories: 4 of 4 runs finished>"
    assert len(simulate_many([], periods=5)) == 0
    assert len(simulate_many([], periods=5, keep="stroboscopic").kept) == 0


def test_each_run_says_how_it_ended() -> None:
    undecided = Parameters(omega=1e-3, zeta=1e-3, alpha=0.03)
    found = simulate_many([Parameters(), undecided], [(0, 0, 0), (0, 0.005, 0)], periods=2)
    alone = simulate(undecided, (0.0, 0.005, 0.0), periods=2)
    assert found.status.tolist() == [results.Status.FINISHED, alone.status]
    assert found.success.tolist() == [True, alone.success]
    late = simulate_many(SETS, periods=10**12, max_seconds=1e-3)
    assert set(late.status.tolist()) <= {results.Status.TIME_LIMIT, results.Status.FINISHED}
    assert results.Status.TIME_LIMIT in late.status.tolist()
    cut = simulate_many(SETS, periods=9, keep="stroboscopic", max_segments=5)
    for i, parameters in enumerate(SETS):
        alone = simulate(parameters, periods=9, max_segments=5)
        np.testing.assert_array_equal(cut[i], alone.stroboscopic)
        assert tuple(cut.states[i]) == alone.final[1]
    assert results.Status.SEGMENT_LIMIT in cut.status.tolist()


BAD: list[tuple[str, dict[str, Any]]] = [
    ("parameters", {"parameters": np.zeros((2, 6))}),
    ("omega", {"parameters": np.zeros((2, 7))}),
    ("phases", {"phases": 99.0}),
    ("states", {"states": (0.0, np.nan, 0.0)}),
    ("periods", {"periods": 0}),
    ("threads", {"threads": 0}),
    ("keep", {"keep": "all"}),
    ("keep", {"keep": "segments"}),
    ("max_seconds", {"max_seconds": -1}),
    ("alpha", {"parameters": np.array([[0.1, *[1.0] * 6], [-1.0, *[1.0] * 6]])}),
    *(("parameters", {"parameters": one}) for one in (SETS[0], ["a"], np.zeros((1, 7), complex))),
    *(("states", {"states": one}) for one in (np.zeros((3, 3)), "abc")),
    ("phases", {"phases": [0.0, 1.0]}),
]


@pytest.mark.parametrize(("field", "bad"), BAD)
def test_bad_input_is_refused_by_name(field: str, bad: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput) as caught:
        simulate_many(**{"parameters": SETS, "periods": 2, **bad})
    assert caught.value.field == field
    with pytest.raises(InvalidInput, match="index"):
        simulate_many(SETS, periods=1)[0:2]  # type: ignore[index]


def test_rows_that_were_not_begun_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter([0.0, *[1e9] * 1000])
    monkeypatch.setattr(watch, "perf_counter", lambda: next(clock))
    for keep in ("final", "stroboscopic"):
        clock = iter([0.0, *[1e9] * 1000])
        found = simulate_many(SETS, STARTS, keep=keep, max_seconds=1.0, max_segments=99)
        assert set(found.status.tolist()) == {results.Status.TIME_LIMIT}
        np.testing.assert_array_equal(found.states, STARTS)


def test_states_at_the_ends_of_very_many_periods_are_kept_in_pieces() -> None:
    found = simulate_many(
        [Parameters(alpha=0.005)], periods=10**9, keep="stroboscopic", max_seconds=30
    )
    assert found.status.tolist() == ["finished"]
    assert found.kept.nbytes < 10**6


def test_what_is_kept_takes_no_more_memory_than_it_may(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counts that are sure to take more are refused; other runs end where it is full."""
    rows = np.tile([*SETS[0].to_dict().values()], (10**5, 1))
    refused: list[tuple[str, dict[str, Any]]] = [
        ("periods", {"periods": 8000, "keep": "stroboscopic"}),
        ("periods", {"periods": 10**12, "keep": "stroboscopic"}),
    ]
    for field, bad in refused:
        with pytest.raises(InvalidInput, match="GiB would be kept, 4 GiB may be") as caught:
            simulate_many(rows, **bad)
        assert caught.value.field == field
    room = 2**20
    monkeypatch.setattr(keeping, "MOST_BYTES", room)
    rapid = Parameters(omega=3000.0, zeta=0.0, f_b=1e6)  # a segment lasts for hundreds of periods
    for p, keep in [(SETS[0], what) for what in CHOICES if what != "final"] + [(rapid, "segments")]:
        run = simulate(p, (1.0, 0.0, 0.0), periods=10**6, keep=keep)
        assert (run.status, run.success) == (results.Status.MEMORY_LIMIT, False)
        arrays = [run.records] if keep == "segments" else []
        arrays += [run.stroboscopic]
        assert room / 2 < sum(array.nbytes for array in arrays) < 1.3 * room
