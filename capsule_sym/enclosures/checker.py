"""Check certificates of the capsule system: `python checker.py FILE...`; needs python-flint alone.

It shares no code with what made them: the fields are those of Eqs. (7)-(12), their flow is flint's
exponential of a matrix, and every accepted claim is a comparison of balls. A number in a
certificate stands for all within 0.3 units of its last digit. Exit status 1 if one is rejected.
"""

from __future__ import annotations

import json
import sys
from typing import Any

from flint import arb, arb_mat, ctx

BITS = 256
DEEPEST = 40
MODES = {f: (int(f > 3), 1 - (f - 1) % 3) for f in range(1, 7)}  # contact, drift


class Rejected(Exception):
    """A claim that is not proved."""


def number(text: str) -> tuple[Any, Any]:
    """Middle and radius of a decimal."""
    return arb(text), arb("0.3") / 10 ** len(text.partition(".")[2])


def rows(field: int, p: dict[str, Any]) -> tuple[Any, list[Any]]:
    """A with y' = A y for y = (x_r, v_r, v_c, alpha cos, alpha sin, 1), and the guards."""
    contact, drift = MODES[field]
    k, d = p["beta"] * contact, p["f_b"] * drift
    force = [1 + k, 2 * p["zeta"], 0, 0, 0, -k * p["delta"]]
    load = [(f - (d if j == 5 else 0)) / p["gamma"] * abs(drift) for j, f in enumerate(force)]
    speed = [int(j == 3) - f - c for j, (f, c) in enumerate(zip(force, load, strict=True))]
    turn = [[0, 0, 0, 0, -p["omega"], 0], [0, 0, 0, p["omega"], 0, 0]]
    A = arb_mat([[0, 1, 0, 0, 0, 0], speed, load, *turn, [0] * 6])
    side = 1 if contact else -1
    guards = [[side, 0, 0, 0, 0, -side * p["delta"]]]
    if drift:
        guards.append([0, 0, drift, 0, 0, 0])
    else:
        guards += [[-s * f + (p["f_b"] if j == 5 else 0) for j, f in enumerate(force)] for s in (1, -1)]
    return A, [arb_mat([g]) for g in guards]


def between(field: int, following: int) -> int:
    """The guard of a field at which the next one takes over."""
    (c, d), (after, e) = MODES[field], MODES[following]
    if (c != after) == (d != e):
        raise Rejected(f"no guard leads from F{field} to F{following}")
    return 0 if c != after else 1 if d else (1 if e > 0 else 2)


def positive(A: Any, g: Any, y: Any, h: Any, before: int, after: int) -> None:
    """Prove a guard positive for 0 < t < h; it vanishes `before`-fold at 0 and `after`-fold at h."""
    longest = h.upper()
    slope = [g]
    for _ in range(5):
        slope.append(slope[-1] * A)
    pieces = [(longest / 8 * k, longest / 8 * (k + 1) if k < 7 else longest, 0) for k in range(8)]
    while pieces:
        low, high, depth = pieces.pop()
        middle, step = (low + high) / 2, arb(0, ((high - low) / 2).upper())
        state = (A * middle).exp() * y
        around = (A * step).exp() * state

        def value(k: int, state: Any = state, around: Any = around, step: Any = step) -> Any:
            here, rate, bend = (slope[k] * state, slope[k + 1] * state, slope[k + 2] * around)
            return here[0, 0] + rate[0, 0] * step + bend[0, 0] * step * step / 2

        first, last = before if low == 0 else 0, after if high >= longest else 0
        # With a zero at both ends g/t^first falls to its zero at h.
        if (
            (value(first) > 0 if not last else not first and (-1) ** last * value(last) > 0)
            or (first and last == 1 and value(first + 1) < 0)
        ):
            continue
        if depth == DEEPEST:
            raise Rejected("a guard is not seen to be positive")
        pieces += [(low, middle, depth + 1), (middle, high, depth + 1)]


