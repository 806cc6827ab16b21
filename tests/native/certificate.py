"""Claims of the certified step about an expansion, checked against its motion in 60 digits.

The library is built with each of its error terms under a switch, so that one build has every
mutant; `reach` lengthens the expansions, so that remainders are not hidden by roundings.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mpmath import MPContext

from capsule_sym import Parameters
from tests.native import KERNELS, LIBRARY, place_of

HERE = Path(__file__).parent
WIDTHS = {"1": 1, "4": 4, "8": 8, "106 bits": 1}
_UNITS = {"1": "scalar.c", "4": "lanes_4.c", "8": "lanes_8.c", "106 bits": "double_double.c"}
_NAMES = {"1": "probe_1", "4": "probe_4", "8": "probe_8", "106 bits": "probe_wide"}

mp = MPContext()
mp.dps = 60
mpf = mp.mpf

_PAIR = ("<f8", 2)
_GUARD = np.dtype(
    [("zeros", "<f8"), ("rounding", "<f8"), ("tail", "<f8"), ("value", "<f8", (30, 2))]
)
PROBED = np.dtype(
    [("guard", _GUARD, 3)]
    + [(n, "<f8") for n in ("reach", "degree", "open", "crossing", "undetermined", "at_gap", "way")]
    + [("error", "<f8")]
    + [(name, *_PAIR) for name in ("h", "x_r", "gap", "v_r", "v_c")]
    + [("angle", "<f8", 3)]
    + [(name, "<f8") for name in ("energy_error", "v_c_error", "angle_error")]
)


class Mutant(NamedTuple):
    """A text of the library's sources, in one place of them, that makes way for another."""

    name: str
    old: str
    new: str


def put_mutants(directory: Path, mutants: tuple[Mutant, ...]) -> None:
    """Puts mutants into sources, i in force where `capsule_weak` is i + 1, and a reach to be set.

    The text of a mutant is an expression, or `NAME value` of a definition.
    """
    numbered = sorted(enumerate(mutants, start=1), key=lambda pair: -len(pair[1].old))
    for number, (name, old, new) in numbered:  # a text that holds another comes before it
        path = place_of(old, directory, name)
        text = path.read_text()
        if old.startswith("#define"):
            head, value = old.rsplit(" ", 1)
            text = text.replace(old, f"{head} (capsule_weak == {number} ? {new} : {value})")
        else:
            text = text.replace(old, f"(capsule_weak == {number} ? ({new}) : ({old}))")
        path.write_text(text)
    header = directory / "capsule.h"
    text = header.read_text()
    for name in ("REACH", "GROWTH"):
        line = next(part for part in text.splitlines() if f"#define CAPSULE_{name} " in part)
        value = line.split()[2]
        text = text.replace(
            line, f"#define CAPSULE_{name} (capsule_reach > 0 ? capsule_reach : {value})"
        )
    declared = "extern int capsule_weak;\nextern double capsule_reach;\n"
    header.write_text(declared + text)
    (directory / "switch.c").write_text("int capsule_weak;\ndouble capsule_reach;\n")


def build(directory: Path, mutants: tuple[Mutant, ...]) -> ctypes.CDLL:
    """The library with probes at every width, mutant i in force where `capsule_weak` is i + 1."""
    shutil.copytree(LIBRARY, directory, ignore=shutil.ignore_patterns("build", "__pycache__"))
    put_mutants(directory, mutants)
    shutil.copy(HERE / "probe.h", directory)
    for width, unit in _UNITS.items():
        (directory / f"{_NAMES[width]}.c").write_text(
            f'#include "{unit}"\n#include <string.h>\n'
            f'#define PROBE {_NAMES[width]}\n#include "probe.h"\n'
        )
    left = _UNITS.values()
    sources = [file.name for file in directory.glob("*.c") if file.name not in left]
    # Lanes of AVX2 throughout: those of AVX-512 need not be here.
    command = ["cc", "-std=c99", "-O0", "-ffp-contract=off", "-shared", "-fPIC", "-Wno-psabi"]
    command += ["-DCAPSULE_ANY_WIDTH=1", "-I.", f"-I{KERNELS}", *sources]
    command += [str(KERNELS / "capsule_kernels.c"), "-lm", "-o", "probed"]
    done = subprocess.run(command, cwd=directory, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(directory / "probed"))


