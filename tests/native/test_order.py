"""Switches whose order only a proof decides: P rises past f_b, x_r meets delta, P falls past -f_b.

All three happen within one expansion. The first slip is short, and a core that took the impact for
the first switch would miss it.
"""

from random import Random

import numpy as np
import pytest

from capsule_sym import Parameters, simulate
from capsule_sym._native import core
from tests.finals import final_states
from tests.native.families import ORDERED, Ordered, hidden

pytestmark = pytest.mark.skipif(core is None, reason="the C core was not compiled")


def _start(row: Ordered) -> tuple[Parameters, tuple[float, float, float], float]:
    (alpha, omega, zeta), (beta, gamma, f_b), (x_r, v_r, phase) = row
    return Parameters(alpha, omega, 0.0, zeta, beta, gamma, f_b), (x_r, v_r, 0.0), phase


@pytest.mark.parametrize("row", ORDERED)
def test_the_first_of_three_switches_is_taken(row: Ordered) -> None:
    parameters, state, phase = _start(row)
    truth = simulate(parameters, state, phase, 1, backend="mpmath").segments
    found = simulate(parameters, state, phase, 1, backend="c").segments
    assert truth[0].target == "Σ1"  # by the independent path: P passes f_b first
    assert [(s.field, s.target) for s in found] == [(s.field, s.target) for s in truth]
    assert [s.duration for s in found] == pytest.approx(
        [float(s.duration) for s in truth], abs=1e-13
    )


@pytest.mark.parametrize("row", ORDERED)
def test_so_it_is_side_by_side(row: Ordered) -> None:
    parameters, state, phase = _start(row)
    truth = simulate(parameters, state, phase, 1, backend="mpmath").final[1]
    rows = np.tile(list(parameters.to_dict().values()), (9, 1))
    found = final_states(rows, state, phase, 1).states
    assert found == pytest.approx(np.tile([float(value) for value in truth], (9, 1)), abs=1e-13)


def test_a_short_contact_just_before_a_drift_ends_is_seen() -> None:
    """The gap dips by less than its form is off, and is that far from zero where v_c vanishes."""
    start = hidden(Random(0))
    phase = start.angle / start.parameters.omega
    found, truth = (
        simulate(start.parameters, start.state, phase, 1, backend=backend).segments
        for backend in ("c", "mpmath")
    )
    assert [one.field for one in truth[:4]] == [1, 4, 1, 2]
    assert [one.field for one in found[:4]] == [1, 4, 1, 2]
    assert [one.duration for one in found[:4]] == pytest.approx(
        [one.duration for one in truth[:4]], rel=1e-9
    )
