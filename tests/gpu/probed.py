"""The device source with probes, and with mutants, on the host."""

from __future__ import annotations

import ctypes
import shutil
from pathlib import Path
from tempfile import mkdtemp

from capsule_sym._native.device import source
from capsule_sym._parameters import CAPSULE
from tests.gpu.host import compiled
from tests.native import LIBRARY, place_of
from tests.native.certificate import Mutant, put_mutants

_DECLARED = "extern int capsule_weak;\nextern double capsule_reach;\n"
_DEFINED = 'extern "C" { int capsule_weak; double capsule_reach; }\n'


def probed(mutants: tuple[Mutant, ...]) -> ctypes.CDLL:
    """Probes of width 1 in the device source, mutant i in force where `capsule_weak` is i + 1."""
    with_mutants = _copied()
    put_mutants(with_mutants, mutants)
    text = source(CAPSULE, with_mutants)
    shutil.rmtree(with_mutants)
    text = text.replace(_DECLARED, "")
    return compiled(_DEFINED + text, "-DBLOCK=1", "-O0", program="probe.cpp").runs


def changed(change: tuple[str, str] | None) -> ctypes.CDLL:
    """Probes of the device source, one text of whose sources is changed: (old, new)."""
    place = _copied()
    if change:
        path = place_of(change[0], place)
        path.write_text(path.read_text().replace(*change))
    text = source(CAPSULE, place)
    shutil.rmtree(place)
    return compiled(text, "-DBLOCK=1", program="probe.cpp").runs


def _copied() -> Path:
    place = Path(mkdtemp(prefix="device")) / "c"
    shutil.copytree(LIBRARY, place, ignore=shutil.ignore_patterns("build", "__pycache__"))
    return place