class Shooting:
    """The equations of a certificate's orbit in all its states, durations, angle and free values."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.fields, self.still = given["fields"], given.get("still", [])
        self.given, self.n = given, len(given["fields"])
        self.free = sorted(given.get("free", {}))
        texts = [t for s in given["states"] for t in s] + given["durations"] + [given["angle"]]
        texts += [given["free"][name] for name in self.free]
        self.middle, self.radius = zip(*map(number, texts), strict=True)
        closed = [3 * self.n + s for s in self.still] + ([4] if self.n == 1 else [])  # the angle
        self.open = [i for i in range(len(texts)) if i not in closed]

    def parameters(self, z: Any) -> dict[str, Any]:
        found = {name: arb(text) for name, text in self.given["parameters"].items()}
        return found | {name: z[4 * self.n + 1 + k] for k, name in enumerate(self.free)}

    def guard(self, i: int) -> int | None:
        return between(self.fields[i], self.fields[(i + 1) % self.n]) if self.n > 1 else None

    def orders(self, i: int, field: int, still: list[int]) -> list[int]:
        """How often each guard of a field vanishes where leg i begins, by what is exact there."""
        first, last = i, i
        while (first - 1) % self.n in still:
            first -= 1
        while last % self.n in still:
            last += 1
        gap, rest, side, level = 0, 0, 0, 0
        for j in range(first - 1, last):
            guard, drift = self.guard(j % self.n), MODES[self.fields[j % self.n]][1]
            if guard == 0:
                gap += 1
            elif drift and rest:  # v_c' = 0 as well, and after the end of stick v_c'' = 0
                level, side = int(side != 0), drift
            elif guard is not None:
                rest, side = 1, side if drift else 3 - 2 * guard
        drift = MODES[field][1]
        if drift:
            return [gap, rest * (1 + (side == drift) * (1 + level))]
        return [gap, *((1 + level) * (side == s) for s in (1, -1))]

    def nodes(self, z: Any) -> list[Any]:
        p, n, found, elapsed = self.parameters(z), self.n, [], arb(0)
        for i in range(n):
            s, c = (z[4 * n] + p["omega"] * elapsed).sin_cos()
            x, v, w = z[3 * i : 3 * i + 3]
            found.append(arb_mat([[x], [v], [w], [p["alpha"] * c], [p["alpha"] * s], [1]]))
            elapsed += z[3 * n + i]
        return found

    def residual(self, z: Any) -> tuple[Any, Any]:
        """The equations and their derivative by the open unknowns."""
        p, n = self.parameters(z), self.n
        size = len(z)
        values, slopes = [], []
        nodes = self.nodes(z)
        total = sum((z[3 * n + i] for i in range(n)), arb(0))
        for i, y in enumerate(nodes):
            field, h = self.fields[i], z[3 * n + i]
            A, guards = rows(field, p)
            M = arb_mat([[int(r == s) for s in range(6)] for r in range(6)])
            if i not in self.still:
                M = (A * arb(h.mid())).exp() * (A * (h - arb(h.mid()))).exp()
            by = arb_mat(6, size)
            for r in range(3):
                by[r, 3 * i + r] = 1
            for at, rate in [(4 * n, 1), *((3 * n + j, p["omega"]) for j in range(i))]:
                by[3, at], by[4, at] = -y[4, 0] * rate, y[3, 0] * rate
            if "alpha" in self.free:
                at = 4 * n + 1 + self.free.index("alpha")
                by[3, at], by[4, at] = y[3, 0] / p["alpha"], y[4, 0] / p["alpha"]
            end, end_by = M * y, M * by
            if i not in self.still:
                for r, rate in enumerate((A * end).tolist()):
                    end_by[r, 3 * n + i] += rate[0]
            if MODES[field][1] == 0:
                end[2, 0] = 0
                for s in range(size):
                    end_by[2, s] = 0
            for r in range(3):
                at = 3 * ((i + 1) % n) + r
                values.append(end[r, 0] - z[at])
                slopes.append([end_by[r, s] - int(s == at) for s in range(size)])
            guard = self.guard(i)
            if guard is None:
                continue
            row = guards[guard]
            if i in self.still:  # its first derivative that does not vanish by what is known
                for _ in range(self.orders(i, field, [s for s in self.still if s != i])[guard]):
                    row = row * A
            values.append((row * end)[0, 0])
            slopes.append([(row * end_by)[0, s] for s in range(size)])
        values.append(p["omega"] * total - 2 * self.given["periods"] * arb.pi())
        slopes.append([p["omega"] if 3 * n <= s < 4 * n else arb(0) for s in range(size)])
        return arb_mat([[v] for v in values]), arb_mat([[r[s] for s in self.open] for r in slopes])

    def enclose(self) -> list[Any]:
        """Krawczyk's operator maps the certificate's box into itself: one solution, and only one."""
        thin, slopes = self.residual(list(self.middle))
        box = [m + arb(0, r.upper()) for m, r in zip(self.middle, self.radius, strict=True)]
        for s in self.still:
            box[3 * self.n + s] = arb(0)
        _, wide = self.residual(box)
        kept = self.open
        inverse = slopes.mid().inv().mid()
        deviation = arb_mat([[arb(0, self.radius[s].upper())] for s in kept])
        one = arb_mat([[int(i == j) for j in range(len(kept))] for i in range(len(kept))])
        image = (one - inverse * wide) * deviation - inverse * thin
        for k, s in enumerate(kept):
            if not abs(image[k, 0]) < self.radius[s]:
                raise Rejected(f"unknown {s} is not enclosed")
        return box

    def check(self) -> None:
        box = self.enclose()
        p, nodes, n = self.parameters(box), self.nodes(box), self.n
        turn = arb_mat([[int(i == j) for j in range(3)] for i in range(3)])
        start = next((i for i in range(n) if MODES[self.fields[i]][1] == 0), 0)
        for step in range(n):
            i = (start + step) % n
            field, h, after = self.fields[i], box[3 * n + i], (i + 1) % n
            A, guards = rows(field, p)
            if i not in self.still:
                if not h > 0:
                    raise Rejected(f"duration of leg {i}")
                first, last = (self.orders(k, field, self.still) for k in (i, i + 1))
                if n == 1:
                    first = last = [0] * len(guards)
                for g, before, behind in zip(guards, first, last, strict=True):
                    positive(A, g, nodes[i], h, before, behind)
            M = (A * h).exp()
            flow = arb_mat([[M[r, s] for s in range(3)] for r in range(3)])
            if MODES[field][1] == 0:
                flow[2, 2] = 0
            turn = flow * turn
            if self.guard(i) == 1 and MODES[field][1]:
                B, _ = rows(self.fields[after], p)
                ahead, behind_ = (B * nodes[after])[2, 0], (A * nodes[after])[2, 0]
                lost = 1 if MODES[self.fields[after]][1] == 0 else 1 - ahead / behind_
                turn = arb_mat([[1, 0, 0], [0, 1, lost], [0, 0, 1 - lost]]) * turn
        if self.given["stable"]:
            a, c = turn.trace(), turn.det()
            b = (a * a - (turn * turn).trace()) / 2
            for value in (1 - a + b - c, 1 + a + b + c, 1 - c, 1 + c, 1 - b + a * c - c * c):
                if not value > 0:
                    raise Rejected("stability")


def check(given: dict[str, Any]) -> None:
    """Accept a certificate, or raise Rejected."""
    ctx.prec = BITS
    try:
        Shooting(given).check()
    except (KeyError, IndexError, ValueError, TypeError, ZeroDivisionError) as error:
        raise Rejected(f"not a certificate: {error!r}") from error


def main(paths: list[str]) -> int:
    """Check files; the exit status."""
    failed = 0
    for path in paths:
        with open(path, encoding="utf-8") as file:
            held = json.load(file)
        for k, given in enumerate(held if isinstance(held, list) else [held]):
            try:
                check(given)
                print(f"{path} [{k}]: accepted")
            except Rejected as error:
                failed = 1
                print(f"{path} [{k}]: rejected ({error})")
    return failed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
