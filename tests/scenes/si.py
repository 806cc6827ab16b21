"""Both bodies on a slope in SI units, by forces on each: what is true of a device.

A mass moves in a capsule without friction, between two stops with springs of their own; a spring
with a preload and a damper tie it. The capsule lies on a track that rises by an angle; weight pulls
both bodies, and the track carries both. A force drives the mass, against the track or the capsule.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from tests.scenes import Form

State = tuple[float, float, float, float]
"""Positions and velocities of mass and capsule along the track, upward."""


@dataclass(frozen=True)
class Device:
    """Quantities in SI units; positions are upward along the track.

    `X_r`, the mass's position in the capsule, is 0 where the front stop is `G_front` ahead and the
    back stop `G_back` behind. The springs pull the mass back with `F_0` there.
    """

    M_m: float
    M_c: float
    k1: float
    c: float
    k_front: float
    k_back: float
    G_front: float
    G_back: float
    F_0: float
    P_d: float
    P_low: float
    D: float
    Omega: float
    theta: float
    mu_forward: float
    mu_backward: float
    form: Form
    g: float = 9.81

    def drive(self, t: float, level: int) -> float:
        """Force of the actuator."""
        if self.form.pulsed:
            return self.P_low if level else self.P_d
        return self.P_d * math.cos(self.Omega * t)

    def between(self, X_r: float, V_r: float, contact: int) -> float:
        """Force of springs and damper on the capsule, against that on the mass."""
        force = self.F_0 + self.k1 * X_r + self.c * V_r
        if contact == 1:
            force += self.k_front * (X_r - self.G_front)
        if contact == 2:
            force += self.k_back * (X_r + self.G_back)
        return force

    def on_capsule(self, t: float, z: State, level: int, contact: int) -> float:
        """All forces on the capsule along the track but friction."""
        force = self.between(z[0] - z[1], z[2] - z[3], contact)
        force -= self.M_c * self.g * math.sin(self.theta)
        return force - self.drive(t, level) * self.form.reacts

    def friction(self, way: int) -> float:
        """Largest friction that acts downward if the capsule moves up, and upward if down."""
        normal = (self.M_m + self.M_c) * self.g * math.cos(self.theta)
        return normal * (self.mu_forward if way > 0 else self.mu_backward)


def _way(device: Device, t: float, z: State, level: int, contact: int) -> int:
    """Coulomb's law where the capsule does not move: the way that it begins to move, or 0."""
    force = device.on_capsule(t, z, level, contact)
    if force > device.friction(1):
        return 1
    return -1 if force < -device.friction(-1) else 0


def run(device: Device, start: State, periods: int) -> tuple[State, list[tuple[int, int, int]]]:
    """State at the end, and (level, contact, way) of each segment."""
    period = 2 * math.pi / device.Omega
    z, t, level, turns = start, 0.0, 0, 0
    contact = 1 if z[0] - z[1] > device.G_front else 0
    if device.form.stops == 2 and z[0] - z[1] < -device.G_back:
        contact = 2
    way = int(np.sign(z[3])) or _way(device, t, z, level, contact)
    passed = [(level, contact, way)]
    rate = math.sqrt(
        (device.k1 + device.k_front + device.k_back) * (1 / device.M_m + 1 / device.M_c)
    )
    while turns < periods:
        pulse = device.form.pulsed and level == 0
        until = device.D * period if pulse else period

        def rates(t: float, z: State) -> tuple[float, ...]:
            force = device.between(z[0] - z[1], z[2] - z[3], contact)  # noqa: B023
            on_mass = device.drive(t, level) - force  # noqa: B023
            on_mass -= device.M_m * device.g * math.sin(device.theta)
            on_capsule = 0.0
            if way:  # noqa: B023
                on_capsule = device.on_capsule(t, z, level, contact)  # noqa: B023
                on_capsule -= way * device.friction(way)  # noqa: B023
            return z[2], z[3], on_mass / device.M_m, on_capsule / device.M_c

        watched = _watched(device, level, contact, way)
        for event in watched.values():
            event.terminal, event.direction = True, -1
        done = solve_ivp(
            rates,
            (t, until),
            z,
            "DOP853",
            rtol=1e-12,
            atol=1e-16,
            max_step=0.1 / rate,
            first_step=min(1e-3 / rate, until - t),  # past the zeros of the start
            events=list(watched.values()),
        )
        t, z = float(done.t[-1]), tuple(map(float, done.y[:, -1]))
        fired = [name for name, at in zip(watched, done.t_events, strict=True) if len(at)]
        if not fired and pulse:
            level = 1
        elif not fired:
            t, level, turns = 0.0, 0, turns + 1
            if not device.form.pulsed and turns < periods:
                continue  # a harmonic drive has no edge
        elif fired[0] in {"front", "back"}:
            contact = 0 if contact else 1 if fired[0] == "front" else 2
        if turns == periods:
            break
        if fired and fired[0] == "stops":
            z, way = (*z[:3], 0.0), 0
        if way == 0 and not (fired and fired[0] in {"up", "down"}):
            way = _way(device, t, z, level, contact)
        elif fired and fired[0] in {"up", "down"}:
            way = 1 if fired[0] == "up" else -1
        passed.append((level, contact, way))
    return z, passed


def _watched(device: Device, level: int, contact: int, way: int) -> dict:
    """Functions that are positive during a segment, by the event that ends it."""
    watched = {}
    if contact != 2:
        side = 1 if contact else -1
        watched["front"] = lambda t, z: side * (z[0] - z[1] - device.G_front)
    if device.form.stops == 2 and contact != 1:
        other = -1 if contact else 1
        watched["back"] = lambda t, z: other * (z[0] - z[1] + device.G_back)
    if way:
        watched["stops"] = lambda t, z: way * z[3]
        return watched
    watched["up"] = lambda t, z: device.friction(1) - device.on_capsule(t, z, level, contact)
    watched["down"] = lambda t, z: device.friction(-1) + device.on_capsule(t, z, level, contact)
    return watched
