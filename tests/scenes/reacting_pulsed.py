"""The capsule whose drive sits between both bodies and pushes the shell back, in pulses."""

from capsule_sym._symbolic.model.declaration import Model

model = Model()


def parameter(name, default, between, label):
    """A parameter without further documentation."""
    about = {"definition": label, "about": label, "slider": (0, 1, 0.01)}
    return model.parameter(name, default, between, label=label, **about)


alpha = parameter("alpha", 0.7, (0, 1e10), "excitation amplitude")
alpha_low = parameter("alpha_low", -0.5, (-1e10, 1e10), "low level")
omega = parameter("omega", 0.8, (1e-6, 1e6), "excitation frequency")
D = parameter("D", 0.4, (1e-9, 1 - 1e-9), "duty cycle")
delta = parameter("delta", 0.02, (0, 1e10), "gap")
zeta = parameter("zeta", 0.05, (0, 1e4), "damping ratio")
beta = parameter("beta", 1.5, (0, 1e10), "stiffness ratio")
gamma = parameter("gamma", 3.3, (1e-8, 1e8), "mass ratio")
f_b = parameter("f_b", 1.0, (1e-10, 1e10), "friction bound")

x_r, v_r, v_c = model.states(
    x_r="relative displacement", v_r="relative velocity", v_c="capsule velocity"
)
u = model.pulses(alpha, alpha_low, omega, D)

model.region("NC", x_r < delta, stiffness=0)
model.region("C", x_r > delta, stiffness=beta)
kappa = model.stiffness
P = model.interaction(x_r + 2 * zeta * v_r + kappa * (x_r - delta))

pull = P - u
model.drift("FD", v_c > 0, against=f_b)
model.rest("S", pull < f_b, pull > -f_b)
model.drift("BD", v_c < 0, against=f_b)

model.mass(u - P)
model.capsule(gamma, pull)
