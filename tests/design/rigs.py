"""Synthetic videos of a device in SI units, by a time stepping of its equations of motion alone."""

import math
from functools import cache

import numpy as np

from capsule_sym import PhysicalParameters, inputs

DEVICE = PhysicalParameters(
    M_m=0.02, M_c=0.066, k1=40.0, k2=60.0, c=0.1, G=2e-4, P_d=0.2, Omega=45.0, mu=0.25
)
DRIVES = {"slow": (0.25, 38.0), "middle": (0.2, 45.0), "fast": (0.3, 52.0)}
SCALE, SLIP, RATE, NOISE = 8000.0, 2e-3, 120.0, 0.3  # pixels a metre, frames a second, pixels
STEP = 2e-5


@cache
def motion(drive, phase, seconds, settling=2.0):
    """Positions x_m and x_c (m) at every step, from `settling` seconds after rest on.

    Moreau's time stepping: friction takes as much of the capsule's velocity as it can. `phase` is
    the time in the period of the drive (s) where they begin.
    """
    d = DEVICE
    P_d, Omega = drive
    friction = d.mu * (d.M_m + d.M_c) * d.g * STEP / d.M_c
    steps, before = round(seconds / STEP), round(settling / STEP)
    t = phase - before * STEP
    x_r = v_m = v_c = x_c = 0.0
    found = np.empty((steps, 2))
    for i in range(-before, steps):
        if i >= 0:
            found[i] = x_c + x_r, x_c
        v_r = v_m - v_c
        P = d.k1 * x_r + d.c * v_r + (d.k2 * (x_r - d.G) if x_r > d.G else 0.0)
        v_m += STEP * (P_d * math.cos(Omega * t) - P) / d.M_m
        free = v_c + STEP * P / d.M_c
        v_c = math.copysign(max(abs(free) - friction, 0.0), free)
        x_r += STEP * (v_m - v_c)
        x_c += STEP * v_c
        t += STEP
    return found


def phase_of(name):
    """Phase of the drive (s) at the first frame of a run."""
    return {"slow": 0.05, "middle": 0.1, "fast": 0.01}[name]


def video(name, seed=0, seconds=1.5, outliers=0.05, drift=0.0, scales=(SCALE, SCALE)):
    """A run as a camera sees it: pixels, frames that miss, outliers, and a clock that slips."""
    draw = np.random.default_rng([seed, sorted(DRIVES).index(name)])
    drive = DRIVES[name]
    t = np.arange(0.0, seconds, 1 / RATE)
    path = motion(drive, phase_of(name), 1.1 * seconds)
    times = np.arange(len(path)) * STEP
    data = {"t": t}
    for column, (series, scale) in enumerate(zip(("x_m", "x_c"), scales, strict=True)):
        x = scale * np.interp((1 + SLIP) * t, times, path[:, column])
        x += draw.uniform(100, 900) + drift * t + NOISE * draw.normal(size=len(t))
        x += (draw.random(len(t)) < outliers) * draw.normal(size=len(t)) * 60
        x[draw.random(len(t)) < 0.03] = np.nan
        data[series] = x
    return inputs.RigRun(name, data, {"P_d": drive[0], "Omega": drive[1]})
