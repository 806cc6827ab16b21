"""The capsule system: Section 2 of B. Guo and Y. Liu, Physica D 2019, dimensionless.

A mass is driven inside a capsule, to which a spring and a damper tie it, and a second spring behind
a gap. Dry friction holds the capsule, or works against its drift. The unit of force is the friction
P_f, that of length P_f / k1, and that of time 1 / Omega0 = sqrt(M_m / k1).
"""

from sympy import cos

from capsule_sym._symbolic.model.declaration import Model, tau

model = Model()

# Parameters, Eq. (6); the defaults are the case study's.
# fmt: off
alpha = model.parameter(
    "alpha", 0.7, (0, 1e10), label="excitation amplitude", definition="P_d / P_f",
    about="Amplitude of the force that drives the inner mass, over the friction force: P_d / P_f.",
    letter="α", tex=r"\alpha", slider=(0, 2, 0.001), device=("P_d", "N"))
omega = model.parameter(
    "omega", 0.8, (1e-6, 1e6), label="excitation frequency", definition="Omega / Omega0",
    about="Frequency of the driving force, over the natural frequency √(k₁/M_m) of the inner mass.",
    letter="ω", tex=r"\omega", slider=(0.1, 3, 0.001), device=("Omega", "rad/s"))
delta = model.parameter(
    "delta", 0.02, (0, 1e10), label="gap", definition="k1 G / P_f",
    about="Distance at which the inner mass meets the second spring, over the length P_f / k₁.",
    letter="δ", tex=r"\delta", slider=(0, 1, 0.001), device=("G", "m"))
zeta = model.parameter(
    "zeta", 0.05, (0, 1e4), label="damping ratio", definition="c / (2 M_m Omega0)",
    about="Damping between mass and capsule, over twice M_m √(k₁/M_m); 1 is critical.",
    letter="ζ", tex=r"\zeta", slider=(0, 1, 0.001), device=("c", "N s/m"))
beta = model.parameter(
    "beta", 1.5, (0, 1e10), label="stiffness ratio", definition="k2 / k1",
    about="Stiffness of the second spring over that of the first: k₂ / k₁.",
    letter="β", tex=r"\beta", slider=(0, 20, 0.01), device=("k2", "N/m"))
gamma = model.parameter(
    "gamma", 3.3, (1e-8, 1e8), label="mass ratio", definition="M_c / M_m",
    about="Mass of the capsule over the inner mass: M_c / M_m. The paper prints 3.3; its global "
    "maps come out at 3.0.", letter="γ", tex=r"\gamma", slider=(0.2, 8, 0.01))
f_b = model.parameter(
    "f_b", 1.0, (1e-10, 1e10), label="friction bound",
    definition="max|F_r| / P_f; 1 for dry friction",
    about="Largest friction force over P_f: 1 for dry friction.", slider=(0.1, 2, 0.01))
# fmt: on

# State: of the mass relative to the capsule, and of the capsule.
x_r, v_r, v_c = model.states(
    x_r="relative displacement", v_r="relative velocity", v_c="capsule velocity"
)

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
