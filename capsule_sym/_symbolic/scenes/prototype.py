"""A millimetre prototype: a magnet driven by pulses between two stops, in a capsule on a slope.

The mass is driven by u = alpha in the first part D of each period, and by alpha_low in the rest; it
meets a stop in front and one behind. Gravity pulls both bodies down the slope, as in the scene
`slope`. Friction alone holds the mean of the drive: where alpha D is above f_plus + s, the capsule
is driven faster without end. The unit of force is the friction P_f on the slope, that of length
P_f / k1, and that of time sqrt(M_m / k1). The device's values are assumptions of the size of
published prototypes.
"""

from capsule_sym._symbolic.model.declaration import Model

model = Model()

# The device in SI units. A relation is text, computed in the order in which it is written.
# fmt: off
model.quantity(
    "M_m", "kg", (1e-9, 1e9), 0.0018, label="inner mass",
    about="Mass that moves inside the capsule.", slider=(0.0001, 0.01, 0.0001))
model.quantity(
    "M_c", "kg", (1e-9, 1e9), 0.0017, label="mass of the capsule",
    about="Mass of the capsule without the inner mass.", slider=(0.0001, 0.01, 0.0001))
model.quantity(
    "k1", "N/m", (1e-9, 1e12), 62, label="stiffness of the spring", letter="k₁",
    about="Stiffness of the spring between mass and capsule.", slider=(1, 500, 1))
model.quantity(
    "k_front", "N/m", (0, 1e12), 54000, label="stiffness of the stop in front", letter="k₊",
    about="Stiffness of the stop that the mass meets in front.", slider=(0, 100000, 100))
model.quantity(
    "k_back", "N/m", (0, 1e12), 28000, label="stiffness of the stop behind", letter="k₋",
    about="Stiffness of the stop that the mass meets behind.", slider=(0, 100000, 100))
model.quantity(
    "c", "N s/m", (0, 1e9), 0.016, label="damping coefficient",
    about="Damping coefficient between mass and capsule.", slider=(0, 0.2, 0.001))
model.quantity(
    "G_front", "m", (0, 1e6), 0.0016, label="gap in front", letter="G₊",
    about="Distance from the mass at rest to the stop in front, without preload.",
    slider=(0, 0.01, 0.0001))
model.quantity(
    "G_back", "m", (0, 1e6), 0.0004, label="gap behind", letter="G₋",
    about="Distance from the mass at rest to the stop behind, without preload.",
    slider=(0, 0.01, 0.0001))
model.quantity(
    "P_d", "N", (0, 1e9), 0.016, label="force of the pulse",
    about="Force that drives the mass while the pulse lasts.", slider=(0, 0.1, 0.0005))
model.quantity(
    "P_low", "N", (-1e9, 1e9), 0, label="force between pulses", letter="P_l",
    about="Force that drives the mass in the rest of a period.", slider=(-0.1, 0.1, 0.0005))
model.quantity(
    "duty", "", (1e-9, 1 - 1e-9), 0.4, label="duty cycle", letter="D",
    about="Part of a period in which the pulse lasts.", slider=(0.01, 0.99, 0.001))
model.quantity(
    "Omega", "rad/s", (1e-9, 1e9), 130, label="frequency of the pulses", letter="Ω",
    about="Angular frequency of the pulses.", slider=(1, 500, 1))
model.quantity(
    "mu", "", (1e-9, 1e6), 0.23, label="friction coefficient forward", letter="μ",
    about="Coulomb friction where the capsule moves forward.", slider=(0.01, 2, 0.001))
model.quantity(
    "mu_back", "", (1e-9, 1e6), 0.23, label="friction coefficient backward", letter="μ₋",
    about="Coulomb friction where the capsule moves backward.", slider=(0.01, 2, 0.001))
model.quantity(
    "preload", "N", (-1e9, 1e9), default=0.0, label="preload of the spring", letter="F₀",
    about="Force by which the spring pulls the mass backward from where the gaps are measured.",
    slider=(-0.1, 0.1, 0.001))
model.quantity(
    "slope", "", (-1e6, 1e6), default=0.0, label="slope",
    about="Slope of the track, its rise over its run, upward in the forward direction.",
    slider=(-0.2, 0.2, 0.001))
model.quantity(
    "g", "m/s^2", (1e-6, 1e6), default=9.81, label="gravitational acceleration",
    about="Gravitational acceleration.", slider=(0.1, 30, 0.01))
