"""Devices in SI units, moved by forces on both bodies, beside the dimensionless integrator."""

from __future__ import annotations

import math
import random
import shutil
from dataclasses import asdict

import pytest

from tests.sampling import many, sampled
from tests.scenes import Form, Integrator, Start
from tests.scenes.si import Device, State, run

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")

UNITS = {
    "P_f": "mu_forward * (M_m + M_c) * g * cos(theta)",
    "Omega0": "sqrt(k1 / M_m)",
    "x_0": "P_f / k1",
}
"""Units of force, rate and length."""

RELATIONS = {
    "alpha": "P_d / P_f",
    "alpha_low": "P_low / P_f",
    "D": "D",
    "omega": "Omega / Omega0",
    "zeta": "c / (M_m * Omega0) / 2",
    "gamma": "M_c / M_m",
    "beta_1": "k_front / k1",
    "beta_2": "k_back / k1",
    "delta_1": "(k1 * G_front + F_0) / P_f",
    "delta_2": "(k1 * G_back - F_0) / P_f",
    "s": "tan(theta) / (mu_forward * (1 + M_c / M_m))",
    "f_plus": "1 + tan(theta) * M_c / (mu_forward * (M_m + M_c))",
    "f_minus": "mu_backward / mu_forward - tan(theta) * M_c / (mu_forward * (M_m + M_c))",
}
"""Parameters of the general form; x_r counts from where spring and preload balance."""

FORMS = [
    Form(stops, pulsed, reacts, biased=True)
    for stops in (1, 2)
    for pulsed in (False, True)
    for reacts in (False, True)
]


def random_device(form: Form, r: random.Random) -> Device:
    """A device whose gaps stay open under preload, and which can rest on its slope for some P."""
    M_m, M_c, k1 = r.uniform(0.1, 2), r.uniform(0.1, 3), r.uniform(10, 200)
    mu, theta = r.uniform(0.1, 0.6), r.choice([0.0, r.uniform(-0.3, 0.3)])
    friction = mu * (M_m + M_c) * 9.81 * math.cos(theta)
    level = abs(math.tan(theta)) * M_c / (M_m + M_c)
    gap = friction / k1
    return Device(
        M_m=M_m,
        M_c=M_c,
        k1=k1,
        c=2 * r.uniform(0, 0.4) * math.sqrt(k1 * M_m),
        k_front=k1 * r.uniform(0.5, 20),
        k_back=k1 * r.uniform(0.5, 20) if form.stops == 2 else 0.0,
        G_front=gap * r.uniform(0.2, 1),
        G_back=gap * r.uniform(0.2, 1),
        F_0=friction * r.uniform(-0.2, 0.2),
        P_d=friction * r.uniform(0.3, 2.5),
        P_low=friction * r.uniform(-1.5, 0.3) if form.pulsed else 0.0,
        D=r.uniform(0.1, 0.9) if form.pulsed else 1.0,
        Omega=math.sqrt(k1 / M_m) * r.uniform(0.4, 1.6),
        theta=theta if level < 0.9 * mu else 0.0,
        mu_forward=mu,
        mu_backward=mu * r.uniform(1, 2),
        form=form,
    )


def dimensionless(device: Device) -> tuple[dict[str, float], dict[str, float]]:
    """Units, and parameters of the scene."""
    names = {**asdict(device), "sqrt": math.sqrt, "cos": math.cos, "tan": math.tan}
    for unit, text in UNITS.items():
        names[unit] = eval(text, {}, names)
    one = {"delta": "delta_1", "beta": "beta_1"}
    values = {name: eval(RELATIONS[one.get(name, name)], {}, names) for name in device.form.names}
    return {unit: names[unit] for unit in UNITS}, values


def number(form: Form, level: int, contact: int, way: int) -> int:
    return 3 * ((1 + form.stops) * level + contact) + {1: 1, 0: 2, -1: 3}[way]


def start_of(device: Device, r: random.Random) -> State:
    length = device.G_front
    speed = length * math.sqrt(device.k1 / device.M_m)
    capsule = r.choice([0.0, r.uniform(-1, 1) * speed])
    return r.uniform(-0.15, 0.8) * length, 0.0, r.uniform(-1, 1) * speed + capsule, capsule


PERIODS = 2


def check(judge: Integrator, form: Form, count: int) -> int:
    r, compared = random.Random(f"SI {form}"), 0
    for _ in range(count):
        device = random_device(form, r)
        start = start_of(device, r)
        units, parameters = dimensionless(device)
        length, speed = units["x_0"], units["x_0"] * units["Omega0"]
        shift = device.F_0 / device.k1

        def relative(z: State) -> tuple[float, float, float]:
            return (
                (z[0] - z[1] + shift) / length,  # noqa: B023
                (z[2] - z[3]) / speed,  # noqa: B023
                z[3] / speed,  # noqa: B023
            )

        end, passed = run(device, start, PERIODS)
        (judged,) = judge.runs(form, [Start(parameters, relative(start))], PERIODS)
        assert judged.status == "done"
        assert judged.fields == tuple(number(form, *segment) for segment in passed)
        tolerance = 1e-10 * max(1, *judged.unit)
        for a, b in zip((*relative(end), end[1] / length), judged.state, strict=True):
            assert abs(a - float(b)) < tolerance
        compared += len(passed) > 3
    return compared


@sampled
@pytest.mark.parametrize("form", FORMS, ids=str)
def test_devices_move_as_their_dimensionless_scene(form: Form, judge: Integrator) -> None:
    count = many(13, 1)
    assert check(judge, form, count) > count / 2
