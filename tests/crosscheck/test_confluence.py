"""Motions at and beside resonance, with little or no damping, in units of their conditioning."""

from __future__ import annotations

import ctypes
import inspect
import math
import shutil
import textwrap
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from capsule_sym import Parameters, simulate, simulate_many
from capsule_sym._map import course
from capsule_sym._parameters import CAPSULE
from tests.native import KERNELS, LIBRARY, compile_in
from tests.sampling import sampled, some

Values = NDArray[np.float64]
UNIT = 2.0**-53
MOST = 16.0
"""Units of the conditioning: those of each parameter's and the start's own rounding."""
SMALL = [10.0**-k for k in range(1, 17)]
KINDS = {
    "rest": (Parameters(0.05, delta=1e9, f_b=1e9), 1.0, (0.0, 0.0, 0.0)),
    "displaced": (Parameters(0.05, delta=1e9, f_b=1e9), 1.0, (0.3, -0.2, 0.0)),
    "slip": (Parameters(0.05, delta=1e9, gamma=1 / 3, f_b=1e-3), 4.0, (0.1, 0.0, 9.0)),
    "contact": (Parameters(0.05, delta=0.0, beta=3.0, f_b=1e9), 4.0, (0.2, 0.1, 0.0)),
}
"""Parameters, squared frequency of the flow that is driven near its resonance, and a start."""


def final(row: Values, periods: int, lanes: int) -> Values:
    if lanes:
        many = simulate_many(np.tile(row[:7], (lanes, 1)), row[7:], periods=periods)
        assert len({state.tobytes() for state in many.states}) == 1
        return many.states[0]
    return np.array(simulate(Parameters(*row[:7]), tuple(row[7:]), periods=periods).final[1])


def units(row: Values, periods: int, final: Any = final) -> list[float]:
    """Errors of the final state, alone and in lanes, in units of the conditioning.

    A unit is what a rounding of each number given changes.
    """
    p, start = Parameters(*row[:7].tolist()), tuple(row[7:].tolist())
    exact = simulate(p, start, periods=periods, backend="mpmath").final[1]
    there = np.array(exact, dtype=float)
    allowed, share = abs(there), 2.0**-24
    for i in np.flatnonzero(row):
        moved = row * np.where(np.arange(row.size) == i, 1 + share, 1.0)
        allowed = allowed + abs(final(moved, periods, 0) - there) / share
    unit = UNIT * float(allowed.max())
    return [
        max(abs(float(a - b)) for a, b in zip(final(row, periods, n).tolist(), exact, strict=True))
        / unit
        for n in (0, 9)
    ]


CASES = [
    (kind, side * detuning, damping, periods)
    for kind, detuning, (side, periods), damping in product(
        KINDS, SMALL, ((1, 1), (-1, 4), (1, 300)), (0.0, *SMALL)
    )
    if periods < 300 or kind in ("rest", "displaced")  # others have hundreds of segments
][::11]


@sampled
def test_no_digits_are_lost_near_resonance() -> None:
    for kind, detuning, damping, periods in some(CASES, 9):
        p, K, start = KINDS[kind]
        p = p.replace(omega=math.sqrt(K) * (1 + detuning), zeta=damping)
        row = np.array([*p.to_dict().values(), *start])
        assert max(units(row, periods)) < MOST, (p, start, periods)


# A rest near resonance without damping, and one far from it whose free part has decayed.
RESTS = ((1 + 1e-10, 0.0, 10), (1.3, 0.1, 100_000))
SHIM = """
const capsule_code capsule_code_fused, capsule_code_wide, capsule_code_wide_fused;
void rest(const capsule_parameters *p, double x_r, double v_r, double h, capsule_state *out)
{
    static capsule_map map;
    const capsule_start start = {.x_r = x_r, .v_r = v_r, .cos_theta = 1.0};
    capsule_map_make(p, &map);
    resting_state(&map.field[FIELD_OF[0][0][1] - 1], &start, h, out);
}
"""
CHOICE = "k->omega * h * sqrt(k->Z2) >= k->K + k->omega * k->omega"


def worst_at_rests(final: Any) -> float:
    """Largest error at the ends of the rests, in units of the conditioning."""
    p, _, start = KINDS["displaced"]
    systems = ((p.replace(omega=omega, zeta=zeta), n) for omega, zeta, n in RESTS)
    return max(max(units(np.array([*p.to_dict().values(), *start]), n, final)) for p, n in systems)


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
@pytest.mark.parametrize(("choice", "right"), [(CHOICE, True), ("1", False), ("0", False)])
def test_the_form_of_a_rest_in_c_has_its_place(choice: str, right: bool, tmp_path: Path) -> None:
    text = (LIBRARY / "run.c").read_text()
    assert text.count(CHOICE) == 1
    (tmp_path / "changed.c").write_text(text.replace(CHOICE, choice) + SHIM)
    others = LIBRARY / "tables.c", LIBRARY / "scalar.c", KERNELS / "capsule_kernels.c"
    compile_in(tmp_path, "-shared", "changed.c", *others, "-lm", "-o", "built.so")
    library = ctypes.CDLL(str(tmp_path / "built.so"))
    library.rest.argtypes = [ctypes.c_void_p, *[ctypes.c_double] * 3, ctypes.c_void_p]

    def changed(row: Values, periods: int, _: int) -> Values:
        end, h = np.zeros(1, CAPSULE.records.STATE), periods * 2 * math.pi / row[1]
        library.rest(row.ctypes.data, row[7], row[8], h, end.ctypes.data)
        return np.array([end[name][0] for name in ("x_r", "v_r", "v_c")])

    assert (worst_at_rests(changed) < MOST) is right


@pytest.mark.parametrize(("least", "right"), [("8 *", True), ("0 *", False), ("1e99 *", False)])
def test_the_form_of_a_rest_in_python_has_its_place(least: str, right: bool, monkeypatch) -> None:
    text = textwrap.dedent(inspect.getsource(course.Course.at_mark))
    assert text.count("< 8 *") == 1
    made: dict[str, Any] = {}
    exec(text.replace("8 *", least), vars(course), made)
    monkeypatch.setattr(course.Course, "at_mark", made["at_mark"])

    def changed(row: Values, periods: int, _: int) -> Values:
        p, start = Parameters(*row[:7].tolist()), tuple(row[7:].tolist())
        return np.array(simulate(p, start, periods=periods, backend="numpy").final[1])

    assert (worst_at_rests(changed) < MOST) is right
