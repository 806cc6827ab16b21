"""Plans that no sweep can be: each is refused in one line, before memory is taken."""

from __future__ import annotations

import datetime
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capsule_sym import InvalidInput, Parameters
from capsule_sym._sweeps.quantities import TAKEN
from capsule_sym.inputs import Axis, Sweep, read_plan
from tests.sampling import many, sampled

GOOD = {"alpha": [0.5, 0.7]}
RANGE = {"from": 0.1, "to": 1.0, "count": 4}
SOBOL = {"sobol": {"alpha": [0, 2], "gamma": [1, 5]}, "count": 8, "seed": 1}
HUGE = 10**400
ENDLESS = 10**5000  # too long for Python to print
DEEP: Any = 0.5
for _ in range(2000):
    DEEP = [DEEP]


def alpha(values: Any) -> dict[str, Any]:
    return {"axes": {"alpha": values}}


def ranged(**changes: Any) -> dict[str, Any]:
    return alpha({**RANGE, **changes})


def sobol(**changes: Any) -> dict[str, Any]:
    return {"axes": {"sample": {**SOBOL, **changes}}}


def boxed(ends: Any) -> dict[str, Any]:
    return sobol(sobol={"alpha": ends})


def setting(**changes: Any) -> dict[str, Any]:
    return {"axes": GOOD, **changes}


DEVICE = {"M_m": 0.5, "M_c": 1.6, "k1": 30.0, "k2": 45.0, "c": 0.4, "G": 0.004, "mu": 0.3}
DEVICE |= {"P_d": 4.0, "Omega": 6.0}


