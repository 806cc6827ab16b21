"""Runge-Kutta's method with fixed steps, events by the signs at the ends of steps, then bisection.

This is what one codes in an afternoon. The number of steps a unit of time is STEPS=1000.
"""

import os

import numpy as np

STEPS = int(os.environ.get("STEPS", "1000"))


def step(field, t, y, h):
    """One step."""

    def rate(t, y):
        return np.array(field.rates(t, y))

    a = rate(t, y)
    b = rate(t + h / 2, y + h / 2 * a)
    c = rate(t + h / 2, y + h / 2 * b)
    d = rate(t + h, y + h * c)
    return y + h / 6 * (a + 2 * b + 2 * c + d)


def first_event(field, t, y, end, leaving):
    """First guard that is positive at the begin of a step and not at its end."""
    before = np.array(field.guards(t, y))
    before[list(leaving)] = 1e-300
    while t < end:
        h = min(1 / STEPS, end - t)
        later = step(field, t, y, h)
        after = np.array(field.guards(t + h, later))
        fired = np.flatnonzero((before > 0) & (after <= 0))
        if fired.size:
            found = []
            for k in fired:
                low, high = 0.0, h
                for _ in range(60):
                    middle = (low + high) / 2
                    if field.guards(t + middle, step(field, t, y, middle))[k] > 0:
                        low = middle
                    else:
                        high = middle
                found.append((high, int(k)))
            h, guard = min(found)
            return t + h, step(field, t, y, h), guard
        t, y, before = t + h, later, after
    return None