@dataclass(frozen=True)
class Start:
    """The start of an expansion, and how far the true motion is off it.

    `zeros` are how many derivatives of the gap and of v_c vanish there (at rest the second is 1
    where P is f_b, -1 where it is -f_b); `off` are true x_r, v_r, v_c and angle less the
    start's, and `hints` times at which a guard comes close to zero.
    """

    parameters: Parameters
    field: int
    state: tuple[float, float, float]
    angle: float
    zeros: tuple[int, int] = (0, 0)
    errors: tuple[float, float, float] = (0.0, 0.0, 0.0)
    off: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    level: int = 0
    steps: int = 1
    hints: tuple[float, ...] = field(default=())


class Truth:
    """The motion of a segment's linear flow in 60 digits, from the equations as the paper has them:
    P = x_r + beta (x_r - delta) in contact + 2 zeta v_r, gamma v_c' = P - way f_b in drift, and
    v_r' = alpha cos(angle) - P - v_c'."""

    gaps: tuple[int, ...] = (0,)
    """True for the guards of stops."""

    def __init__(self, start: Start) -> None:
        self.known: dict[mpf, list[mpf]] = {}
        p = start.parameters
        alpha, omega, delta, zeta, beta, gamma, f_b, *_ = map(mpf, p.to_dict().values())
        way = {1: 1, 2: 0, 3: -1, 4: 1, 5: 0, 6: -1}[start.field]
        contact = start.field > 3
        self.way, self.side, self.f_b, self.gamma = way, 1 if contact else -1, f_b, gamma
        self.alpha = alpha
        x, v, v_c, angle = (
            mpf(a) + mpf(b) for a, b in zip((*start.state, start.angle), start.off, strict=True)
        )
        self.x, self.v, self.v_c, self.omega, self.angle = x, v, v_c, omega, angle
        self.gap = mpf(0) if start.zeros[0] else x - delta
        self.stiff, self.damp = 1 + (beta if contact else 0), 2 * zeta
        pull = x + (beta * self.gap if contact else 0) + self.damp * v
        if way and start.zeros[1] == 2:
            pull = way * f_b
        elif not way and start.zeros[1]:
            pull = start.zeros[1] * f_b
        self.pull = pull
        m = (gamma + 1) / gamma if way else mpf(1)
        self.K, rate = m * self.stiff, m * self.damp
        # v' = A + alpha cos - K (x - x(0)) - rate v
        still = x + (beta * self.gap if contact else 0)
        push = way * f_b / gamma
        self.rest = (push - m * still) / self.K
        self.rate = push - m * still - rate * v + alpha * mp.cos(angle)
        self.forced = alpha * mp.expj(angle) / (self.K - omega**2 + 1j * rate * omega)
        root = mp.sqrt(mp.mpc(rate**2 / 4 - self.K))
        self.rates = (-rate / 2 + root, -rate / 2 - root)
        y, w = -self.rest - self.forced.real, v + omega * self.forced.imag
        one, two = self.rates
        self.parts = ((w - two * y) / (one - two), (one * y - w) / (one - two))

    def moved(self, t: mpf) -> tuple[mpf, mpf, mpf]:
        """x_r - x_r(0), v_r, and the integral of the first."""
        turn = self.forced * mp.expj(self.omega * t)
        grown = [c * mp.exp(r * t) for c, r in zip(self.parts, self.rates, strict=True)]
        x = self.rest + turn.real + mp.re(sum(grown))
        v = -self.omega * turn.imag + mp.re(
            sum(g * r for g, r in zip(grown, self.rates, strict=True))
        )
        area = self.rest * t + (turn - self.forced).imag / self.omega
        area += mp.re(
            sum((g - c) / r for g, c, r in zip(grown, self.parts, self.rates, strict=True))
        )
        return x, v, area

    def guards(self, t: mpf) -> list[mpf]:
        """The segment's guards, positive while it lasts."""
        if t not in self.known:
            self.known[t] = self._guards(t)
        return self.known[t]

    def _guards(self, t: mpf) -> list[mpf]:
        x, v, area = self.moved(t)
        if self.way:
            friction = self.way * self.f_b
            gain = (self.pull - friction) * t + self.stiff * area + self.damp * (x - self.v * t)
            return [self.side * (self.gap + x), self.way * (self.v_c + gain / self.gamma)]
        pull = self.pull + self.stiff * x + self.damp * (v - self.v)
        return [self.side * (self.gap + x), self.f_b - pull, self.f_b + pull]

    def direction_after(self, t: mpf, which: int) -> int:
        """The drift's way after a switch by the gap's guard (0) or by friction."""
        x, v, _ = self.moved(t)
        pull = self.pull + self.stiff * x + self.damp * (v - self.v)
        if which == 0 or not self.way:
            rest = 0 if which == 0 else (1 if pull > 0 else -1)
            return self.way or rest
        return (pull > self.f_b) - (pull < -self.f_b)

    def takes_over(self) -> bool:
        """True if every guard is positive just after the start, by its first derivatives."""
        guards = [tuple(self.side * d for d in (self.gap, self.v, self.rate))]
        pull_rate = self.pull_rate()
        if self.way:
            slip = self.way * (self.pull - self.way * self.f_b)
            guards.append((self.way * self.v_c, slip, self.way * pull_rate))
        else:
            guards += [(self.f_b - self.pull, -pull_rate), (self.f_b + self.pull, pull_rate)]
        signs = [next((d for d in derivatives if d), mpf(0)) for derivatives in guards]
        return min(signs) > 0

    def pull_rate(self) -> mpf:
        """P' at the start."""
        return self.stiff * self.v + self.damp * self.rate

    def farthest(self) -> mpf:
        """The least upper bound of |x_r| at rest without damping and off resonance."""
        x, v = -self.rest - self.forced.real, self.v + self.omega * self.forced.imag
        return abs(self.forced) + mp.hypot(x, v / mp.sqrt(self.K))


