"""The symbols of the theory, each with the assumptions the model makes about it.

Everything is dimensionless (Section 2 of the paper). A module that needs a symbol takes it
from here, so that two expressions about the same quantity always combine.
"""

from __future__ import annotations

import sympy as sp

# Parameters, with the ranges that `capsule_sym._parameters.Parameters` enforces.
alpha = sp.Symbol("alpha", nonnegative=True)  # excitation amplitude
omega = sp.Symbol("omega", positive=True)  # excitation frequency
delta = sp.Symbol("delta", nonnegative=True)  # gap
zeta = sp.Symbol("zeta", nonnegative=True)  # damping ratio
beta = sp.Symbol("beta", nonnegative=True)  # stiffness ratio
gamma = sp.Symbol("gamma", positive=True)  # mass ratio
f_b = sp.Symbol("f_b", positive=True)  # friction bound

PARAMETERS = (alpha, omega, delta, zeta, beta, gamma, f_b)

# State of the map, and the absolute position of the capsule (a quadrature of v_c).
x_r = sp.Symbol("x_r", real=True)
v_r = sp.Symbol("v_r", real=True)
v_c = sp.Symbol("v_c", real=True)
x_c = sp.Symbol("x_c", real=True)

STATE = (x_r, v_r, v_c)

# Where the force of the excitation, which is bounded by alpha, stands for itself.
force = sp.Symbol("u", real=True)  # alpha cos(omega tau)
force_rate = sp.Symbol("u1", real=True)  # its time derivative

tau = sp.Symbol("tau", real=True)  # time
theta = sp.Symbol("theta", real=True)  # forcing angle omega * tau at the start of a segment
h = sp.Symbol("h", nonnegative=True)  # time since the start of a segment
