"""Check certificates of the capsule system: `python checker.py FILE...`; needs python-flint alone.

Independent of what made them: Eqs. (7)-(12), flint's exponential of their matrices, and comparisons
of balls. A number stands for all within 0.3 units of its last digit, but parameters and the start
of a run are exact; "about" is no claim. Exit status 1 if one is rejected.
"""

import json
import re
import sys
from pathlib import Path
from typing import Any

from flint import arb, arb_mat, ctx

BITS, DEEPEST, NUMBER = 256, 40, r"-?\d+(\.\d+)?"
NAMES = {"alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b"}
MODES = {f: (int(f > 3), 1 - (f - 1) % 3) for f in range(1, 7)}  # contact, drift


class Rejected(Exception):
    """A claim that is not proved."""


def rows(field: int, p: dict[str, Any]) -> tuple[Any, list[Any]]:
    """A with y' = A y for y = (x_r, v_r, v_c, alpha cos, alpha sin, 1), and the guards."""
    contact, drift = MODES[field]
    k, d, side = p["beta"] * contact, p["f_b"] * drift, 2 * contact - 1
    force = [1 + k, 2 * p["zeta"], 0, 0, 0, -k * p["delta"]]
    load = [(f - (d if j == 5 else 0)) / p["gamma"] * abs(drift) for j, f in enumerate(force)]
    speed = [int(j == 3) - f - c for j, (f, c) in enumerate(zip(force, load, strict=True))]
    turn = [[0, 0, 0, 0, -p["omega"], 0], [0, 0, 0, p["omega"], 0, 0]]
    guards = [[side, 0, 0, 0, 0, -side * p["delta"]], [0, 0, drift, 0, 0, 0]]
    if not drift:
        guards[1:] = [[p["f_b"] * (j == 5) - s * force[j] for j in range(6)] for s in (1, -1)]
    A = arb_mat([[0, 1, 0, 0, 0, 0], speed, load, *turn, [0] * 6])
    return A, [arb_mat([guard]) for guard in guards]


def flow(field: int, A: Any, h: Any) -> Any:
    """exp(A h); v_c is no state of stick."""
    found = (A * arb(h.mid())).exp() * (A * (h - arb(h.mid()))).exp()
    found[2, 2] = found[2, 2] * abs(MODES[field][1])
    return found


def positive(A: Any, g: Any, y: Any, h: Any, before: int, after: int) -> None:
    """Prove a guard positive inside (0, h); it vanishes `before`-fold at 0, `after`-fold at h."""
    longest, slope = h.upper(), arb_mat([(g * A**k).tolist()[0] for k in range(7)])
    pieces = [(longest / 8 * k, longest / 8 * (k + 1) if k < 7 else longest, 0) for k in range(8)]
    while pieces:
        low, high, depth = pieces.pop()
        middle, step = (low + high) / 2, arb(0, ((high - low) / 2).upper())
        state = (A * middle).exp() * y
        here, far = (slope * state).tolist(), (slope * ((A * step).exp() * state)).tolist()
        around = zip(here, here[1:], far[2:], strict=False)
        value = [x + v * step + r * step * step / 2 for (x,), (v,), (r,) in around]
        first, last = before if low == 0 else 0, after if high >= longest else 0  # never both
        if not (-1) ** last * value[first + last] > 0:
            if depth == DEEPEST:
                raise Rejected("a guard is not seen to be positive")
            pieces += [(low, middle, depth + 1), (middle, high, depth + 1)]


