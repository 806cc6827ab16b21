"""Claims of the certified step about an expansion, checked against its motion in 60 digits.

The library is built with each of its error terms under a switch, so that one build has every
mutant; `reach` lengthens the expansions, so that remainders are not hidden by roundings.
"""

import ctypes
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mpmath import MPContext

from capsule_sym import Parameters
from tests.native import KERNELS, LIBRARY, place_of
from tests.scenes import GENERAL, Form

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
    form = Form()

    @property
    def given(self) -> dict[str, float]:
        """Parameters by name."""
        return self.parameters.to_dict()

    @property
    def place(self) -> tuple[int, int, int]:
        """The drive's level, contact, and way of the drift."""
        return 0, int(self.field > 3), (1, 0, -1)[(self.field - 1) % 3]

    @property
    def bound_at(self) -> int:
        """1 (-1) where P is f_b (-f_b)."""
        way, second = self.place[2], self.zeros[1]
        return way * (second == 2) if way else second


class Truth:
    """The motion of a segment's linear flow in 60 digits, from the equations of the general form.

    P = x_r + kappa (x_r - stop) + 2 zeta v_r, Q = P - eps u, gamma v_c' = Q - friction in drift,
    and v_r' = u - s - P - v_c', with the drive u. `start` is of the capsule or of another scene.
    """

    def __init__(self, start: Any) -> None:
        self.known: dict[mpf, list[mpf]] = {}
        values = start.form.general(start.given)
        p = self.p = dict(zip(GENERAL, map(mpf, values), strict=True))
        level, contact, way = start.place
        self.way, self.contact, self.level, self.form = way, contact, level, start.form
        begun = (*start.state, start.angle)
        x, v, v_c, angle = (mpf(a) + mpf(b) for a, b in zip(begun, start.off, strict=True))
        self.x, self.v, self.v_c, self.angle, self.omega = x, v, v_c, angle, p["omega"]
        kappa = (mpf(0), p["beta_1"], p["beta_2"])[contact]
        stop = -p["delta_2"] if contact == 2 else p["delta_1"]
        self.gap = mpf(0) if start.zeros[0] else x - stop
        self.behind = x + p["delta_2"]
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
        self.rate = push - rate * v + amplitude * mp.cos(angle)
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
        if t not in self.known:
            self.known[t] = self._guards(t)
        return self.known[t]

    def _guards(self, t: mpf) -> list[mpf]:
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

    def takes_over(self) -> bool:
        """True if every guard of the capsule is positive just after the start, by derivatives."""
        guards = [tuple(self.side * d for d in (self.gap, self.v, self.rate))]
        pull_rate = self.pull_rate()
        if self.way:
            slip = self.way * (self.Q - self.friction)
            guards.append((self.way * self.v_c, slip, self.way * pull_rate))
        else:
            f_b = self.p["f_plus"]
            guards += [(f_b - self.Q, -pull_rate), (f_b + self.Q, pull_rate)]
        signs = [next((d for d in derivatives if d), mpf(0)) for derivatives in guards]
        return min(signs) > 0

    def pull_rate(self) -> mpf:
        """P' of the capsule at the start."""
        return self.stiff * self.v + self.damp * self.rate

    def farthest(self) -> mpf:
        """The least upper bound of |x_r| about its centre at rest without damping."""
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
