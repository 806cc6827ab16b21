"""Check a certificate of a horseshoe: `python horseshoe_checker.py FILE`; needs python-flint alone.

Independent of what made it: Eqs. (7)-(12), and the mean value theorem from switch to switch. A set
is centre + u unstable + s stable with u, s in [-1, 1], in the plane (x_r, v_r) at phase 0 with the
capsule at rest. Exit status 1 if it is rejected.
"""

import json
import re
import sys
from fractions import Fraction
from math import floor
from pathlib import Path
from typing import Any

from flint import arb, arb_mat, ctx

BITS, HALVINGS, DEEPEST, PIECE = 80, 20, 7, 0.25
NUMBER = r"(?!-0$)-?(0|[1-9][0-9]*)(\.[0-9]*[1-9])?"
NAMES = ("alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b")
MODES = {f: (int(f > 3), 1 - (f - 1) % 3) for f in range(1, 7)}  # contact, drift
SIDES = (Fraction(-1), Fraction(1))


class Rejected(Exception):
    """A claim that is not proved."""


def require(held: object, claim: str) -> None:
    """Reject the certificate unless a claim is proved."""
    if held is not True:
        raise Rejected(claim)


class Field:
    """A with y' = A y for y = (x_r, v_r, v_c, alpha cos, alpha sin, 1), and the guards."""

    def __init__(self, field: int, p: dict[str, Any]) -> None:
        contact, self.drift = MODES[field]
        k, bound, side = p["beta"] * contact, p["f_b"], 2 * contact - 1
        P = [1 + k, 2 * p["zeta"], 0, 0, 0, -k * p["delta"]]
        pull = [(f - bound * self.drift * (j == 5)) / p["gamma"] for j, f in enumerate(P)]
        load = [f * abs(self.drift) for f in pull]
        speed = [int(j == 3) - f - c for j, (f, c) in enumerate(zip(P, load, strict=True))]
        turn = [[0, 0, 0, 0, -p["omega"], 0], [0, 0, 0, p["omega"], 0, 0]]
        self.A = arb_mat([[0, 1, 0, 0, 0, 0], speed, load, *turn, [0] * 6])
        guards = [[side, 0, 0, 0, 0, -side * p["delta"]], [0, 0, self.drift, 0, 0, 0]]
        if not self.drift:
            guards[1:] = [[bound * (j == 5) - s * f for j, f in enumerate(P)] for s in (1, -1)]
        self.guards = [arb_mat([guard]) for guard in guards]
        self.rows: dict[Any, Any] = {}

    def flow(self, h: Any) -> Any:
        """exp(A h)."""
        middle = arb(h.mid())
        return (self.A * middle).exp() * (self.A * (h - middle)).exp()

    def positive(self, guard: int, zeros: int, y: Any, end: Any) -> None:
        """Prove a guard positive up to a time; it vanishes `zeros`-fold at the start."""
        last = float(end.upper()) * (1 + 1e-12)
        count = int(last / PIECE) + 1
        pieces = [(PIECE * k, min(PIECE * (k + 1), last), 0) for k in range(count)]
        while pieces:
            low, high, depth = pieces.pop()
            here, slope, rest = self.taylor(guard, zeros if low == 0 else 0, low, high)
            half = arb(0, ((arb(high) - low) / 2).upper())
            value = span(here * y) + half * span(slope * y) + half * half / 2 * span(rest * y)
            if not value > 0:
                require(depth < DEEPEST, "a guard is not seen to be positive")
                middle = (low + high) / 2
                pieces += [(low, middle, depth + 1), (middle, high, depth + 1)]

    def taylor(self, guard: int, order: int, low: float, high: float) -> tuple[Any, Any, Any]:
        """Derivative `order` of a guard at the middle of a piece, the next, and the one after."""
        key = guard, order, low, high
        if key not in self.rows:
            if len(self.rows) > 50000:
                self.rows.clear()
            row = self.guards[guard] * self.A**order
            middle = (arb(low) + high) / 2
            at = row * (self.A * middle).exp()
            around = (self.A * arb(0, ((arb(high) - low) / 2).upper())).exp()
            self.rows[key] = at, at * self.A, at * self.A * self.A * around
        return self.rows[key]  # type: ignore[no-any-return]


