"""Processor time of what a newcomer waits for: the installation, a scene of one's own, the paper.

Times of processes and of all that they start, in seconds of a machine on which DOP853 in C takes
30 microseconds a period, so that figures of different machines can be compared.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from zipfile import ZipFile

from benchmarks.speed.goals import Goal
from benchmarks.speed.model import Start
from benchmarks.speed.peers import compiled
from capsule_sym import Parameters

ROOT = Path(__file__).parents[2]
_PERIODS = 2000  # of the integration that measures the machine, some 50 ms
_MACHINE = 30e-6
"""Seconds a period of DOP853 in C at 1e-13 on the machine of the goals."""
_CODE = (".so", ".so.1", ".pyd", ".dll")
_SCENE = ROOT / "tests" / "scenes" / "two_stops.py"
_RUN = (
    "from capsule_sym import scenes, simulate; "
    "assert simulate(scenes.load('two_stops').Parameters(), periods=1).backend == 'c'"
)


def goals(paper: bool) -> Iterator[Goal]:
    """Figures beside what they have to be; with `paper` those of `python -m paper` too."""
    unit, share = "s of the machine of the goals", _MACHINE / _of_machine()
    with TemporaryDirectory() as name:
        folder = Path(name)
        made, wheels = folder / "source", folder / "wheels"
        _copy(made)
        build = ("-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation", "-w")
        taken = _processor_time(*build, str(folder / "first"), ".", at=made)
        yield Goal("pip install . from source, without downloads", taken * share, unit, "<=", 60.0)
        _processor_time(*build, str(wheels), "-C", "cmake.define.CAPSULE_CORES=all", ".", at=made)
        (wheel,) = wheels.glob("*.whl")
        with ZipFile(wheel) as packed:
            sizes = [one.compress_size for one in packed.infolist() if one.filename.endswith(_CODE)]
        yield Goal("compiled code in its wheel, all scenes", sum(sizes) / 1e6, "MB", "<=", 1.5)
        shutil.unpack_archive(wheel, folder / "installed", "zip")
        taken = _own_scene(folder / "installed", folder / "own")
        yield Goal("a scene of one's own to its first run in C", taken * share, unit, "<=", 35.0)
        if paper:
            taken = _processor_time("-m", "paper", at=_empty(folder / "paper"))
            yield Goal("python -m paper, all from nothing", taken * share, unit, "<=", 170.0)


def _of_machine() -> float:
    """Seconds a period of DOP853 in C at 1e-13, which looks inside its steps."""
    run, start = compiled.dop853(1e-13, True), Start(Parameters(), (0.0, 0.0, 0.0), _PERIODS)
    run([start])  # compiles it
    begun = process_time()
    run([start])
    return (process_time() - begun) / _PERIODS


def _copy(folder: Path) -> None:
    """The files under version control alone: nothing that was built is found."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, stdout=subprocess.PIPE, check=True)
    for name in filter(None, listed.stdout.decode().split("\0")):
        (target := folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, target, follow_symlinks=False)


def _own_scene(installed: Path, folder: Path) -> float:
    """Processor seconds of a scene's derivation, compilation and first run in an empty folder.

    On the path is a compiler alone, neither CMake nor Cython.
    """
    shutil.copy(_SCENE, _empty(folder))
    tools = _empty(folder / "tools")
    for name in ("cc", "as", "ld"):
        (tools / name).symlink_to(str(shutil.which(name)))
    path = os.pathsep.join([str(installed), sysconfig.get_path("purelib")])
    environment = {"PATH": str(tools), "PYTHONPATH": path}
    words = ("-S", "-m", "capsule_sym.codegen", "--scene", _SCENE.name, "--core")
    taken = _processor_time(*words, at=folder, environment=environment)
    return taken + _processor_time("-S", "-c", _RUN, at=folder, environment=environment)


def _empty(folder: Path) -> Path:
    folder.mkdir()
    return folder


def _processor_time(*words: str, at: Path, environment: Mapping[str, str] | None = None) -> float:
    """Processor seconds of Python with these words, and of the processes that it starts."""
    begun = _of_children()
    if environment is None:
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
    # The output is shown where the process fails.
    done = subprocess.run(
        [sys.executable, *words], cwd=at, env=environment, capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)}: {done.stdout}{done.stderr}")
    return _of_children() - begun


def _of_children() -> float:
    import resource  # not on Windows

    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
