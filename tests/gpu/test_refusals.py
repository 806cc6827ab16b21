"""No card, one without double precision, too little memory, an old driver: one line each."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from capsule_sym import InvalidInput, Parameters, simulate_many
from capsule_sym._cli import main
from capsule_sym._native.cuda import Facts, facts_of, refusal

CARD = Facts(1, "", "NVIDIA H200", (9, 0), 132 * 2048, 140 * 2**30, 12090, 12090)


class CudaError(RuntimeError):
    """An error of CUDA's runtime, as CuPy raises it."""


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
        "NVIDIA H200 has 1.0 GiB of free memory, and 6.2 GiB are needed",
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


@pytest.fixture
def _no_cupy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cupy", None)


@pytest.mark.usefixtures("_no_cupy")
@pytest.mark.parametrize(
    "line", [["sweep", "--alpha", "0.1:2:5"], ["basin", "--x-r", "-1:1:5"]], ids=["sweep", "basin"]
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


@pytest.mark.parametrize("keep", ["segments", "switches"])
def test_what_a_card_does_not_keep_is_refused(keep: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("capsule_sym._native.cuda.card_of", lambda scene, binding: binding)
    with pytest.raises(InvalidInput, match="device = 'gpu': must be cpu unless states are kept"):
        simulate_many([Parameters()], device="gpu", keep=keep)


def test_the_cpu_loads_nothing_of_cards() -> None:
    program = (
        "import sys, capsule_sym as c; c.simulate_many([c.Parameters()], periods=1);"
        "assert not {'cupy', 'capsule_sym._native.cuda', 'capsule_sym._native.on_card',"
        "'capsule_sym._native.device'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)