class Shooting:
    """The equations of an orbit in all its states, durations, angle and free parameters."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.given, self.fields, self.run = given, given["fields"], given.get("kind") == "run"
        self.still = [] if self.run else given.get("still", [])
        self.n, self.free = len(self.fields), sorted(given.get("free", {}))
        if strange := sorted({*given["parameters"]} ^ (NAMES - {*self.free})):
            raise Rejected(f"parameters other than these equations have: {', '.join(strange)}")
        texts = [t for s in given["states"] for t in s] + given["durations"] + [given["angle"]]
        texts += [given["free"][name] for name in self.free] + given.get("end", [])
        whole = {*map(type, (given["periods"], *self.still))} == {int} and given["periods"] > 0
        written = all(re.fullmatch(NUMBER, t) for t in (*texts, *given["parameters"].values()))
        fits = self.free == ["alpha"] * len(self.still) and {*self.still} <= {*range(self.n)}
        rests = not self.run or MODES[self.fields[0]][1] or arb(texts[2]) == 0
        if not (whole and written and fits and rests):
            raise Rejected("numbers, segments of duration 0, or the free parameter")
        self.middle = [arb(text) for text in texts]
        self.radius = [arb("0.3") / 10 ** len(text.partition(".")[2]) for text in texts]
        closed = [3 * self.n + s for s in self.still] + ([4] if self.n == 1 else [])  # the angle
        self.open = [i for i in range(len(texts)) if i not in closed]

    def parameters(self, z: Any) -> dict[str, Any]:
        """The parameters, the free ones from the unknowns."""
        found = {name: arb(text) for name, text in self.given["parameters"].items()}
        return found | {name: z[4 * self.n + 1 + k] for k, name in enumerate(self.free)}

    def guard(self, i: int) -> int | None:
        """Guard of segment i that selects the next field."""
        (c, d), (after, e) = (MODES[self.fields[k % self.n]] for k in (i, i + 1))
        if self.n > 1 and (c == after) == (d == e):
            raise Rejected(f"no guard ends segment {i}")
        return None if self.n == 1 else 0 if c != after else 1 if d or e > 0 else 2

    def orders(self, i: int, field: int, still: list[int]) -> list[int]:
        """Number of zeros of each guard of a field at the start of segment i, by exact facts."""
        if (n := self.n) == 1 or (self.run and i in (0, n)):  # no switch, or the ends of a run
            return [0, 0, 0]
        first = next(k for k in range(i, i - n, -1) if (k - 1) % n not in still)
        last = next(k for k in range(i, i + n) if k % n not in still)
        gap, rest, side, level, drift = 0, 0, 0, 0, MODES[field][1]
        for j in range(first - 1, last):
            guard, drifts = self.guard(j % n), MODES[self.fields[j % n]][1]
            if guard == 0:
                gap += 1
            elif drifts and rest:  # v_c' = 0 as well, and after the end of stick v_c'' = 0
                level, side = int(side != 0), drifts
            elif guard is not None:
                rest, side = 1, side if drifts else 3 - 2 * guard
        sides = [(1 + level) * (side == s) for s in (1, -1)]
        return [gap, rest * (1 + (side == drift) * (1 + level))] if drift else [gap, *sides]

    def node(self, z: Any, i: int) -> Any:
        """The extended state where segment i begins."""
        p, spent = self.parameters(z), sum(z[3 * self.n : 3 * self.n + i])
        s, c = (p["alpha"] * x for x in (z[4 * self.n] + p["omega"] * spent).sin_cos())
        return arb_mat([[x] for x in (*z[3 * i : 3 * i + 3], c, s, 1)])

    def residual(self, z: Any) -> tuple[Any, Any]:
        """The equations and their derivative by the open unknowns."""
        p, n, size = self.parameters(z), self.n, len(z)
        values, slopes = [], []
        for i, field in enumerate(self.fields):
            y, h, (A, guards) = self.node(z, i), z[3 * n + i], rows(field, p)
            by = arb_mat([[int(r < 3 and s == 3 * i + r) for s in range(size)] for r in range(6)])
            for at, rate in [(4 * n, 1), *((3 * n + j, p["omega"]) for j in range(i))]:
                by[3, at], by[4, at] = -y[4, 0] * rate, y[3, 0] * rate
            for at in [4 * n + 1] if self.free else []:
                by[3, at], by[4, at] = y[3, 0] / p["alpha"], y[4, 0] / p["alpha"]
            M = flow(field, A, h)
            end, end_by = M * y, M * by
            for r, rate in enumerate((A * end).tolist()):
                end_by[r, 3 * n + i] += rate[0]
            for at, r in ((3 * ((i + 1) % n) + r, r) for r in range(3)):
                values.append(end[r, 0] - z[at])
                slopes.append([end_by[r, s] - int(s == at) for s in range(size)])
            if (guard := self.guard(i)) is not None:
                order = self.orders(i, field, [])[guard] if i in self.still else 0
                row = guards[guard] * A**order  # what does not vanish by what is known
                values.append((row * end)[0, 0])
                slopes.append([(row * end_by)[0, s] for s in range(size)])
        values.append(p["omega"] * sum(z[3 * n : 4 * n]) - 2 * self.given["periods"] * arb.pi())
        slopes.append([p["omega"] if 3 * n <= s < 4 * n else arb(0) for s in range(size)])
        return arb_mat([[v] for v in values]), arb_mat([[r[s] for s in self.open] for r in slopes])

    def _claimed(self, s: int, value: Any) -> Any:
        if not abs(value - self.middle[s]) < self.radius[s]:
            raise Rejected(f"unknown {s} is not enclosed")
        return value

    def enclose(self) -> list[Any]:
        """Krawczyk's operator maps the box into itself: it holds one solution, and only one."""
        box = [m + arb(0, r.upper()) for m, r in zip(self.middle, self.radius, strict=True)]
        for at in (3 * self.n + s for s in self.still):
            self.middle[at] = box[at] = self._claimed(at, arb(0))
        (thin, slopes), (_, wide) = self.residual(self.middle), self.residual(box)
        inverse, size = slopes.mid().inv().mid(), len(self.open)
        deviation = arb_mat([[arb(0, self.radius[s].upper())] for s in self.open])
        image = (arb_mat(size, size, 1) - inverse * wide) * deviation - inverse * thin
        for k, s in enumerate(self.open):
            self._claimed(s, self.middle[s] + image[k, 0])
        return box

    def follow(self) -> list[Any]:
        """A run from its start: each switch by Newton's method over all that its digits allow."""
        z, n, p = [*self.middle], self.n, self.parameters(self.middle)
        for i, field in enumerate(self.fields):
            (A, guards), y, at, last = rows(field, p), self.node(z, i), 3 * n + i, i == n - 1
            h = (2 * self.given["periods"] * arb.pi() - z[4 * n]) / p["omega"] - sum(z[3 * n : at])
            if not last:
                row, h = guards[self.guard(i) or 0], z[at] + arb(0, self.radius[at].upper())
                for _ in range(6):
                    here, slope = (A * arb(h.mid())).exp() * y, row * A * (A * h).exp() * y
                    h = self._claimed(at, arb(h.mid()) - (row * here)[0, 0] / slope[0, 0])
            end, to = flow(field, A, h) * y, 4 * n + 1 if last else 3 * i + 3
            for s, value in ((at, h), *((to + r, end[r, 0]) for r in range(3))):
                z[s] = self._claimed(s, value)
        return z

    def check(self) -> None:
        """Existence, uniqueness, then the itinerary, then Jury's conditions."""
        box, n, turn = self.follow() if self.run else self.enclose(), self.n, arb_mat(3, 3, 1)
        p = self.parameters(box)
        for i in range(n):
            field, y, h, after = self.fields[i], self.node(box, i), box[3 * n + i], (i + 1) % n
            (A, guards), (B, _) = rows(field, p), rows(self.fields[after], p)
            ends = [self.orders(k, field, self.still) for k in (i, i + 1)]
            if i not in self.still and not h > 0:
                raise Rejected(f"the duration of segment {i}")
            for g, before, behind in zip([] if i in self.still else guards, *ends, strict=False):
                positive(A, g, y, h, before, behind)
            if self.run:
                continue
            turn = arb_mat([row[:3] for row in flow(field, A, h).tolist()[:3]]) * turn
            if self.guard(i) == 1 and MODES[field][1]:
                # The inner mass does not feel friction: v_r gains what v_c loses.
                y, drifts = self.node(box, after), abs(MODES[self.fields[after]][1])
                lost = 1 - drifts * (B * y)[2, 0] / (A * y)[2, 0]
                turn = arb_mat([[1, 0, 0], [0, 1, lost], [0, 0, 1 - lost]]) * turn
        a, b, c = turn.trace(), (turn.trace() ** 2 - (turn * turn).trace()) / 2, turn.det()
        jury = (1 - a + b - c, 1 + a + b + c, 1 - c, 1 + c, 1 - b + a * c - c * c)
        if self.given["stable"] and not all(value > 0 for value in jury):
            raise Rejected("stability")


def check_certificate(given: dict[str, Any]) -> None:
    """Accept a certificate, or raise Rejected."""
    try:
        ctx.prec = BITS + 4 * len(given["fields"])  # roundings grow along a run
        Shooting(given).check()
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise Rejected(f"not a certificate: {error!r}") from error


if __name__ == "__main__":
    for path in sys.argv[1:]:
        at = path
        try:
            held = json.loads(Path(path).read_bytes())
            for number, one in enumerate(held.get("certificates", [held])):
                at = f"{path} [{number}]"
                check_certificate(one)
                print(f"{at}: accepted")
        except (AttributeError, OSError, RecursionError, TypeError, ValueError, Rejected) as error:
            sys.exit(f"{at}: rejected ({error})")
