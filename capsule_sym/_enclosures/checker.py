"""Check certificates of the capsule system: `python checker.py FILE...`; needs python-flint alone.

It shares no code with what made them: the fields are those of Eqs. (7)-(12), their flow is flint's
exponential of a matrix, and every accepted claim is a comparison of balls. A number stands for all
within 0.3 units of its last digit; "about" is no claim. Exit status 1 if one is rejected.
"""

import json
import re
import sys
from typing import Any

from flint import arb, arb_mat, ctx

BITS, DEEPEST, NUMBER = 256, 40, r"-?\d+(\.\d+)?"
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
        bound = [0, 0, 0, 0, 0, p["f_b"]]
        guards[1:] = [[b - s * f for b, f in zip(bound, force, strict=True)] for s in (1, -1)]
    A = arb_mat([[0, 1, 0, 0, 0, 0], speed, load, *turn, [0] * 6])
    return A, [arb_mat([guard]) for guard in guards]


def positive(A: Any, g: Any, y: Any, h: Any, before: int, after: int) -> None:
    """Prove a guard positive inside (0, h); it vanishes `before`-fold at 0, `after`-fold at h."""
    longest, slope = h.upper(), [g * A**k for k in range(7)]
    pieces = [(longest / 8 * k, longest / 8 * (k + 1) if k < 7 else longest, 0) for k in range(8)]
    while pieces:
        low, high, depth = pieces.pop()
        middle, step = (low + high) / 2, arb(0, ((high - low) / 2).upper())
        state = (A * middle).exp() * y
        around = (A * step).exp() * state
        rest = [(row * around)[0, 0] * step * step / 2 for row in slope[2:]]
        here = [(row * state)[0, 0] for row in slope]
        # The guard and its derivatives over the piece, to second order.
        value = [x + v * step + r for x, v, r in zip(here, here[1:], rest, strict=False)]
        first, last = before if low == 0 else 0, after if high >= longest else 0
        signs = [value[first], (-1) ** last * value[last], -value[first + 1]]
        if (not last and signs[0] > 0) or (last and not first and signs[1] > 0):
            continue
        if first and last == 1 and signs[2] > 0:  # g/t^first falls to its zero at h
            continue
        if depth == DEEPEST:
            raise Rejected("a guard is not seen to be positive")
        pieces += [(low, middle, depth + 1), (middle, high, depth + 1)]