BAD: list[Any] = [
    # Names that are a result's, or a quantity's that the axis does not have.
    *({"axes": {name: SOBOL}} for name in (
        *sorted(TAKEN), "beta", "", "two words", "two\nlines", "a/b", "..", "7", "x" * 5000)),
    *({"axes": {name: [0.5]}} for name in (
        "component", "multiplier", "itinerary", "outcome", "two\nlines", 3, "gravity")),
    {"axes": {"alpha": {**SOBOL, "sobol": {"beta": [0, 1]}}}},
    # Values of an axis.
    *map(alpha, (
        [], [[]], {}, 0.5, "0.5", None, True, ["0.5"], ["1", "2"], [0.5, "0.7"], [True],
        [True, False], [0.5, True], [0.5, None], [[0.5, 0.7]], [[0.5], [0.7]], [0.5, [0.7]],
        [[0.5], [0.6, 0.7]], [{"from": 1}], [datetime.date(2019, 4, 8)], [HUGE], [ENDLESS],
        [-HUGE, 0.5], [math.nan], [0.5, math.inf], [-0.1], [1e11], [1 + 2j], DEEP, [DEEP])),
    # Ranges.
    *(ranged(count=value) for value in (
        0, -1, 2.0, "4", True, None, [4], 10**10, 10**11, HUGE, ENDLESS, math.inf)),
    *(ranged(**{end: value}) for end in ("from", "to") for value in (
        "0.1", True, None, [0.1], {}, math.nan, math.inf, -0.1, 1e11, HUGE, ENDLESS, DEEP)),
    *(ranged(spacing=value) for value in ("cubic", 3, ["log"])),
    ranged(spacing="log", **{"from": 0.0}), ranged(step=0.1),
    alpha({"from": 0.1, "to": 1.0}), alpha({"count": 4}),
    # Random designs.
    *(sobol(sobol=value) for value in (
        [0, 1], {}, "alpha", None, {"gravity": [0, 1]}, {3: [0, 1]})),
    *map(boxed, (
        [], [1], [0, 1, 2], "01", 3, None, ["0", "1"], [False, True], [1, 0], [1, 1], [[0], [1]],
        [0, math.inf], [math.nan, 1], [0, HUGE], [0, ENDLESS], {"from": 0, "to": 1},
        [-1, 1], DEEP)),
    *(sobol(count=value) for value in (0, 10**10, 10**11, "8")),
    *(sobol(seed=value) for value in (-1, "1", 1.5, True, None)),
    sobol(spacing="log"),
    {"axes": {"sample": {"sobol": {"alpha": [0, 1]}, "count": 8}}},
    # Axes together.
    3, None, [], {}, *({"axes": value} for value in (
        {}, [], "alpha", None, [[0.5, 0.7]], {**GOOD, "sample": SOBOL},
        {"alpha": {**RANGE, "count": 10**6}, "beta": {**RANGE, "count": 10**6}},
        {"phase": [0.0, 8.0]})),
    {"axes": {"omega": [0.1, 2.0]}, "start": {"phase": 4.0}},
    # The rest of a plan.
    setting(period=300),
    *(setting(periods=value) for value in (0, -1, 2.5, "300", True, None, [300], HUGE, ENDLESS)),
    *(setting(tolerance=value) for value in (0, 1, -1e-9, "1e-9", True, None, math.nan, [], HUGE)),
    *(setting(compute=value) for value in (
        [], {}, "", "spin", "itineraries", ["spin"], [3], [["itinerary"]], None, True, 3,
        {"itinerary": True}, DEEP)),
    *(setting(chunk=value) for value in (
        [0], [3], [-1], [1.0], ["1"], [True], [[1]], [1, 1], 2, "2", None, {}, {"alpha": 1}, [HUGE],
        [ENDLESS], DEEP)),
    {"axes": {"alpha": {**RANGE, "count": 10**7}}, "chunk": [10**7]},
    *(setting(parameters=value) for value in (
        [], 3, "omega", None, {"self": 1}, {"omega": 0}, {"omega": "1"}, {"omega": True},
        {"omega": HUGE}, {"omega": ENDLESS}, {"omega": [1]}, {"omega": 1e9}, {"M_m": 1.0},
        {"zeta": math.nan}, {"zeta": DEEP}, {3: 1})),
    *(setting(start=value) for value in (
        [], 3, "x_r", None, {"x": 1}, {"x_r": "1"}, {"x_r": True}, {"v_r": HUGE}, {"v_c": ENDLESS},
        {"x_r": math.nan}, {"x_r": 1e21}, {"x_r": [1]}, {"x_r": DEEP}, {"phase": -1},
        {"phase": "0"}, {"phase": 8.0}, {"phase": True}, {"phase": [0]}, {"phase": HUGE}, {3: 1})),
    # Of a device.
    *({"device": DEVICE, "axes": {"P_d": {"from": low, "to": high, "count": count}}}
      for low, high, count in ((1, HUGE, 3), ("1", 2, 3), (1, math.inf, 3), (1, 2, 10**11))),
    {"device": DEVICE, "axes": {"P_d": SOBOL}},
    *(setting(device=value) for value in ({}, 3, {3: 1.0}, DEVICE | {"M": 1.0})),
]  # fmt: skip


def test_there_are_many() -> None:
    assert len(BAD) > 200


@pytest.mark.parametrize("plan", BAD, ids=range(len(BAD)))
def test_a_bad_plan_is_refused_in_one_line(plan: Any) -> None:
    with pytest.raises(InvalidInput) as refused:
        read_plan(plan)
    message = str(refused.value)
    assert "\n" not in message
    assert len(message) < 1000


def test_good_plans_beside_the_bad_ones_are_taken() -> None:
    for plan in (alpha([0.5, 1]), ranged(), ranged(spacing="log"), sobol(), boxed([0, 1.5])):
        assert isinstance(read_plan(plan), Sweep)
    integers = alpha(np.array([1, 2]).tolist())
    assert read_plan(integers).axes[0].values.tolist() == [[1.0], [2.0]]


TEXTS = [
    "[" * 2000, "x = " + "[" * 2000 + "]" * 2000, "[axes]\nalpha = " + "[" * 2000 + "]" * 2000,
    *(f"[axes]\nalpha = {values}" for values in (
        "[1" + "0" * 5000 + "]", "[1" + "0" * 400 + "]", "['1', '2']", "[true, false]",
        "[2019-04-08]", "1\nalpha = 2", "[1, 2")),
    "[[axes]]\nalpha = [1, 2]", '[axes]\n"al\\npha" = [1, 2]', "axes.alpha.from.x = 1",
    '[axes]\nsample = { sobol = { "al\\npha" = [0, 1] }, count = 4, seed = 1 }',
    "\x00", "",
]  # fmt: skip


