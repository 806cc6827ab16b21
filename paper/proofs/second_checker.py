"""Check certificates of the capsule system: `python second_checker.py FILE...`; needs Python alone.

It shares no code with `checker.py`, and proves in other ways: intervals of integers, exponentials
by Taylor series with a bound on the rest, the interval Newton method, guards by their Taylor
series from either end, and multipliers by the maps from switch to switch. Forms of certificates,
meaning of their numbers and exit status are those of `checker.py`.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

DEEPEST, HALF = 40, Fraction(1, 2 * 10**30)
FIELDS = {1: (0, 1), 2: (0, 0), 3: (0, -1), 4: (1, 1), 5: (1, 0), 6: (1, -1)}  # contact, drift
NAMES = {"alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b"}
KEYS = {"kind", "fields", "periods", "parameters", "angle", "durations", "states"}
MORE = {"orbit": {"stable"}, "bifurcation": {"free", "still"}, "run": {"end"}}
EXACT = re.compile(r"-?(0|[1-9][0-9]*)(\.[0-9]*[1-9])?", re.ASCII)
ROUNDED = re.compile(r"-?(0|[1-9][0-9]{0,14})\.[0-9]{30}", re.ASCII)


class Rejected(Exception):
    """A claim that is not proved."""


class I:  # noqa: E742 - an interval is this file's number
    """Interval from lo to hi in units of 2**-bits; every operation encloses the exact results."""

    bits = 256
    __slots__ = "hi", "lo"

    def __init__(self, lo: int, hi: int) -> None:
        self.lo, self.hi = lo, hi

    def __add__(self, other: I) -> I:
        return I(self.lo + other.lo, self.hi + other.hi)

    def __sub__(self, other: I) -> I:
        return I(self.lo - other.hi, self.hi - other.lo)

    def __neg__(self) -> I:
        return I(-self.hi, -self.lo)

    def __mul__(self, other: I) -> I:
        a, b, c, d = self.lo, self.hi, other.lo, other.hi
        ends = a * c, a * d, b * c, b * d
        return I(min(ends) >> I.bits, -(-max(ends) >> I.bits))

    def __truediv__(self, other: I) -> I:
        if other.lo <= 0 <= other.hi:
            raise Rejected("a division by an interval that holds 0")
        ends = [Fraction(a << I.bits, b) for a in (self.lo, self.hi) for b in (other.lo, other.hi)]
        return I(min(ends).__floor__(), max(ends).__ceil__())

    def over(self, number: int) -> I:
        """Quotient by an integer above 0."""
        return I(self.lo // number, -(-self.hi // number))

    def size(self) -> int:
        """Largest absolute value, in units."""
        return max(abs(self.lo), abs(self.hi))


def number(value: Any, radius: Any = 0) -> I:
    """Interval around a decimal, an integer or a fraction."""
    low, high = Fraction(value) - Fraction(radius), Fraction(value) + Fraction(radius)
    return I((low * 2**I.bits).__floor__(), (high * 2**I.bits).__ceil__())


def about(size: int) -> I:
    """Interval of all numbers up to a size, in units."""
    return I(-size, size)


def total(parts: Any) -> I:
    """Sum of intervals."""
    low = high = 0
    for one in parts:
        low, high = low + one.lo, high + one.hi
    return I(low, high)


Vector = list[I]
Matrix = list[Vector]


def times(a: Matrix, b: Matrix) -> Matrix:
    """Product of matrices, exact zeros of the first one passed over; sums are rounded once."""
    found, columns = [], [*zip(*b, strict=True)]
    for row in a:
        held = [(k, x.lo, x.hi) for k, x in enumerate(row) if x.lo or x.hi]
        sums = []
        for one in columns:
            low = high = 0
            for k, p, q in held:
                r, s = one[k].lo, one[k].hi
                ends = p * r, p * s, q * r, q * s
                low, high = low + min(ends), high + max(ends)
            sums.append(I(low >> I.bits, -(-high >> I.bits)))
        found.append(sums)
    return found


def unit(n: int) -> Matrix:
    """Unit matrix."""
    return [[number(int(i == j)) for j in range(n)] for i in range(n)]


def column(values: Sequence[I]) -> Matrix:
    """Matrix of one column."""
    return [[x] for x in values]


def norm(a: Matrix) -> int:
    """Bound on the largest row sum of absolute values, in units."""
    return max(sum(x.size() for x in row) for row in a)


def series(a: Matrix, y: Matrix, least: int = 2) -> tuple[list[Matrix], int]:
    """Terms of exp(a) y for norm(a) <= 2, and a bound on each entry of what follows, in units."""
    most, size, terms = norm(a), max(x.size() for row in y for x in row), [y]
    while len(terms) < 9 or size > least:
        k = len(terms)
        terms.append([[x.over(k) for x in row] for row in times(a, terms[-1])])
        size = -(-size * most // (k << I.bits))
    return terms, size


def bounded(a: Matrix) -> Matrix:
    """A matrix, or Rejected if its numbers have too many digits."""
    if norm(a) >> 2 * I.bits:
        raise Rejected("a number is too large")
    return a


def moved(a: Matrix, y: Matrix) -> Matrix:
    """exp(a) y, by the series of a half of a, and its square, as long as norm(a) > 2."""
    if norm(a) > 2 << I.bits:
        half = bounded(moved([[x.over(2) for x in row] for row in bounded(a)], unit(len(a))))
        return times(times(half, half), y)
    terms, rest = series(a, y)
    return [
        [total(term[i][j] for term in terms) + about(rest) for j in range(len(y[0]))]
        for i in range(len(y))
    ]


def scaled(a: Matrix, h: I) -> Matrix:
    """Matrix times a number."""
    return [[x * h for x in row] for row in a]


def solved(a: Matrix) -> Vector:
    """Solution x of the rows (a, b) of a x + b = 0, by Gauss' elimination."""
    a = [*a]
    for k in range(len(a)):
        a[k:] = sorted(a[k:], key=lambda row: -abs(row[k].lo + row[k].hi))
        a[k] = [x / a[k][k] for x in a[k]]
        a = [
            row if j == k else [x - row[k] * y for x, y in zip(row, a[k], strict=True)]
            for j, row in enumerate(a)
        ]
    return [-row[-1] for row in a]


