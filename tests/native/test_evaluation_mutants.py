"""The pass over segments with a line of its C changed: each change is noticed."""

import ctypes
import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from capsule_sym import Parameters, results, simulate
from capsule_sym._native import core
from tests.native import KERNELS, LIBRARY, compile_in

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler here"),
    pytest.mark.skipif(core is None, reason="the C core was not compiled"),
]

P = Parameters(alpha=1.5, gamma=3.0)
MUTANTS = {
    "the segment before": ("    return at;\n", "    return at ? at - 1 : at;\n"),
    "the segment after": ("    return at;\n", "    return at + 1 < count ? at + 1 : at;\n"),
    "a search one short": ("            high = at + step;", "            high = at + step - 1;"),
    "a search that ends early": ("while (high - at > 1)", "while (high - at > 2)"),
    "no step back": ("    while (at > 0 && !begun", "    while (0 && !begun"),
    "another segment's expansion": (
        "if (p.of != s || p.node != node)",
        "if (!p.of || p.node != node)",
    ),
    "the expansion before": ("if (p.of != s || p.node != node)", "if (p.of != s)"),
    "the constants of another field": ("p->c = &map->field[s->field - 1]", "p->c = &map->field[0]"),
    "whole periods without their rest": ("((double)periods * c->rest + ", "(0.0 * c->rest + "),
    "times beyond a duration": ("if (h >= s->duration) {", "if (0) {"),
    "times before a start": ("h = h > 0.0 ? h : 0.0;", ""),
    "x_c from the segment's start": ("            p->begin.position +=", "            (void)"),
    "an angle that does not turn": ("    if (node > 0.0) {", "    if (node > 1.0) {"),
}


SHIM = """
size_t states(const capsule_map *map, const capsule_segment *segments, size_t count,
              const double *times, size_t n, double (*out)[4])
{
    return states_at(map, segments, count, 0, 1, times, n, out, NULL);
}
"""


@pytest.fixture(scope="module")
def objects(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Functions that the pass calls, compiled once: they are the same for every change."""
    directory = tmp_path_factory.mktemp("objects")
    names = ("lanes", "rest", "write_strobe", "allowed", "code_here")
    others = "".join(f"int capsule_{name}(void) {{ return 1; }}\n" for name in names)
    (directory / "others.c").write_text(others)
    sources = "others.c", LIBRARY / "tables.c", KERNELS / "capsule_kernels.c"
    compile_in(directory, "-O0", "-c", *sources)
    return sorted(directory.glob("*.o"))


class Library:
    """The pass compiled by itself, with one text of it changed."""

    def __init__(
        self, directory: Path, objects: list[Path], change: tuple[str, str] | None
    ) -> None:
        text = (LIBRARY / "evaluate.h").read_text()
        if change:
            assert text.count(change[0]) == 1, change
            text = text.replace(*change)
        (directory / "changed.c").write_text(f'#include "scalar.h"\n{text}\n{SHIM}')
        words = "-shared", "changed.c", *objects, "-lm", "-o", "built.so"
        compile_in(directory, "-O0", *words)
        self.library = ctypes.CDLL(str(directory / "built.so"))
        self.library.states.restype = ctypes.c_size_t

    def states(self, run: results.Trajectory, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """States at times."""
        parameters = np.array([*run.parameters.to_dict().values()])
        work, out = np.zeros(1 << 17, np.uint8), np.zeros((len(times), 4))

        def at(array: NDArray[np.generic]) -> ctypes.c_void_p:
            return ctypes.c_void_p(array.ctypes.data)

        self.library.capsule_map_make(at(parameters), at(work))
        size = ctypes.c_size_t
        self.library.states(
            at(work), at(run.records), size(len(run.records)), at(times), size(len(times)), at(out)
        )
        return out


@pytest.fixture(scope="module")
def runs() -> list[tuple[results.Trajectory, NDArray[np.float64]]]:
    """A short run densely, and a long one late and now and then, its end among the times."""
    short, late = simulate(P, (0.1, -0.2, 0.3), 1.25, 6), simulate(P, periods=20_000)
    random, period = np.random.default_rng(0), P.period
    dense = np.append(random.uniform(1.25, 6 * period, 1500), 0.75)  # the last before the start
    sparse = np.sort(random.uniform(0, 20_000, 200)) * period
    sparse = np.append(sparse, 20_000 * period * (1 + 1e-12))
    return [(short, dense), (late, sparse)]


def off(library: Library, runs: list[tuple[results.Trajectory, NDArray[np.float64]]]) -> float:
    """Largest difference from the core's states, which other tests check against 50 digits."""
    worst = 0.0
    for run, times in runs:
        end = run.final[0].period * P.period
        true = run(np.clip(times, run.origin[0].phase, end), position=True)
        true[times > end] = (*run.final[1], run.advance)
        difference = library.states(run, times) - true
        scale = np.array([1.0, 1.0, 1.0, 1e-3 * len(run.stroboscopic) + 1.0])
        worst = max(worst, float(np.abs(difference / scale).max()))
    return worst


def test_unchanged_it_gives_what_the_core_gives(tmp_path: Path, objects: list, runs: list) -> None:
    assert off(Library(tmp_path, objects, None), runs) < 5e-14


@pytest.mark.parametrize("name", MUTANTS)
def test_a_change_is_noticed(name: str, tmp_path: Path, objects: list, runs: list) -> None:
    assert not off(Library(tmp_path, objects, MUTANTS[name]), runs) < 1e-12
