"""The help in two parts."""

import re

from capsule_sym._cli import group


def test_help_has_everyday_commands_first_and_the_others_apart(inside) -> None:
    everyday, others = inside("--help").stdout.split("For reviewers and developers:\n")
    found = [re.findall(r"^  ([a-z][a-z-]+)  +[A-Z].*\.$", one, re.M) for one in (everyday, others)]
    assert found[0] + found[1] == list(group.commands)
    assert found[0][:4] == ["run", "orbit", "branch", "curve"]
    assert set(found[1]) == {"verify"}