def span(row: Any) -> Any:
    """Range of middle and two directions, with factors in [-1, 1]."""
    return row[0, 0] + arb(0, 1) * (abs(row[0, 1]) + abs(row[0, 2]))


def hull(y: Any) -> Any:
    """All states of a form, as a column."""
    return y * arb_mat([[1], [arb(0, 1)], [arb(0, 1)]])


def guard_between(field: int, then: int) -> int:
    """Guard of a field that selects the next one."""
    (c, d), (contact, drift) = MODES[field], MODES[then]
    require((c == contact) != (d == drift), "no guard leads from a field to the next")
    return 0 if c != contact else 1 if d or drift > 0 else 2


def switch(field: Field, guard: int, y: Any, guess: Any) -> tuple[Any, Any, Any]:
    """Duration from the middle, those from all states, and a time before which none is over."""
    row, rate = field.guards[guard], field.guards[guard] * field.A
    middle, box = arb_mat([[r[0]] for r in y.tolist()]), hull(y)
    near = arb(guess)
    for _ in range(8):
        there = field.flow(near) * middle
        move = (row * there)[0, 0] / (rate * there)[0, 0]
        require(abs(move) < 1, "no switch is near the guess")
        near = arb((near - move).mid())
    found = []
    for state, off in (
        (middle, row * field.flow(near) * middle),
        (box, row * field.flow(near) * y),
    ):
        value = span(off) if off.ncols() == 3 else off[0, 0]
        reach = 2 * abs(value / (rate * field.flow(near) * middle)[0, 0]).upper() + arb("1e-20")
        wide = near + arb(0, reach.upper())
        slope = (rate * field.flow(wide) * state)[0, 0]
        require(slope < 0, "a guard is not seen to fall at its switch")
        exact = near - value / slope
        # Each state's guard has exactly one zero in the wide interval, and it is in this one.
        require(abs(exact - near) < reach, "a switch is not enclosed")
        found.append(exact)
    return found[0], found[1], near - reach


def image(fields: dict[int, Field], given: dict[str, Any], y: Any, turn: Any, delta: Any) -> Any:
    """Middle and two directions (6, 3) of the image of y, one period later."""
    order, guesses = given["fields"], [arb(t) for t in given["durations"]]
    spent, late, before = arb(0), arb_mat([[0, 0]]), [0, 0, 0]
    for k, number in enumerate(order):
        field, last = fields[number], k == len(order) - 1
        rests = all(y[2, j] == 0 for j in range(3))
        require(field.drift != 0 or rests, "stick does not begin at rest")
        box, guard = hull(y), None if last else guard_between(number, order[k + 1])
        if guard is None:
            h = turn - spent
            durations = h - (late * arb_mat([[arb(0, 1)], [arb(0, 1)]]))[0, 0]
            require(durations > 0, "a period ends before its last segment")
            until = durations
        else:
            h, durations, until = switch(field, guard, y, guesses[k])
            require(until > 0, "a duration is not positive")
        for g in range(len(field.guards)):
            field.positive(g, before[g], y, until if g == guard else durations)
        flow = field.flow(durations)
        rates, by = field.A * (flow * box), flow * arb_mat([r[1:] for r in y.tolist()])
        if guard is None:
            by -= rates * late
        else:
            row = field.guards[guard]
            moved = (row * by) / -(row * rates)[0, 0]
            by, late, spent = by + rates * moved, late + moved, spent + h
        middle = field.flow(h) * arb_mat([[r[0]] for r in y.tolist()])
        y = arb_mat([[*a, *b] for a, b in zip(middle.tolist(), by.tolist(), strict=True)])
        for j in range(3):  # exact facts
            if guard == 0:
                y[0, j] = arb(0) if j else delta
            if field.drift == 0 or guard == 1:
                y[2, j] = arb(0)
        before = [int(guard == 0), *[0, 0]]
        if guard is not None and field.drift == 0 and guard > 0:
            before[1] = 2  # v_c = 0, and v_c' = 0, for the force is the friction's bound
    return y


