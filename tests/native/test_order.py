"""Switches whose order only a proof tells: P rises past f_b, x_r meets delta, P falls past -f_b.

All three happen within one expansion. The first slip is short, and a core that took the impact for
the first switch would miss it.
"""

import numpy as np
import pytest

from capsule_sym import Parameters, simulate
from capsule_sym._native import core
from tests.finals import final_states

pytestmark = pytest.mark.skipif(core is None, reason="the C core was not compiled")

# alpha, omega, zeta, beta, gamma, f_b (delta is 0); x_r, v_r at rest, phase
STARTS = [
    (
        (2.3837827716870166, 1.0690716566096392, 0.3082677339729205),
        (0.9891951494972765, 4.942143517142021, 0.05416355459881703),
        (-0.02096709732463163, -0.011608767544829108, 1.1685358814730318),
    ),
    (
        (1.0920262664902491, 1.2006372326031984, 0.3256947501430873),
        (1.7464861081931033, 1.4706432112019958, 0.06240025762064204),
        (-0.029281921560665457, 0.040629844749590714, 0.9762053397573378),
    ),
    (
        (2.9061109533748755, 0.8678388032148538, 0.5628869736731561),
        (0.34613253808203426, 5.470109283036071, 0.06276324435884041),
        (-0.006330451848614541, -0.04389248398030901, 1.5158942297580225),
    ),
    (
        (1.4948031519179055, 0.9706343786048014, 0.5142225889774076),
        (2.9233641566496713, 5.46900586323855, 0.034748153255739184),
        (-0.003724053656182954, -0.02052128124669291, 1.3280098703996766),
    ),
]
Row = tuple[tuple[float, float, float], ...]


def _start(row: Row) -> tuple[Parameters, tuple[float, float, float], float]:
    (alpha, omega, zeta), (beta, gamma, f_b), (x_r, v_r, phase) = row
    return Parameters(alpha, omega, 0.0, zeta, beta, gamma, f_b), (x_r, v_r, 0.0), phase


@pytest.mark.parametrize("row", STARTS)
def test_the_first_of_three_switches_is_taken(row: Row) -> None:
    parameters, state, phase = _start(row)
    truth = simulate(parameters, state, phase, 1, backend="mpmath").segments
    found = simulate(parameters, state, phase, 1, backend="c").segments
    assert truth[0].target == "Σ1"  # by the independent path: P passes f_b first
    assert [(s.field, s.target) for s in found] == [(s.field, s.target) for s in truth]
    assert [s.duration for s in found] == pytest.approx(
        [float(s.duration) for s in truth], abs=1e-13
    )


@pytest.mark.parametrize("row", STARTS)
def test_so_it_is_side_by_side(row: Row) -> None:
    parameters, state, phase = _start(row)
    truth = simulate(parameters, state, phase, 1, backend="mpmath").final[1]
    rows = np.tile(list(parameters.to_dict().values()), (9, 1))
    found = final_states(rows, state, phase, 1).states
    assert found == pytest.approx(np.tile([float(value) for value in truth], (9, 1)), abs=1e-13)
