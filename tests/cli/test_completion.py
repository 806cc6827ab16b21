"""Completion in a shell, by the script of `_CAPSULE_SYM_COMPLETE`."""

import os
import shutil
import subprocess
import sys

import pytest


def asked(instruction: str, words: str = "") -> subprocess.CompletedProcess[str]:
    """Answer of the program to a shell that completes the last of the words."""
    environment = {
        "_CAPSULE_SYM_COMPLETE": instruction,
        "COMP_WORDS": words,
        "COMP_CWORD": str(words.count(" ")),
    }
    return subprocess.run(
        [sys.executable, "-m", "capsule_sym"],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        check=False,
    )


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ("capsule-sym sw", {"sweep"}),
        ("capsule-sym sweep --p", {"--params", "--periods"}),
        ("capsule-sym run --backend n", {"numpy"}),
        ("capsule-sym verify --o", {"--only", "--out"}),
    ],
)
def test_commands_options_and_values_are_completed(words: str, found: set[str]) -> None:
    done = asked("bash_complete", words)
    assert (done.returncode, done.stderr) == (0, "")
    assert {line.split(",")[1] for line in done.stdout.splitlines()} == found


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_takes_the_script() -> None:
    script = asked("bash_source").stdout
    told = subprocess.run(
        ["bash", "-c", f"{script}\ncomplete -p capsule-sym"], capture_output=True, text=True
    )
    assert told.returncode == 0, told.stderr
    assert "_capsule_sym_completion" in told.stdout


def test_a_shell_that_is_not_known_is_refused() -> None:
    done = asked("csh_source")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(
        "error: _CAPSULE_SYM_COMPLETE = 'csh_source': must be bash_source"
    )
    assert done.stderr.count("\n") == 1
