"""The journal paper and the note: every number from a record, every reference known."""

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from collections import Counter
from copy import deepcopy
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "paper" / "article"
CITED = re.compile(r"@([a-z]+\d{4})|\\cite\{([^}]*)\}")


@pytest.fixture(scope="module")
def build() -> ModuleType:
    """The script as a module."""
    spec = importlib.util.spec_from_file_location("article", FOLDER / "build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", ["paper.md.in", "note.tex.in"])
def test_every_reference_is_known(name: str) -> None:
    """Each cited key is in the bibliography, and each entry of it is cited in the paper."""
    known = set(re.findall(r"^@\w+\{(\w+),", (FOLDER / "paper.bib").read_text("utf-8"), re.M))
    found = CITED.findall((FOLDER / name).read_text("utf-8"))
    cited = {key.strip() for a, b in found for key in (a or b).split(",")}
    assert cited <= known
    assert name != "paper.md.in" or cited == known


@pytest.fixture(scope="module")
def records() -> dict[str, Any]:
    """New records of the case study and of the enclosures, and the verdicts."""

    def printed(*command: str) -> dict[str, Any]:
        line = [sys.executable, "-m", *command, "--json"]
        run = subprocess.run(line, cwd=ROOT, check=True, stdout=subprocess.PIPE)
        found: dict[str, Any] = json.loads(run.stdout)
        return found

    proved = (printed("paper", "claims"), printed("capsule_sym", "verify"))
    return {
        "casestudy": printed("paper", "case-study"),
        "enclosed": printed("paper", "enclose"),
        "verdicts": Counter(item["status"] for one in proved for item in one["items"]),
    }


@pytest.mark.long
def test_the_paper_is_that_of_the_records(
    build: ModuleType, records: dict[str, Any], tmp_path: Path
) -> None:
    """The committed paper is what new records give, and LaTeX takes the note."""
    values = build.numbers(**records)
    assert build.rendered("paper.md.in", values) == (FOLDER / "paper.md").read_text("utf-8")
    note = build.rendered("note.tex.in", values)
    assert "<<" not in note
    latex = shutil.which("pdflatex")
    if not latex:
        pytest.skip("pdflatex is missing")
    shutil.copy(ROOT / "docs" / "explorer.png", tmp_path)
    drawn = note.replace("bifurcations.pdf", "explorer.png")
    (tmp_path / "note.tex").write_text(drawn, encoding="utf-8")
    command = [latex, "-interaction=nonstopmode", "-halt-on-error", "note.tex"]
    subprocess.run(command, cwd=tmp_path, check=True, stdout=subprocess.DEVNULL)


@pytest.mark.long
def test_records_that_differ_are_refused(build: ModuleType, records: dict[str, Any]) -> None:
    """A case study that locates another bifurcation, or steps left unproved, end the build."""
    changed = deepcopy(records)
    changed["casestudy"]["bifurcations"]["thresholds"][0]["exact"] += 1e-6
    with pytest.raises(SystemExit, match="the records differ in grazing"):
        build.numbers(**changed)
    changed = deepcopy(records)
    changed["enclosed"]["sections"][1]["intervals"] = []
    with pytest.raises(SystemExit, match="unproved"):
        build.numbers(**changed)


@pytest.mark.long
def test_the_script_writes_the_paper_and_the_note_with_its_figure(
    build: ModuleType, records: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The script finds the records in a folder, and names one that is missing."""
    folder, out = tmp_path / "article", tmp_path / "out"
    shutil.copytree(FOLDER, folder)
    monkeypatch.setattr(build, "HERE", folder)
    monkeypatch.setattr(sys, "argv", ["build", "--records", str(tmp_path), "--out", str(out)])
    (tmp_path / "paper").mkdir()
    items = [{"status": status} for status in records["verdicts"].elements()]
    for name, record in (
        ("paper/casestudy.json", records["casestudy"]),
        ("verify.json", {"items": items}),
    ):
        (tmp_path / name).write_text(json.dumps(record), encoding="utf-8")
    missing = r"enclose\.json is missing: .* enclose --json > .*enclose\.json writes it"
    with pytest.raises(SystemExit, match=missing):
        build.main()
    (tmp_path / "enclose.json").write_text(json.dumps(records["enclosed"]), encoding="utf-8")
    build.main()
    assert (folder / "paper.md").read_bytes() == (FOLDER / "paper.md").read_bytes()
    assert (out / "note.tex").exists()
    assert (out / "bifurcations.pdf").read_bytes().startswith(b"%PDF")
