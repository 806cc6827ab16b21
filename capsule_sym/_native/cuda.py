"""Graphics cards by CuPy, and the reasons why there is none."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from threading import Lock, local
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput, NotInstalled
from capsule_sym._native.device import BASICS, BLOCK, COMPILED, OPTIONS, source
from capsule_sym._native.on_card import OnCard
from capsule_sym._parameters import Scene

_STACK = 22 * 2**10  # bytes of a thread, at most
_ROOM = 2**28  # bytes that a chunk should have at least
_SHARE = 0.25  # of the free memory, for a chunk: at most three are there at a time


class Facts(NamedTuple):
    """Facts of the card that computes, or of what is missing."""

    cards: int
    error: str = ""
    name: str = ""
    capability: tuple[int, int] = (0, 0)
    threads: int = 0  # at a time, each of which needs a stack
    free: int = 0  # bytes of memory
    driver: int = 0  # CUDA's version, as 12040 for 12.4; and of what compiles
    toolkit: int = 0


def refusal(facts: Facts) -> str:
    """Reason why no runs are possible on a card, empty if they are."""
    if not facts.cards:
        return f"no card of CUDA is found{facts.error and f' ({facts.error})'}"
    if facts.driver // 1000 < facts.toolkit // 1000:
        driver, toolkit = (f"{v // 1000}.{v % 1000 // 10}" for v in (facts.driver, facts.toolkit))
        return f"the driver has CUDA {driver}, which is older than CUDA {toolkit} of cupy"
    if facts.capability < (1, 3):
        capability = ".".join(map(str, facts.capability))
        return f"{facts.name}, of compute capability {capability}, has no double precision"
    need = facts.threads * _STACK + int(_ROOM / _SHARE)
    if facts.free < need:
        left, needed = (f"{size / 2**30:.1f} GiB" for size in (facts.free, need))
        return f"{facts.name} has {left} of free memory, and {needed} are needed"
    return ""


def facts_of(cuda: Any) -> Facts:
    """Facts of the present card, by the module cupy.cuda."""
    runtime = cuda.runtime
    driver, toolkit = runtime.driverGetVersion(), runtime.runtimeGetVersion()
    if not driver:
        return Facts(0, "there is no driver")
    if driver // 1000 < toolkit // 1000:  # an older one answers no further question
        return Facts(1, driver=driver, toolkit=toolkit)
    try:
        cards = runtime.getDeviceCount()
    except runtime.CUDARuntimeError as error:
        return Facts(0, str(error))
    of = runtime.getDeviceProperties(cuda.Device().id)
    return Facts(
        cards,
        "",
        of["name"].decode(),
        (of["major"], of["minor"]),
        of["multiProcessorCount"] * of["maxThreadsPerMultiProcessor"],
        cuda.Device().mem_info[0],
        driver,
        toolkit,
    )


class CudaCard:
    """A card of CUDA with the kernels of a scene; each thread of the host has its own queue."""

    def __init__(self, cupy: Any, facts: Facts, scene: Scene) -> None:
        self.cuda, self.name = cupy.cuda, f"cuda {facts.name}"
        self.failures = RuntimeError, MemoryError, cupy.cuda.compiler.CompileException
        self.kept = cupy.get_default_memory_pool()
        text = BASICS + source(scene)
        self.modules = {
            option: cupy.RawModule(code=text, options=(*OPTIONS, *option.split()))
            for option in ("", *COMPILED.values())
        }
        self.own, self.compiling = local(), Lock()

    @property
    def stream(self) -> Any:
        """Queue of the present thread."""
        if not hasattr(self.own, "stream"):
            self.own.stream = self.cuda.Stream(non_blocking=True)
        return self.own.stream

    @contextmanager
    def _used(self) -> Iterator[None]:
        """Use of the card in the present thread's queue; its errors are those of a refusal."""
        with self.stream:
            try:
                yield
            except self.failures as error:
                raise refused(str(error)) from None

    def free(self) -> int:
        """Bytes that a chunk may take."""
        # CuPy keeps what was freed, of ended threads too, and gives it up before memory is out.
        with self._used():
            return int(_SHARE * (self.cuda.Device().mem_info[0] + self.kept.free_bytes()))

    def blank(self, size: int) -> Any:
        """Memory of so many bytes."""
        with self._used():
            return self.cuda.alloc(size)

    def put(self, values: NDArray[Any]) -> Any:
        """Copy of an array in the card's memory."""
        values = np.ascontiguousarray(values)
        held = self.blank(values.nbytes)
        with self._used():
            held.copy_from_host_async(values.ctypes.data, values.nbytes, self.stream)
            self.stream.synchronize()
        return held

    def take(self, held: Any, values: NDArray[Any]) -> None:
        """Copy memory of the card to an array."""
        with self._used():
            held.copy_to_host_async(values.ctypes.data, values.nbytes, self.stream)
            self.stream.synchronize()

    def launch(self, kernel: str, count: int, *arguments: Any) -> None:
        """Run a kernel in at least `count` threads, until its end."""
        given = tuple(a if isinstance(a, np.generic) else np.uintp(a.ptr) for a in arguments)
        with self._used():
            with self.compiling:  # once, at a module's first launch
                function = self.modules[COMPILED.get(kernel, "")].get_function(kernel)
            function((-(-count // BLOCK),), (BLOCK,), given)
            self.stream.synchronize()


@cache
def card_of(scene: Scene, binding: ModuleType | None) -> OnCard:
    """Runs of a scene on the present card, beside the binding of its core.

    Raises InvalidInput if a package or the card is missing, or if the card has too little.
    """
    try:
        cupy = import_module("cupy")
        cupy.cuda.nvrtc.getVersion()
    except ModuleNotFoundError as error:
        raise refused(str(NotInstalled(error, "gpu"))) from None
    except ImportError as error:
        raise refused(str(error)) from error
    except RuntimeError:
        missing = ModuleNotFoundError(name="nvidia-cuda-nvrtc-cu12")
        raise refused(str(NotInstalled(missing, "gpu"))) from None
    facts = facts_of(cupy.cuda)
    if card_of.cache_info().currsize:
        facts = facts._replace(threads=0)  # the stacks are there, for another scene
    if reason := refusal(facts):
        raise refused(reason)
    if binding is None:
        raise refused("the C core of the scene was not compiled")
    try:
        return OnCard(binding, scene, CudaCard(cupy, facts, scene))
    except RuntimeError as error:  # of CuPy and CUDA: headers, compiler and driver that do not fit
        raise refused(str(error)) from error


def refused(reason: str) -> InvalidInput:
    """Error for a card that cannot be used, in one line."""
    return InvalidInput("device", "gpu", f"cpu here: {' '.join(reason.split())}")
