"""The C library by itself: a user's program, compilers and sanitizers."""

import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from capsule_sym import Parameters, simulate
from tests.native import EXAMPLE, KERNELS, LIBRARY, built

pytestmark = pytest.mark.skipif(
    shutil.which("make") is None or shutil.which("cc") is None, reason="no C compiler here"
)


def make(target: str, build: Path, *settings: str) -> str:
    command = ["make", "-C", str(LIBRARY), f"BUILD={build}", target, *settings]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The library, compiled once."""
    directory = tmp_path_factory.mktemp("library") / "c"
    return built(directory, "int capsule_program;", "-O0", "-shared", "-fPIC", change=None)


def printed_by(library: Path, source: Path) -> str:
    """Output of a program that links the library."""
    program = source.with_suffix("")
    command = ["cc", "-std=c99", f"-I{LIBRARY}", f"-I{KERNELS}", source, library, "-o", program]
    subprocess.run([*command, "-lm", f"-Wl,-rpath,{library.parent}"], check=True)
    ran = subprocess.run([program], capture_output=True, text=True, check=True, timeout=60)
    return ran.stdout


@pytest.mark.long
def test_a_users_program_builds_and_runs(tmp_path: Path, library: Path) -> None:
    source = shutil.copy(EXAMPLE, tmp_path)
    check_example(printed_by(library, Path(source)))


@pytest.mark.long
def test_make_builds_and_runs_a_users_program(tmp_path: Path) -> None:
    check_example(make("example", tmp_path))


def check_example(text: str) -> None:
    printed = re.search(r"progression per period (\S+)", text)
    motion = simulate(Parameters(), periods=120, backend="numpy").steady()
    assert printed
    assert motion
    assert float(printed[1]) == pytest.approx(motion.progression, abs=1e-9)


@pytest.mark.long
@pytest.mark.skipif(shutil.which("clang") is None or shutil.which("gcc") is None, reason="no clang")
def test_the_test_set_is_clean_under_compilers_and_sanitizers(tmp_path: Path) -> None:
    assert make("check", tmp_path).count(" 0 left open") == 14


@pytest.mark.long
@pytest.mark.skipif(
    shutil.which("aarch64-linux-gnu-gcc") is None or shutil.which("qemu-aarch64") is None,
    reason="no compiler for ARM 64, or no emulator",
)
def test_the_test_set_passes_on_arm(tmp_path: Path) -> None:
    assert make("check-arm", tmp_path).count(" 0 left open") == 2


@pytest.mark.long
@pytest.mark.skipif(
    find_spec("ziglang") is None or shutil.which("node") is None,
    reason="no compiler for WebAssembly, or no node",
)
def test_the_test_set_passes_as_webassembly(tmp_path: Path) -> None:
    assert make("check-wasm", tmp_path, f"PYTHON={sys.executable}").count(" 0 left open") == 1


PROGRAM = """
#include <stdio.h>
#include "capsule.h"
int main(void)
{
    enum { RUNS = 120, PERIODS = 30 };
    static capsule_map map;
    static capsule_workspace workspace;
    static capsule_parameters rows[RUNS];
    static capsule_state states[RUNS];
    static int8_t stops[RUNS];
    for (int i = 0; i < RUNS; i++) {
        rows[i] = (capsule_parameters){0.016 * (i + 1), 0.8, 0.02, 0.05, 1.5, 3.3, 1};
        capsule_map_remake(&rows[i], &map);
        states[i] = capsule_state_at(&map, 0, 0, 0, 0);
        if (i == RUNS - 1) { /* v_c would vanish at 0.3, 0.6 and 1.1: within one expansion */
            rows[i].alpha = 3.01;
            rows[i].delta = 50;
            capsule_map_remake(&rows[i], &map);
            states[i] = capsule_state_at(&map, 0.41877449, 1.76297973, 0.02, 4.8771432);
        }
        capsule_state alone = states[i];
        static capsule_event events[1000];
        const capsule_request request = {.events = events, .room = 1000};
        capsule_outcome open;
        size_t count = 0;
        capsule_run(&map, &alone, PERIODS, &request, &count, &open);
        printf("%zu %.9f %.9f ", count, alone.x_r, alone.v_c);
    }
    static double strobe[RUNS * (PERIODS + 1)][3];
    const capsule_batch many = {
        .stride = 1, .parameters = rows, .states = states, .stops = stops, .strobe = strobe};
    capsule_run_many(&many, RUNS, PERIODS, &workspace);
    printf("|");
    for (int i = 0; i < RUNS; i++)
        printf(" %.9f %.9f %.9f", strobe[i * (PERIODS + 1) + 1][0], states[i].x_r, states[i].v_c);
    return 0;
}
"""


def test_what_is_not_allowed_is_refused_and_work_has_a_limit(library: Path) -> None:
    program = library.parent / "check"
    command = ["cc", "-std=c99", f"-I{LIBRARY}", f"-I{KERNELS}", Path(__file__).parent / "check.c"]
    linked = [library, "-lm", f"-Wl,-rpath,{library.parent}"]
    subprocess.run([*command, *linked, "-o", program], check=True)
    ran = subprocess.run([program, "refused"], capture_output=True, text=True, timeout=60)
    assert (ran.returncode, ran.stderr) == (0, "")


def test_no_symbol_without_the_prefix(library: Path) -> None:
    listed = subprocess.run(
        ["nm", "-gD", "--defined-only", library], capture_output=True, text=True
    )
    names = [line.split()[-1] for line in listed.stdout.splitlines()]
    assert "capsule_run" in names
    assert [n for n in names if not n.startswith(("capsule_", "_init", "_fini"))] == []


def test_a_program_counts_the_switches_of_the_reference(tmp_path: Path, library: Path) -> None:
    (tmp_path / "program.c").write_text(PROGRAM)
    alone, _, beside = printed_by(library, tmp_path / "program.c").partition("|")
    rows = alone.split()
    counts = [int(count) for count in rows[::3]]
    finals = [float(value) for value in beside.split()]
    assert finals[1::3] == pytest.approx([float(x) for x in rows[1::3]], abs=1e-8)
    assert finals[2::3] == pytest.approx([float(v) for v in rows[2::3]], abs=1e-8)
    for i in (20, 60, 90, 110):
        run = simulate(Parameters(alpha=0.016 * (i + 1)), periods=30, backend="numpy")
        assert counts[i] == sum(bool(s.target) for s in run.segments)
