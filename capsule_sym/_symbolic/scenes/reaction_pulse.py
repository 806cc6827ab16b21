"""The capsule of the paper with an actuator between both bodies, driven by pulses.

The drive has two levels, u = alpha in the first part D of each period and alpha_low in the rest. It
acts on the mass, and against it on the capsule: Q = P - u moves the capsule. An edge of the drive
changes Q at once, and may break rest. The units are the paper's.
"""

from capsule_sym._symbolic.model.declaration import Model
from capsule_sym._symbolic.model.vocabulary import BODIES, FRICTION, ONE_STOP, pulses

model = Model(BODIES, pulses("between both bodies"), ONE_STOP, FRICTION)

# The device in SI units.
# fmt: off
model.device(
    M_m=0.5, M_c=1.65, k1=50, k2=75, c=0.5, G=0.0017, P_d=3, P_low=0, duty=0.5, Omega=8, mu=0.2,
    g=9.81)

# Parameters; the defaults are the case study's.
alpha, alpha_low, D, omega, delta, zeta, beta, gamma, f_b = model.system(
    alpha=0.7, alpha_low=0.0, D=0.5, omega=0.8, delta=0.02, zeta=0.05, beta=1.5, gamma=3.3, f_b=1.0)
# fmt: on

# State: of the mass relative to the capsule, and of the capsule.
x_r, v_r, v_c = model.states()
u = model.pulses(alpha, alpha_low, omega, D)

# The second spring acts beyond the gap.
model.region("NC", x_r < delta, stiffness=0)
model.region("C", x_r > delta, stiffness=beta)

# Force of the mass on the capsule, by spring, damper and second spring.
P = model.interaction(x_r + 2 * zeta * v_r + model.stiffness * (x_r - delta))

# Dry friction.
Q = P - u  # what moves the capsule
model.drift("FD", v_c > 0, against=f_b)
model.rest("S", Q < f_b, Q > -f_b)
model.drift("BD", v_c < 0, against=f_b)

# v_r' + v_c' of the mass, and gamma v_c' of the capsule, which friction adds to.
model.mass(u - P)
model.capsule(gamma, Q)
