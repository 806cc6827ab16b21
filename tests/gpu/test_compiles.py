"""The device source by NVRTC, which compiles it for a card without one."""

from __future__ import annotations

import re

import pytest

from capsule_sym._native.cuda import _STACK
from capsule_sym._native.device import BASICS, BLOCK, COMPILED, OPTIONS, source
from capsule_sym._parameters import SHIPPED, as_scene
from tests.gpu.nvrtc import compiled, kernels, library

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(library() is None, reason="no nvidia-cuda-nvrtc-cu12 here"),
]
BY_CUPY = "--device-as-default-execution-space"
REGISTERS = 65536
"""Registers of a multiprocessor of compute capability 9.0, of which a thread has 255 at most."""


@pytest.mark.parametrize("scene", SHIPPED)
def test_it_compiles_for_a_card(scene: str) -> None:
    text = BASICS + source(as_scene(scene))
    found = {}
    for part in ((), ("-DTABLES",), ("-DORBITS",)):
        options = (*OPTIONS, BY_CUPY, "--gpu-architecture=sm_90", "--ptxas-options=-v", *part)
        binary, log = compiled(text, options)
        assert binary.startswith(b"\x7fELF")
        found |= kernels(log)
    assert set(found) == {"capsule_sizes", "capsule_starts", "capsule_runs", *COMPILED}
    for name, figures in found.items():
        print(f"{scene} {name}: {figures}")  # `make gpu-check` shows them
        assert figures.stack <= _STACK
    for name in ("capsule_runs", "capsule_motions", "capsule_orbits"):
        assert found[name].registers * 2 * BLOCK <= REGISTERS  # two blocks at a time


def test_cupy_has_all_that_it_needs_to_compile_and_adds_no_other_standard() -> None:
    """It raises RuntimeError without headers of CUDA, of which the source needs none."""
    given = pytest.importorskip("cupy")._core.core.assemble_cupy_compiler_options(OPTIONS)
    assert set(OPTIONS) < set(given)
    assert [option for option in given if "std=" in option] == ["--std=c++20"]


def test_the_compiler_fuses_nothing_that_is_not_written() -> None:
    """`mul.f64` and `add.f64` without .rn may be contracted; all of them have it."""
    options = (*OPTIONS, BY_CUPY, "--gpu-architecture=compute_90")
    text = compiled(BASICS + source(as_scene("capsule")), options, "PTX")[0].decode()
    assert len(re.findall(r"\bfma\.rn\.f64", text)) > 1000
    assert len(re.findall(r"\bmul\.rn\.f64", text)) > 1000
    assert re.findall(r"\b(?:mul|add|sub|mad)\.f64", text) == []
