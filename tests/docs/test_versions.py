"""The folder of all versions of the documentation."""

import importlib.util
import json
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_versions_stand_side_by_side(tmp_path: Path) -> None:
    """A new version leaves the older ones, and is listed in the order of its numbers."""
    spec = importlib.util.spec_from_file_location("site_of_versions", ROOT / "docs" / "site.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    html, site = tmp_path / "html", tmp_path / "site"
    html.mkdir()
    (html / "index.html").write_text("first", encoding="utf-8")
    (html / "gone.html").write_text("first", encoding="utf-8")
    assert script.publish(html, site, "0.9.0") == ["0.9.0"]
    assert script.publish(html, site, "0.10.0") == ["0.10.0", "0.9.0"]
    (html / "gone.html").unlink()
    assert script.publish(html, site, "0.9.0") == ["0.10.0", "0.9.0"]
    assert not (site / "0.9.0" / "gone.html").exists()
    assert (site / "0.10.0" / "gone.html").exists()
    assert json.loads((site / "versions.json").read_text("utf-8")) == ["0.10.0", "0.9.0"]
    assert 'href="0.10.0/index.html"' in (site / "index.html").read_text("utf-8")
