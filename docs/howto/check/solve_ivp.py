"""Switches of the capsule by SciPy's solve_ivp, restarted at each event: writes switches.csv."""

import sys

import numpy as np
from scipy.integrate import solve_ivp

omega, delta, zeta, beta, gamma, f_b = 0.8, 0.02, 0.05, 1.5, 3.3, 1.0
FIELDS = {(0, 1): 1, (0, 0): 2, (0, -1): 3, (1, 1): 4, (1, 0): 5, (1, -1): 6}
MOST = 10_000  # switches, beyond which a run counts as locked up in them


def force(y, contact):
    return y[0] + 2 * zeta * y[1] + contact * beta * (y[0] - delta)


def rates(t, y, alpha, contact, drift):
    pull = force(y, contact)
    slip = (pull - drift * f_b) / gamma if drift else 0.0
    return [y[1], alpha * np.cos(omega * t) - pull - slip, slip]


def gap(t, y, alpha, contact, drift):
    return (1 if contact else -1) * (y[0] - delta)


def upper(t, y, alpha, contact, drift):
    return drift * y[2] if drift else f_b - force(y, contact)


def lower(t, y, alpha, contact, drift):
    return 1.0 if drift else f_b + force(y, contact)


for guard in (gap, upper, lower):
    guard.terminal, guard.direction = True, -1


def switches(alpha, tolerance, end, max_step=np.inf):
    """Times of the switches from rest to a time, and the fields entered."""
    t, y, contact, drift, found = 0.0, np.zeros(3), 0, 0, []
    while t < end and len(found) < MOST:
        run = solve_ivp(
            rates,
            (t, end),
            y,
            rtol=tolerance,
            atol=tolerance,
            max_step=max_step,
            events=(gap, upper, lower),
            args=(alpha, contact, drift),
        )
        fired = [k for k, times in enumerate(run.t_events) if len(times)]
        if not fired:
            break
        t, y = run.t[-1], run.y[:, -1]
        if fired[0] == 0:
            contact, y[0] = 1 - contact, delta
        elif drift:
            pull, y[2] = force(y, contact), 0.0
            drift = 0 if abs(pull) <= f_b else int(np.sign(pull))
        else:
            drift = 1 if fired[0] == 1 else -1
        found.append((float(t), f"F{FIELDS[contact, drift]}"))
    return found


if __name__ == "__main__":
    tolerance = float(sys.argv[1]) if len(sys.argv) > 1 else 1e-9
    periods = int(sys.argv[2]) if len(sys.argv) > 2 else 20
    end = periods * 2 * np.pi / omega
    with open("switches.csv", "w") as file:
        print(f"# alpha = 0.7\n# end = {end!r}\n# tolerance = {tolerance}", file=file)
        print("time,entered", file=file)
        for time, entered in switches(0.7, tolerance, end):
            print(f"{time!r},{entered}", file=file)