class Parallelogram:
    """A set of the certificate."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.given = given
        self.columns = [
            [arb(text) for text in given[name]] for name in ("centre", "unstable", "stable")
        ]
        self.basis = arb_mat([list(row) for row in zip(*self.columns[1:], strict=True)])
        self.inverse = self.basis.inv()
        self.lengths = [
            Fraction(max(abs(float(t)) for t in given[n])) for n in ("unstable", "stable")
        ]

    def part(self, sides: Any) -> Any:
        """States (2, 3) with u and s in intervals."""
        (x, *ways), found = self.columns, []
        for i in range(2):
            shift = [
                rational((a + b) / 2) * way[i] for (a, b), way in zip(sides, ways, strict=True)
            ]
            reach = [
                rational((b - a) / 2) * way[i] for (a, b), way in zip(sides, ways, strict=True)
            ]
            found.append([x[i] + sum(shift), *reach])
        return arb_mat(found)

    def place(self, states: Any) -> tuple[Any, Any]:
        """Ranges of u and s of states (2, 3)."""
        centre = arb_mat([[x, 0, 0] for x in self.columns[0]])
        rows = (self.inverse * (states - centre)).tolist()
        u, s = (span(arb_mat([row])) for row in rows)
        return u, s


def rational(value: Fraction) -> Any:
    """Ball of a fraction."""
    return arb(value.numerator) / value.denominator


class Checker:
    """The sets and coverings of a certificate."""

    def __init__(self, given: dict[str, Any]) -> None:
        read(given)
        p = {name: arb(text) for name, text in given["parameters"].items()}
        require(min(p["omega"], p["gamma"], p["f_b"]) > 0, "the parameters")
        self.given, self.p, self.turn = given, p, 2 * arb.pi() / p["omega"]
        self.fields = {f: Field(f, p) for f in MODES}
        self.sets = [Parallelogram(one) for one in given["sets"]]

    def check(self) -> float:
        """The proved lower bound of the topological entropy."""
        entropy = self.entropy()
        self.disjoint()
        self.coverings()
        return entropy

    def disjoint(self) -> None:
        """Check that no two sets have a point in common."""
        for k, one in enumerate(self.sets):
            for other in self.sets[:k]:
                ranges = [*one.place(other.part([SIDES] * 2)), *other.place(one.part([SIDES] * 2))]
                require(any(abs(r) > 1 for r in ranges), "two sets are not disjoint")

    def coverings(self) -> None:
        """Check every covering."""
        for source in sorted({row["from"] for row in self.given["coverings"]}):
            for u in (SIDES, SIDES[:1] * 2, SIDES[1:] * 2):
                self.covers(source, (u, SIDES), 0)

    def entropy(self) -> float:
        """Logarithm of the least growth of the weights, which the spectral radius reaches."""
        weights, rows = self.given["weights"], self.given["coverings"]
        reached = [
            sum(weights[r["to"]] for r in rows if r["from"] == k) for k in range(len(weights))
        ]
        growth = min(Fraction(a, w) for a, w in zip(reached, weights, strict=True))
        require(growth > 1, "the coverings have no entropy")
        return float(rational(growth).log().lower())

    def covers(self, source: int, part: Any, halvings: int) -> None:
        """Check the image of a part of a set, or of its halves, for every covering."""
        one = self.sets[source]
        try:
            self.image(one, part, source)
        except Rejected:
            if halvings == HALVINGS:
                raise
            sizes = [(b - a) * n for (a, b), n in zip(part, one.lengths, strict=True)]
            at = int(sizes[1] >= sizes[0])
            low, high = part[at]
            for half in ((low, (low + high) / 2), ((low + high) / 2, high)):
                self.covers(source, (half, part[1]) if at == 0 else (part[0], half), halvings + 1)

    def image(self, one: Parallelogram, part: Any, source: int) -> None:
        """Check the image of a part for every covering."""
        others: list[list[Any]] = [[0] * 3, [self.p["alpha"], 0, 0], [0] * 3, [1, 0, 0]]
        y = arb_mat([*one.part(part).tolist(), *others])
        ended = image(self.fields, one.given, y, self.turn, self.p["delta"])
        for row in self.given["coverings"]:
            if row["from"] == source:
                u, s = self.sets[row["to"]].place(arb_mat(ended.tolist()[:2]))
                (low, high), _ = part
                if low == high:
                    require(low.numerator * row["side"] * u > 1, "an edge is not beyond a set")
                require(abs(s) < 1 or abs(u) > 1, "an image leaves a set by its long edges")


def held(text: str) -> Any:
    """Content of a file; raises ValueError for a key twice and for numbers but integers."""

    def refused(number: str) -> Any:
        raise ValueError(f"{number[:20]} is not an integer")

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(found := dict(pairs)) < len(pairs):
            raise ValueError("an object has a key twice")
        return found

    return json.loads(text, object_pairs_hook=once, parse_float=refused, parse_constant=refused)


def read(given: dict[str, Any]) -> None:
    """Reject what is not written as a certificate of a horseshoe."""
    require(
        {*given} == {"kind", "parameters", "sets", "coverings", "weights"}
        and given["kind"] == "horseshoe"
        and {*given["parameters"]} == {*NAMES},
        "the keys of the certificate",
    )
    texts, count = [*given["parameters"].values()], len(given["sets"])
    for one in given["sets"]:
        pairs = [one["centre"], one["unstable"], one["stable"]]
        order, known = one["fields"], {"centre", "unstable", "stable", "fields", "durations"}
        require({*one} == known and {len(pair) for pair in pairs} == {2}, "the keys of a set")
        require({*order} <= {*MODES} and {*map(type, order)} == {int}, "the fields of a set")
        require(len(order) == len(one["durations"]) + 1, "the durations of a set")
        require(
            not MODES[order[0]][1] and not MODES[order[-1]][1], "a period begins or ends in drift"
        )
        texts += [text for pair in (*pairs, one["durations"]) for text in pair]
    short = all(len(text) <= 400 for text in texts)
    require(short and all(re.fullmatch(NUMBER, text) for text in texts), "a number")
    whole, rows = [*given["weights"]], given["coverings"]
    require(len(whole) == count > 0 and min(whole) > 0, "the weights")
    for row in rows:
        require({*row} == {"from", "to", "side"} and row["side"] in (-1, 1), "a covering")
        require(
            0 <= min(row["from"], row["to"]) <= max(row["from"], row["to"]) < count, "a covering"
        )
        whole += row.values()
    require({*map(type, whole)} == {int}, "a whole number")
    require(len({(row["from"], row["to"]) for row in rows}) == len(rows), "a covering twice")


def check_certificate(given: dict[str, Any]) -> float:
    """Lower bound of the entropy for one period; raises Rejected."""
    try:
        ctx.prec = BITS
        return Checker(given).check()
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise Rejected(f"not a certificate: {error!r}") from error


if __name__ == "__main__":
    try:
        if len(sys.argv) != 2:
            sys.exit("usage: python horseshoe_checker.py FILE")
        entropy = check_certificate(held(Path(sys.argv[1]).read_text("utf-8")))
        print(f"accepted: entropy at least {floor(1e6 * entropy) / 1e6:.6f}")
    except (OSError, RecursionError, ValueError, Rejected) as error:
        sys.exit(f"rejected: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
