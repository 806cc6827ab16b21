"""A second model as the judge: declared in a file of its own, generated, compiled and run.

Nothing of the package is edited for it. Its results are compared with an integrator based on the
equations of motion alone (`tests.scenes`), and with 50 digits of the package's reference map. Its
orbits, their monodromy matrices and gradients are compared with differences of the integrator's.
"""

from __future__ import annotations

import json
import random
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.native import LIBRARY, ROOT
from tests.scenes import SCENES, Integrator, Start
from tests.scenes import integrator as compiled_integrator

HERE = Path(__file__).parent
MODEL = HERE / "biased.py"
PERIODS = 4
WARNED = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off")
SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")

Row = list[float]
Ends = list[tuple[tuple[float, ...], str]]
"""Final state and fields of each run."""

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]


def random_rows(count: int) -> list[Row]:
    """Parameters in the order of the declaration, and a state."""
    r = random.Random(29)
    zeta = [0.0, 0.05, 0.4]
    return [
        [
            *(r.uniform(0, 2.5), r.uniform(0.4, 2), r.uniform(0, 1), r.choice(zeta)),
            *(r.uniform(0, 10), r.uniform(0.3, 5)),
            *(r.uniform(-0.4, 0.4), r.uniform(0.2, 1.5), r.uniform(0.2, 1.5)),
            *(r.uniform(-1, 1), r.uniform(-1, 1), r.choice([0.0, r.uniform(-1, 1)])),
        ]
        for _ in range(count)
    ]


