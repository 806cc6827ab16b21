"""Claims of the step about an expansion in any scene, checked against its motion in 60 digits.

The library is built as in tests/native/certificate.py, with each mutant under a switch.
"""

from __future__ import annotations

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
    false_claims,
    mp,
    mpf,
    number,
    put_mutants,
)
from tests.scenes import GENERAL, HERE, Form

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

    @property
    def field(self) -> int:
        """Number of the field."""
        level, contact, way = self.place
        return 3 * ((1 + self.form.stops) * level + contact) + 2 - way


class Truth:
    """The motion of a segment in 60 digits, from the equations of the general form."""

    def __init__(self, start: Start) -> None:
        values = start.form.general(start.parameters)
        p = self.p = dict(zip(GENERAL, map(mpf, values), strict=True))
        level, contact, way = start.place
        self.way, self.contact, self.level, self.form = way, contact, level, start.form
        begun = (*start.state, start.angle)
        x, v, v_c, angle = (mpf(a) + mpf(b) for a, b in zip(begun, start.off, strict=True))
        self.x, self.v, self.v_c, self.angle, self.omega = x, v, v_c, angle, p["omega"]
        kappa = (mpf(0), p["beta_1"], p["beta_2"])[contact]
        stop = -p["delta_2"] if contact == 2 else p["delta_1"]
        self.gap, self.behind = x - stop, x + p["delta_2"]
        self.gaps = (0, 2 if way else 3) if start.form.stops == 2 and not contact else (0,)
        self.side = 1 if contact == 1 else -1
        self.friction = (-p["f_minus"], mpf(0), p["f_plus"])[way + 1]
        gamma, self.eps = p["gamma"], int(start.form.reacts)
        self.stiff, self.damp = 1 + kappa, 2 * p["zeta"]
        still = x + kappa * self.gap
        m, pushed = (1 + 1 / gamma, 1 + self.eps / gamma) if way else (mpf(1), mpf(1))
        self.push = p["alpha_low"] if level else p["alpha"]
        self.Q = still + self.damp * v - self.eps * self.drive(mpf(0))
        if start.bound_at:
            self.Q = p["f_plus"] if start.bound_at > 0 else -p["f_minus"]
        self.K, rate = m * self.stiff, m * self.damp
        push = self.friction / gamma * abs(way) - p["s"] - m * still
        amplitude = pushed * p["alpha"]
        if start.form.pulsed:
            push, amplitude = push + pushed * self.push, mpf(0)
        self.rest = push / self.K
        self.forced = amplitude * mp.expj(angle) / (self.K - self.omega**2 + 1j * rate * self.omega)
        root = mp.sqrt(mp.mpc(rate**2 / 4 - self.K))
        self.rates = one, two = (-rate / 2 + root, -rate / 2 - root)
        y, w = -self.rest - self.forced.real, v + self.omega * self.forced.imag
        self.parts = ((w - two * y) / (one - two), (one * y - w) / (one - two))

    def drive(self, t: mpf) -> mpf:
        """The drive."""
        return self.push * (1 if self.form.pulsed else mp.cos(self.angle + self.omega * t))

    def impulse(self, t: mpf) -> mpf:
        """Its integral."""
        if self.form.pulsed:
            return self.push * t
        return self.push * (mp.sin(self.angle + self.omega * t) - mp.sin(self.angle)) / self.omega

    def edge(self) -> mpf:
        """The time until the drive's next edge; infinite without pulses."""
        if not self.form.pulsed:
            return mp.inf
        share = mpf(1) if self.level else self.p["D"]
        return (2 * mp.pi * share - self.angle) / self.omega

    def moved(self, t: mpf) -> tuple[mpf, mpf, mpf]:
        """x_r - x_r(0), v_r, and the integral of the first."""
        turn = self.forced * mp.expj(self.omega * t)
        grown = [c * mp.exp(r * t) for c, r in zip(self.parts, self.rates, strict=True)]
        x = self.rest + turn.real + mp.re(sum(grown))
        both = list(zip(grown, self.rates, self.parts, strict=True))
        v = -self.omega * turn.imag + mp.re(sum(g * r for g, r, _ in both))
        area = self.rest * t + (turn - self.forced).imag / self.omega
        return x, v, area + mp.re(sum((g - c) / r for g, r, c in both))

    def pull(self, t: mpf, drive: mpf | None = None) -> mpf:
        """Q, at the drive's own level or at another one."""
        x, v, _ = self.moved(t)
        now = self.drive(t) if drive is None else drive
        grown = self.stiff * x + self.damp * (v - self.v)
        return self.Q + grown - self.eps * (now - self.drive(mpf(0)))

    def velocity(self, t: mpf) -> mpf:
        """v_c in a drift."""
        x, _, area = self.moved(t)
        gain = (self.Q - self.friction) * t + self.stiff * area + self.damp * (x - self.v * t)
        gain -= self.eps * (self.impulse(t) - self.drive(mpf(0)) * t)
        return self.v_c + gain / self.p["gamma"]

    def guards(self, t: mpf) -> list[mpf]:
        """The segment's guards, positive while it lasts."""
        x = self.moved(t)[0]
        found = [self.side * (self.gap + x)]
        if self.way:
            found.append(self.way * self.velocity(t))
        else:
            pull = self.pull(t)
            found += [self.p["f_plus"] - pull, self.p["f_minus"] + pull]
        return [*found, self.behind + x] if len(self.gaps) == 2 else found

    def direction_after(self, t: mpf, which: int, drive: mpf | None = None) -> int:
        """The drift's way after a switch by the gap's guard (0), by friction, or at an edge."""
        pull = self.pull(t, drive)
        if drive is None and which == 0:
            return self.way
        if drive is not None and self.way:
            return self.way
        if drive is None and not self.way:
            return 1 if pull > 0 else -1
        return int(pull > self.p["f_plus"]) - int(pull < -self.p["f_minus"])

    def before(self, t: float) -> tuple[float, float, float]:
        """The state so much earlier."""
        x, v, _ = self.moved(mpf(-t))
        v_c = self.velocity(mpf(-t)) if self.way else mpf(0)
        return float(self.x + x), float(v), float(v_c)

    def farthest(self) -> mpf:
        """The least upper bound of |x_r| about its centre at rest without damping."""
        x, v = -self.rest - self.forced.real, self.v + self.omega * self.forced.imag
        return abs(self.forced) + mp.hypot(x, v / mp.sqrt(self.K))


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