@cache
def pi(bits: int) -> I:
    """Machin's formula, each arc tangent between two partial sums of its alternating series."""
    found = I(0, 0)
    for factor, n in ((16, 5), (-4, 239)):
        sums, term = [Fraction(0)], 0
        while not sums[1:] or abs(sums[-1] - sums[-2]) * 2 ** (bits + 8) > 1:
            sums.append(sums[-1] + Fraction((-1) ** term, (2 * term + 1) * n ** (2 * term + 1)))
            term += 1
        ends = sorted(factor * one for one in sums[-2:])
        found += I(number(ends[0]).lo, number(ends[1]).hi)
    return found


def direction(angle: I) -> tuple[I, I]:
    """Cosine and sine."""
    turn = number(2) * pi(I.bits)
    x = angle - turn * number((angle.lo + angle.hi) // (turn.lo + turn.hi))
    middle, width = I((x.lo + x.hi) // 2, (x.lo + x.hi) // 2), about(x.hi - x.lo)
    (c,), (s,) = moved([[I(0, 0), -middle], [middle, I(0, 0)]], column([number(1), number(0)]))
    return c + width, s + width


def model(field: int, p: dict[str, I]) -> tuple[Matrix, dict[str, Vector]]:
    """Rates of (x_r, v_r, v_c, alpha cos, alpha sin, 1), and the guards of a field by name.

    The rate of v_c is by momentum: friction alone acts on (gamma + 1) v_c + v_r from outside.
    """
    contact, drift = FIELDS[field]
    one, zero = number(1), number(0)
    k, push = p["beta"] * number(contact), p["f_b"] * number(drift)
    pull = [one + k, p["zeta"] * number(2), zero, zero, zero, -(k * p["delta"])]
    drive, friction = [number(int(j == 3)) for j in range(6)], [zero] * 5 + [push]
    share = (one + one / p["gamma"]) if drift else one
    speed = [u - share * f + d / p["gamma"] for u, f, d in zip(drive, pull, friction, strict=True)]
    both = [u - v - d for u, v, d in zip(drive, speed, friction, strict=True)]
    body = [x / (p["gamma"] + one) if drift else zero for x in both]
    a = [[number(int(j == 1)) for j in range(6)], speed, body, [zero] * 6, [zero] * 6, [zero] * 6]
    a[3][4], a[4][3] = -p["omega"], p["omega"]
    side = number(2 * contact - 1)
    guards = {"x": [side] + [zero] * 4 + [-(side * p["delta"])]}
    if drift:
        guards["c"] = [zero, zero, number(drift), zero, zero, zero]
    else:
        bound = [zero] * 5 + [p["f_b"]]
        guards["P1"] = [b - f for b, f in zip(bound, pull, strict=True)]
        guards["P-1"] = [b + f for b, f in zip(bound, pull, strict=True)]
    return a, guards


def positive(a: Matrix, y: Matrix, z: Matrix, h: I, guards: list[Any], depth: int = 0) -> None:
    """Prove guards positive between the states y and z, a duration h apart.

    `guards` are rows, and how often each vanishes at y and at z. The first terms of its series that
    do not vanish are above the sum of all later ones that are negative, and of the rest.
    """
    left, h = guards, I(h.hi, h.hi)
    if norm(scaled(a, h)) <= 2 << I.bits:
        left, ways = [], {}
        for row, before, after in guards:
            if way := 1 if after == 0 else -1 if before == 0 else 0:
                if way not in ways:
                    step = scaled(a, h if way > 0 else -h)
                    ways[way] = series(step, y if way > 0 else z, 1 << I.bits - 80)
                terms, rest = ways[way]
                first, *later = [times([row], term)[0][0].lo for term in terms][before or after :]
                if first + sum(min(0, x) for x in later) - (rest * norm([row]) >> I.bits) > 1:
                    continue
            left.append((row, before, after))
    if not left:
        return
    if depth == DEEPEST:
        raise Rejected("a guard is not seen to be positive")
    half = h.over(2)
    middle = moved(scaled(a, half), y)
    positive(a, y, middle, half, [(row, before, 0) for row, before, _ in left], depth + 1)
    positive(a, middle, z, half, [(row, 0, after) for row, _, after in left], depth + 1)


def product(maps: Sequence[Matrix]) -> Matrix:
    """Product of maps, the last on the left, by halves."""
    half = len(maps) // 2
    return times(product(maps[half:]), product(maps[:half])) if half else maps[0]


def starts(maps: Sequence[Matrix], first: Matrix) -> list[Matrix]:
    """Vectors from which each map begins."""
    if not (half := len(maps) // 2):
        return [first]
    middle = times(product(maps[:half]), first)
    return starts(maps[:half], first) + starts(maps[half:], middle)


def stable(map_of_turn: Matrix) -> bool:
    """True if all eigenvalues are inside the unit circle, False if one is outside; or Rejected.

    Their polynomial is by Newton's identities, and reduced by Schur and Cohn.
    """
    m = [row[:4] for row in map_of_turn[:4]]  # beside the multipliers it has the eigenvalue 0
    powers = [m, times(m, m), times(times(m, m), m)]
    p, q, r = (total(one[k][k] for k in range(4)) for one in powers)
    second = (p * p - q).over(2)
    left = [number(1), -p, second, -(second * p - p * q + r).over(3)]
    while len(left) > 1:
        first, last = left[0], left[-1]
        gap = first * first - last * last
        if gap.hi < 0:
            return False
        if gap.lo <= 0:
            raise Rejected("stability")
        left = [first * x - last * y for x, y in zip(left[:-1], left[:0:-1], strict=True)]
    return True


CHAINS = {"x": ["x", "v"], "P1": ["P1", "P'"], "P-1": ["P-1", "P'"]}


def chain(field: int, guard: str) -> list[str]:
    """Names of a guard and its derivatives, in order; P1 and P-1 are the force at its bounds."""
    return CHAINS.get(guard, ["c", f"P{FIELDS[field][1]}", "P'"])


class Motion:
    """Equations of a motion, for ways from its decimals to a solution near them."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.given, self.fields, self.run = given, given["fields"], given["kind"] == "run"
        self.n, self.still = len(self.fields), given.get("still", [])
        if len({self.n, len(given["states"]), len(given["durations"])}) > 1:
            raise Rejected("states, durations and fields are not of one number")
        if self.still and not self.still[0] < self.n > 1:
            raise Rejected("no such segment of duration 0")
        self.p = {name: number(text) for name, text in given["parameters"].items()}
        self.models = {field: model(field, self.p) for field in {*self.fields}}
        self.turn = number(2 * given["periods"]) * pi(I.bits)

    def event(self, i: int) -> str:
        """Guard that ends segment i."""
        (c, d), (after, e) = (FIELDS[self.fields[k % self.n]] for k in (i, i + 1))
        if (c == after) == (d == e):
            raise Rejected(f"no guard ends segment {i}")
        return "x" if c != after else "c" if d else f"P{e}"

    def known(self, *segments: int) -> set[str]:
        """Names of all that vanishes exactly where some segments end together."""
        found: set[str] = set()
        for j in segments:
            links = chain(self.fields[j % self.n], self.event(j))
            found |= {next((one for one in links if one not in found), links[-1])}
            found |= {"c"} if links[0] in ("P1", "P-1") else set()
        return found

    def zeros(self, i: int, field: int, guard: str) -> int:
        """Number of zeros of a guard of a field where segment i begins."""
        n = self.n
        if n == 1 or (self.run and i in (0, n)):
            return 0
        before = (i - 2, i - 1) if [(i - 1) % n] == self.still else (i - 1,)
        found = self.known(*before, *([i] if [i % n] == self.still else []))
        links = chain(field, guard)
        return next((k for k, one in enumerate(links) if one not in found), len(links))

    def node(self, state: Vector, angle: I, alpha: I) -> Matrix:
        """Extended state."""
        c, s = direction(angle)
        return column([*state, alpha * c, alpha * s, number(1)])

    def flow(self, i: int, h: I) -> Matrix:
        """Flow of segment i over a duration; v_c is no state of stick."""
        found = moved(scaled(self.models[self.fields[i]][0], h), unit(6))
        return [
            row if r != 2 or FIELDS[self.fields[i]][1] else [I(0, 0)] * 6
            for r, row in enumerate(found)
        ]

    def box(self, radius: Any) -> tuple[list[Vector], Vector, Vector, I]:
        """States, durations, angles and alpha, all within a radius of the decimals."""
        given = self.given
        states = [[number(x, radius) for x in state] for state in given["states"]]
        durations = [
            number(h, 0 if [i] == self.still else radius) for i, h in enumerate(given["durations"])
        ]
        angles = [number(given["angle"], 0 if given["angle"] == "0" else radius)]
        for h in durations:
            angles.append(angles[-1] + self.p["omega"] * h)
        alpha = number(given["free"]["alpha"], radius) if self.still else self.p["alpha"]
        return states, durations, angles, alpha

    def link(self, i: int, thin: Any, wide: Any) -> tuple[Matrix, Vector, Vector]:
        """Segment i: linear maps from (x_r, v_r, v_c, angle, alpha, h, 1) at its start.

        They give its end, its duration and its guard on ways from the decimals, with all
        derivatives in the box; h is the duration before a segment of duration 0.
        """
        n, omega, zero = self.n, self.p["omega"], I(0, 0)
        a, guards = self.models[self.fields[i]]
        states, durations, angles, alpha = wide
        y = self.node(states[i], angles[i], alpha)
        (u,), (w,) = y[3:5]
        by = [[*row, zero] for row in unit(6)]
        by[3], by[4], by[5] = (
            [zero] * 3 + [x] + [z] + [zero] * 2 for x, z in ((-w, u), (u, w), (zero, zero))
        )
        for row in by[3:5]:
            row[4] = row[4] / alpha if self.still else zero
        middle = self.flow(i, thin[1][i])
        flow = times(middle, moved(scaled(a, durations[i] - thin[1][i]), unit(6)))
        rate = times(a, times(flow, y))
        end = times(middle, self.node(thin[0][i], thin[2][i], thin[3]))
        ends = [[*row[:6], at] for row, (at,) in zip(times(flow, by), end, strict=True)]
        if n == 1:  # the segment ends with the period
            late = [zero] * 3 + [number(1), zero, zero, thin[2][1] - thin[2][0] - self.turn]
            longer = left = [-(x / omega) for x in late]
        else:
            row, guard = guards[self.event(i)], self.event(i)
            links = chain(self.fields[i], guard)
            if [i] == self.still:
                for _ in range(sum(one in self.known(i - 1) for one in links)):
                    row = times([row], a)[0]
            (left,), ((slope,),) = times([row], ends), times([row], rate)
            longer = [zero] * 7
            if [(i + 1) % n] == self.still:
                longer[5], left[5] = number(1), slope
            elif [i] != self.still:
                longer = [-(x / slope) for x in left]
        after = [*thin[0][(i + 1) % n], zero, zero, zero, zero]
        kept = [*ends[:3], *unit(7)[3:]]
        along = [rate[0][0], rate[1][0], rate[2][0], omega, zero, zero, zero]
        found = [
            [x + v * h for x, h in zip(row, longer, strict=True)]
            for row, v in zip(kept, along, strict=True)
        ]
        return [[*row[:6], row[6] - x] for row, x in zip(found, after, strict=True)], longer, left

    def enclose(self) -> Matrix:
        """Interval Newton: one solution in the box, and only one. Returns the map of a turn."""
        n, one, turn = self.n, unit(7), self.given["durations"]
        if self.still and Fraction(turn[self.still[0]]) != 0:
            raise Rejected("the segment of duration 0 lasts")
        thin, wide = self.box(0), self.box(HALF)
        maps, longer, guards = zip(*(self.link(i, thin, wide) for i in range(n)), strict=True)
        whole = product(maps)
        closed = [
            [x - y for x, y in zip(*rows, strict=True)] for rows in zip(whole, one, strict=True)
        ][:4]
        closed[3][6] += thin[2][n] - thin[2][0] - self.turn
        closed[3:] = [one[3] if n == 1 else closed[3]] + ([] if self.still else one[4:6])
        for i in (k % n for s in self.still for k in (s - 1, s)):
            closed += times([guards[i]], product([one, *maps[:i]]))
        first = column([*solved(closed), number(1)])
        ways = starts(maps, first)
        small = [way[r][0] for way in ways for r in range(3)]
        small += [
            times([by], way)[0][0] for i, (by, way) in enumerate(zip(longer, ways, strict=True))
        ]
        small += [first[3][0], first[4][0]]
        if not all(x.size() * 2 * 10**30 < 1 << I.bits for x in small):
            raise Rejected("a number is not enclosed")
        return whole

    def follow(self) -> tuple[list[Matrix], Vector]:
        """A run from its start, by Newton's method: extended states at all ends, and durations."""
        given, omega, n, alpha = self.given, self.p["omega"], self.n, self.p["alpha"]
        state, angle = [number(x) for x in given["states"][0]], number(given["angle"])
        if not FIELDS[self.fields[0]][1] and given["states"][0][2] != "0":
            raise Rejected("a capsule that sticks is at rest")
        nodes, durations = [self.node(state, angle, alpha)], []
        for i, text in enumerate(given["durations"]):
            a, guards = self.models[self.fields[i]]
            near = times(self.flow(i, number(text)), nodes[-1])
            way = (self.turn - angle) / omega - number(text)
            if i < n - 1:
                row, way = guards[self.event(i)], number(0, HALF)
                for _ in range(6):
                    middle = I((way.lo + way.hi) // 2, (way.lo + way.hi) // 2)
                    ((value,),) = times([row], moved(scaled(a, middle), near))
                    ((slope,),) = times([row], times(a, moved(scaled(a, way), near)))
                    way = small(middle - value / slope)
            end = moved(scaled(a, small(way)), near)
            state = [x for (x,) in end[:2]] + [end[2][0] if FIELDS[self.fields[i]][1] else I(0, 0)]
            for x, claim in zip(state, [*given["states"][1:], given["end"]][i], strict=True):
                small(x - number(claim))
            durations.append(number(text) + way)
            angle += omega * durations[-1]
            nodes.append(self.node(state, angle, alpha))
        return nodes, durations

    def begins(self, angles: Vector) -> None:
        """Prove that it begins in the first turn, and an orbit at its switch of least phase."""
        turns = [angle / (number(2) * pi(I.bits)) for angle in angles]
        wholes = {turn.lo >> I.bits for turn in turns[:1]} | {turns[0].hi >> I.bits}
        later = turns[2 if self.still == [0] else 1 :]
        apart = all((x.lo >> I.bits) == (x.hi >> I.bits) for x in later)
        if wholes != {0} or not apart or any(x.lo % (1 << I.bits) <= turns[0].hi for x in later):
            raise Rejected("the first segment is not seen to begin at the least phase")

    def check(self) -> None:
        """Existence, start, itinerary, stability."""
        if self.run:
            nodes, durations = self.follow()
            self.begins([number(self.given["angle"])])
        else:
            whole = self.enclose()
            states, durations, angles, alpha = self.box(HALF)
            self.begins(angles[: self.n])
            nodes = [
                self.node(*one, alpha) for one in zip([*states, states[0]], angles, strict=True)
            ]
        for i, field in enumerate(self.fields):
            if [i] == self.still:
                continue
            if durations[i].lo <= 0:
                raise Rejected(f"the duration of segment {i}")
            a, guards = self.models[field]
            rows = [
                (row, *(self.zeros(k, field, name) for k in (i, i + 1)))
                for name, row in guards.items()
            ]
            positive(a, nodes[i], nodes[i + 1], durations[i], rows)
        if self.given["kind"] == "orbit" and stable(whole) != self.given["stable"]:
            raise Rejected("stability")


def small(x: I) -> I:
    """A way that is shorter than half a unit of the last decimal, or Rejected."""
    if x.size() * 2 * 10**30 >= 1 << I.bits:
        raise Rejected("a number is not enclosed")
    return x


def well_formed(given: Any) -> bool:
    """True for a certificate of the form that the schema gives."""

    def texts(one: Any, kind: re.Pattern[str], count: int = 0, signed: bool = False) -> bool:
        if not isinstance(one, list) or not one or count not in (0, len(one)):
            return False
        good = all(isinstance(x, str) and len(x) <= 400 and kind.fullmatch(x) for x in one)
        return good and not any(x[0] == "-" and not (signed and x.strip("-0.")) for x in one)

    def whole(one: Any, most: int, least: int = 1) -> bool:
        return type(one) is int and least <= one <= most

    kind = given.get("kind") if isinstance(given, dict) else None
    if not isinstance(kind, str) or kind not in MORE or given.keys() != KEYS | MORE[kind]:
        return False
    fields, angle, states, p = (given[k] for k in ("fields", "angle", "states", "parameters"))
    if not (isinstance(fields, list) and isinstance(states, list) and isinstance(p, dict)):
        return False
    run, unswitched = kind == "run", kind == "orbit" and len(fields) == 1
    shapes = [texts(x, EXACT if run and not k else ROUNDED, 3, True) for k, x in enumerate(states)]
    good = [
        fields and all(whole(field, 6) for field in fields),
        whole(given["periods"], 1 if unswitched else 10**6),
        p.keys() == (NAMES - {"alpha"} if kind == "bifurcation" else NAMES),
        texts([*p.values()], EXACT),
        angle == "0" if unswitched else texts([angle], EXACT if run else ROUNDED),
        texts(given["durations"], ROUNDED) and shapes and all(shapes),
    ]
    if kind == "bifurcation":
        free, still = given["free"], given["still"]
        good.append(
            isinstance(free, dict) and free.keys() == {"alpha"} and texts([*free.values()], ROUNDED)
        )
        good.append(isinstance(still, list) and len(still) == 1 and whole(still[0], 10**6 - 1, 0))
    return (
        all(good)
        and (kind != "orbit" or type(given["stable"]) is bool)
        and (not run or texts(given["end"], ROUNDED, 3, True))
    )


def check_certificate(given: Any) -> None:
    """Accept a certificate, or raise Rejected."""
    if not well_formed(given):
        raise Rejected("not of the form that the schema gives")
    I.bits = 256 + (8 * len(given["fields"]) if given["kind"] == "run" else 0)
    try:
        Motion(given).check()
    except ArithmeticError as error:
        raise Rejected(str(error)) from error


def read(path: str) -> list[Any]:
    """Certificates of a file; raises OSError, RecursionError, ValueError or Rejected."""

    def refused(text: str) -> Any:
        raise ValueError(f"{text[:20]} is not an integer")

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len({key for key, _ in pairs}) < len(pairs):
            raise ValueError("an object has a key twice")
        return dict(pairs)

    text = Path(path).read_bytes().decode("utf-8")
    held = json.loads(text, object_pairs_hook=once, parse_float=refused, parse_constant=refused)
    if not isinstance(held, dict) or held.keys() != {"version", "certificates"}:
        raise Rejected("not a file of the form that the schema gives")
    found = held["certificates"]
    if type(held["version"]) is not int or held["version"] != 1 or not isinstance(found, list):
        raise Rejected("not a file of the version 1")
    if not found or any(one in found[:k] for k, one in enumerate(found)):
        raise Rejected("no certificate, or one twice")
    return found


def main(paths: list[str]) -> int:
    """Exit status of the command: 0, 1 or 2.

    It prints a line for each certificate of a file, up to the first rejected one.
    """
    status = 0
    for path in paths:
        at = path
        try:
            for k, one in enumerate(read(path)):
                at = f"{path} [{k}]"
                check_certificate(one)
                print(f"{at}: accepted", flush=True)
        except Rejected as error:
            status = max(status, 1)
            print(f"{at}: rejected ({error})")
        except (OSError, RecursionError, ValueError) as error:
            status = 2
            print(f"{path}: cannot be read ({error})", file=sys.stderr)
    return status


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]) if sys.argv[1:] else "usage: python second_checker.py FILE...")
    except KeyboardInterrupt:
        sys.exit(130)
