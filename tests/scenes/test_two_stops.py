"""Two stops with a cosine: the C library's runs, and the integrator's."""

from __future__ import annotations

import random
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.native import LIBRARY, ROOT
from tests.scenes import Form, Integrator, Run, Start, integrator, random_starts

HERE = Path(__file__).parent
FORM = Form(stops=2)
ORDER = ("alpha", "omega", "delta_1", "delta_2", "zeta", "beta_1", "beta_2", "gamma", "f_b")
FLOW = ("omega", "zeta", "beta_1", "beta_2", "gamma")
PERIODS = 4
WITHIN = 10
"""Units of a run's rounding errors, of which states are off by a few."""
WARNED = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off")
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]


def starts(count: int) -> list[Start]:
    """Random starts, every fifth on the surface of a stop, every sixth with narrow gaps.

    Of twenty each linear flows are the same, so that they run side by side.
    """
    r, found, drawn = random.Random(2), list[Start](), random_starts(FORM, count)
    for k, start in enumerate(drawn):
        flow = {name: drawn[k - k % 20].parameters[name] for name in FLOW}
        given = {**start.parameters, **flow}
        x_r, v_r, v_c = start.state
        if k % 6 == 1:
            given["delta_1"], given["delta_2"] = 0.01, r.choice([0.01, 0.0])
        if k // 20 % 6 == 2:
            given["beta_1"] = given["beta_2"] = 900.0
        if k % 5 == 1:
            x_r = given["delta_1"]
        if k % 5 == 2:
            x_r = -given["delta_2"]
        if given["delta_1"] + given["delta_2"] > 0:
            phase = start.phase * start.parameters["omega"] / given["omega"]
            found.append(Start(given, (x_r, v_r, v_c), phase))
    return found


@pytest.fixture(scope="module")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Integrator:
    return integrator(tmp_path_factory.mktemp("integrator"))


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The C library of the scene with a driver, under sanitizers."""
    folder = tmp_path_factory.mktemp("two_stops")
    command = [sys.executable, "-m", "capsule_sym.codegen", "--scene", HERE / "two_stops.py"]
    subprocess.run([*command, "--out", folder], cwd=ROOT, check=True, capture_output=True)
    sources = [*LIBRARY.glob("*.c"), folder / "c" / "capsule_kernels.c", HERE / "driver.c"]
    flags = ["-O1", *WARNED, *SANITIZED, f"-I{LIBRARY}", f"-I{folder / 'c'}"]
    subprocess.run(["cc", *flags, *sources, "-lm", "-o", folder / "driver"], check=True)
    return folder / "driver"


def printed(driver: Path, given: list[Start], *options: int) -> list[list[str]]:
    rows = ([*(s.parameters[name] for name in ORDER), *s.state, s.phase] for s in given)
    text = "".join(" ".join(map(repr, map(float, row))) + "\n" for row in rows)
    done = subprocess.run(
        [driver, *map(str, (PERIODS, *options))],
        input=text,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [line.split() for line in done.stdout.splitlines()]


@pytest.fixture(scope="module")
def judged(judge: Integrator) -> tuple[list[Start], list[Run]]:
    """Starts whose runs the integrator decides."""
    given = starts(1000)
    pairs = zip(given, judge.runs(FORM, given, PERIODS), strict=True)
    found = [(s, run) for s, run in pairs if run.status == "done"]
    assert len(found) > 0.99 * len(given)
    assert {e.event for _, run in found for e in run.segments} >= {"F", "B", "V", "U", "L"}
    return [s for s, _ in found], [run for _, run in found]


@pytest.mark.parametrize("precision", [0, 1, 2])
def test_runs_alone_are_those_of_the_integrator(
    precision: int, driver: Path, judged: tuple[list[Start], list[Run]]
) -> None:
    given, expected = judged
    open_ = 0
    for line, run in zip(printed(driver, given, precision), expected, strict=True):
        if line[0] == "2" and precision == 1:  # doubles alone leave some open
            open_ += 1
            continue
        assert line[0] == "0"
        assert tuple(int(one.split(":")[0]) for one in line[5:-1]) == run.fields
        assert run.off(tuple(map(float, line[1:4]))) < WITHIN
    assert open_ < 0.02 * len(given)


@pytest.mark.parametrize("lanes", [4, 8])
def test_runs_side_by_side_are_those_of_the_integrator(
    lanes: int, driver: Path, judged: tuple[list[Start], list[Run]]
) -> None:
    given, expected = judged
    for line, run in zip(printed(driver, given, 0, lanes), expected, strict=True):
        assert line[0] == "0"
        assert run.off(tuple(map(float, line[1:4]))) < WITHIN
