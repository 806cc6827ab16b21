"""The page's parts under Node: TypeScript's own tests, bundled and run."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from explorer import build

ESBUILD = build.HERE / "node_modules" / ".bin" / "esbuild"


@pytest.mark.skipif(shutil.which("node") is None, reason="Node.js is not there")
@pytest.mark.skipif(not ESBUILD.exists(), reason="esbuild is not installed: make explorer")
def test_units(tmp_path):
    modules = str(build.HERE / "node_modules")
    bundle = tmp_path / "units.mjs"
    source = str(Path(__file__).with_name("units.test.ts"))
    subprocess.run(
        [
            str(ESBUILD),
            source,
            "--bundle",
            "--platform=node",
            "--format=esm",
            f"--outfile={bundle}",
        ],
        check=True,
        capture_output=True,
        env=os.environ | {"NODE_PATH": modules},
    )
    done = subprocess.run(
        ["node", "--test", str(bundle)],
        capture_output=True,
        text=True,
        env=os.environ | {"PAGE": str(build.PAGE)},
    )
    assert done.returncode == 0, done.stdout + done.stderr
