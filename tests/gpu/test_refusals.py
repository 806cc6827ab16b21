"""No card, one without double precision, too little memory, an old driver: one line each."""

from __future__ import annotations

import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from capsule_sym import InvalidInput, Parameters, simulate_many
from capsule_sym._cli import main
from capsule_sym._native.cuda import CudaCard, Facts, card_of, facts_of, refusal
from capsule_sym._parameters import CAPSULE, as_scene

CARD = Facts(1, "", "NVIDIA H200", (9, 0), 132 * 2048, 140 * 2**30, 12090, 12090)


class CudaError(RuntimeError):
    """An error of CUDA's runtime, as CuPy raises it."""


class CompileError(Exception):
    """An error of the compiler, which is no RuntimeError in CuPy."""


def cuda(facts: Facts, error: str = "") -> Any:
    """CuPy's module `cuda`, as on a machine with such a card."""

    def count() -> int:
        if error:
            raise CudaError(error)
        return facts.cards

    major, minor = facts.capability
    properties = {
        "name": facts.name.encode(),
        "major": major,
        "minor": minor,
        "multiProcessorCount": facts.threads // 2048,
        "maxThreadsPerMultiProcessor": 2048,
    }
    return SimpleNamespace(
        runtime=SimpleNamespace(
            CUDARuntimeError=CudaError,
            driverGetVersion=lambda: facts.driver,
            runtimeGetVersion=lambda: facts.toolkit,
            getDeviceCount=count,
            getDeviceProperties=lambda number: properties,
        ),
        Device=lambda: SimpleNamespace(id=0, mem_info=(facts.free, 2 * facts.free)),
        nvrtc=SimpleNamespace(getVersion=lambda: (12, 9)),
        compiler=SimpleNamespace(CompileException=CompileError),
        Stream=lambda **given: nullcontext(),
    )


