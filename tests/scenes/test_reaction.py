"""A drive that pushes the capsule back, by the C library, against the integrator of the scenes."""

from __future__ import annotations

import math
import shutil
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.native import LIBRARY, ROOT
from tests.scenes import SCENES, Integrator, Run, Start, integrator, random_starts

HERE = Path(__file__).parent
NAMES = {
    "reacting": ("alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b"),
    "reacting_pulsed": (
        *("alpha", "alpha_low", "omega", "D", "delta", "zeta", "beta", "gamma", "f_b"),
    ),
}
"""Parameters in the order of the declaration of this name."""
FORMS = {"reacting": SCENES["reaction"], "reacting_pulsed": SCENES["reaction_pulse"]}
FLOW = ("omega", "zeta", "beta", "gamma")
"""Parameters of the linear flows, which runs share that go side by side."""
PERIODS, COUNT = 4, 300
WARNED = (
    "-std=gnu99",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-ffp-contract=off",
    "-Wno-psabi",
    "-DCAPSULE_ANY_WIDTH=1",
)
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]


@pytest.fixture(scope="module")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Integrator:
    return integrator(tmp_path_factory.mktemp("reaction"))


class Library(NamedTuple):
    """The C library compiled for a scene, under sanitizers."""

    scene: str
    kernels: Path
    objects: list[Path]


