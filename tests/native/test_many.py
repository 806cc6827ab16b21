"""Many runs at once give what single runs give, one after another, with their offsets."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from capsule_sym import InvalidInput, Parameters, Status, Trajectories, simulate, simulate_many
from capsule_sym.map.segments import Segments

SETS = [Parameters(alpha=a, omega=w) for a, w in ((0.7, 0.8), (1.2, 0.9), (0.005, 0.8), (1.5, 0.7))]
STARTS = np.array([[0.0, 0.0, 0.0], [0.1, -0.2, 0.3], [0.01, 0.0, 0.0], [-0.4, 0.2, -0.1]])
PHASES = np.array([0.0, 1.0, 0.0, 2.5])
TIMES = np.random.default_rng(0).uniform(2.5, 60.0, 40)


def single(i: int, keep: Any, periods: int = 9) -> Any:
    return simulate(SETS[i], STARTS[i].tolist(), float(PHASES[i]), periods, keep=keep)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("keep", ["segments", "switches", "stroboscopic", "final", TIMES])
def test_each_run_is_as_if_alone(keep: Any, threads: int) -> None:
    found = simulate_many(SETS, STARTS, PHASES, 9, keep=keep, threads=threads)
    assert isinstance(found, Trajectories)
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
        if isinstance(keep, np.ndarray):
            np.testing.assert_array_equal(part[:, :3], alone.states)
            np.testing.assert_array_equal(part[:, 3], alone.positions)
        elif keep == "segments":
            assert isinstance(part, Segments)
            assert part == alone.segments
        elif keep == "switches":
            np.testing.assert_array_equal(part, alone.switches)
        elif keep == "stroboscopic":
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
    assert repr(found) == "<Trajectories: 4 of 4 runs finished, kept final>"
    assert len(simulate_many([], periods=5)) == 0
    assert len(simulate_many([], periods=5, keep="segments").kept) == 0


def test_each_run_says_how_it_ended() -> None:
    undecided = Parameters(omega=1e-3, zeta=1e-3, alpha=0.03)
    found = simulate_many([Parameters(), undecided], [(0, 0, 0), (0, 0.005, 0)], periods=2)
    alone = simulate(undecided, (0.0, 0.005, 0.0), periods=2)
    assert found.status.tolist() == [Status.FINISHED, alone.status]
    assert found.success.tolist() == [True, alone.success]
    late = simulate_many(SETS, periods=10**12, max_seconds=1e-3)
    assert set(late.status.tolist()) <= {Status.TIME_LIMIT, Status.FINISHED}
    assert Status.TIME_LIMIT in late.status.tolist()
    cut = simulate_many(SETS, periods=9, keep="segments", max_segments=5)
    assert np.diff(cut.offsets).max() == 5
    assert Status.SEGMENT_LIMIT in cut.status.tolist()


BAD: list[tuple[str, dict[str, Any]]] = [
    ("parameters", {"parameters": np.zeros((2, 6))}),
    ("omega", {"parameters": np.zeros((2, 7))}),
    ("phases", {"phases": 99.0}),
    ("states", {"states": (0.0, np.nan, 0.0)}),
    ("periods", {"periods": 0}),
    ("threads", {"threads": 0}),
    ("keep", {"keep": "all"}),
    ("keep", {"keep": [1e9]}),
    ("max_seconds", {"max_seconds": -1}),
]


@pytest.mark.parametrize(("field", "bad"), BAD)
def test_bad_input_is_refused_by_name(field: str, bad: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput) as caught:
        simulate_many(**{"parameters": SETS, "periods": 2, **bad})
    assert caught.value.field == field