def number(pair: Sequence[float]) -> mpf:
    """A double-double."""
    return mpf(float(pair[0])) + mpf(float(pair[1]))


@cache
def _bernstein(degree: int, s: float) -> list[mpf]:
    u = mpf(s)
    return [mp.binomial(degree, j) * u**j * (1 - u) ** (degree - j) for j in range(degree + 1)]


class Core:
    """The probes of one build."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self.library = library
        self.weak = ctypes.c_int.in_dll(library, "capsule_weak")
        self.reach = ctypes.c_double.in_dll(library, "capsule_reach")

    def probe(self, width: str, starts: list[Start]) -> list[list[np.void]]:
        """Outcomes of as many starts as there are lanes, expansion by expansion."""
        first = starts[0]
        lanes = WIDTHS[width]
        assert len(starts) == lanes
        rows = np.array([(*s.state, s.angle, *s.zeros, *s.errors) for s in starts], dtype=float)
        out = np.zeros((first.steps, lanes), PROBED)
        values = np.array(list(first.parameters.to_dict().values()))
        pointer = [ctypes.c_void_p(a.ctypes.data) for a in (values, rows, out)]
        made = getattr(self.library, _NAMES[width])(
            pointer[0], first.field, first.level, first.steps, pointer[1], pointer[2]
        )
        return [[out[i, lane] for i in range(made)] for lane in range(lanes)]

    def asked(self, what: str, width: str, start: Start) -> int:
        """Claims of the scalar code about a start: its field is the successor, or rests forever."""
        row = np.array([(*start.state, start.angle, *start.zeros, *start.errors)], dtype=float)
        values = np.array(list(start.parameters.to_dict().values()))
        pointer = [ctypes.c_void_p(a.ctypes.data) for a in (values, row)]
        found = getattr(self.library, f"{_NAMES[width]}_{what}")(
            pointer[0], start.field, pointer[1]
        )
        return int(found)


GRID = (1.0, 0.83, 0.5, 0.21, 0.03, 1e-3, 1e-5, 1e-8)


def false_claims(start: Start, seen: list[np.void], truth: Truth | None = None) -> Iterator[str]:
    """False claims of a start's expansions."""
    truth = truth or Truth(start)
    began = mpf(0)
    root_K = mp.sqrt(truth.K)
    for index, now in enumerate(seen):
        reach, r, degree = mpf(float(now["reach"])), mpf(2) ** -start.level, int(now["degree"])
        for s in GRID:
            exact = truth.guards(began + mpf(s) * r * reach)
            for which, true in enumerate(exact):
                guard = now["guard"][which]
                u = mpf(s)
                values = [number(value) for value in guard["value"][: degree + 1].tolist()]
                total = mp.fdot(values, _bernstein(degree, s))
                allowed = mpf(float(guard["rounding"])) * (u * r) ** int(guard["zeros"])
                allowed += mpf(float(guard["tail"])) * (u * r) ** 3
                if abs(total - true) > allowed:
                    yield f"guard {which} at {s} of expansion {index}"
        if now["open"]:
            return
        h = number(now["h"])
        if now["crossing"]:
            which = 0 if now["at_gap"] else -1
            yield from _false_root(truth, began, now, which, () if index else start.hints)
            return
        inner = [mpf(s) * h for s in GRID] + [mpf(t) for t in start.hints if not index and t < h]
        for t in inner:
            if min(truth.guards(began + t)) <= 0:
                yield f"a guard is negative {float(t)} after expansion {index} began"
        began += h
        x, v, _ = truth.moved(began)
        off_x = max(abs(truth.x + x - number(now["x_r"])), abs(truth.gap + x - number(now["gap"])))
        energy = mp.hypot(root_K * off_x, v - number(now["v_r"]))
        if energy > mpf(float(now["energy_error"])):
            yield f"x_r and v_r after expansion {index}"
        if truth.way:
            true = truth.way * truth.guards(began)[1]
            if abs(true - number(now["v_c"])) > mpf(float(now["v_c_error"])):
                yield f"v_c after expansion {index}"
        turned = truth.angle + truth.omega * began
        off = turned - number(now["angle"]) - mpf(float(now["angle"][2]))
        off -= 2 * mp.pi * mp.nint(off / (2 * mp.pi))
        if abs(off) > mpf(float(now["angle_error"])):
            yield f"angle after expansion {index}"


