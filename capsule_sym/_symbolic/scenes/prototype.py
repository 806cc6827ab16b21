"""A millimetre prototype: a magnet driven by pulses between two stops, in a capsule on a slope.

The mass is driven by u = alpha in the first part D of each period, and by alpha_low in the rest; it
meets a stop in front and one behind. Gravity pulls both bodies down the slope, as in the scene
`slope`. Friction alone limits the mean of the drive: where alpha D + alpha_low (1 - D) is above
f_plus + s, the capsule accelerates without end. The unit of force is the friction P_f on the slope,
that of length P_f / k1, and that of time sqrt(M_m / k1). The device's values are assumptions of the
size of published prototypes.
"""

from capsule_sym._symbolic.model.declaration import Model
from capsule_sym._symbolic.model.vocabulary import BODIES, SLOPE, TWO_STOPS, pulses

SLIDERS = {
    "M_m": (0.0001, 0.01, 0.0001),
    "M_c": (0.0001, 0.01, 0.0001),
    "k1": (1, 500, 1),
    "c": (0, 0.2, 0.001),
    "P_d": (0, 0.1, 0.0005),
    "P_low": (-0.1, 0.1, 0.0005),
    "Omega": (1, 500, 1),
    "alpha": (0, 10, 0.001),
    "alpha_low": (-10, 10, 0.001),
    "omega": (0.05, 3, 0.001),
}
OWN = {name: {"slider": slider} for name, slider in SLIDERS.items()}
model = Model(BODIES, pulses(), TWO_STOPS, SLOPE, OWN)

# The device in SI units.
# fmt: off
model.device(
    M_m=0.0018, M_c=0.0017, k1=62, k_front=54000, k_back=28000, c=0.016, G_front=0.0016,
    G_back=0.0004, P_d=0.016, P_low=0, duty=0.4, Omega=130, mu=0.23, mu_back=0.23, preload=0.0,
    slope=0.0, g=9.81)

# Parameters; the defaults are those of the device, rounded.
alpha, alpha_low, D, omega, *others = model.system(
    alpha=2.0, alpha_low=0.0, D=0.4, omega=0.7, delta_1=12.6, delta_2=3.1, zeta=0.024, beta_1=870,
    beta_2=450, gamma=0.944, s=0.0, f_plus=1.0, f_minus=1.0)
delta_1, delta_2, zeta, beta_1, beta_2, gamma, bias, f_plus, f_minus = others
# fmt: on

# State: of the mass relative to the capsule, and of the capsule.
x_r, v_r, v_c = model.states()
u = model.pulses(alpha, alpha_low, omega, D)

# The stops act beyond the gaps.
model.region("NC", x_r < delta_1, x_r > -delta_2, stiffness=0)
model.region("FC", x_r > delta_1, stiffness=beta_1)
model.region("BC", x_r < -delta_2, stiffness=beta_2)

# Force of the mass on the capsule, by spring, damper and the stop that it is at.
kappa, stop = model.stiffness, model.stop
P = model.interaction(x_r + 2 * zeta * v_r + kappa * (x_r - stop))

# Dry friction, with the capsule's own weight on the slope.
model.drift("FD", v_c > 0, against=f_plus)
model.rest("S", P < f_plus, P > -f_minus)
model.drift("BD", v_c < 0, against=f_minus)

# v_r' + v_c' of the mass, and gamma v_c' of the capsule, which friction adds to.
model.mass(u - bias - P)
model.capsule(gamma, P, weight=gamma * bias)
