"""Accumulated and lost roundings: starts decided by an angle's rest, and long segments."""

import ctypes
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from capsule_sym import Parameters, simulate
from capsule_sym._native import core
from tests.finals import final_states, parameter_rows
from tests.native import built

SHIM = """
#include "internal.h"
int planes(const double *p, double x_r, double phase, int *plane)
{
    static capsule_map map;
    capsule_map_make((const capsule_parameters *)p, &map);
    capsule_state at = capsule_state_at(&map, x_r, 0, 0, phase);
    *plane = at.plane;
    at.field = 0;
    return capsule_code_here(0)->field_at(&map, &at);
}
"""


def mismatched(directory: Path, change: tuple[str, str] | None) -> int:
    """Number of starts at rest on x_r = delta, beside v_r' = 0, lie on another plane than the one
    that a run leaves by the field it begins with."""
    planes = ctypes.CDLL(
        str(built(directory, SHIM, "-O0", "-shared", "-fPIC", change=change))
    ).planes
    random, count = np.random.default_rng(0), 0
    for _ in range(60):
        delta, omega = random.uniform(0.05, 0.6), random.uniform(0.5, 3.0)
        alpha = random.uniform(1.05 * delta, 1.5)
        row = (ctypes.c_double * 7)(alpha, omega, delta, 0.05, 1.5, 3.3, 1.0)
        phase = (2 * math.pi - math.acos(delta / alpha)) / omega
        for step in range(-40, 41):
            plane, at = ctypes.c_int(), phase + step * np.spacing(phase)
            field = planes(row, ctypes.c_double(delta), ctypes.c_double(at), ctypes.byref(plane))
            count += field != plane.value
    return count


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_a_start_lies_on_the_plane_of_the_field_that_a_run_begins_with(tmp_path: Path) -> None:
    assert mismatched(tmp_path / "sound", None) == 0


@pytest.mark.long
@pytest.mark.skipif(
    shutil.which("cc") is None or core is None or core.lanes() == 1, reason="no lanes here"
)
def test_a_start_from_the_rounded_angle_is_noticed(tmp_path: Path) -> None:
    exact = "state.plane = state.field = capsule_code_here(0)->field_at(map, &state);"
    lost = "double rest = state.angle_rest; state.angle_rest = 0.0;"
    rounded = f"{lost} {exact} state.angle_rest = rest;"
    assert mismatched(tmp_path / "rounded", (exact, rounded)) > 0


@pytest.mark.skipif(core is None, reason="the C core was not compiled")
def test_segments_of_many_expansions_lose_nothing_side_by_side() -> None:
    """Slow forcing: a period takes 1,700 units of time, and segments up to 1,000 expansions."""
    base = Parameters(omega=0.00371, delta=0.3, zeta=0.05, beta=1.5, gamma=3.3)
    alpha = np.linspace(1.1, 1.6, 6)
    finals = final_states(parameter_rows(base, alpha=alpha), periods=1)
    for value, final in zip(alpha.tolist(), finals.states, strict=True):
        run = simulate(base.replace(alpha=value), periods=1, backend="numpy")
        assert sum(s.duration > 100 for s in run.segments) > 1
        np.testing.assert_allclose(final, run.final[1], rtol=0, atol=1e-13)