@pytest.fixture(scope="module", params=FORMS)
def library(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Library:
    folder = tmp_path_factory.mktemp(request.param)
    command = [sys.executable, "-m", "capsule_sym.codegen", "--out", folder / "generated"]
    command += ["--scene", HERE / f"{request.param}.py"]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    kernels = folder / "generated" / "c"
    sources = [*LIBRARY.glob("*.c"), kernels / "capsule_kernels.c"]
    command = ["cc", "-c", "-O0", *WARNED, *SANITIZED, f"-I{LIBRARY}", f"-I{kernels}", *sources]
    subprocess.run(command, cwd=folder, check=True)
    return Library(request.param, kernels, sorted(folder.glob("*.o")))


def program(source: Path, library: Library) -> Path:
    made = library.objects[0].with_name(source.stem)
    command = ["cc", "-O0", *WARNED, *SANITIZED, f"-I{LIBRARY}", f"-I{library.kernels}", source]
    subprocess.run([*command, *library.objects, "-lm", "-o", made], check=True)
    return made


def printed(made: Path, rows: list[list[float]], *words: int) -> list[list[str]]:
    text = "".join(" ".join(map(repr, map(float, row))) + "\n" for row in rows)
    command = [made, *map(str, words)]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [line.split() for line in done.stdout.splitlines()]


def grouped(starts: list[Start]) -> list[Start]:
    """The same with the linear flows' parameters of every eighth for it and the next seven."""
    found = []
    for i, start in enumerate(starts):
        shared = {name: starts[i - i % 8].parameters[name] for name in FLOW}
        phase = start.phase * start.parameters["omega"] / shared["omega"]
        found.append(start._replace(parameters={**start.parameters, **shared}, phase=0.999 * phase))
    return found


class Judged(NamedTuple):
    """Starts with the integrator's runs."""

    rows: list[list[float]]
    runs: list[Run]


@pytest.fixture(scope="module")
def judged(judge: Integrator, library: Library) -> Judged:
    form, names = FORMS[library.scene], NAMES[library.scene]
    starts = grouped(random_starts(form, COUNT))
    runs = judge.runs(form, starts, PERIODS)
    assert all(run.status == "done" for run in runs)
    return Judged([[*(s.parameters[n] for n in names), *s.state, s.phase] for s in starts], runs)


@pytest.mark.parametrize("way", [(0,), (2,), (0, 4), (0, 8)], ids=["alone", "106", "4", "8"])
def test_runs_are_those_of_the_integrator(
    way: tuple[int, ...], judged: Judged, library: Library
) -> None:
    """Fields equal, and errors of few roundings, times what the run does to them."""
    lines = printed(program(HERE / "driver.c", library), judged.rows, PERIODS, *way)
    for line, run in zip(lines, judged.runs, strict=True):
        assert line[0] == "0"
        assert run.off(tuple(map(float, line[1:4]))) < 32
        if len(way) == 1:
            assert tuple(int(one.split(":")[0]) for one in line[5:-1]) == run.fields


class Found(NamedTuple):
    """An orbit, by the C library or by differences of the integrator's, with what it depends on."""

    state: np.ndarray
    monodromy: np.ndarray
    by_parameter: np.ndarray
    progression: float
    gradient: np.ndarray


STEP = Fraction(1, 2**12)


def by_differences(judge: Integrator, row: list[float], state: np.ndarray) -> Found | None:
    """The period's end from an orbit, and its slopes to fourth order in STEP.

    None where the itinerary is not the same in all directions: there are no two-sided slopes.
    """
    names = NAMES["reacting"]
    at, m = np.array([*row[: len(names)], *state]), len(names)
    moves = [k * float(STEP) * one for one in np.eye(len(at)) for k in (-2, -1, 1, 2)]
    places = [at + move for move in (0 * at, *moves)]
    begun = [Start(dict(zip(names, z, strict=False)), tuple(z[m:])) for z in places]
    runs = judge.runs(FORMS["reacting"], begun, 1, checked=False)
    if len({run.fields for run in runs}) > 1:
        return None
    ends = np.array([run.state[:4] for run in runs])
    rows = ends[1:].reshape(len(at), 4, 4)
    slopes = ((rows[:, 0] - 8 * rows[:, 1] + 8 * rows[:, 2] - rows[:, 3]) / (12 * STEP)).T
    slopes, end = slopes.astype(float), ends[0].astype(float)
    moved = np.linalg.solve(np.eye(3) - slopes[:3, m:], slopes[:3, :m])
    gradient = slopes[3, :m] + slopes[3, m:] @ moved
    return Found(end[:3], slopes[:3, m:], moved, end[3], gradient)


def apart(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.max(np.abs(first - second)) / (1 + np.max(np.abs(second))))


@pytest.mark.parametrize("library", ["reacting"], indirect=True)
def test_orbits_and_what_they_depend_on_are_those_of_the_integrator(
    library: Library, judge: Integrator
) -> None:
    """State and progression to rounding; slopes to what is left of STEP^4 and of 1 - multipliers.

    The itinerary's own equations come to the same multipliers. Contacts of stiffness 900 enlarge
    rounding too much for differences.
    """
    made, m = program(ROOT / "tests" / "secondmodel" / "orbits.c", library), len(NAMES["reacting"])
    starts = [s for s in random_starts(FORMS["reacting"], 150) if s.parameters["beta"] < 100]
    rows = [[*(s.parameters[n] for n in NAMES["reacting"]), *s.state] for s in starts]
    compared = 0
    for row, (fit, *texts) in zip(rows, printed(made, rows, 1), strict=True):
        if not int(fit):
            continue
        places = np.cumsum([3, 9, 3 * m, 1, m])
        state, by, moved, (advance,), gradient, rest = np.split(np.array(texts, float), places)
        residual, trace, determinant = rest
        assert residual < 1e-13 * max(1, 2 * math.pi / row[1])  # the longest duration's
        if (found := by_differences(judge, row, state)) is None:
            continue
        compared += 1
        assert apart(state, found.state) < 1e-13
        assert abs(advance - found.progression) < 1e-12
        assert apart(by.reshape(3, 3), found.monodromy) < 1e-10
        assert apart(moved.reshape(3, m), found.by_parameter) < 1e-8
        assert apart(gradient, found.gradient) < 1e-8
        assert abs(trace - np.trace(found.monodromy)) < 1e-10
        assert abs(determinant - np.linalg.det(found.monodromy)) < 1e-10
    assert compared >= 10
