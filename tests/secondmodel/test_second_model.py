"""A second model as the judge: declared in a file of its own, generated, compiled and run.

Nothing of the package is edited for it. What it gives is compared with an integrator that knows the
equations of motion alone (`integrator.c`), and with 50 digits of the package's reference map.
"""

from __future__ import annotations

import inspect
import json
import random
import runpy
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.native import LIBRARY, ROOT

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


def printed(program: Path, rows: list[Row]) -> list[list[str]]:
    text = "".join(" ".join(map(repr, row)) + "\n" for row in rows)
    done = subprocess.run(
        [program, str(PERIODS)], input=text, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [line.split() for line in done.stdout.splitlines()]


def generate(model: Path, out: Path) -> None:
    command = [sys.executable, "-m", "capsule_sym.codegen", "--model", model, "--out", out]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("second")


@pytest.fixture(scope="module")
def generated(folder: Path) -> Path:
    generate(MODEL, folder / "generated")
    return folder / "generated"


@pytest.fixture(scope="module")
def judged(folder: Path) -> tuple[list[Row], Ends]:
    """Runs by the integrator."""
    program, rows = folder / "integrator", random_rows(300)
    command = ["cc", "-O2", *WARNED[:-1], HERE / "integrator.c", "-lm", "-o", program]
    subprocess.run(command, check=True)
    lines = printed(program, rows)
    return rows, [(tuple(map(float, line[:3])), line[4]) for line in lines]


def difference(first: tuple[float, ...], second: tuple[float, ...]) -> float:
    return max(abs(a - b) for a, b in zip(first, second, strict=True))


def test_the_fields_of_the_balls_take_the_parameters_that_they_name(generated: Path) -> None:
    fields = runpy.run_path(str(generated / "fields.py"))
    assert {"s", "f_plus", "f_minus"} < {*fields["PARAMETERS"]}
    for name in ("RATES", "RATES_BY", "GUARDS", "GUARDS_BY"):
        for function in fields[name]:
            assert tuple(inspect.signature(function).parameters) == fields["PARAMETERS"]


def test_the_c_library_moves_as_the_integrator(
    folder: Path, generated: Path, judged: tuple[list[Row], Ends]
) -> None:
    """Alone and side by side, under sanitizers: every field passed, and final states to 1e-11."""
    program = folder / "driver"
    sources = [*LIBRARY.glob("*.c"), generated / "c" / "capsule_kernels.c", HERE / "driver.c"]
    paths = [f"-I{LIBRARY}", f"-I{generated / 'c'}"]
    command = ["cc", "-O0", *WARNED, *SANITIZED, *paths, *sources, "-lm", "-o", program]
    subprocess.run(command, check=True)
    rows, expected = judged
    lines = printed(program, rows)
    for alone, many, (state, fields) in zip(
        lines[: len(rows)], lines[len(rows) :], expected, strict=True
    ):
        assert alone[0] == many[0] == "0"
        assert alone[4] == fields
        assert difference(tuple(map(float, alone[1:4])), state) < 1e-11
        assert difference(tuple(map(float, many[1:4])), state) < 1e-11


SIMULATED = """
import importlib.metadata, json, sys
importlib.metadata.distributions = lambda **_: iter(())  # no core of another model
from capsule_sym import Parameters, simulate
from capsule_sym.generated.facts import PARAMETERS
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
    shutil.copytree(generated, tree / "capsule_sym" / "generated", dirs_exist_ok=True)
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
    """In doubles, and in 50 digits, from which the integrator's 19 are off by its own rounding."""
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


@pytest.mark.parametrize("change", MUTANTS.values(), ids=MUTANTS)
def test_a_changed_declaration_is_noticed(
    change: tuple[str, str], folder: Path, tmp_path: Path, judged: tuple[list[Row], Ends]
) -> None:
    text = MODEL.read_text(encoding="utf-8")
    assert text.count(change[0]) == 1
    (tmp_path / "mutant.py").write_text(text.replace(*change), encoding="utf-8")
    generate(tmp_path / "mutant.py", tmp_path / "generated")
    rows, expected = judged
    found = simulated(tmp_path / "tree", tmp_path / "generated", rows[:12], "numpy")
    off = [
        difference(state, judge) for (state, _), (judge, _) in zip(found, expected, strict=False)
    ]
    assert max(off) > 1e-3
