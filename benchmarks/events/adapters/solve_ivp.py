"""SciPy's solve_ivp with terminal events; the method and tolerance by SOLVE_IVP=DOP853,1e-10."""

import os

import numpy as np
from scipy.integrate import solve_ivp

METHOD, TOLERANCE = os.environ.get("SOLVE_IVP", "DOP853,1e-10").split(",")


def first_event(field, t, y, end, leaving):
    """First guard that falls through zero, by the event search of solve_ivp."""
    events = []
    for k in range(len(field.guard_names)):

        def event(t, y, k=k):
            return field.guards(t, y)[k]

        event.terminal, event.direction = True, -1
        events.append(event)
    tolerance = float(TOLERANCE)
    run = solve_ivp(
        field.rates, (t, end), y, method=METHOD, rtol=tolerance, atol=tolerance, events=events
    )
    if run.status < 0:
        raise ArithmeticError(run.message)
    hits = [times[0] if len(times) else np.inf for times in run.t_events]
    guard = int(np.argmin(hits))
    return None if hits[guard] == np.inf else (hits[guard], run.y_events[guard][0], guard)
