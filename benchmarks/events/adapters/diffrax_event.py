"""Diffrax: diffeqsolve with an Event and a root finder, in 64 bits; tolerance by DIFFRAX=1e-10.

All guards are conditions of one Event, with direction=False for those that fall.
"""

import os

import diffrax
import jax
import jax.numpy as jnp
import optimistix

jax.config.update("jax_enable_x64", True)
TOLERANCE = float(os.environ.get("DIFFRAX", "1e-10"))


def rates(t, z, args):
    """The field as its matrix: z has cosine and sine of the drive, too."""
    matrix, _ = args
    return matrix @ z


def condition(k):
    """Guard k of at most three."""
    return lambda t, y, args, **_: args[1][k] @ y


EVENT = diffrax.Event(
    [condition(k) for k in range(3)],
    optimistix.Newton(rtol=1e-12, atol=1e-14, norm=optimistix.max_norm),
    direction=[False] * 3,
)


@jax.jit
def solve(t, z, end, matrix, rows):
    """State and mask of events at the end of a segment."""
    found = diffrax.diffeqsolve(
        diffrax.ODETerm(rates),
        diffrax.Tsit5(),
        t,
        end,
        None,
        z,
        args=(matrix, rows),
        stepsize_controller=diffrax.PIDController(rtol=TOLERANCE, atol=TOLERANCE),
        event=EVENT,
        max_steps=100_000,
        throw=False,
    )
    return (
        found.ts[-1],
        found.ys[-1],
        jnp.array(found.event_mask),
        found.result == diffrax.RESULTS.successful,
    )


def first_event(field, t, y, end, leaving):
    """First condition that Diffrax reports."""
    omega = field.parameters["omega"]
    z = jnp.array([*y, jnp.cos(omega * t), jnp.sin(omega * t), 1.0])
    rows = jnp.zeros((3, 6)).at[:, 5].set(1.0)  # a guard that is 1 never fires
    rows = rows.at[: len(field.guard_rows)].set(jnp.array(field.guard_rows))
    time, state, mask, _ = solve(t, z, end, jnp.array(field.matrix), rows)
    if not bool(mask.any()):
        return None
    return float(time), state[:3], int(mask.argmax())
