"""SUNDIALS' CVODE with root finding, by scikit-sundae; CVODE=Adams,1e-10 chooses the method."""

import os

import numpy as np
from sksundae.cvode import CVODE

METHOD, TOLERANCE = os.environ.get("CVODE", "Adams,1e-10").split(",")
ROOT_FOUND = 2


def first_event(field, t, y, end, leaving):
    """First root that CVODE reports."""
    count = len(field.guard_names)

    def rates(t, y, out):
        out[:] = field.rates(t, y)

    def events(t, y, out):
        out[:] = field.guards(t, y)

    events.terminal, events.direction = [True] * count, [-1] * count
    solver = CVODE(
        rates,
        method=METHOD,
        rtol=float(TOLERANCE),
        atol=float(TOLERANCE),
        eventsfn=events,
        num_events=count,
        max_num_steps=1_000_000,
    )
    solver.init_step(t, y)
    found = solver.step(end, tstop=end)
    if found.status < 0:
        raise ArithmeticError(found.message)
    if found.status != ROOT_FOUND:
        return None
    guard = int(np.flatnonzero(np.reshape(found.i_events, (-1, count))[-1])[0])
    return float(np.ravel(found.t)[-1]), np.reshape(found.y, (-1, 3))[-1], guard
