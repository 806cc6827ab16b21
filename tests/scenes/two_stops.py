"""A mass between two stops, driven by a cosine, on level ground."""

from sympy import cos

from capsule_sym._symbolic.model.declaration import Model, tau

model = Model()


def parameter(name, default, between, label):
    """A parameter without further documentation."""
    about = {"definition": label, "about": label, "slider": (0, 1, 0.01)}
    return model.parameter(name, default, between, label=label, **about)


alpha = parameter("alpha", 0.7, (0, 1e10), "excitation amplitude")
omega = parameter("omega", 0.8, (1e-6, 1e6), "excitation frequency")
delta_1 = parameter("delta_1", 0.02, (0, 1e10), "gap in front")
delta_2 = parameter("delta_2", 0.05, (0, 1e10), "gap behind")
zeta = parameter("zeta", 0.05, (0, 1e4), "damping ratio")
beta_1 = parameter("beta_1", 1.5, (0, 1e10), "stiffness ratio in front")
beta_2 = parameter("beta_2", 2.5, (0, 1e10), "stiffness ratio behind")
gamma = parameter("gamma", 3.3, (1e-8, 1e8), "mass ratio")
f_b = parameter("f_b", 1.0, (1e-10, 1e10), "friction bound")

x_r, v_r, v_c = model.states()

model.region("NC", x_r < delta_1, x_r > -delta_2, stiffness=0)
model.region("FC", x_r > delta_1, stiffness=beta_1)
model.region("BC", x_r < -delta_2, stiffness=beta_2)
kappa, stop = model.stiffness, model.stop
P = model.interaction(x_r + 2 * zeta * v_r + kappa * (x_r - stop))

model.drift("FD", v_c > 0, against=f_b)
model.rest("S", P < f_b, P > -f_b)
model.drift("BD", v_c < 0, against=f_b)

model.mass(alpha * cos(omega * tau) - P)
model.capsule(gamma, P)
