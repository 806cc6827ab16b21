"""Old spellings: accepted, with one notice on stderr; and the help in two parts."""

import re

import pytest

from capsule_sym._cli import group
from capsule_sym._commands.renamed import renewed


@pytest.mark.parametrize(
    ("line", "now", "notice"),
    [
        ("diagram a.json --out a.svg", "figure a.json --out a.svg", "diagram is now figure"),
        ("sweep-figure s --as chart", "figure s --as chart", "sweep-figure is now figure"),
        ("sweep a.toml --store s", "sweep a.toml --out s", "--store is now --out"),
        ("basin --store=s --json", "basin --out=s --json", "--store is now --out"),
        ("sweep a.toml -- --store", "sweep a.toml -- --store", ""),
        ("figure diagram --out --store", "figure diagram --out --store", ""),
        ("", "", ""),
    ],
)
def test_an_old_spelling_is_renewed(line: str, now: str, notice: str) -> None:
    words, told = renewed(line.split())
    assert words == now.split()
    assert told == (f"{notice}; version 0.3 drops the old spelling" if notice else "")


def test_a_notice_is_one_line_on_stderr(inside) -> None:
    done = inside("diagram", "none.json", "--out", "a.svg")
    assert (done.returncode, done.stdout) == (2, "")
    notice, error = done.stderr.splitlines()
    assert notice == "note: diagram is now figure; version 0.3 drops the old spelling"
    assert error.startswith("error: ")


def test_help_has_everyday_commands_first_and_the_others_apart(inside) -> None:
    everyday, others = inside("--help").stdout.split("For reviewers and developers:\n")
    found = [re.findall(r"^  ([a-z][a-z-]+)  +[A-Z].*\.$", one, re.M) for one in (everyday, others)]
    assert found[0] + found[1] == list(group.commands)
    assert found[0][:4] == ["run", "orbit", "branch", "curve"]
    assert set(found[1]) == {"paper", "report", "verify", "enclose", "bench"}
