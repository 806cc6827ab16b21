"""No command line ends in a traceback: its status has a meaning, and one line gives the reason."""

import json
import os
import re
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, find, given, settings

from capsule_sym._cli import group
from tests.cli import fuzz
from tests.cli.fuzz import command_lines, commands, prepare, run_in_copy, words_of
from tests.examples import ROOT

_BUDGET = 0.3  # seconds after which a command is interrupted
_PARTS = 8  # of the long test, so that no part takes minutes
_COUNT = int(os.environ.get("CAPSULE_SYM_FUZZ", "1000"))
_ANYHOW: dict[str, Any] = {
    "deadline": None,
    "suppress_health_check": list(HealthCheck),
    "database": None,
}
_ONE = settings(max_examples=1, phases=[Phase.generate], **_ANYHOW)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    path = tmp_path_factory.mktemp("fuzz") / "folder"
    path.mkdir()
    with pytest.MonkeyPatch.context() as patch:
        prepare(path, patch)
        yield path


def check(folder: Path, line: list[str]) -> None:
    with warnings.catch_warnings():
        # A user sees warnings as lines on stderr.
        warnings.simplefilter("default")
        for hidden in (DeprecationWarning, PendingDeprecationWarning, ResourceWarning):
            warnings.simplefilter("ignore", hidden)
        ended = run_in_copy(folder, line, _BUDGET)
    assert ended.problem() is None, f"{line}: {ended.problem()}\n{ended.err}"
    if ended.status == 0 and "--json" in line:
        json.loads(ended.out)


def test_the_page_of_the_command_line_names_every_status() -> None:
    page = (ROOT / "docs" / "cli" / "index.md").read_text(encoding="utf-8")
    named = set(map(int, re.findall(r"^\| (\d+) \|", page, re.M)))
    assert fuzz.ENDS | {fuzz.NOT_PROVED, fuzz.INTERRUPTED} < named


@pytest.mark.long
def test_every_option_of_every_command_is_tried() -> None:
    assert set(commands()) == {*group.commands}
    assert all(command.params for command in commands().values())
    for command in commands().values():
        for parameter in command.params:
            words = find(words_of(parameter), bool, settings=_ONE)
            assert words[0] in parameter.opts or parameter.param_type_name == "argument"


@settings(max_examples=20, derandomize=True, phases=[Phase.generate], **_ANYHOW)
@given(line=command_lines())
def test_twenty_command_lines(folder: Path, line: list[str]) -> None:
    check(folder, line)


@pytest.mark.long
def test_another_declaration_is_refused_after_the_theory_of_the_paper(folder: Path) -> None:
    check(folder, ["verify", "--only", "erratum"])
    check(folder, ["verify", "--scene", "sweep.toml"])


@pytest.mark.long
@pytest.mark.parametrize("part", range(_PARTS))
@settings(max_examples=-(-_COUNT // _PARTS), **_ANYHOW)
@given(line=command_lines())
def test_thousands_of_command_lines(folder: Path, part: int, line: list[str]) -> None:
    check(folder, line)


@pytest.mark.parametrize(
    ("line", "status"),
    [
        (["run", "--gamma", "5e-324", "--periods", "1"], None),
        (["sweep", "not.toml", "--out", "new"], 2),
        *(
            pytest.param(line.split(), 2, marks=pytest.mark.long)
            for line in (
                "sweep sweep.toml --out sweep.toml/below",
                "basin --out new --x-r 0 nan 3",
                "figure folder --out folder/.svg",
            )
        ),
    ],
)
def test_a_process_ends_the_same_way(folder: Path, line: list[str], status: int | None) -> None:
    program = [sys.executable, "-m", "capsule_sym", *line]
    done = subprocess.run(program, capture_output=True, text=True, cwd=folder, check=False)
    assert done.returncode in ((0, 2, 3) if status is None else (status,))
    assert done.stderr.count("\n") == (1 if done.returncode else 0)
