"""Claims of the step about an expansion in any scene, checked against its motion in 60 digits.

The library is built as in tests/native/certificate.py, with each mutant under a switch.
"""

import ctypes
import math
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tests.native import LIBRARY
from tests.native.certificate import (
    GRID,
    PROBED,
    Mutant,
    Truth,
    false_claims,
    mpf,
    number,
    put_mutants,
)
from tests.scenes import HERE, Form

SEEN = np.dtype(
    [("guard", PROBED["guard"].base, 4)]
    + [(name, PROBED[name]) for name in PROBED.names[1:]]
    + [("edge", "<f8")]
)
UNITS = {"1": "scalar.c", "106 bits": "double_double.c"}
_NAMES = {"1": "narrow", "106 bits": "wide"}


class Place(NamedTuple):
    """A field: the drive's level, contact, and way of the drift."""

    level: int
    contact: int
    way: int


@dataclass(frozen=True)
class Start:
    """The start of an expansion, and how far the true motion is off it: x_r, v_r, v_c and angle.

    `errors` are of x_r and v_r, of v_c and of the angle, as the step bounds them; `hints` times
    at which a guard comes close to zero. `bound_at` is 1 (-1) where Q is the bound forward
    (backward).
    """

    form: Form
    parameters: dict[str, float]
    place: Place
    state: tuple[float, float, float]
    angle: float
    bound_at: int = 0
    errors: tuple[float, float, float] = (0.0, 0.0, 0.0)
    off: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    steps: int = 1
    hints: tuple[float, ...] = ()
    level: int = 0

    zeros = (0, 0)

    @property
    def given(self) -> dict[str, float]:
        """Parameters by name."""
        return self.parameters

    @property
    def field(self) -> int:
        """Number of the field."""
        level, contact, way = self.place
        return 3 * ((1 + self.form.stops) * level + contact) + 2 - way


class Core:
    """The probes of one scene's library, with mutants."""

    def __init__(
        self, folder: Path, kernels: Path, order: tuple[str, ...], mutants: tuple[Mutant, ...]
    ) -> None:
        shutil.copytree(LIBRARY, folder, ignore=shutil.ignore_patterns("build", "__pycache__"))
        put_mutants(folder, mutants)
        for width, unit in UNITS.items():
            name = _NAMES[width]
            names = f"#define PROBE probe_{name}\n#define RESTS rests_{name}\n"
            probe = f'#include "{unit}"\n{names}#include "{HERE / "probe.c"}"\n'
            (folder / f"probed_{unit}").write_text(probe)
        sources = [file.name for file in folder.glob("*.c") if file.name not in UNITS.values()]
        command = ["cc", "-std=c99", "-O0", "-ffp-contract=off", "-shared", "-fPIC", "-w"]
        command += ["-DCAPSULE_LANES=1", "-I.", f"-I{kernels}", *sources]
        command += [str(kernels / "capsule_kernels.c"), "-lm", "-o", "probed"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        self.library, self.order = ctypes.CDLL(str(folder / "probed")), order
        self.mutants = mutants
        self.weak = ctypes.c_int.in_dll(self.library, "capsule_weak")
        self.reach = ctypes.c_double.in_dll(self.library, "capsule_reach")

    def _asked(self, what: str, start: Start, *words: object) -> int:
        values = np.array([start.parameters[name] for name in self.order])
        row = np.array([*start.state, start.angle, start.bound_at, *start.errors], float)
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (values, row)]
        ask = getattr(self.library, what)
        return int(ask(pointers[0], start.field, *words[:1], pointers[1], *words[1:]))

    def probe(self, width: str, start: Start) -> list[np.void]:
        """Outcome of a start, expansion by expansion."""
        out = np.zeros(start.steps, SEEN)
        steps = ctypes.c_void_p(out.ctypes.data)
        made = self._asked(f"probe_{_NAMES[width]}", start, start.steps, steps)
        assert made >= 0, start
        return [out[i] for i in range(made)]

    def rests(self, width: str, start: Start) -> bool:
        """True if it is claimed to rest forever."""
        return self._asked(f"rests_{_NAMES[width]}", start) == 1


def false_in(start: Start, seen: list[np.void]) -> Iterator[str]:
    """False claims of a start's expansions, edges of the drive included."""
    truth, last = Truth(start), seen[-1]
    at_edge = last["crossing"] and last["edge"]
    yield from false_claims(start, seen[:-1] if at_edge else seen, truth)  # type: ignore[arg-type]
    began = sum((number(one["h"]) for one in seen[:-1]), mpf(0))
    edge = truth.edge() - began
    if not at_edge:
        if not last["open"] and number(last["h"]) - last["error"] * last["reach"] > edge:
            yield "an edge comes first"
        return
    within = (mpf(s) * edge * (1 - mpf(10) ** -12) for s in GRID)
    hints = (t - began for t in start.hints if began < t < began + edge)
    for t in (*within, *hints):
        if min(truth.guards(began + t)) <= 0:
            yield f"a guard is negative {float(t)} after the start, before the edge"
    other = truth.p["alpha" if truth.level else "alpha_low"]
    if not last["undetermined"] and truth.direction_after(began + edge, 0, other) != last["way"]:
        yield "the way after the edge"


def log(random: object, low: float, high: float) -> float:
    """A number between two, evenly by its logarithm."""
    return math.exp(random.uniform(math.log(low), math.log(high)))  # type: ignore[attr-defined]
