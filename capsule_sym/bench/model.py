"""The six fields as a good researcher would code them for an integrator, Eqs. (7)-(12)."""

from __future__ import annotations

from typing import NamedTuple

from capsule_sym.parameters import Parameters

CONTACT = {1: 0, 2: 0, 3: 0, 4: 1, 5: 1, 6: 1}
DRIFT = {1: 1, 2: 0, 3: -1, 4: 1, 5: 0, 6: -1}
FIELD = {(CONTACT[field], DRIFT[field]): field for field in CONTACT}


class Result(NamedTuple):
    """What a tool's run gives: the fields in order of time, and the final (x_r, v_r, v_c)."""

    fields: str
    state: tuple[float, ...]


def force(p: Parameters, contact: int, x_r: float, v_r: float) -> float:
    """The interaction force P."""
    return x_r + 2 * p.zeta * v_r + (p.beta * (x_r - p.delta) if contact else 0.0)


def following(p: Parameters, field: int, fired: int, x_r: float, v_r: float, v_c: float) -> int:
    """The field after guard 0 (gap) or 1, 2 (friction) of a field fired."""
    contact, drift = CONTACT[field], DRIFT[field]
    if fired == 0:
        return FIELD[1 - contact, drift]
    if drift == 0:
        return FIELD[contact, 1 if fired == 1 else -1]
    pull = force(p, contact, x_r, v_r)
    return FIELD[contact, 0 if abs(pull) <= p.f_b else (1 if pull > 0 else -1)]
