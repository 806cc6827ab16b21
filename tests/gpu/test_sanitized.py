"""The device source under AddressSanitizer and UBSan, in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.gpu.host import COMPILER
from tests.native import ROOT

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(COMPILER is None, reason="no C++ compiler here"),
    pytest.mark.skipif(sys.platform != "linux", reason="the sanitizer has to be loaded first"),
]
PROGRAM = """
from capsule_sym._native import core_of
from capsule_sym._native.device import source
from capsule_sym._native.on_card import OnCard
from capsule_sym._parameters import as_scene
from tests.gpu.host import Host, compiled
from tests.gpu.test_motions import ends_of, motions_of
from tests.gpu.test_runs import drawn, run
sanitized = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-DBLOCK=32", "-g")
for name, change in {runs}:
    scene = as_scene(name)
    text = source(scene)
    if change:
        assert text.count(change[0]) == 1
        text = text.replace(*change)
    device = OnCard(core_of(scene), scene, Host(compiled(text, *sanitized)))
    run(device, drawn(name, 150, 10))
    motions_of(device, ends_of(name, 150, 10))
    print("ran", name)
"""


def sanitized(*runs: tuple[str, tuple[str, str] | None]) -> subprocess.CompletedProcess[str]:
    assert COMPILER is not None
    found = subprocess.run(
        [COMPILER, "-print-file-name=libasan.so"], capture_output=True, text=True, check=True
    )
    return subprocess.run(
        [sys.executable, "-c", PROGRAM.format(runs=runs)],
        cwd=ROOT,
        env={
            **os.environ,
            "LD_PRELOAD": found.stdout.strip(),
            "ASAN_OPTIONS": "detect_leaks=0",
            "PYTHONMALLOC": "malloc",
        },
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def test_no_run_reads_or_writes_what_is_not_its_own() -> None:
    done = sanitized(("capsule", None), ("prototype", None))
    assert done.stdout.splitlines() == ["ran capsule", "ran prototype"], done.stderr[-3000:]


def test_a_thread_beyond_the_last_run_is_noticed() -> None:
    done = sanitized(("capsule", ("if (i >= count || stops[i]", "if (stops[i]")))
    assert done.returncode != 0
    assert "heap-buffer-overflow" in done.stderr
