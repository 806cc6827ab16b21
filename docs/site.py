"""Put the built documentation beside that of other versions, ready for any web server.

The folder holds one folder a version, `versions.json`, and a front page that
leads to the newest release. No page needs another host.
"""

import json
import shutil
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
FRONT = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>capsule-sym</title>
<meta http-equiv="refresh" content="0; url={version}/index.html">
<p><a href="{version}/index.html">capsule-sym {version}</a></p></html>
"""


def order(version: str) -> tuple[int, ...]:
    """Numbers of a version such as 0.10.1, to sort by."""
    return tuple(int(part) for part in version.split("."))


def publish(html: Path, site: Path, version: str) -> list[str]:
    """Copy the pages to the folder of their version; the versions there, newest first."""
    shutil.rmtree(site / version, ignore_errors=True)
    shutil.copytree(html, site / version, ignore=shutil.ignore_patterns(".doctrees", ".buildinfo*"))
    folders = [path.parent.name for path in site.glob("*/index.html")]
    versions = sorted(folders, key=order, reverse=True)
    (site / "versions.json").write_text(json.dumps(versions), encoding="utf-8")
    (site / "index.html").write_text(FRONT.format(version=versions[0]), encoding="utf-8")
    return versions


if __name__ == "__main__":
    with (ROOT / "pyproject.toml").open("rb") as file:
        named = tomllib.load(file)["project"]["version"]
    target = Path(sys.argv[1])
    print(f"{target}: {', '.join(publish(ROOT / 'docs/_build/html', target, named))}")