def printed(program: Path, rows: list[Row], periods: int = PERIODS) -> list[list[str]]:
    text = "".join(" ".join(map(repr, row)) + "\n" for row in rows)
    done = subprocess.run(
        [program, str(periods)], input=text, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [line.split() for line in done.stdout.splitlines()]


def generate(model: Path, out: Path) -> None:
    command = [sys.executable, "-m", "capsule_sym.codegen", "--scene", model, "--out", out]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("second")


@pytest.fixture(scope="module")
def generated(folder: Path) -> Path:
    generate(MODEL, folder / "generated")
    return folder / "generated"


def compiled(folder: Path, generated: Path, *flags: str) -> list[Path]:
    """Objects of the C library with generated code."""
    sources = [*LIBRARY.glob("*.c"), generated / "c" / "capsule_kernels.c"]
    folder.mkdir()
    command = ["cc", "-c", "-O0", *WARNED, *flags, f"-I{LIBRARY}", f"-I{generated / 'c'}", *sources]
    subprocess.run(command, cwd=folder, check=True)
    return sorted(folder.glob("*.o"))


def program(name: str, objects: list[Path], generated: Path, *flags: str) -> Path:
    """A driver of this folder, linked with the library."""
    made = objects[0].with_name(name)
    paths = [f"-I{LIBRARY}", f"-I{generated / 'c'}"]
    command = ["cc", "-O0", *WARNED, *flags, *paths, HERE / f"{name}.c", *objects, "-lm"]
    subprocess.run([*command, "-o", made], check=True)
    return made


@pytest.fixture(scope="module")
def library(folder: Path, generated: Path) -> list[Path]:
    return compiled(folder / "library", generated, *SANITIZED)


@pytest.fixture(scope="module")
def integrator(folder: Path) -> Integrator:
    return compiled_integrator(folder)


def integrated(
    integrator: Integrator, rows: list[Row], periods: int = PERIODS
) -> list[tuple[list[float], str]]:
    """Final (x_r, v_r, v_c, x_c) and fields of each run."""
    names = ("alpha", "omega", "delta", "zeta", "beta", "gamma", "s", "f_plus", "f_minus")
    starts = [Start(dict(zip(names, row, strict=False)), tuple(row[9:])) for row in rows]
    runs = integrator.runs(SCENES["slope"], starts, periods, checked=False)
    assert {run.status for run in runs} == {"done"}
    return [([*map(float, run.state)], "".join(map(str, run.fields))) for run in runs]


@pytest.fixture(scope="module")
def judged(integrator: Integrator) -> tuple[list[Row], Ends]:
    """Runs by the integrator."""
    rows = random_rows(300)
    return rows, [(tuple(end[:3]), fields) for end, fields in integrated(integrator, rows)]


def difference(first: tuple[float, ...], second: tuple[float, ...]) -> float:
    return max(abs(a - b) for a, b in zip(first, second, strict=True))


def test_the_c_library_moves_as_the_integrator(
    library: list[Path], generated: Path, judged: tuple[list[Row], Ends]
) -> None:
    """Alone and side by side, under sanitizers: every field passed, and final states to 1e-11."""
    rows, expected = judged
    lines = printed(program("driver", library, generated, *SANITIZED), rows)
    for alone, many, (state, fields) in zip(
        lines[: len(rows)], lines[len(rows) :], expected, strict=True
    ):
        assert alone[0] == many[0] == "0"
        assert alone[4] == fields
        assert difference(tuple(map(float, alone[1:4])), state) < 1e-11
        assert difference(tuple(map(float, many[1:4])), state) < 1e-11


class Found(NamedTuple):
    """An orbit, by the C library or by differences of the integrator's, with what it depends on."""

    state: np.ndarray
    monodromy: np.ndarray
    by_parameter: np.ndarray
    progression: float
    gradient: np.ndarray


STEP = 1e-4


def by_differences(
    integrator: Integrator, row: Row, state: np.ndarray, periods: int
) -> Found | None:
    """The period's end from an orbit, and its slopes to fourth order in STEP.

    None where the itinerary is not the same in all directions: there are no two-sided slopes.
    """
    at = np.array([*row[: len(row) - 3], *state])
    steps = [k * STEP * e for e in np.eye(len(at)) for k in (-2, -1, 1, 2)]
    runs = integrated(integrator, [list(map(float, at + d)) for d in (0 * at, *steps)], periods)
    if len({fields for _, fields in runs}) > 1:
        return None
    ends = np.array([end for end, _ in runs])
    rows = ends[1:].reshape(len(at), 4, 4)
    slopes = (rows[:, 0] - 8 * rows[:, 1] + 8 * rows[:, 2] - rows[:, 3]).T / (12 * STEP)
    m = len(at) - 3
    moved = np.linalg.solve(np.eye(3) - slopes[:3, m:], slopes[:3, :m])
    gradient = (slopes[3, :m] + slopes[3, m:] @ moved) / periods
    return Found(ends[0, :3], slopes[:3, m:], moved, ends[0, 3] / periods, gradient)


def orbits(program: Path, rows: list[Row], periods: int) -> list[tuple[Row, Found, np.ndarray]]:
    """Orbits that drift at angle 0, and residual, trace and determinant of their itineraries."""
    m, found = len(rows[0]) - 3, []
    for row, (fit, *texts) in zip(rows, printed(program, rows, periods), strict=True):
        if int(fit):
            places = np.cumsum([3, 9, 3 * m, 1, m])
            state, by, moved, (advance,), gradient, rest = np.split(np.array(texts, float), places)
            orbit = Found(state, by.reshape(3, 3), moved.reshape(3, m), advance, gradient)
            found.append((row, orbit, rest))
    return found


def apart(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.max(np.abs(first - second)) / (1 + np.max(np.abs(second))))


@pytest.mark.parametrize(("periods", "least"), [(1, 25), (2, 2)])
def test_orbits_and_what_they_depend_on_are_those_of_the_integrator(
    periods: int, least: int, library: list[Path], generated: Path, integrator: Integrator
) -> None:
    """State and progression to rounding; slopes to what is left of STEP^4 and of 1 - multipliers.

    The itinerary's own equations come to the same multipliers.
    """
    made = program("orbits", library, generated, *SANITIZED)
    compared = 0
    for row, orbit, (residual, trace, determinant) in orbits(made, random_rows(60), periods):
        assert residual < 1e-13
        if (judge := by_differences(integrator, row, orbit.state, periods)) is None:
            continue
        compared += 1
        assert apart(orbit.state, judge.state) < 1e-13
        assert abs(orbit.progression - judge.progression) < 1e-12
        assert apart(orbit.monodromy, judge.monodromy) < 1e-10
        assert apart(orbit.by_parameter, judge.by_parameter) < 1e-8
        assert apart(orbit.gradient, judge.gradient) < 1e-8
        assert abs(trace - np.trace(judge.monodromy)) < 1e-10
        assert abs(determinant - np.linalg.det(judge.monodromy)) < 1e-10
    assert compared >= least


SIMULATED = """
import importlib.metadata, json, sys
importlib.metadata.distributions = lambda **_: iter(())  # no core of another model
from capsule_sym import Parameters, simulate
from capsule_sym.generated.capsule.facts import PARAMETERS
rows, backend, periods = json.load(sys.stdin)
ends = []
for row in rows:
    n = len(PARAMETERS)
    run = simulate(Parameters(*row[:n]), row[n:], periods=periods, backend=backend)
    ends.append(([*map(float, run.final[1])], "".join(str(s.field) for s in run.segments)))
json.dump(ends, sys.stdout)
"""


def simulated(tree: Path, generated: Path, rows: list[Row], backend: str) -> Ends:
    """Runs by the package's Python over generated code of another model."""
    if not tree.exists():
        left = shutil.ignore_patterns("generated", "__pycache__", "*.so", "*.pyd", "page.html")
        shutil.copytree(ROOT / "capsule_sym", tree / "capsule_sym", ignore=left)
        (tree / "capsule_sym" / "generated").mkdir()
        for shared in (ROOT / "generated").glob("*.py"):
            shutil.copy(shared, tree / "capsule_sym" / "generated")
    shutil.copytree(generated, tree / "capsule_sym" / "generated" / "capsule", dirs_exist_ok=True)
    paths = f"{tree}:{sysconfig.get_path('purelib')}"
    done = subprocess.run(
        [sys.executable, "-S", "-W", "ignore", "-c", SIMULATED],
        input=json.dumps([rows, backend, PERIODS]),
        env={"PYTHONPATH": paths, "PYTHONDONTWRITEBYTECODE": "1"},
        cwd=tree,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return [(tuple(state), fields) for state, fields in json.loads(done.stdout)]


@pytest.mark.parametrize(("backend", "count"), [("numpy", 40), ("mpmath", 12)])
def test_the_reference_map_moves_as_the_integrator(
    backend: str, count: int, folder: Path, generated: Path, judged: tuple[list[Row], Ends]
) -> None:
    """In doubles, and in 50 digits, from which the integrator is off by its ends' rounding."""
    rows, expected = judged
    found = simulated(folder / "tree", generated, rows[:count], backend)
    for (state, fields), (judge, passed) in zip(found, expected[:count], strict=True):
        assert fields == passed
        assert difference(state, judge) < (1e-11 if backend == "numpy" else 1e-13)


MUTANTS = {
    "the bias pulls the other way": ("- s - P", "+ s - P"),
    "no bias": ("- s - P", "- P"),
    "half the damping": ("2 * zeta", "zeta"),
    "a spring too stiff": ("stiffness=beta", "stiffness=2 * beta"),
    "one bound for both ways": (
        'P > -f_minus)\nmodel.drift("BD", v_c < 0, against=f_minus)',
        'P > -f_plus)\nmodel.drift("BD", v_c < 0, against=f_plus)',
    ),
}


def mutated(folder: Path, name: str) -> Path:
    """Generated code of a mutant, made once."""
    old, new = MUTANTS[name]
    text = MODEL.read_text(encoding="utf-8")
    assert text.count(old) == 1
    mutant = folder / f"{name.replace(' ', '_')}.py"
    if not mutant.exists():
        mutant.write_text(text.replace(old, new), encoding="utf-8")
        generate(mutant, mutant.with_suffix(""))
    return mutant.with_suffix("")


@pytest.mark.parametrize("name", MUTANTS)
def test_a_changed_declaration_is_noticed(
    name: str, folder: Path, tmp_path: Path, judged: tuple[list[Row], Ends]
) -> None:
    rows, expected = judged
    found = simulated(tmp_path / "tree", mutated(folder, name), rows[:12], "numpy")
    off = [
        difference(state, judge) for (state, _), (judge, _) in zip(found, expected, strict=False)
    ]
    assert max(off) > 1e-3


def test_orbits_of_a_changed_declaration_are_noticed(
    folder: Path, tmp_path: Path, integrator: Integrator
) -> None:
    generated = mutated(folder, "the bias pulls the other way")
    made = program("orbits", compiled(tmp_path / "library", generated), generated)
    found = orbits(made, random_rows(12), 1)
    assert found
    for row, orbit, _ in found:
        judge = by_differences(integrator, row, orbit.state, 1)
        assert judge is None or apart(orbit.state, judge.state) > 1e-3
