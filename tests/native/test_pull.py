"""Extrema of the pull Q inside a segment, by C, where the drive pushes the capsule back."""

import ctypes
import math
import random
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from capsule_sym._native import core_of
from capsule_sym._parameters import scene
from capsule_sym.generated.interface import Quantity
from tests.native import LIBRARY, ROOT
from tests.native.test_native_extrema import ORDER, Expanded
from tests.sampling import flows

NAMES = ("reaction", "reaction_pulse")


@pytest.mark.parametrize("name", NAMES)
def test_every_turn_of_the_pull_is_found_and_no_other(name: str) -> None:
    """Beside signs of its rate at many times, of the closed form and the drive as they stand."""
    given, r = scene(name), random.Random(name)
    core, seen = core_of(given), 0
    if core is None:
        pytest.skip("the C core was not compiled")
    pull, force = Quantity.PULL, Quantity.FORCE
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
        x, v, _ = flows(given.kernels, c, first, 12.0, 6000)
        drive = p["alpha"] * np.cos(angle + p["omega"] * h) if name == "reaction" else u
        P = (1 + c.kappa) * (x_r + x) - c.kappa * 0.1 + 2 * p["zeta"] * v
        Q = P - drive
        for quantity, values in ((pull, Q), (force, P)):
            found = core.fields(np.array(parameters)).extrema(field, start, quantity, 0, 12.0)
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


def remainder_holds(folder: Path, change: tuple[str, str]) -> bool:
    """True if Q' stays within an expansion's bounds at rest under a fast drive, sources changed."""
    text = (LIBRARY / "extrema.c").read_text()
    assert text.count(change[0]) == 1
    (folder / "extrema.c").write_text(text.replace(*change) + PROBE)
    kernels = ROOT / "generated" / "reaction" / "c"
    command = ["cc", "-std=c99", "-O1", "-ffp-contract=off", "-fPIC", "-w", "-shared"]
    command += [f"-I{LIBRARY}", f"-I{kernels}", "extrema.c", str(kernels / "capsule_kernels.c")]
    subprocess.run([*command, "-lm", "-o", "probe"], cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "probe"))
    given, e = scene("reaction"), Expanded()
    p = {"alpha": 1.0, "omega": 30.0, "delta": 0.1, "zeta": 0.01, "beta": 1.0}
    p |= {"gamma": 2.0, "f_b": 1.0}
    numbers = [p[one] for one in given.facts.PARAMETERS]
    x_r, v_r, angle, d = 0.01, 0.02, 0.7, 0.05
    margin = x_r + 2 * p["zeta"] * v_r - math.cos(angle)
    start = (x_r, x_r - 0.1, v_r, 0.0, margin, math.cos(angle), math.sin(angle))
    library.probe(
        (ctypes.c_double * 7)(*numbers),
        (ctypes.c_double * 7)(*start),
        int(Quantity.PULL),
        ctypes.byref(e),
    )
    c = given.kernels.constants(2, *numbers)
    x, v = given.kernels.flow(c, given.kernels.Start(*start), d)
    turned = angle + p["omega"] * d
    P = x_r + x + 2 * p["zeta"] * v
    true = v + 2 * p["zeta"] * (math.cos(turned) - P) + p["omega"] * math.sin(turned)
    found = sum(rate * d**n for n, rate in enumerate(e.rate))
    errors = sum(error * d**n for n, error in enumerate(e.error))
    return abs(found - true) <= e.rest * d**ORDER + e.growth * d ** (ORDER + 1) + errors


PROBE = """
void probe(const capsule_parameters *p, const capsule_start *start, int quantity, expansion *e)
{
    capsule_constants c;
    capsule_constants_of(2, p, &c);
    const course f = course_of(&c, start, quantity, 1.0);
    *e = expand(&f, 0.0);
}
"""


@pytest.mark.long
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here")
def test_the_remainder_of_the_pull_has_the_drive(tmp_path: Path) -> None:
    assert remainder_holds(tmp_path, ("factor += of_drive;", "factor += of_drive;"))
    (tmp_path / "mutant").mkdir()
    assert not remainder_holds(tmp_path / "mutant", ("factor += of_drive;", ";"))