CASES = {
    "no driver": (
        CARD._replace(cards=0, driver=0),
        "",
        "no card of CUDA is found (there is no driver)",
    ),
    "no card": (CARD._replace(cards=0), "", "no card of CUDA is found"),
    "hidden": (
        CARD._replace(cards=0),
        "cudaErrorNoDevice: no CUDA-capable\ndevice is detected",
        "no card of CUDA is found (cudaErrorNoDevice: no CUDA-capable device is detected)",
    ),
    "single precision": (
        CARD._replace(name="GeForce 8800", capability=(1, 0)),
        "",
        "GeForce 8800, of compute capability 1.0, has no double precision",
    ),
    "small": (
        CARD._replace(free=2**30),
        "",
        "NVIDIA H200 has 1.0 GiB of free memory, and 6.7 GiB are needed",
    ),
    "old driver": (
        CARD._replace(driver=11040),
        "",
        "the driver has CUDA 11.4, which is older than CUDA 12.9 of cupy",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_a_card_that_cannot_compute_is_refused_in_one_line(
    case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    facts, error, reason = CASES[case]
    module = ModuleType("cupy")
    module.cuda = cuda(facts, error)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "cupy", module)
    with pytest.raises(InvalidInput) as raised:
        simulate_many([Parameters()], device="gpu")
    assert str(raised.value) == f"device = 'gpu': must be cpu here: {reason}"


def test_a_card_with_all_that_is_needed_is_accepted() -> None:
    assert facts_of(cuda(CARD)) == CARD
    assert refusal(CARD) == ""
    assert refusal(CARD._replace(driver=12020)) == ""  # of the same first number


def test_the_compiler_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise RuntimeError('Failure finding "libnvrtc.so.12"')

    module = ModuleType("cupy")
    module.cuda = cuda(CARD)  # type: ignore[attr-defined]
    module.cuda.nvrtc.getVersion = missing
    monkeypatch.setitem(sys.modules, "cupy", module)
    with pytest.raises(InvalidInput, match=r"nvidia-cuda-nvrtc-cu12 is missing: pip install"):
        simulate_many([Parameters()], device="gpu")


def test_what_cupy_lacks_to_compile_is_told_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(**given: Any) -> None:
        raise RuntimeError("Failed to find CUDA headers.\nPlease install them.")

    module = ModuleType("cupy")
    module.__dict__.update(cuda=cuda(CARD), RawModule=missing, get_default_memory_pool=list)
    monkeypatch.setitem(sys.modules, "cupy", module)
    with pytest.raises(InvalidInput) as raised:
        simulate_many([Parameters()], device="gpu")
    told = "Failed to find CUDA headers. Please install them."
    assert str(raised.value) == f"device = 'gpu': must be cpu here: {told}"


def test_a_package_that_cannot_be_loaded_is_told_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def broken(name: str) -> None:
        raise ImportError("=====\nlibcuda.so.1: cannot open shared object file\n=====")

    monkeypatch.setattr("capsule_sym._native.cuda.import_module", broken)
    with pytest.raises(InvalidInput, match=r"must be cpu here: =+ libcuda.so.1: cannot .* =+$"):
        simulate_many([Parameters()], device="gpu")


def test_memory_that_cupy_keeps_is_free_for_a_chunk() -> None:
    module = SimpleNamespace(
        cuda=cuda(CARD._replace(free=2**20)),
        get_default_memory_pool=lambda: SimpleNamespace(free_bytes=lambda: 3 * 2**20),
        RawModule=lambda **given: SimpleNamespace(compile=lambda: None),
    )
    assert CudaCard(module, CARD, CAPSULE).free() == 2**20


@pytest.mark.parametrize("error", [CudaError, MemoryError, CompileError])
def test_an_error_of_the_card_in_the_middle_of_work_is_told_in_one_line(error: Any) -> None:
    def failing(*given: Any) -> None:
        raise error("cudaErrorIllegalAddress:\nan illegal memory access")

    of = cuda(CARD)
    of.alloc = failing
    module = SimpleNamespace(
        cuda=of,
        get_default_memory_pool=list,
        RawModule=lambda **given: SimpleNamespace(get_function=lambda name: failing),
    )
    card = CudaCard(module, CARD, CAPSULE)
    told = "must be cpu here: cudaErrorIllegalAddress: an illegal memory access"
    for work in (lambda: card.launch("capsule_runs", 1), lambda: card.put(np.zeros(3))):
        with pytest.raises(InvalidInput, match=told):
            work()


def test_stacks_that_another_scene_has_need_no_more_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A card of 8 GiB has room for stacks once."""
    module = ModuleType("cupy")
    module.__dict__.update(
        cuda=cuda(CARD._replace(free=8 * 2**30)),
        get_default_memory_pool=list,
        RawModule=lambda **given: None,
    )
    monkeypatch.setitem(sys.modules, "cupy", module)
    monkeypatch.setattr("capsule_sym._native.cuda.OnCard", lambda *of: of)
    card_of.cache_clear()
    try:
        card_of(CAPSULE, ModuleType("core"))
        module.cuda = cuda(CARD._replace(free=2 * 2**30))  # type: ignore[attr-defined]
        card_of(as_scene("slope"), ModuleType("core"))
        card_of.cache_clear()
        with pytest.raises(InvalidInput, match=r"2.0 GiB of free memory, and 6.7 GiB are needed"):
            card_of(CAPSULE, ModuleType("core"))
    finally:
        card_of.cache_clear()


@pytest.fixture
def _no_cupy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cupy", None)


@pytest.mark.usefixtures("_no_cupy")
@pytest.mark.parametrize(
    "line",
    [
        ["sweep", "--alpha", "0.1:2:5"],
        ["basin", "--x-r", "-1:1:5"],
        ["attractors", "--x-r", "-1:1"],
        ["attractors", "--x-r", "-1:1", "--alpha", "0.5:1:3"],
    ],
    ids=lambda line: " ".join(line[::2]),
)
def test_a_command_without_the_package_writes_nothing(
    tmp_path: Path, line: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    store = tmp_path / "store"
    with pytest.raises(SystemExit) as ended:
        main([*line, "--out", str(store), "--device", "gpu"])
    assert ended.value.code == 2
    (told,) = capsys.readouterr().err.splitlines()
    assert "cupy is missing: pip install 'capsule-sym[gpu]'" in told
    assert not store.exists()


@pytest.mark.usefixtures("_no_cupy")
@pytest.mark.parametrize(
    "given",
    [
        {"keep": "segments"},
        {"keep": "switches"},
        {"keep": [0.0]},
        {"keep": "stroboscopic", "periods": 8193},
        {"max_segments": 5},
    ],
)
def test_what_a_card_does_not_keep_is_refused_before_it_is_looked_for(given: Any) -> None:
    with pytest.raises(InvalidInput, match="device = 'gpu': must be cpu for segments, switches"):
        simulate_many([Parameters()], device="gpu", **given)


def test_a_cluster_is_refused_beside_a_card(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = ["sweep", "--alpha", "0.1:2:5", "--out", str(tmp_path / "store"), "--dask", "local"]
    with pytest.raises(SystemExit) as ended:
        main([*line, "--device", "gpu"])
    assert ended.value.code == 2
    (told,) = capsys.readouterr().err.splitlines()
    assert "--device and --dask exclude each other" in told
    assert not (tmp_path / "store").exists()


@pytest.mark.parametrize("device", ["GPU", "", None])
def test_another_device_is_refused(device: Any) -> None:
    with pytest.raises(InvalidInput, match=r"device = .*: must be one of cpu, gpu"):
        simulate_many([Parameters()], keep="segments", device=device)


def test_the_cpu_loads_nothing_of_cards() -> None:
    program = (
        "import sys, capsule_sym as c; c.simulate_many([c.Parameters()], periods=1);"
        "assert not {'cupy', 'capsule_sym._native.cuda', 'capsule_sym._native.on_card',"
        "'capsule_sym._native.device'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
