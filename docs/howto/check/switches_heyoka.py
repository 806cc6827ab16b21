"""Switches of the capsule by heyoka.py, one integrator a field, restarted at each event."""

import heyoka as hy
import numpy as np

alpha, omega, delta, zeta, beta, gamma, f_b = 0.7, 0.8, 0.02, 0.05, 1.5, 3.3, 1.0
FIELDS = {(0, 1): 1, (0, 0): 2, (0, -1): 3, (1, 1): 4, (1, 0): 5, (1, -1): 6}
tolerance, end = 1e-15, 20 * 2 * np.pi / omega
ULP = 1e-16  # a start inside the guards by so much keeps the next root


def integrator(contact, drift):
    x, v, w = hy.make_vars("x", "v", "w")
    pull = x + 2 * zeta * v + contact * beta * (x - delta)
    slip = (pull - drift * f_b) / gamma if drift else 0.0 * x
    system = [(x, v), (v, alpha * hy.cos(omega * hy.time) - pull - slip), (w, slip)]
    guards = [(2.0 * contact - 1) * (x - delta)]
    guards += [drift * w] if drift else [f_b - pull, f_b + pull]
    events = [hy.t_event(guard, direction=hy.event_direction.negative) for guard in guards]
    return hy.taylor_adaptive(system, state=[0.0] * 3, t_events=events, tol=tolerance)


def force(y, contact):
    return y[0] + 2 * zeta * y[1] + contact * beta * (y[0] - delta)


integrators = {key: integrator(*key) for key in FIELDS}
t, y, contact, drift, rows = 0.0, np.zeros(3), 0, 0, []
while True:
    ta = integrators[contact, drift]
    ta.time, ta.state[:] = t, y
    ta.reset_cooldowns()
    outcome = int(ta.propagate_until(end)[0])
    if outcome < -(2**32) or outcome >= 0:  # the end, or an event that does not stop it
        break
    t, y, fired = ta.time, ta.state.copy(), -outcome - 1
    if fired == 0:
        contact = 1 - contact
        y[0] = delta + (2 * contact - 1) * ULP
    elif drift:
        pull = force(y, contact)
        drift = 0 if abs(pull) <= f_b else int(np.sign(pull))
        y[2] = drift * ULP
    else:
        drift = 1 if fired == 1 else -1
        y[2] = drift * ULP
    rows.append(f"{t!r},F{FIELDS[contact, drift]}")

with open("switches.csv", "w") as file:
    print(f"# alpha = {alpha}\n# end = {end!r}\n# tolerance = {tolerance}", file=file)
    print("time,entered", *rows, sep="\n", file=file)