model.unit(
    "friction_force", "P_f", "mu * (M_m + M_c) * g / sqrt(1 + slope * slope)",
    "Friction on the slope")
model.unit(
    "natural_frequency", "Omega0", "sqrt(k1 / M_m)", "Natural frequency, the unit of rates")
model.unit("length_scale", "x_0", "P_f / k1", "Length that friction stretches the spring, the unit")

# Parameters, with their relations to the device; the defaults are those of the device's examples.
alpha = model.parameter(
    "alpha", 2.0, (0, 1e10), label="force of the pulse", si="P_d / P_f",
    about="Force on the inner mass while the pulse lasts, over the friction force: P_d / P_f.",
    letter="α", tex=r"\alpha", slider=(0, 10, 0.001))
alpha_low = model.parameter(
    "alpha_low", 0.0, (-1e10, 1e10), label="force between pulses", si="P_low / P_f",
    about="Force on the inner mass in the rest of a period, over the friction force.",
    letter="α_l", tex=r"\alpha_l", slider=(-10, 10, 0.001))
D = model.parameter(
    "D", 0.4, (1e-9, 1 - 1e-9), label="duty cycle", si="duty",
    about="Part of a period in which the pulse lasts.", slider=(0.01, 0.99, 0.001))
omega = model.parameter(
    "omega", 0.7, (1e-6, 1e6), label="frequency of the pulses", si="Omega / Omega0",
    about="Frequency of the pulses, over the natural frequency √(k₁/M_m) of the inner mass.",
    letter="ω", tex=r"\omega", slider=(0.05, 3, 0.001))
delta_1 = model.parameter(
    "delta_1", 12.6, (0, 1e10), label="gap in front", si="(k1 * G_front + preload) / P_f",
    about="Distance at which the inner mass meets the stop in front, over the length P_f / k₁.",
    letter="δ₁", tex=r"\delta_1", slider=(0, 30, 0.01))
delta_2 = model.parameter(
    "delta_2", 3.1, (0, 1e10), label="gap behind", si="(k1 * G_back - preload) / P_f",
    about="Distance at which the inner mass meets the stop behind, over the length P_f / k₁.",
    letter="δ₂", tex=r"\delta_2", slider=(0, 30, 0.01))
zeta = model.parameter(
    "zeta", 0.024, (0, 1e4), label="damping ratio",
    si="c / (M_m * Omega0) / 2", definition="c / (2 M_m Omega0)",
    about="Damping between mass and capsule, over twice M_m √(k₁/M_m); 1 is critical.",
    letter="ζ", tex=r"\zeta", slider=(0, 1, 0.001))
beta_1 = model.parameter(
    "beta_1", 870, (0, 1e10), label="stiffness ratio in front", si="k_front / k1",
    about="Stiffness of the stop in front over that of the spring.",
    letter="β₁", tex=r"\beta_1", slider=(0, 1000, 1))
beta_2 = model.parameter(
    "beta_2", 450, (0, 1e10), label="stiffness ratio behind", si="k_back / k1",
    about="Stiffness of the stop behind over that of the spring.",
    letter="β₂", tex=r"\beta_2", slider=(0, 1000, 1))
gamma = model.parameter(
    "gamma", 0.944, (1e-8, 1e8), label="mass ratio", si="M_c / M_m",
    about="Mass of the capsule over the inner mass: M_c / M_m.", letter="γ", tex=r"\gamma",
    slider=(0.2, 8, 0.01))
bias = model.parameter(
    "s", 0.0, (-1e10, 1e10), label="bias on the mass", si="slope / (mu * (1 + gamma))",
    about="Pull of gravity on the inner mass down the slope, over the friction force.",
    slider=(-0.3, 0.3, 0.001))
f_plus = model.parameter(
    "f_plus", 1.0, (1e-10, 1e10), label="friction bound forward", si="1 + gamma * s",
    about="Force that moves the capsule up the slope, over the friction force.", letter="f₊",
    tex="f_+", slider=(0.1, 2, 0.001))
f_minus = model.parameter(
    "f_minus", 1.0, (1e-10, 1e10), label="friction bound backward", si="mu_back / mu - gamma * s",
    about="Force that moves the capsule down the slope, over the friction force. Where it is not "
    "above 0, the capsule slips down by itself and never rests.", letter="f₋", tex="f_-",
    slider=(0.1, 2, 0.001))
# fmt: on

# State: of the mass relative to the capsule, and of the capsule.
x_r, v_r, v_c = model.states(
    x_r="relative displacement", v_r="relative velocity", v_c="capsule velocity"
)
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
