"""The capsule with a bias s on the mass, and friction that is stronger in one direction."""

from sympy import cos

from capsule_sym._symbolic.model.declaration import Model, tau

model = Model()


def parameter(name, default, between, label):
    """A parameter without further documentation."""
    about = {"definition": label, "about": label, "slider": (0, 1, 0.01)}
    return model.parameter(name, default, between, label=label, **about)


alpha = parameter("alpha", 0.7, (0, 1e10), "excitation amplitude")
omega = parameter("omega", 0.8, (1e-6, 1e6), "excitation frequency")
delta = parameter("delta", 0.02, (0, 1e10), "gap")
zeta = parameter("zeta", 0.05, (0, 1e4), "damping ratio")
beta = parameter("beta", 1.5, (0, 1e10), "stiffness ratio")
gamma = parameter("gamma", 3.3, (1e-8, 1e8), "mass ratio")
s = parameter("s", 0.1, (-1e10, 1e10), "bias on the mass")
f_plus = parameter("f_plus", 1.0, (1e-10, 1e10), "friction bound forward")
f_minus = parameter("f_minus", 0.8, (1e-10, 1e10), "friction bound backward")

x_r, v_r, v_c = model.states()

model.region("NC", x_r < delta, stiffness=0)
model.region("C", x_r > delta, stiffness=beta)
kappa = model.stiffness
P = model.interaction(x_r + 2 * zeta * v_r + kappa * (x_r - delta))

model.drift("FD", v_c > 0, against=f_plus)
model.rest("S", P < f_plus, P > -f_minus)
model.drift("BD", v_c < 0, against=f_minus)

model.mass(alpha * cos(omega * tau) - s - P)
model.capsule(gamma, P)
