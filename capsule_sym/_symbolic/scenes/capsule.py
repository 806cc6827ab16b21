"""The capsule system: Section 2 of B. Guo and Y. Liu, Physica D 2019, dimensionless.

A mass is driven inside a capsule, to which a spring and a damper tie it, and a second spring behind
a gap. Dry friction holds the capsule, or works against its drift. The unit of force is the friction
P_f, that of length P_f / k1, and that of time 1 / Omega0 = sqrt(M_m / k1).
"""

from sympy import cos

from capsule_sym._symbolic.model.declaration import Model, tau
from capsule_sym._symbolic.model.vocabulary import BODIES, FRICTION, ONE_STOP, harmonic

PRINTED = (
    "Mass of the capsule over the inner mass: M_c / M_m. The paper prints 3.3; its global maps \
come out at 3.0."
)
model = Model(BODIES, harmonic(), ONE_STOP, FRICTION, {"gamma": {"about": PRINTED}})

# The device in SI units, with values of the size of the paper's.
model.device(M_m=0.5, M_c=1.65, k1=50, k2=75, c=0.5, G=0.0017, P_d=3, Omega=8, mu=0.2, g=9.81)

# Parameters, Eq. (6); the defaults are the case study's.
alpha, omega, delta, zeta, beta, gamma, f_b = model.system(
    alpha=0.7, omega=0.8, delta=0.02, zeta=0.05, beta=1.5, gamma=3.3, f_b=1.0
)

# State: of the mass relative to the capsule, and of the capsule.
x_r, v_r, v_c = model.states()

# The second spring acts beyond the gap.
model.region("NC", x_r < delta, stiffness=0)
model.region("C", x_r > delta, stiffness=beta)

# Force of the mass on the capsule, by spring, damper and second spring: P3 of Eq. (7) without
# contact, P4 with it.
kappa = model.stiffness
P = model.interaction(x_r + 2 * zeta * v_r + kappa * (x_r - delta))

# Dry friction.
model.drift("FD", v_c > 0, against=f_b)
model.rest("S", P < f_b, P > -f_b)
model.drift("BD", v_c < 0, against=f_b)

# v_r' + v_c' of the mass, and gamma v_c' of the capsule, which friction adds to: Eqs. (7)-(12).
model.mass(alpha * cos(omega * tau) - P)
model.capsule(gamma, P)
