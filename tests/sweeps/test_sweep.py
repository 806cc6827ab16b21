"""A sweep as data: axes, chunks, columns, files, and what is refused at the door."""

import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest

from capsule_sym import InvalidInput, Parameters, PhysicalParameters
from capsule_sym.inputs import Axis, Sweep, read_plan
from tests.sweeps import chart


def test_axes_have_the_values_that_were_asked_for() -> None:
    assert Axis.linear("alpha", 0.0, 2.0, 5).values.ravel().tolist() == [0.0, 0.5, 1.0, 1.5, 2.0]
    ratios = np.diff(np.log(Axis.log("omega", 0.1, 10.0, 9).values.ravel()))
    np.testing.assert_allclose(ratios, math.log(100) / 8, rtol=1e-14)
    assert Axis.of("delta", [0.3, 0.1]).values.ravel().tolist() == [0.3, 0.1]


def test_a_random_design_is_low_in_discrepancy_and_repeats_with_its_seed() -> None:
    ranges = {"alpha": (0.0, 2.0), "gamma": (1.0, 5.0)}
    axis = Axis.sobol(ranges, 64, seed=3)
    assert axis.quantities == ("alpha", "gamma")
    # A Sobol sequence of 64 points has exactly one in each of 64 equal slices of each side.
    for column, (low, high) in zip(axis.values.T, ranges.values(), strict=True):
        slices = np.floor((column - low) / (high - low) * 64)
        assert sorted(slices.tolist()) == list(range(64))
    np.testing.assert_array_equal(axis.values, Axis.sobol(ranges, 64, seed=3).values)
    assert (axis.values != Axis.sobol(ranges, 64, seed=4).values).any()


def test_counts_are_whole_numbers_of_any_kind() -> None:
    ranges = {"alpha": (0.0, 2.0), "gamma": (1.0, 5.0)}
    for make in (
        lambda count: Axis.linear("alpha", 0.1, 1.0, count),
        lambda count: Axis.log("alpha", 0.1, 1.0, count),
        lambda count: Axis.sobol(ranges, count, seed=count),
    ):
        assert np.array_equal(make(np.int64(12)).values, make(12).values)


def test_columns_are_the_product_of_the_axes_and_parts_tile_them() -> None:
    pair = Axis("pair", ("beta", "v_c"), np.array([[1.0, 0.1], [2.0, 0.2], [3.0, 0.3]]))
    axes = (Axis.of("alpha", [0.5, 0.6]), pair, Axis.of("phase", [0.0, 1.0]))
    sweep = Sweep(axes, Parameters(delta=0.3), state=(0.1, 0.2, 0.0), chunk=(1, 2, 2))
    rows, states, phases = sweep.columns()
    expected = list(itertools.product([0.5, 0.6], pair.values.tolist(), [0.0, 1.0]))
    assert rows[:, 0].tolist() == [alpha for alpha, _, _ in expected]
    assert rows[:, 4].tolist() == [beta for _, (beta, _), _ in expected]
    assert (rows[:, 2] == 0.3).all()
    assert states.tolist() == [[0.1, 0.2, v_c] for _, (_, v_c), _ in expected]
    assert phases.tolist() == [phase for *_, phase in expected]

    seen = np.zeros(sweep.shape)
    for index in range(math.prod(sweep.chunks)):
        region = sweep.region(index)
        seen[region] += 1
        part = sweep.part(index).columns()[0]
        np.testing.assert_array_equal(part, rows.reshape(*sweep.shape, 7)[region].reshape(-1, 7))
        assert sweep.cells_in(index) == len(part)
    assert (seen == 1).all()
    with pytest.raises(InvalidInput, match=r"index = 4: must be .*3"):
        sweep.part(4)


def test_a_part_of_a_device_s_axis_has_its_own_values_in_si_units() -> None:
    """A chunk of forces from 1 to 3 N has those of its cells alone."""
    device = PhysicalParameters(1.0, 3.0, 1.0, 1.0, 0.05, 0.1, 1.0, 1.0, 0.1)
    axis = Axis.of_device(device, "P_d", [1.0, 2.0, 3.0])
    part = Sweep((axis,), device=device, chunk=(2,)).part(1).axes[0]
    assert part.device is not None
    assert (part.device[0].tolist(), part.device[1]) == ([3.0], "N")
    np.testing.assert_array_equal(part.values, axis.values[2:])


def test_an_axis_of_another_device_is_refused() -> None:
    """The force of 3 N over twice the friction is another alpha."""
    device = PhysicalParameters(1.0, 3.0, 1.0, 1.0, 0.05, 0.1, 1.0, 1.0, 0.1)
    other, axis = device.replace(mu=0.2), Axis.of_device(device, "P_d", [3.0])
    assert axis.values[0, 0] / Axis.of_device(other, "P_d", [3.0]).values[0, 0] == 2
    with pytest.raises(InvalidInput, match=r"device = .*mu=0\.2.*: must be that of the axis P_d"):
        Sweep((axis,), device=other)
    assert Sweep((axis,), device=device.replace(P_d=5.0)).axes == (axis,)


