"""A run of tests that stands still ends and fails, wherever it stands."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.examples import ROOT

STANDS = "import time; time.sleep(1000)"
WHERE = {
    "test": f"def test() -> None:\n    {STANDS}",
    "teardown": f"""import pytest
@pytest.fixture
def late():
    yield
    {STANDS}
def test(late) -> None:
    raise ValueError
""",
    "end": "def test() -> None: ...",
}
CONFTEST = f"""from tests.standing import *
def pytest_unconfigure(config):
    if hasattr(config, "workerinput") == WORKER:
        {STANDS}
"""


@pytest.mark.long
@pytest.mark.parametrize("where", WHERE)
@pytest.mark.parametrize("beside", [0, 1])
def test_what_stands_still_ends_and_fails(where: str, beside: int, tmp_path: Path) -> None:
    conftest = CONFTEST.replace("WORKER", str(bool(beside)))
    (tmp_path / "conftest.py").write_text(conftest if where == "end" else CONFTEST.split("\n")[0])
    (tmp_path / "test_it.py").write_text(WHERE[where])
    command = [sys.executable, "-m", "pytest", "-n", str(beside), "--dist", "worksteal"]
    command += ["-o", "faulthandler_timeout=3", "-o", "faulthandler_exit_on_timeout=true"]
    command += ["-c", "none.ini", "-o", f"pythonpath={ROOT}", "--max-worker-restart", "1"]
    (tmp_path / "none.ini").write_text("")
    done = subprocess.run(command, capture_output=True, cwd=tmp_path, timeout=90, check=False)
    assert done.returncode != 0
    assert b"Timeout (0:00:03)!" in done.stderr
