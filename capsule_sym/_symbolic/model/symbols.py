"""Symbols of parameters, state, drive and time, with the assumptions that the model makes.

Everything is dimensionless (Section 2 of the paper). Other modules import these symbols, so that
two expressions about the same quantity combine.
"""

from __future__ import annotations

import sympy as sp

from capsule_sym._symbolic.model import declaration

MODEL = declaration.chosen()
"""The model of this process."""

tau = declaration.tau
PULSES = MODEL.drive if MODEL.drive and MODEL.drive.pulsed else None
PULSED = PULSES is not None
"""True if the drive is constant between edges."""
PARAMETERS = tuple(parameter.symbol for parameter in MODEL.parameters)

alpha = MODEL.symbol("alpha")  # amplitude of the drive, and its frequency
omega = MODEL.symbol("omega")
gamma = MODEL.symbol("gamma")  # mass ratio

# x_r at the stop in front, and where the spring of a field begins to act: with one stop the same.
front = MODEL.stops[0]
stop = front if len(MODEL.stops) == 1 else MODEL.stop


def __getattr__(name: str) -> sp.Symbol:
    """Symbol of a parameter by its name; raises AttributeError if there is none."""
    try:
        return MODEL.symbol(name)
    except KeyError:
        raise AttributeError(name) from None


# State of the map, and the absolute position of the capsule (a quadrature of v_c).
STATE = MODEL.state
x_r, v_r, v_c = STATE
x_c = sp.Symbol("x_c", real=True)

# Force of the drive as a symbol of its own; that of a cosine is bounded by alpha.
force = declaration.force  # alpha cos(omega tau), or the level of pulses
force_rate = sp.Symbol("u1", real=True)  # its time derivative

theta = sp.Symbol("theta", real=True)  # forcing angle omega * tau at the start of a segment
h = sp.Symbol("h", nonnegative=True)  # time since the start of a segment
