"""Commands that are gone, by one line with their new place; and the help in two parts."""

import re

import pytest

from capsule_sym._cli import _MOVED, group


@pytest.mark.parametrize("name", _MOVED)
def test_a_command_that_has_moved_says_where_in_one_line(name: str, inside) -> None:
    for words in ((name,), (name, "--help"), (name, "a.toml", "--out", "b")):
        done = inside(*words)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr == f"error: {name} has moved: {_MOVED[name]}\n"
    assert name not in group.commands


def test_help_has_everyday_commands_first_and_the_others_apart(inside) -> None:
    everyday, others = inside("--help").stdout.split("For reviewers and developers:\n")
    found = [re.findall(r"^  ([a-z][a-z-]+)  +[A-Z].*\.$", one, re.M) for one in (everyday, others)]
    assert found[0] + found[1] == list(group.commands)
    assert found[0][:4] == ["run", "orbit", "branch", "curve"]
    assert set(found[1]) == {"verify"}
