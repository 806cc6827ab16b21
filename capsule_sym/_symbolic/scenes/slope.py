"""The capsule of the paper on a slope: gravity pulls both bodies backward, down the slope.

Forward is up the slope. On the mass gravity is the bias s. For the capsule it increases the
friction bound f_plus of going up and decreases f_minus of going down, which may have a friction
coefficient of its own. The unit of force is the friction P_f on the slope, that of length
P_f / k1, and that of time sqrt(M_m / k1).
"""

from sympy import cos

from capsule_sym._symbolic.model.declaration import Model, tau
from capsule_sym._symbolic.model.vocabulary import BODIES, ONE_STOP, SLOPE, harmonic

model = Model(BODIES, harmonic(), ONE_STOP, SLOPE)

# The device in SI units.
# fmt: off
model.device(
    M_m=0.5, M_c=1.65, k1=50, k2=75, c=0.5, G=0.0017, P_d=3, Omega=8, mu=0.2, mu_back=0.2, g=9.81,
    slope=0.02)

# Parameters; the defaults are the case study's, on a slope.
alpha, omega, delta, zeta, beta, gamma, bias, f_plus, f_minus = model.system(
    alpha=0.7, omega=0.8, delta=0.02, zeta=0.05, beta=1.5, gamma=3.3, s=0.02, f_plus=1.066,
    f_minus=0.934)
# fmt: on

# State: of the mass relative to the capsule, and of the capsule.
x_r, v_r, v_c = model.states()

# The second spring acts beyond the gap.
model.region("NC", x_r < delta, stiffness=0)
model.region("C", x_r > delta, stiffness=beta)

# Force of the mass on the capsule, by spring, damper and second spring.
P = model.interaction(x_r + 2 * zeta * v_r + model.stiffness * (x_r - delta))

# Dry friction, with the capsule's own weight on the slope.
model.drift("FD", v_c > 0, against=f_plus)
model.rest("S", P < f_plus, P > -f_minus)
model.drift("BD", v_c < 0, against=f_minus)

# v_r' + v_c' of the mass, and gamma v_c' of the capsule, which friction adds to.
model.mass(alpha * cos(omega * tau) - bias - P)
model.capsule(gamma, P, weight=gamma * bias)
