"""The gateways, compiled once for all tests in Octave."""

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.examples import ROOT
from tests.octave.test_octave import GATEWAYS, PAGE


@pytest.fixture(scope="session")
def gateways(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The gateways compiled, as on the page, against installed libraries of two scenes."""
    if not all(map(shutil.which, ("cmake", "mkoctfile"))):
        pytest.skip("no CMake, or no mkoctfile")
    folder = tmp_path_factory.mktemp("gateways")
    shutil.copytree(ROOT / "capsule_sym", folder / "capsule_sym", symlinks=False)
    shutil.copy(ROOT / "pyproject.toml", folder)
    shutil.copytree(GATEWAYS, folder / GATEWAYS.relative_to(ROOT))
    block = "".join(block for block in PAGE.blocks("sh") if "capsule_build" in block)
    done = subprocess.run(
        ["sh", "-ec", block.replace("PREFIX", "prefix")],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    shutil.rmtree(folder / "prefix")
    return folder
