"""Extrema of the pull Q inside a segment, by C, where the drive pushes the capsule back."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest

from capsule_sym._native import core_of
from capsule_sym._parameters import scene

NAMES = ("reaction", "reaction_pulse")


@pytest.mark.parametrize("name", NAMES)
def test_every_turn_of_the_pull_is_found_and_no_other(name: str) -> None:
    """Beside signs of its rate at many times, of the closed form and the drive as they stand."""
    given, r = scene(name), random.Random(name)
    core, seen = core_of(given), 0
    if core is None:
        pytest.skip("the C core was not compiled")
    pull, force = given.interface.Quantity.PULL, given.interface.Quantity.FORCE
    for _ in range(60):
        p = {"alpha": r.uniform(0.5, 2), "omega": r.uniform(0.5, 4), "delta": 0.1, "zeta": 0.05}
        p |= {"beta": r.uniform(0, 5), "gamma": r.uniform(0.5, 4), "f_b": 1.0}
        p |= {"alpha_low": r.uniform(-1, 0.3), "D": 0.5}
        parameters = [p[one] for one in given.facts.PARAMETERS]
        field = r.randint(1, 12 if name == "reaction_pulse" else 6)
        c = given.kernels.constants(field, *parameters)
        x_r, v_r, angle = r.uniform(-1, 1), r.uniform(-1, 1), r.uniform(0, 6)
        level = p["alpha_low" if field > 6 else "alpha"]
        u = level * math.cos(angle) if name == "reaction" else level
        margin = (1 + c.kappa) * x_r - c.kappa * 0.1 + 2 * p["zeta"] * v_r - u - c.friction
        start = (x_r, x_r - 0.1, v_r, 0.3, margin, math.cos(angle), math.sin(angle))
        h = np.linspace(0, 12.0, 6001)
        first = given.kernels.Start(*start)
        x, v, *_ = given.kernels.flow(c, first, h)
        drive = p["alpha"] * np.cos(angle + p["omega"] * h) if name == "reaction" else u
        P = (1 + c.kappa) * (x_r + x) - c.kappa * 0.1 + 2 * p["zeta"] * v
        Q = P - drive
        for quantity, values in ((pull, Q), (force, P)):
            found = core.Fields(np.array(parameters)).extrema(field, start, quantity, 0, 12.0)
            if found is None:
                continue
            turns = np.flatnonzero(np.diff(np.sign(np.diff(values)))) + 1
            assert [kind for kind, _, _ in found] == [
                int(np.sign(values[i + 1] - values[i])) for i in turns
            ], (p, field)
            for (_, time, value), i in zip(found, turns, strict=True):
                assert abs(time - h[i]) <= 0.0021
                assert value == pytest.approx(values[i], abs=1e-3 * (1 + abs(values).max()))
            seen += len(found)
    assert seen > 300