class Shooting:
    """The equations of an orbit in all its states, durations, angle and free parameters."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.given, self.fields, self.still = given, given["fields"], given.get("still", [])
        self.n, self.free = len(self.fields), sorted(given.get("free", {}))
        texts = [t for s in given["states"] for t in s] + given["durations"] + [given["angle"]]
        texts += [given["free"][name] for name in self.free]
        whole = type(given["periods"]) is int and given["periods"] > 0
        segments = all(type(s) is int and 0 <= s < self.n for s in self.still)
        written = all(re.fullmatch(NUMBER, t) for t in (*texts, *given["parameters"].values()))
        twice = {*self.free} & {*given["parameters"]} or len({*self.still}) < len(self.still)
        if not (whole and segments and written and len(self.still) == len(self.free)) or twice:
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
        """The guard of segment i at which the next field takes over."""
        (c, d), (after, e) = (MODES[self.fields[k % self.n]] for k in (i, i + 1))
        if self.n > 1 and (c == after) == (d == e):
            raise Rejected(f"no guard ends segment {i}")
        return None if self.n == 1 else 0 if c != after else 1 if d or e > 0 else 2

    def orders(self, i: int, field: int, still: list[int]) -> list[int]:
        """How often each guard of a field vanishes at the start of segment i, by what is exact."""
        first, last = i, i
        while (first - 1) % self.n in still:
            first -= 1
        while last % self.n in still:
            last += 1
        gap, rest, side, level, drift = 0, 0, 0, 0, MODES[field][1]
        for j in range(first - 1, last):
            guard, drifts = self.guard(j % self.n), MODES[self.fields[j % self.n]][1]
            if guard == 0:
                gap += 1
            elif drifts and rest:  # v_c' = 0 as well, and after the end of stick v_c'' = 0
                level, side = int(side != 0), drifts
            elif guard is not None:
                rest, side = 1, side if drifts else 3 - 2 * guard
        sides = [(1 + level) * (side == s) for s in (1, -1)]
        return [gap, rest * (1 + (side == drift) * (1 + level))] if drift else [gap, *sides]

    def nodes(self, z: Any) -> list[Any]:
        """The extended states where the segments begin."""
        p, found, angle = self.parameters(z), [], z[4 * self.n]
        for i in range(self.n):
            s, c = (p["alpha"] * x for x in angle.sin_cos())
            found.append(arb_mat([[x] for x in (*z[3 * i : 3 * i + 3], c, s, 1)]))
            angle = angle + p["omega"] * z[3 * self.n + i]
        return found

    def residual(self, z: Any) -> tuple[Any, Any]:
        """The equations and their derivative by the open unknowns."""
        p, n, size = self.parameters(z), self.n, len(z)
        values, slopes = [], []
        for i, y in enumerate(self.nodes(z)):
            field, h, by = self.fields[i], z[3 * n + i], arb_mat(6, size)
            A, guards = rows(field, p)
            for r in range(3):
                by[r, 3 * i + r] = 1
            for at, rate in [(4 * n, 1), *((3 * n + j, p["omega"]) for j in range(i))]:
                by[3, at], by[4, at] = -y[4, 0] * rate, y[3, 0] * rate
            for at in [4 * n + 1] if self.free else []:
                by[3, at], by[4, at] = y[3, 0] / p["alpha"], y[4, 0] / p["alpha"]
            M = (A * arb(h.mid())).exp() * (A * (h - arb(h.mid()))).exp()
            end, end_by = M * y, M * by
            for r, rate in enumerate((A * end).tolist()):
                end_by[r, 3 * n + i] += rate[0]
            if MODES[field][1] == 0:  # v_c is no state of stick
                end[2, 0] = 0
                for s in range(size):
                    end_by[2, s] = 0
            for at, r in ((3 * ((i + 1) % n) + r, r) for r in range(3)):
                values.append(end[r, 0] - z[at])
                slopes.append([end_by[r, s] - int(s == at) for s in range(size)])
            guard = self.guard(i)
            if guard is not None:
                row = guards[guard]
                if i in self.still:  # its first derivative that does not vanish by what is known
                    for _ in range(self.orders(i, field, [s for s in self.still if s != i])[guard]):
                        row = row * A
                values.append((row * end)[0, 0])
                slopes.append([(row * end_by)[0, s] for s in range(size)])
        values.append(p["omega"] * sum(z[3 * n : 4 * n]) - 2 * self.given["periods"] * arb.pi())
        slopes.append([p["omega"] if 3 * n <= s < 4 * n else arb(0) for s in range(size)])
        return arb_mat([[v] for v in values]), arb_mat([[r[s] for s in self.open] for r in slopes])

    def enclose(self) -> list[Any]:
        """Krawczyk's operator maps the box into itself: it holds one solution, and only one."""
        box = [m + arb(0, r.upper()) for m, r in zip(self.middle, self.radius, strict=True)]
        for at in (3 * self.n + s for s in self.still):
            if not abs(self.middle[at]) < self.radius[at]:
                raise Rejected(f"unknown {at} is not 0")
            self.middle[at] = box[at] = arb(0)
        (thin, slopes), (_, wide) = self.residual(self.middle), self.residual(box)
        inverse, size = slopes.mid().inv().mid(), len(self.open)
        one = arb_mat([[int(i == j) for j in range(size)] for i in range(size)])
        deviation = arb_mat([[arb(0, self.radius[s].upper())] for s in self.open])
        image = (one - inverse * wide) * deviation - inverse * thin
        for k, s in enumerate(self.open):
            if not abs(image[k, 0]) < self.radius[s]:
                raise Rejected(f"unknown {s} is not enclosed")
        return box

    def check(self) -> None:
        """Existence, uniqueness, then the itinerary, then Jury's conditions."""
        if self.free not in ([], ["alpha"]):
            raise Rejected("the free parameter is not alpha")
        box, n, turn = self.enclose(), self.n, arb_mat([[1, 0, 0], [0, 1, 0], [0, 0, 1]])
        p, nodes = self.parameters(box), self.nodes(box)
        for i in range(n):
            field, h, after = self.fields[i], box[3 * n + i], (i + 1) % n
            (A, guards), (B, _) = rows(field, p), rows(self.fields[after], p)
            ends = [self.orders(k, field, self.still) if n > 1 else [0] * 3 for k in (i, i + 1)]
            if i not in self.still and not h > 0:
                raise Rejected(f"the duration of segment {i}")
            for g, before, behind in zip([] if i in self.still else guards, *ends, strict=False):
                positive(A, g, nodes[i], h, before, behind)
            M = (A * h).exp()
            kept = [[1, 0, 0, 0, 0, 0], [0, 1, 0, 0, 0, 0], [0, 0, abs(MODES[field][1]), 0, 0, 0]]
            turn = arb_mat(kept) * M * arb_mat(kept).transpose() * turn
            if self.guard(i) == 1 and MODES[field][1]:
                # The inner mass does not feel friction: v_r gains what v_c loses.
                lost = 1 - (B * nodes[after])[2, 0] / (A * nodes[after])[2, 0]
                lost = lost if MODES[self.fields[after]][1] else arb(1)
                turn = arb_mat([[1, 0, 0], [0, 1, lost], [0, 0, 1 - lost]]) * turn
        a, c = turn.trace(), turn.det()
        b = (a * a - (turn * turn).trace()) / 2
        jury = (1 - a + b - c, 1 + a + b + c, 1 - c, 1 + c, 1 - b + a * c - c * c)
        if self.given["stable"] and not all(value > 0 for value in jury):
            raise Rejected("stability")


def check(given: dict[str, Any]) -> None:
    """Accept a certificate, or raise Rejected."""
    ctx.prec = BITS
    try:
        Shooting(given).check()
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise Rejected(f"not a certificate: {error!r}") from error


if __name__ == "__main__":
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as file:
            held = json.load(file)
        for number, one in enumerate(held.get("certificates", [held])):
            try:
                check(one)
                print(f"{path} [{number}]: accepted")
            except Rejected as error:
                print(f"{path} [{number}]: rejected ({error})")
                sys.exit(1)