@pytest.mark.parametrize("data", [*(text.encode() for text in TEXTS), b"\xff\xfe\x00"])
def test_a_bad_file_is_refused_in_one_line(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "plan.toml"
    path.write_bytes(data)
    for place in (path, tmp_path, tmp_path / "none.toml"):
        with pytest.raises(InvalidInput) as refused:
            read_plan(place)
        assert "\n" not in str(refused.value)


@pytest.mark.parametrize("values", [
    [["a"]], [[True]], [["1"], ["2"]], [[1.0], [1.0, 2.0]], np.array([["1.0"]]), np.array([[True]]),
    np.array([[1j]]), np.array([["2019-04-08"]], dtype="datetime64[D]"),
    None, object(),
])  # fmt: skip
def test_an_axis_takes_numbers_alone(values: Any) -> None:
    with pytest.raises(InvalidInput):
        Axis("alpha", ("alpha",), values)


def test_an_axis_takes_every_kind_of_number() -> None:
    for values in (np.arange(3), np.arange(3, dtype=np.float32), [np.int8(0), 1, 2.0], (0, 1, 2)):
        assert Axis.of("alpha", values).values.tolist() == [[0.0], [1.0], [2.0]]
    assert Axis.of("alpha", 0.5).values.tolist() == [[0.5]]


@pytest.mark.parametrize(
    "settings",
    [{"axes": "alpha"}, {"axes": ("alpha",)}, {"parameters": None}, {"parameters": {"alpha": 1}}],
)
def test_a_sweep_takes_axes_and_parameters_alone(settings: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput):
        Sweep(**{"axes": (Axis.of("alpha", [0.5]),), "parameters": Parameters(), **settings})


atoms = st.one_of(
    st.none(), st.booleans(), st.integers(), st.integers(-3, 12), st.floats(), st.floats(0.0, 2.0),
    st.sampled_from([10**10, 10**12, HUGE, "log", "itinerary", "alpha", "1", "0.5"]),
    st.text(max_size=3), st.dates(),
)  # fmt: skip
names = st.sampled_from([
    "alpha", "omega", "phase", "x_r", "sample", "itinerary", "from", "to", "count", "seed", "sobol",
])  # fmt: skip
values = st.recursive(
    atoms,
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(names | st.text(max_size=2), inner, max_size=4)
    ),
    max_leaves=8,
)
table = values | st.dictionaries(names, values, max_size=2)
axes = st.one_of(
    values,
    st.fixed_dictionaries({"from": values, "to": values, "count": values}),
    st.fixed_dictionaries({"sobol": table, "count": values, "seed": values}),
    st.lists(st.floats(0.0, 2.0), min_size=1, max_size=4),
)
plans = st.fixed_dictionaries(
    {"axes": values | st.dictionaries(names, axes, max_size=3)},
    optional={"parameters": table, "start": table}
    | dict.fromkeys(("periods", "tolerance", "compute", "chunk"), values),
)


def taken(read: Callable[[], Sweep]) -> tuple[Sweep | None, str]:
    """The sweep that is read, or why it is refused."""
    try:
        return read(), ""
    except InvalidInput as refused:
        return None, str(refused)


@sampled
@settings(max_examples=many(40, 10), deadline=None, derandomize=True, database=None)
@given(plans)
def test_any_plan_is_a_sweep_or_refused_in_one_line(plan: dict[str, Any]) -> None:
    sweep, message = taken(lambda: read_plan(plan))
    assert "\n" not in message
    if sweep is not None:
        assert 0 < sweep.size <= 10**10
        assert all(np.isfinite(axis.values).all() for axis in sweep.axes)


@settings(max_examples=many(30, 10), deadline=None, derandomize=True, database=None)
@given(st.text("[]{}=,.\"'\n alph12e-+_true", max_size=60))
def test_any_text_is_a_sweep_or_refused_in_one_line(text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plan.toml"
        path.write_text("[axes]\nalpha = " + text, encoding="utf-8")
        _, message = taken(lambda: read_plan(path))
        assert "\n" not in message
