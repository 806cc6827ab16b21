"""The page's parts under Node: TypeScript's own tests, bundled and run."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from capsule_sym import scenes
from explorer import build

ESBUILD = build.HERE / "node_modules" / ".bin" / "esbuild"
pytestmark = [
    pytest.mark.skipif(shutil.which("node") is None, reason="Node.js is not there"),
    pytest.mark.skipif(not ESBUILD.exists(), reason="esbuild is not installed: make explorer"),
]


def _run(name, folder, scene="capsule"):
    bundle = folder / "tests.mjs"
    options = ["--bundle", "--platform=node", "--format=esm", f"--outfile={bundle}"]
    # As a worker has it: by its name, which is read before anything else.
    options.append(f"--banner:js=globalThis.name = 'scene={scene}';")
    subprocess.run(
        [str(ESBUILD), str(Path(__file__).with_name(name)), *options],
        check=True,
        capture_output=True,
        env=os.environ | {"NODE_PATH": str(build.HERE / "node_modules")},
    )
    done = subprocess.run(
        ["node", "--test", str(bundle)],
        capture_output=True,
        text=True,
        env=os.environ | {"PAGE": str(build.PAGE), "SCENE": scene},
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_units(tmp_path):
    _run("units.test.ts", tmp_path)


@pytest.mark.parametrize("scene", scenes.SHIPPED)
def test_scenes(tmp_path, scene):
    _run("scenes.test.ts", tmp_path, scene)


def test_all_scenes_are_in_the_page():
    assert {*build.SCENES} == {*scenes.SHIPPED}
