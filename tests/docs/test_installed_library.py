"""The C library installed: what it shows, and programs built against it alone."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from capsule_sym import simulate
from capsule_sym.scenes import prototype
from tests.examples import ROOT, Page
from tests.native import EXAMPLE, KERNELS, LIBRARY
from tests.native.test_c_library import check_example

sys.path.append(str(ROOT / "docs" / "_extensions"))

PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
CMAKE, PKG_CONFIG = shutil.which("cmake", path=PATH), shutil.which("pkg-config")
PAGE = Page(ROOT / "docs" / "howto" / "c-library.md")

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        CMAKE is None or shutil.which("cc") is None or sys.platform != "linux",
        reason="no CMake, or no C compiler",
    ),
]


def run(*command: str | Path, at: Path, **environment: str) -> str:
    done = subprocess.run(
        [str(word) for word in command],
        cwd=at,
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
        env={**os.environ, "PATH": PATH, **environment},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def install(folder: Path, scene: str, block: str) -> Path:
    """The library of a scene, installed as the page has it but without optimisation, and moved."""
    for name in ("capsule_sym", "pyproject.toml"):
        (folder / name).symlink_to(ROOT / name)
    quick = {"CMAKE_GENERATOR": "Unix Makefiles", "CMAKE_BUILD_TYPE": "Debug", "CFLAGS": "-O0"}
    run("sh", "-ec", block, at=folder, HOME=str(folder), **quick)
    shutil.rmtree(folder / "build")
    return (folder / scene).rename(folder / "moved")


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return install(tmp_path_factory.mktemp("installed"), "capsule", PAGE.blocks("sh")[0])


@pytest.fixture
def program(tmp_path: Path) -> Path:
    """A folder with a user's program and nothing of ours."""
    shutil.copy(EXAMPLE, tmp_path)
    return tmp_path


def found(installed: Path, pattern: str) -> Path:
    (path,) = installed.rglob(pattern)
    return path


@pytest.mark.skipif(PKG_CONFIG is None, reason="no pkg-config")
def test_a_program_is_built_by_pkg_config(installed: Path, program: Path) -> None:
    folder = found(installed, "capsule.pc").parent
    check_example(run("sh", "-ec", PAGE.blocks("sh")[1], at=program, PREFIX=str(installed)))
    needed = run("ldd", "example", at=program)
    soname = re.search(r"libcapsule\.so\.(\d+\.\d+) =>", needed)
    version = run(PKG_CONFIG, "--modversion", "capsule", at=program, PKG_CONFIG_PATH=str(folder))
    assert soname
    assert version.startswith(f"{soname[1]}.")


@pytest.mark.skipif(PKG_CONFIG is None, reason="no pkg-config")
def test_a_program_of_another_scene_is_built_as_the_page_says(tmp_path: Path) -> None:
    prefix = install(tmp_path, "prototype", PAGE.blocks("sh")[2])
    shutil.copy(EXAMPLE.with_name("prototype.c"), tmp_path)
    printed = run("sh", "-ec", PAGE.blocks("sh")[3], at=tmp_path, PREFIX=str(prefix))
    assert printed in PAGE.blocks("text")
    p = prototype.Parameters(alpha=4, D=0.2)
    trajectory = simulate(p, periods=401, backend="numpy")
    segments = [one for one in trajectory.segments if one.start.period >= 400]
    found = re.findall(r"F(\d+) +for ([\d.]+)", printed)
    assert [int(field) for field, _ in found] == [one.field for one in segments]
    durations = [float(one.duration) for one in segments]
    assert [float(duration) for _, duration in found] == pytest.approx(durations, abs=1e-9)
    motion = trajectory.steady()
    assert motion
    assert float(printed.split()[-1]) == pytest.approx(motion.progression, abs=1e-9)


@pytest.mark.parametrize("library", ["capsule", "capsule_static"])
def test_a_program_is_built_by_cmake(installed: Path, program: Path, library: str) -> None:
    (text,) = PAGE.blocks("cmake")
    (program / "CMakeLists.txt").write_text(text.replace("capsule::capsule", f"capsule::{library}"))
    place = f"-DCMAKE_PREFIX_PATH={installed}"
    run(CMAKE, "-S", ".", "-B", "build", "-G", "Unix Makefiles", place, at=program)
    run(CMAKE, "--build", "build", at=program)
    check_example(run("build/example", at=program))
    needed = run("ldd", "build/example", at=program)
    assert ("libcapsule" in needed) == (library == "capsule")


def test_what_it_shows_is_what_the_page_documents(installed: Path) -> None:
    headers = pytest.importorskip("headers", reason="the documentation's extensions need Sphinx")
    library = found(installed, "libcapsule.so")
    listed = run("nm", "-gD", "--defined-only", library, at=installed)
    shown = {line.split()[-1] for line in listed.splitlines()} - {"_init", "_fini", "capsule_core"}
    assert "`capsule_core()` of `capsule_core.h`" in PAGE.text
    documented = {}
    for path in (LIBRARY / "capsule.h", *KERNELS.glob("*.h")):
        if path.name in PAGE.text:
            assert (installed / "include" / "capsule" / path.name).is_file()
            for one in headers.declared(path.read_text(encoding="utf-8")):
                documented |= {name: one.comment for name in one.names if one.functions}
    assert shown == set(documented)
    assert all(len(comment) > 20 for comment in documented.values())
