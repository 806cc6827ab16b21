"""`make lines` and `make contract`: counts of small trees that are known."""

import re
import subprocess
from pathlib import Path

import pytest

from benchmarks import houses, lines

PYTHON = '''"""Docstring
of a module."""

import os  # 1


def one(
    a: int,
) -> str:
    """Docstring."""
    # A comment.
    return """2
    3"""
'''
TEXTS = {
    "a.py": (PYTHON, 6),
    "a.c": ("/* of\n two */\nint a; // one\n\n// none\nint b; /* c */\n", 2),
    "a.pyx": ("# none\ncdef int a\n\n", 1),
    "a.toml": ("# none\na = 1\n[b]\n", 2),
    "a.md": ("none\n", 0),
}


@pytest.mark.parametrize("name", TEXTS)
def test_lines_of_code_have_no_comment_docstring_or_blank(name: str, tmp_path: Path) -> None:
    text, count = TEXTS[name]
    (tmp_path / name).write_text(text)
    assert lines.count(tmp_path / name) == count


def test_files_under_version_control_are_counted_by_package(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lines, "ROOT", tmp_path)
    for name in ("tool/a.py", "tool/inner/a.py", "tool/inner/deep/a.toml", "tool/inner/other.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(TEXTS[Path(name).name.replace("other", "a")][0])
    (tmp_path / "tool/link").symlink_to("inner")
    added = ["tool/a.py", "tool/inner/a.py", "tool/inner/deep/a.toml", "tool/link"]
    for command in (["init", "-q"], ["add", *added]):
        subprocess.run(["git", *command], cwd=tmp_path, check=True)
    found = lines.by_package("tool")
    assert found == {"tool": {"code": 6}, "tool/inner": {"code": 6, "toml": 2}}


def test_every_count_is_printed_beside_its_goal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lines, "files", lambda *folders: iter([Path(lines.__file__)]))
    lines.main()
    table = capsys.readouterr().out.rpartition("\n\n")[2]
    for row in lines.rows():
        assert re.search(rf"^{row.what} +{row.now:,} +{row.goal:,}( +over)?$", table, re.M)


def test_targets_of_make_are_phony_and_few() -> None:
    text = (lines.ROOT / "Makefile").read_text(encoding="utf-8")
    (phony,) = re.findall(r"^\.PHONY: (.*)$", text, re.M)
    assert sorted(phony.split()) == sorted(lines.targets())
    assert len(lines.targets()) <= 20


def test_a_class_has_a_name_of_its_own() -> None:
    assert [name for name, number in lines.classes().items() if number > 1] == []


def test_only_listed_private_modules_are_imported() -> None:
    assert houses.faults() == []


@pytest.mark.parametrize(
    ("text", "modules"),
    [
        ("from capsule_sym import simulate, __version__", []),
        ("import capsule_sym\nimport capsule\nfrom . import a", []),
        ("from capsule_sym import _files", ["capsule_sym._files"]),
        ("from capsule_sym._files import whole", ["capsule_sym._files"]),
        ("def f():\n    import capsule_sym._files", ["capsule_sym._files"]),
        ("from capsule_sym._map import Segment", ["capsule_sym._map"]),
        ("from capsule_sym._map import simulate", ["capsule_sym._map"]),
        ("from capsule_sym._commands import options", ["capsule_sym._commands.options"]),
    ],
)
def test_a_private_module_is_seen(text: str, modules: list[str]) -> None:
    assert [*houses.imported(text)] == modules


def test_what_is_not_listed_and_what_nobody_imports_are_faults(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(houses, "ROOT", tmp_path)
    monkeypatch.setattr(houses, "private_modules", lambda: {"capsule_sym._new": ["paper/a.py"]})
    found = sorted(houses.faults())
    assert found[0] == "capsule_sym._cli is listed, and nobody imports it"
    assert "capsule_sym._new is not listed: paper/a.py" in found


def test_an_exported_name_without_a_user_is_a_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(houses, "ROOT", tmp_path)
    for name, text in {
        "capsule_sym/_map/face.py": "# imported to be exported\nfrom x import a, b, c as d\n",
        "paper/one.py": "from capsule_sym._map.face import a\nfrom capsule_sym._map import face\n",
        "benchmarks/two.py": "from capsule_sym._map import face as here\nhere.b()\n",
        "benchmarks/three.py": "from capsule_sym._orbits.face import c\nface.d()\n",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert houses.unused_exports() == ["capsule_sym._map.face.d"]
