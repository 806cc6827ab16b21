"""The capsule of the paper declared in full, without the vocabulary: what tests change."""

from sympy import cos

from capsule_sym._symbolic.model.declaration import Model, tau

model = Model()

# The device in SI units: its quantities, and the units of force, rate and length that it has. A
# relation is text, computed in the order in which it is written.
# fmt: off
model.quantity(
    "M_m", "kg", (1e-9, 1e9), 0.5, label="inner mass",
    about="Mass that moves inside the capsule.", slider=(0.01, 5, 0.01))
model.quantity(
    "M_c", "kg", (1e-9, 1e9), 1.65, label="mass of the capsule",
    about="Mass of the capsule without the inner mass.", slider=(0.01, 10, 0.01))
model.quantity(
    "k1", "N/m", (1e-9, 1e12), 50, label="stiffness of the spring", letter="k₁",
    about="Stiffness of the spring between mass and capsule.", slider=(1, 500, 0.1))
model.quantity(
    "k2", "N/m", (0, 1e12), 75, label="stiffness of the second spring", letter="k₂",
    about="Stiffness of the spring that the mass meets after the gap.", slider=(0, 1000, 0.1))
model.quantity(
    "c", "N s/m", (0, 1e9), 0.5, label="damping coefficient",
    about="Damping coefficient between mass and capsule.", slider=(0, 10, 0.01))
model.quantity(
    "G", "m", (0, 1e6), 0.0017, label="gap",
    about="Distance between the mass at rest and the second spring.", slider=(0, 0.1, 0.0001))
model.quantity(
    "P_d", "N", (0, 1e9), 3, label="amplitude of the excitation",
    about="Amplitude of the force that drives the inner mass.", slider=(0, 20, 0.01))
model.quantity(
    "Omega", "rad/s", (1e-9, 1e9), 8, label="frequency of the excitation", letter="Ω",
    about="Angular frequency of the driving force.", slider=(0.1, 50, 0.01))
model.quantity(
    "mu", "", (1e-9, 1e6), 0.2, label="friction coefficient", letter="μ",
    about="Coulomb friction between the capsule and what it lies on.", slider=(0.01, 2, 0.001))
model.quantity(
    "g", "m/s^2", (1e-9, 1e6), default=9.81, label="gravitational acceleration",
    about="Gravitational acceleration.", slider=(0.1, 30, 0.01))
model.unit(
    "friction_force", "P_f", "mu * (M_m + M_c) * g", "Coulomb friction, the unit of force")
model.unit(
    "natural_frequency", "Omega0", "sqrt(k1 / M_m)", "Natural frequency, the unit of rates")
model.unit("length_scale", "x_0", "P_f / k1", "Length that friction stretches the spring, the unit")

# Parameters, Eq. (6), with their relations to the device; the defaults are the case study's.
alpha = model.parameter(
    "alpha", 0.7, (0, 1e10), label="excitation amplitude", si="P_d / P_f",
    about="Amplitude of the force that drives the inner mass, over the friction force: P_d / P_f.",
    letter="α", tex=r"\alpha", slider=(0, 2, 0.001))
omega = model.parameter(
    "omega", 0.8, (1e-6, 1e6), label="excitation frequency", si="Omega / Omega0",
    about="Frequency of the driving force, over the natural frequency √(k₁/M_m) of the inner mass.",
    letter="ω", tex=r"\omega", slider=(0.1, 3, 0.001))
delta = model.parameter(
    "delta", 0.02, (0, 1e10), label="gap", si="k1 * G / P_f",
    about="Distance at which the inner mass meets the second spring, over the length P_f / k₁.",
    letter="δ", tex=r"\delta", slider=(0, 1, 0.001))
zeta = model.parameter(
    "zeta", 0.05, (0, 1e4), label="damping ratio",
    si="c / (M_m * Omega0) / 2", definition="c / (2 M_m Omega0)",
    about="Damping between mass and capsule, over twice M_m √(k₁/M_m); 1 is critical.",
    letter="ζ", tex=r"\zeta", slider=(0, 1, 0.001))
beta = model.parameter(
    "beta", 1.5, (0, 1e10), label="stiffness ratio", si="k2 / k1",
    about="Stiffness of the second spring over that of the first: k₂ / k₁.",
    letter="β", tex=r"\beta", slider=(0, 20, 0.01))
gamma = model.parameter(
    "gamma", 3.3, (1e-8, 1e8), label="mass ratio", si="M_c / M_m",
    about="Mass of the capsule over the inner mass: M_c / M_m. The paper prints 3.3; its global "
    "maps come out at 3.0.", letter="γ", tex=r"\gamma", slider=(0.2, 8, 0.01))
f_b = model.parameter(
    "f_b", 1.0, (1e-10, 1e10), label="friction bound",
    si="1", definition="max|F_r| / P_f; 1 for dry friction",
    about="Largest friction force over P_f: 1 for dry friction.", slider=(0.1, 2, 0.01))
# fmt: on

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
