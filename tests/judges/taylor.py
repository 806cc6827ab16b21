"""One linear segment to any number of digits, by Taylor's method on the equations of motion.

With the forcing carried as an oscillator of its own, a segment is an autonomous linear system
z' = A z, z = (x_r, v_r, v_c, x_c, cos(omega tau), sin(omega tau), 1). Its Taylor series over a
short step is the same matrix for every step, so 2^j steps are j squarings of it (`mpmath.expm`
with method "taylor"): stiff systems and long segments cost no more than easy ones.
"""

from collections.abc import Sequence
from typing import Any

from mpmath import mp, mpf

from capsule_sym import Parameters
from tests.judges import CONTACT, DRIFT

_GUARD_DIGITS = 15
_NAMES = ("x_r", "v_r", "v_c", "x_c")


def system(parameters: Parameters, field: int) -> Any:
    """The 7 by 7 matrix A of Eqs. (7)-(12) for one field, parameters taken exactly."""
    zeta, delta, omega, gamma = map(
        mpf, (parameters.zeta, parameters.delta, parameters.omega, parameters.gamma)
    )
    beta = mpf(parameters.beta) if CONTACT[field] else mpf(0)
    # Rows are functionals of z: the push P3 or P4 on the capsule, and its acceleration.
    push = mp.matrix([[1 + beta, 2 * zeta, 0, 0, 0, 0, -beta * delta]])
    friction = mp.matrix([[0, 0, 0, 0, 0, 0, -DRIFT[field] * mpf(parameters.f_b)]])
    capsule = (push + friction) / gamma if DRIFT[field] else mp.zeros(1, 7)
    forcing = mp.matrix([[0, 0, 0, 0, mpf(parameters.alpha), 0, 0]])
    matrix = mp.zeros(7)
    matrix[0, 1] = 1
    matrix[1, :] = forcing - push - capsule
    matrix[2, :] = capsule
    matrix[3, 2] = 1
    matrix[4, 5], matrix[5, 4] = -omega, omega
    return matrix


def integrate(
    parameters: Parameters,
    field: int,
    state: Sequence[Any],
    tau: Any,
    duration: Any,
    digits: int = 50,
) -> tuple[Any, Any, Any, Any]:
    """State (x_r, v_r, v_c, x_c) after `duration` in one field from `state` at time `tau`.

    Numbers are taken exactly, floats included. The result is correct to `digits` digits, relative
    to the largest magnitude that the component has at the start and after each third of the
    duration. This is measured: a run in three parts, whose Taylor step differs from the whole
    run's, must agree; ArithmeticError when it does not.
    """
    with mp.workdps(digits + _GUARD_DIGITS):
        matrix = system(parameters, field)
        angle = mpf(parameters.omega) * mpf(tau)
        start = mp.matrix([*map(mpf, state), mp.cos(angle), mp.sin(angle), 1])
        whole = mp.expm(matrix * mpf(duration)) * start
        third = mp.expm(matrix * (mpf(duration) / 3))
        parts = [start]
        for _ in range(3):
            parts.append(third * parts[-1])
        for row, name in enumerate(_NAMES):
            scale = max(abs(part[row]) for part in parts)
            error = abs(whole[row] - parts[-1][row])
            if error > mpf(10) ** -digits * scale:
                raise ArithmeticError(
                    f"{name}: the run in three parts differs by {mp.nstr(error, 3)}, "
                    f"more than {digits} digits of {mp.nstr(scale, 3)}"
                )
        return whole[0], whole[1], whole[2], whole[3]
