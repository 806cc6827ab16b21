"""A second model as the judge: declared in a file of its own, generated, compiled and run.

Nothing of the package is edited for it. Runs of the reference map, in doubles and in 50 digits, are
compared with an integrator based on the equations of motion alone (`tests.scenes`); its C library,
orbits and what they depend on are compared in `tests/scenes/test_sanitized.py`.
"""

import json
import random
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

from tests.native import ROOT
from tests.scenes import SCENES, Integrator, Start
from tests.scenes.library import generated, library
from tests.scenes.orbits import apart, by_differences, orbits

MODEL = Path(__file__).with_name("biased.py")
FORM = SCENES["slope"]
NAMES = ("alpha", "omega", "delta", "zeta", "beta", "gamma", "s", "f_plus", "f_minus")
PERIODS = 4

Ends = list[tuple[tuple[float, ...], tuple[int, ...]]]
"""Final state and fields of each run."""

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
]


def random_starts(count: int) -> list[Start]:
    """Parameters and a state."""
    r, zeta = random.Random(29), [0.0, 0.05, 0.4]
    found = []
    for _ in range(count):
        p = [r.uniform(0, 2.5), r.uniform(0.4, 2), r.uniform(0, 1), r.choice(zeta)]
        p += [r.uniform(0, 10), r.uniform(0.3, 5)]
        p += [r.uniform(-0.4, 0.4), r.uniform(0.2, 1.5), r.uniform(0.2, 1.5)]
        state = r.uniform(-1, 1), r.uniform(-1, 1), r.choice([0.0, r.uniform(-1, 1)])
        found.append(Start(dict(zip(NAMES, p, strict=True)), state))
    return found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("second")


@pytest.fixture(scope="module")
def judged(judge: Integrator) -> tuple[list[Start], Ends]:
    """Runs by the integrator."""
    starts = random_starts(300)
    runs = judge.runs(FORM, starts, PERIODS, checked=False)
    assert {run.status for run in runs} == {"done"}
    return starts, [(tuple(map(float, run.state[:3])), run.fields) for run in runs]


def difference(first: tuple[float, ...], second: tuple[float, ...]) -> float:
    return max(abs(a - b) for a, b in zip(first, second, strict=True))


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
    ends.append(([*map(float, run.final[1])], [int(s.field) for s in run.segments]))
json.dump(ends, sys.stdout)
"""


def simulated(tree: Path, code: Path, starts: list[Start], backend: str) -> Ends:
    """Runs by the package's Python over generated code of another model."""
    rows = [[*start.parameters.values(), *start.state] for start in starts]
    if not tree.exists():
        left = shutil.ignore_patterns("generated", "__pycache__", "*.so", "*.pyd", "page.html")
        shutil.copytree(ROOT / "capsule_sym", tree / "capsule_sym", ignore=left)
        (tree / "capsule_sym" / "generated").mkdir()
        for shared in (ROOT / "generated").glob("*.py"):
            shutil.copy(shared, tree / "capsule_sym" / "generated")
    shutil.copytree(code, tree / "capsule_sym" / "generated" / "capsule", dirs_exist_ok=True)
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
    return [(tuple(state), tuple(fields)) for state, fields in json.loads(done.stdout)]


@pytest.mark.parametrize(("backend", "count"), [("numpy", 40), ("mpmath", 12)])
def test_the_reference_map_moves_as_the_integrator(backend, count, folder, judged) -> None:
    """In doubles, and in 50 digits, from which the integrator is off by its ends' rounding."""
    starts, expected = judged
    code = generated("biased", folder / "generated")
    found = simulated(folder / "tree", code, starts[:count], backend)
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
    """Generated code of a mutant."""
    old, new = MUTANTS[name]
    text = MODEL.read_text(encoding="utf-8")
    assert text.count(old) == 1
    mutant, out = folder / "mutant.py", folder / "generated"
    mutant.write_text(text.replace(old, new), encoding="utf-8")
    command = [sys.executable, "-m", "capsule_sym.codegen", "--scene", mutant, "--out", out]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return out


@pytest.mark.parametrize("name", MUTANTS)
def test_a_changed_declaration_is_noticed(name, tmp_path, judged) -> None:
    starts, expected = judged
    found = simulated(tmp_path / "tree", mutated(tmp_path, name), starts[:12], "numpy")
    off = [
        difference(state, judge) for (state, _), (judge, _) in zip(found, expected, strict=False)
    ]
    assert max(off) > 1e-3


def test_orbits_of_a_changed_declaration_are_noticed(tmp_path: Path, judge: Integrator) -> None:
    mutated(tmp_path, "the bias pulls the other way")
    scene = library("biased", tmp_path)
    found = orbits(scene, random_starts(12))
    assert found
    for row, orbit, _ in found:
        right = by_differences(judge, FORM, scene.parameters, row, orbit.state)
        assert right is None or apart(orbit.state, right.state) > 1e-3
