import gc
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

import capsule_sym._symbolic  # noqa: F401 - before anything imports SymPy
from capsule_sym._cli import main
from tests.sampling import ALL, many
from tests.scenes import Integrator, integrator
from tests.standing import *  # noqa: F403 (hooks)

# Imported and collected objects stay to the end. Searching them again and again for what is no
# longer referred to took a tenth of the time of all tests.
gc.disable()

# A shell that runs the tests in the background lets them, and what they start, ignore Ctrl-C.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

Command = Callable[..., subprocess.CompletedProcess[str]]

# Wall-clock limits on single examples depend on the load of the machine, not on the code.
# Quick runs always try the same few examples; `make test-long` tries others each time.
settings.register_profile(
    "capsule-sym", deadline=None, derandomize=not ALL, max_examples=many(100, 25)
)
settings.load_profile("capsule-sym")


def call(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "capsule_sym", *arguments],
        capture_output=True,
        encoding="utf-8",
        check=False,
        cwd=cwd,
    )


@pytest.fixture(scope="session")
def judge(tmp_path_factory: pytest.TempPathFactory) -> Integrator:
    """The integrator of the equations of motion alone, compiled."""
    return integrator(tmp_path_factory.mktemp("judge"))


@pytest.fixture(scope="session")
def command() -> Command:
    """Runs `capsule-sym` as a process of its own."""
    return call


@pytest.fixture
def inside(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Command:
    """Runs `capsule-sym` within this process, where a process of its own would show no more."""

    def run(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
        if cwd is not None:
            monkeypatch.chdir(cwd)
        capsys.readouterr()
        with pytest.raises(SystemExit) as stopped:
            main(arguments)
        assert isinstance(stopped.value.code, int)
        return subprocess.CompletedProcess(arguments, stopped.value.code, *capsys.readouterr())

    return run


# Data that tests derive once in a process, such as the model in SymPy, are not derived by both
# workers: a file, and all of these folders, is run by one of them. The longest begin.
TOGETHER = ("tests/symbolic/", "paper/tests/claims/", "tests/orbits/")
FIRST = (
    "tests/symbolic/",
    "paper/tests/test_paper.py",
    "paper/tests/claims/",
    "tests/figures/",
    "tests/orbits/",
    "tests/test_packaging.py",
)


class Together(LoadScopeScheduling):
    """Gives a file, or a folder of `TOGETHER`, to one worker."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return next((name for name in TOGETHER if file.startswith(name)), file)


@pytest.hookimpl(optionalhook=True)  # pytest-xdist may be switched off
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Together | None:
    return Together(config, log) if config.getoption("dist") == "loadscope" else None


def pytest_collection_finish() -> None:
    gc.freeze()
    # Cycles that tests leave behind are looked for after so many new objects, for the default is
    # meant for programs that make few: it took one part in 25 of the time of all tests.
    gc.set_threshold(50_000)
    gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    def place(item: pytest.Item) -> int:
        return next((i for i, name in enumerate(FIRST) if item.nodeid.startswith(name)), len(FIRST))

    items.sort(key=place)
