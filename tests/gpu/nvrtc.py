"""NVRTC by its C interface: device source is compiled without a card."""

from __future__ import annotations

import ctypes
import re
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple


class Kernel(NamedTuple):
    """Figures that the assembler gives of a kernel."""

    registers: int
    stack: int
    spilled: int
    shared: int


def library() -> Path | None:
    """NVRTC of the package nvidia-cuda-nvrtc-cu12, if it is here."""
    spec = find_spec("nvidia.cuda_nvrtc") if find_spec("nvidia") else None
    folders = [] if spec is None else list(spec.submodule_search_locations or ())
    return next((path for at in folders for path in Path(at).glob("lib/libnvrtc.so.12")), None)


def compiled(text: str, options: tuple[str, ...], kind: str = "CUBIN") -> tuple[bytes, str]:
    """Machine code or PTX, and the log; raises ValueError, with the log, on errors."""
    nvrtc = ctypes.CDLL(str(library()))
    program, size = ctypes.c_void_p(), ctypes.c_size_t()
    nvrtc.nvrtcCreateProgram(ctypes.byref(program), text.encode(), b"device.cu", 0, None, None)
    given = (ctypes.c_char_p * len(options))(*(option.encode() for option in options))
    failed = nvrtc.nvrtcCompileProgram(program, len(options), given)
    nvrtc.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    log = ctypes.create_string_buffer(size.value)
    nvrtc.nvrtcGetProgramLog(program, log)
    if failed:
        raise ValueError(log.value.decode())
    getattr(nvrtc, f"nvrtcGet{kind}Size")(program, ctypes.byref(size))
    binary = ctypes.create_string_buffer(size.value)
    getattr(nvrtc, f"nvrtcGet{kind}")(program, binary)
    nvrtc.nvrtcDestroyProgram(ctypes.byref(program))
    return binary.raw, log.value.decode()


_PART = re.compile(
    r"Function properties for (\w+)\n"
    r"ptxas[ .]*(\d+) bytes stack frame, (\d+) bytes spill stores.*\n"
    r"ptxas info *: Used (\d+) registers(.*)\n"
)


def kernels(log: str) -> dict[str, Kernel]:
    """Figures of each kernel, from the assembler's log."""
    found = {}
    for name, stack, spilled, registers, rest in _PART.findall(log):
        shared = re.search(r"(\d+) bytes smem", rest)
        own = int(shared[1]) if shared else 0
        found[name] = Kernel(int(registers), int(stack), int(spilled), own)
    return found
