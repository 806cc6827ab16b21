"""heyoka.py's Taylor integrator with terminal events, tolerance 1e-15, compiled once a field.

A guard that is zero at the start is raised by NUDGE=1e-16 (0 leaves it): its next root may be lost.
"""

import os
from functools import cache

import heyoka as hy

NUDGE = float(os.environ.get("NUDGE", "1e-16"))
hy.set_logger_level_critical()


class Built:
    """Integrator of one field, with the parameters of the case, and raised guards, at run time."""

    def __init__(self, field):
        state = hy.make_vars(*field.system["state"])
        count = len(field.system["parameters"])
        names = dict(zip(field.system["state"], state, strict=True)) | {
            name: hy.par[k] for k, name in enumerate(field.system["parameters"])
        }
        names |= {"t": hy.time, "cos": hy.cos, "sin": hy.sin}
        rates = [eval(one, {}, names) for one in field.given["rates"]]
        rates = [hy.expression(float(one)) if isinstance(one, int) else one for one in rates]
        guards = [
            eval(guard["positive"], {}, names) + hy.par[count + k]
            for k, guard in enumerate(field.given["guards"])
        ]
        self.count = count
        self.run = hy.taylor_adaptive(
            list(zip(state, rates, strict=True)),
            state=[0.0] * 3,
            pars=[0.0] * (count + len(guards)),
            tol=1e-15,
            t_events=[hy.t_event(one, direction=hy.event_direction.negative) for one in guards],
        )


@cache
def _built(name):
    return Built(FIELDS[name])


FIELDS = {}


def first_event(field, t, y, end, leaving):
    """First terminal event of a propagation."""
    FIELDS[field.name] = field
    built = _built(field.name)
    run, values = built.run, [field.parameters[name] for name in field.system["parameters"]]
    raised = [NUDGE * (k in leaving) for k in range(len(field.guard_names))]
    run.pars[:] = [*values, *raised]
    run.time, run.state[:] = t, y
    run.reset_cooldowns()
    outcome = int(run.propagate_until(end)[0])
    if -(2**32) < outcome < 0:  # -index - 1 of a terminal event that stops the propagation
        return run.time, run.state.copy(), -outcome - 1
    return None
