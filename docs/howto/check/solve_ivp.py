"""Switches of the capsule by SciPy's solve_ivp, restarted at each event: writes switches.csv."""

import sys

import numpy as np
from scipy.integrate import solve_ivp

alpha, omega, delta, zeta, beta, gamma, f_b = 0.7, 0.8, 0.02, 0.05, 1.5, 3.3, 1.0
tolerance = float(sys.argv[1]) if len(sys.argv) > 1 else 1e-9
periods = int(sys.argv[2]) if len(sys.argv) > 2 else 20
end = periods * 2 * np.pi / omega
FIELDS = {(0, 1): 1, (0, 0): 2, (0, -1): 3, (1, 1): 4, (1, 0): 5, (1, -1): 6}


def force(y, contact):
    return y[0] + 2 * zeta * y[1] + contact * beta * (y[0] - delta)


def rates(t, y, contact, drift):
    pull = force(y, contact)
    slip = (pull - drift * f_b) / gamma if drift else 0.0
    return [y[1], alpha * np.cos(omega * t) - pull - slip, slip]


def gap(t, y, contact, drift):
    return (1 if contact else -1) * (y[0] - delta)


def upper(t, y, contact, drift):
    return drift * y[2] if drift else f_b - force(y, contact)


def lower(t, y, contact, drift):
    return 1.0 if drift else f_b + force(y, contact)


for event in (gap, upper, lower):
    event.terminal, event.direction = True, -1

t, y, contact, drift = 0.0, np.zeros(3), 0, 0
rows = []
while t < end and len(rows) < 10_000:
    run = solve_ivp(
        rates, (t, end), y, rtol=tolerance, atol=tolerance,
        events=(gap, upper, lower), args=(contact, drift),
    )  # fmt: skip
    fired = [k for k, times in enumerate(run.t_events) if len(times)]
    if not fired:
        break
    t, y = run.t[-1], run.y[:, -1]
    if fired[0] == 0:
        contact, y[0] = 1 - contact, delta
    else:
        pull = force(y, contact)
        if drift:
            drift = 0 if abs(pull) <= f_b else int(np.sign(pull))
        else:
            drift = 1 if fired[0] == 1 else -1
        y[2] = 0.0
    rows.append(f"{float(t)!r},F{FIELDS[contact, drift]}")

with open("switches.csv", "w") as file:
    print(f"# alpha = {alpha}\n# end = {end!r}\n# tolerance = {tolerance}", file=file)
    print("time,entered", *rows, sep="\n", file=file)