def test_chunks_shrink_with_the_work_of_a_cell() -> None:
    axes = (Axis.linear("alpha", 0.1, 2.0, 512), Axis.linear("gamma", 1.0, 5.0, 512))
    sizes = [
        math.prod(Sweep(axes, periods=periods, compute=compute).chunk)
        for periods, compute in (
            (300, ("itinerary",)),
            (30_000, ("itinerary",)),
            (300, ("lyapunov",)),
            (300, ("multipliers",)),
        )
    ]
    assert sizes[0] > sizes[1] > 10
    assert sizes[0] >= sizes[3] > sizes[2] > 10
    assert math.prod(Sweep(axes[:1], periods=100).chunks) >= 16


FILE = """
periods = 50
tolerance = 1e-8
compute = ["final", "itinerary"]
chunk = [2, 1, 8]
[parameters]
omega = 0.9
[start]
v_r = 0.25
phase = 0.5
[axes]
alpha = { from = 0.1, to = 1.0, count = 4, spacing = "log" }
delta = [0.02, 0.03]
sample = { sobol = { gamma = [1, 5], x_r = [-1, 1] }, count = 8, seed = 7 }
"""


def test_a_file_gives_the_sweep_that_it_describes(tmp_path: Path) -> None:
    path = tmp_path / "sweep.toml"
    path.write_text(FILE)
    sample = Axis.sobol({"gamma": (1, 5), "x_r": (-1, 1)}, 8, seed=7)
    expected = Sweep(
        (Axis.log("alpha", 0.1, 1.0, 4), Axis.of("delta", [0.02, 0.03]), sample),
        Parameters(omega=0.9),
        state=(0.0, 0.25, 0.0),
        phase=0.5,
        periods=50,
        tolerance=1e-8,
        compute=("itinerary", "final"),
        chunk=(2, 1, 8),
    )
    assert read_plan(path).record() == expected.record()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[parameters]", "[parameter]", "key = 'parameter'"),
        ("omega = 0.9", "omega = -1", "omega = -1.0"),
        ("v_r = 0.25", "v_x = 0.25", "start = 'v_x'"),
        ("count = 4", "number = 4", "alpha = 'number'"),
        ("count = 4, ", "", "a table with count too"),
        ('"log"', '"cubic"', "spacing = 'cubic'"),
        ("from = 0.1", "from = 0", "logarithmic"),
        ("[0.02, 0.03]", "[0.02, inf]", "delta = inf"),
        ("[0.02, 0.03]", '"0.02"', "delta = '0.02'"),
        ("gamma = [1, 5]", "gamma = [5, 1]", "low < high"),
        ("gamma = [1, 5]", "gravity = [1, 5]", "axis = 'gravity'"),
        ("gamma = [1, 5]", "alpha = [1, 5]", "axis = 'alpha'"),
        ("phase = 0.5", "phase = 7.5", "phase = 7.5"),
        ("periods = 50", "periods = 0", "periods = 0"),
        ("periods = 50", "periods = 'x'", "periods = 'x'"),
        ("1e-8", "2", "tolerance = 2"),
        ('["final", "itinerary"]', "[]", "compute = []"),
        ('["final", "itinerary"]', '["spin"]', "compute = 'spin'"),
        ("[2, 1, 8]", "[2, 1]", "chunk = [2, 1]"),
        ("[2, 1, 8]", "[2, 1, 9]", "chunk = [2, 1, 9]"),
        ("[axes]", "[axes", "a TOML file"),
    ],
)
def test_what_a_file_may_not_hold_is_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = tmp_path / "sweep.toml"
    assert FILE.count(old) == 1
    path.write_text(FILE.replace(old, new))
    with pytest.raises(InvalidInput) as refused:
        read_plan(path)
    assert said in str(refused.value)


def test_numbers_of_numpy_give_the_record_of_those_of_python() -> None:
    """0.5 and 2^-20 are equal in single and in double precision."""
    axes = (Axis.of("alpha", [0.5]),)
    single = Sweep(
        axes, phase=np.float32(0.5), periods=np.int64(50), tolerance=np.float32(2.0**-20)
    )
    record = json.dumps(Sweep(axes, phase=0.5, periods=50, tolerance=2.0**-20).record())
    assert json.dumps(single.record()) == record


def test_the_record_tells_any_two_sweeps_apart() -> None:
    base = chart()
    assert base.record() == chart().record()
    changed = ({"rows": 13}, {"periods": 41}, {"parameters": Parameters(zeta=0.1)}, {"phase": 1.0})
    for other in changed:
        assert chart(**other).record() != base.record()
