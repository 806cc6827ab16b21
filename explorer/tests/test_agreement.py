"""The page's library beside the package's: the same itineraries, the same states but for rounding.

Both run one source. Differing are exp, sin and cos, musl's there and the system's here, and
products that this processor fuses with sums: some roundings in each segment, carried on by the run.
"""

import base64
import json
import math
import random
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from capsule_sym import Parameters, scenes, simulate
from capsule_sym._native import core
from capsule_sym._parameters import CAPSULE, scene
from capsule_sym.orbits import jacobian
from explorer import build

PERIODS = 5
ROUNDINGS = 8  # of each segment, in units of rounding of the largest value there
pytestmark = [
    pytest.mark.skipif(shutil.which("node") is None, reason="Node.js is not there"),
    pytest.mark.skipif(core is None, reason="the C core was not compiled"),
]


def _systems(count):
    draw = random.Random(20)
    for i in range(count):
        parameters = Parameters(
            alpha=draw.uniform(0, 3),
            omega=math.exp(draw.uniform(-1, 1)),
            delta=draw.uniform(0, 1) if i % 5 else 0.0,
            zeta=draw.uniform(0, 1) if i % 3 else 0.0,
            beta=math.exp(draw.uniform(-2, 3)),
            gamma=math.exp(draw.uniform(-1.5, 1.5)),
            f_b=draw.uniform(0.2, 2),
        )
        state = (draw.uniform(-1, 1), draw.uniform(-1, 1), draw.uniform(-1, 1) if i % 2 else 0.0)
        yield parameters, state, draw.uniform(0, 0.999) * parameters.period


def _others(of, count):
    """Systems of another scene, about its defaults."""
    draw, facts = random.Random(of.source), of.facts
    for i in range(count):
        drawn = {
            name: value * math.exp(draw.uniform(-0.7, 0.7)) if value else draw.uniform(-0.3, 0.3)
            for name, value in facts.DEFAULTS.items()
        }
        shares = {n: draw.uniform(0.05, 0.95) for n, (_, high) in facts.RANGES.items() if high < 1}
        parameters = of.Parameters(**(drawn | shares))
        state = (draw.uniform(-1, 1), draw.uniform(-1, 1), draw.uniform(-1, 1) if i % 2 else 0.0)
        yield parameters, state, draw.uniform(0, 0.999) * parameters.period


def _compare(count, of=CAPSULE):
    systems = list(_systems(count) if of is CAPSULE else _others(of, count))
    asked = [
        {"parameters": [*p.to_dict().values()], "state": s, "phase": t, "periods": PERIODS}
        for p, s, t in systems
    ]
    segment, state = of.records.SEGMENT, of.records.STATE
    sizes = {"segment": segment.itemsize, "state": state.itemsize}
    done = subprocess.run(
        ["node", str(Path(__file__).with_name("core.mjs")), str(build.PAGE)],
        input=json.dumps({"scene": of.source, "sizes": sizes, "systems": asked}),
        capture_output=True,
        text=True,
        check=True,
    )
    equal, largest = 0, 0.0
    for (p, s, t), there in zip(systems, json.loads(done.stdout), strict=True):
        here = simulate(p, s, t, PERIODS, backend="c")
        assert there["stop"] == 0
        segments = np.frombuffer(base64.b64decode(there["segments"]), segment)
        assert segments[["field", "source", "target"]].tolist() == [
            (one.field, int(one.source[1:] or 0), int(one.target[1:] or 0)) for one in here.segments
        ]
        (end,) = np.frombuffer(base64.b64decode(there["state"]), state)
        final = here.final[1]
        there_final = (end["x_r"], end["v_r"], end["v_c"])
        error = max(abs(a - b) for a, b in zip(final, there_final, strict=True))
        # Each segment adds some roundings, which the run carries to its end.
        size = 1 + max(abs(v) for one in here.segments for v in one.start_state)
        carried = max(1.0, float(abs(jacobian(here)).max())) * len(here.segments)
        allowed = ROUNDINGS * 2.0**-53 * size * carried
        largest = max(largest, error / allowed)
        equal += error == 0
        assert error <= allowed, (p, s, t, error, allowed)
    return equal, largest


@pytest.mark.parametrize("name", scenes.SHIPPED)
def test_it_agrees_with_the_package(name):
    _compare(20, scene(name))


@pytest.mark.long
@pytest.mark.parametrize("name", scenes.SHIPPED)
def test_it_agrees_with_the_package_on_a_thousand_systems(name):
    equal, largest = _compare(1000, scene(name))
    print(f"{equal} of 1000 equal to the last bit; the others within {largest:.2g} of the bound")
