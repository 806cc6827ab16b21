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
        ("verify --write a.md", "verify --out a.md", "--write is now --out"),
        ("enclose --seconds 9", "enclose --max-seconds 9", "--seconds is now --max-seconds"),
        (
            "attractors --count=9 --along f-b=1:2:3",
            "attractors --starts=9 --f-b 1:2:3",
            "--count is now --starts, --along f-b=1:2:3 is now --f-b 1:2:3",
        ),
        (
            "orbit --box 1 1 1 --along alpha 0 1",
            "orbit --box 1 1 1 --along alpha=0:1",
            "--along alpha 0 1 is now --along alpha=0:1",
        ),
        ("orbit --along alpha=0:1 --json", "orbit --along alpha=0:1 --json", ""),
        (
            "branch --parameter s --from -1 --to 2 --json",
            "branch --along s=-1:2 --json",
            "--parameter s --from -1 --to 2 is now --along s=-1:2",
        ),
        (
            "branch --restart a.json PD1 --parameter zeta --to 0.1",
            "branch --restart a.json PD1 --to zeta=0.1",
            "--parameter zeta --to 0.1 is now --to zeta=0.1",
        ),
        (
            "pulse --most-periods 3 --tolerance mu 0.1",
            "pulse --max-periods 3 --tolerance mu=0.1",
            "--most-periods is now --max-periods, --tolerance mu 0.1 is now --tolerance mu=0.1",
        ),
        ("design --tolerance mu=0.1 --json", "design --tolerance mu=0.1 --json", ""),
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