def _false_root(
    truth: Truth, began: mpf, now: np.void, which: int, hints: Sequence[float]
) -> Iterator[str]:
    """True if the claimed root of a guard is none, or not the first one."""
    h, reach = number(now["h"]), mpf(float(now["reach"]))
    allowed = mpf(float(now["error"])) * reach

    def value(t: mpf) -> mpf:
        guards = enumerate(truth.guards(began + t))
        return min(guard for i, guard in guards if (i in truth.gaps) == (which == 0))

    before, after = h - allowed, h + allowed
    if not now["undetermined"] and truth.direction_after(began + h, which) != now["way"]:
        yield "the way after the switch"
    if min(truth.guards(began + before)) <= 0:
        yield f"a guard is negative just before the root {float(h)}"
    if value(after) >= 0:
        yield f"the guard is positive just after the root {float(h)}"
    if sum(guard <= 0 for guard in truth.guards(began + after)) > 1:
        low, high = before, after
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if value(middle) > 0 else (low, middle)
        if min(truth.guards(began + low)) <= 0:
            yield f"another guard is negative at the root {float(h)}"
    for t in [before * mpf(s) for s in GRID[1:]] + [mpf(t) for t in hints if t < before]:
        if min(truth.guards(began + t)) <= 0:
            yield f"a guard is negative {float(t)} after the start, before the root"
