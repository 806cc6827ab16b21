"""Check certificates of the capsule system: `python checker.py FILE...`; needs python-flint alone.

Independent of what made them: Eqs. (7)-(12), flint's exponential of their matrices, and comparisons
of balls. A number with 30 decimals is rounded: it stands for all within half a unit of the last
one. Parameters and the start of a run are exact. A file is checked up to its first rejected
certificate. Exit status: 0 if all are accepted, 1 if one is rejected or no file is given, 2 if a
file cannot be read as JSON, 130 after Ctrl-C.
"""

import json
import re
import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

from flint import arb, arb_mat, ctx

VERSION, BITS, DEEPEST = 1, 256, 40
NAMES = ("alpha", "omega", "delta", "zeta", "beta", "gamma", "f_b")
MODES = {f: (int(f > 3), 1 - (f - 1) % 3) for f in range(1, 7)}  # contact, drift
HALF, UNIT = arb("0.5") / 10**30, arb_mat(7, 7, 1).tolist()
ONE, PHASE = arb_mat([UNIT[6]]), arb_mat([UNIT[3]]).transpose()

GIVEN, FOUND = r"(0|[1-9][0-9]*)(\.[0-9]*[1-9])?", r"(0|[1-9][0-9]{0,14})\.[0-9]{30}"
EXACT, ROUNDED = rf"(?!-0$)-?{GIVEN}", rf"(?!-0\.0*$)-?{FOUND}"
STATE = (ROUNDED,) * 3
MOTION = {
    "fields": [range(1, 7)],
    "periods": range(1, 10**6 + 1),
    "parameters": dict.fromkeys(NAMES, GIVEN),
    "angle": FOUND,
    "durations": [FOUND],
    "states": [STATE],
}
UNSWITCHED = {"periods": range(1, 2), "angle": "0"}
SOLVED = {"parameters": dict.fromkeys(NAMES[1:], GIVEN), "free": {"alpha": FOUND}}
FORMS: dict[str, dict[str, Any]] = {
    "orbit": MOTION | {"stable": bool},
    "bifurcation": MOTION | SOLVED | {"still": (range(10**6),)},
    "run": MOTION | {"angle": GIVEN, "states": [(EXACT,) * 3, STATE], "end": STATE},
}


class Rejected(Exception):
    """Raised for a certificate of another form, or with a claim that is not proved."""


def fit(form: Any, given: Any, at: str) -> None:
    """Raise Rejected with the place that is not of its form; the last form of a list repeats."""
    good: Any
    if isinstance(form, str):
        good = isinstance(given, str) and len(given) <= 400 and re.fullmatch(form, given)
    elif isinstance(form, dict):
        good = isinstance(given, dict) and given.keys() == form.keys()
    elif isinstance(form, list | tuple):
        more = isinstance(form, list) and given != []
        good = isinstance(given, list) and (more or len(given) == len(form))
    else:
        whole = type(given) is int and isinstance(form, range)
        good = given in form if whole else type(given) is form
    if not good:
        raise Rejected(f"{at}: not of the form that the schema gives")
    for key, part in form.items() if isinstance(form, dict) else ():
        fit(part, given[key], f"{at}.{key}")
    for k, one in enumerate(given) if isinstance(form, list | tuple) else ():
        fit(form[min(k, len(form) - 1)], one, f"{at}[{k}]")


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


def positive(A: Any, guards: list[tuple[Any, int, int]], y: Any, h: Any) -> None:
    """Prove guards positive inside (0, h), given with how often each vanishes at 0 and at h.

    Raises Rejected if one is not proved positive within DEEPEST halvings of an eighth of h.
    """
    longest = h.upper()
    rates: list[Any] = [
        (arb_mat([(g * A**k).tolist()[0] for k in range(7)]), *zeros) for g, *zeros in guards
    ]
    ends = [longest / 8 * k for k in range(8)] + [longest]
    pieces: list[Any] = [(*span, 0, rates) for span in pairwise(ends)]
    while pieces:
        low, high, depth, left = pieces.pop()
        middle, step = (low + high) / 2, arb(0, ((high - low) / 2).upper())
        state = (A * middle).exp() * y
        ahead, unproved = (A * step).exp() * state, []
        for rate, before, after in left:
            here, far = (rate * state).tolist(), (rate * ahead).tolist()
            around = zip(here, here[1:], far[2:], strict=False)
            value = [x + v * step + r * step * step / 2 for (x,), (v,), (r,) in around]
            first, last = before if low == 0 else 0, after if high >= longest else 0  # never both
            if not (-1) ** last * value[first + last] > 0:
                unproved.append((rate, before, after))
        if unproved and depth == DEEPEST:
            raise Rejected("a guard is not seen to be positive")
        halves = ((low, middle), (middle, high)) if unproved else ()
        pieces += [(*half, depth + 1, unproved) for half in halves]


def product(maps: list[Any]) -> Any:
    """Product of maps, the last on the left; by halves, so that radii do not grow with each."""
    half = len(maps) // 2
    return product(maps[half:]) * product(maps[:half]) if half else maps[0]


def starts(maps: list[Any], first: Any) -> list[Any]:
    """Vectors to which each of the maps applies: the first one, and its images."""
    half = len(maps) // 2
    there = [(maps[half:], product(maps[:half]) * first)] if half else []
    return (
        [y for part in [(maps[:half], first), *there] for y in starts(*part)] if half else [first]
    )


class Equations:
    """The equations of a motion in its states, durations, angle, and alpha if it is free."""

    def __init__(self, given: dict[str, Any]) -> None:
        self.given, self.fields, self.kind = given, given["fields"], given["kind"]
        self.n, self.still = len(self.fields), given.get("still", [])
        sizes = {len(given["states"]), len(given["durations"]), self.n}
        if len(sizes) > 1 or (self.still and not self.still[0] < self.n > 1):
            raise Rejected("states, durations and fields are not of one number")
        texts = [t for s in given["states"] for t in s] + given["durations"] + [given["angle"]]
        texts += [*given.get("free", {}).values(), *given.get("end", [])]
        exact = [0, 1, 2, 4 * self.n] if self.kind == "run" else [4] if self.n == 1 else []
        if self.kind == "run" and not (MODES[self.fields[0]][1] or texts[2] == "0"):
            raise Rejected("a capsule that sticks is at rest")
        self.middle = [arb(text) for text in texts]
        self.radius = [arb(0) if s in exact else HALF for s in range(len(texts))]

    def parameters(self, z: Any) -> dict[str, Any]:
        """The parameters, alpha from the unknowns if it is free."""
        found = {name: arb(text) for name, text in self.given["parameters"].items()}
        return found | ({"alpha": z[4 * self.n + 1]} if self.still else {})

    def guard(self, i: int) -> int | None:
        """Guard of segment i that selects the next field; None if nothing ever switches.

        Raises Rejected if no guard leads from the one field to the other.
        """
        (c, d), (after, e) = (MODES[self.fields[k % self.n]] for k in (i, i + 1))
        if self.n > 1 and (c == after) == (d == e):
            raise Rejected(f"no guard ends segment {i}")
        return None if self.n == 1 else 0 if c != after else 1 if d or e > 0 else 2

    def orders(self, i: int, field: int, still: list[int]) -> list[int]:
        """Number of zeros of each guard of a field at the start of segment i, by exact facts."""
        if (n := self.n) == 1 or (self.kind == "run" and i in (0, n)):  # no switch
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

    def angle(self, z: Any, i: int) -> Any:
        """Angle of the excitation where segment i begins."""
        return z[4 * self.n] + self.parameters(z)["omega"] * sum(z[3 * self.n : 3 * self.n + i])

    def start(self, z: Any, i: int) -> Any:
        """Column x_r, v_r, v_c, angle, alpha where segment i begins, 0 and 0."""
        column = *z[3 * i : 3 * i + 3], self.angle(z, i), self.parameters(z)["alpha"], 0, 0
        return arb_mat([[x] for x in column])

    def node(self, z: Any, i: int) -> Any:
        """The extended state where segment i begins."""
        s, c = (self.parameters(z)["alpha"] * x for x in self.angle(z, i).sin_cos())
        return arb_mat([[x] for x in (*z[3 * i : 3 * i + 3], c, s, 1)])

    def ended(self, z: Any, i: int) -> tuple[Any, Any, Any]:
        """End of segment i, its derivative by `start`, and its rate."""
        A, y, by = rows(self.fields[i], self.parameters(z))[0], self.node(z, i), arb_mat(6, 7)
        by[0, 0], by[1, 1], by[2, 2], by[3, 3], by[4, 3] = 1, 1, 1, -y[4, 0], y[3, 0]
        if self.still:
            by[3, 4], by[4, 4] = (y[r, 0] / z[4 * self.n + 1] for r in (3, 4))
        M = flow(self.fields[i], A, z[3 * self.n + i])
        return M * y, M * by, A * M * y

    def linear(self, box: list[Any], i: int) -> tuple[Any, Any, Any]:
        """Krawczyk's equations of segment i: its end, duration and guard, by its start.

        They are rows for (x_r, v_r, v_c, angle, alpha, h, 1), the way from the middle to the image
        of the box, where h is for the duration before a segment of duration 0. The factors of 1 are
        the residuals at the middle, and what the derivatives in the box differ by.
        """
        n, m, at, p = self.n, self.middle, 3 * self.n + i, self.parameters(self.middle)
        (end, by, rate), (_, wide, fast) = self.ended(m, i), self.ended(box, i)
        end += (by - wide) * (self.start(box, i) - self.start(m, i))
        by += (end + (rate - fast) * (box[at] - m[at])) * ONE
        (A, guards), guard = rows(self.fields[i], p), self.guard(i)
        # A guard is divided by the zeros that it has by exact facts.
        order = self.orders(i, self.fields[i], [])[guard or 0] if i in self.still else 0
        row = guards[guard or 0] * A**order
        if i in self.still:
            longer, left = arb_mat(1, 7), row * by
        elif (i + 1) % n in self.still:
            longer = arb_mat([UNIT[5]])
            left = row * by + (row * rate) * longer
        elif guard is None:  # the segment ends with the period
            longer = left = (PHASE.transpose() + self.late(m) * ONE) * (-1 / p["omega"])
        else:
            longer = left = row * by * (-1 / (row * rate)[0, 0])
        along = arb_mat([*rate.tolist()[:3], [p["omega"]], [0], [0], [0]])
        after = arb_mat([*self.start(m, (i + 1) % n).tolist()[:3], *4 * [[0]]])
        return arb_mat([*by.tolist()[:3], *UNIT[3:]]) + along * longer - after * ONE, longer, left

    def late(self, z: list[Any]) -> Any:
        """Angle by which a motion takes longer than its periods."""
        return self.angle(z, self.n) - z[4 * self.n] - 2 * self.given["periods"] * arb.pi()

    def claimed(self, s: int, value: Any) -> Any:
        """A value that lies where its digits say, or Rejected."""
        if not abs(value - self.middle[s]) < self.radius[s]:
            raise Rejected(f"number {s} is not enclosed")
        return value

    def enclose(self) -> list[Any]:
        """Box of the certificate's digits, proved to hold one solution, and only one.

        Krawczyk's operator maps it into itself; Rejected is raised if it does not. The inverse of
        the equations at the middle is applied by elimination, segment by segment.
        """
        n, m, still = self.n, self.middle, [3 * self.n + s for s in self.still]
        for at in still:
            m[at] = self.claimed(at, arb(0))
        box = [
            x + (at not in still) * arb(0, r.upper())
            for at, (x, r) in enumerate(zip(m, self.radius, strict=True))
        ]
        maps, longer, guards = map(list, zip(*(self.linear(box, i) for i in range(n)), strict=True))
        *closed, phase, _, _, _ = (
            product(maps) - arb_mat(UNIT) + self.late(m) * PHASE * ONE
        ).tolist()
        closed.append(UNIT[3] if n == 1 else phase)
        closed += [] if self.still else [UNIT[4], UNIT[5]]
        for i in (k % n for s in self.still for k in (s - 1, s)):
            closed += (guards[i] * product([arb_mat(UNIT), *maps[:i]])).tolist()
        first = arb_mat([r[:6] for r in closed]).solve(arb_mat([[-r[6]] for r in closed]))
        ways = starts(maps, arb_mat([*first.tolist(), [1]]))
        moved = [way[r, 0] for way in ways for r in range(3)]
        moved += [(by * way)[0, 0] for by, way in zip(longer, ways, strict=True)]
        moved += [first[3, 0], first[4, 0]]
        for s, (x, by, r) in enumerate(zip(m, moved, self.radius, strict=False)):
            if r > 0 and s not in still:
                self.claimed(s, x + by)
        return box

    def follow(self) -> list[Any]:
        """Box of a run, from its start on: each switch by Newton's method over all of its digits.

        Raises Rejected if a value is not where its digits say.
        """
        z, n, p = [*self.middle], self.n, self.parameters(self.middle)
        for i, field in enumerate(self.fields):
            (A, guards), y, at, last = rows(field, p), self.node(z, i), 3 * n + i, i == n - 1
            h = (2 * self.given["periods"] * arb.pi() - z[4 * n]) / p["omega"] - sum(z[3 * n : at])
            if not last:
                row, h = guards[self.guard(i) or 0], z[at] + arb(0, self.radius[at].upper())
                for _ in range(6):
                    here, slope = (A * arb(h.mid())).exp() * y, row * A * (A * h).exp() * y
                    h = self.claimed(at, arb(h.mid()) - (row * here)[0, 0] / slope[0, 0])
            end, to = flow(field, A, h) * y, 4 * n + 1 if last else 3 * i + 3
            for s, value in ((at, h), *((to + r, end[r, 0]) for r in range(3))):
                z[s] = self.claimed(s, value)
        return z

    def begins(self, z: list[Any]) -> None:
        """Prove that a motion begins in the first turn, an orbit at its switch of least phase."""
        ends = self.n if self.kind != "run" else 1
        turns = [self.angle(z, i) / (2 * arb.pi()) for i in range(ends) if [i - 1] != self.still]
        if not (0 <= turns[0] < 1 and all(turns[0] < turn - turn.floor() for turn in turns[1:])):
            raise Rejected("the first segment is not seen to begin at the least phase")

    def monodromy(self, box: list[Any]) -> Any:
        """Derivative of the state after the periods by that at the start."""
        n, p, turns = self.n, self.parameters(box), []
        for i, field in enumerate(self.fields):
            following = self.fields[(i + 1) % n]
            (A, _), (B, _) = rows(field, p), rows(following, p)
            turns.append(arb_mat([r[:3] for r in flow(field, A, box[3 * n + i]).tolist()[:3]]))
            if self.guard(i) == 1 and MODES[field][1]:
                # The inner mass does not feel friction: v_r gains what v_c loses.
                y, drifts = self.node(box, (i + 1) % n), abs(MODES[following][1])
                lost = 1 - drifts * (B * y)[2, 0] / (A * y)[2, 0]
                turns.append(arb_mat([[1, 0, 0], [0, 1, lost], [0, 0, 1 - lost]]))
        return product(turns)

    def check(self) -> None:
        """Existence, uniqueness, then the itinerary, then what else is claimed of it."""
        box, n = self.follow() if self.kind == "run" else self.enclose(), self.n
        self.begins(box)
        for i in (k for k in range(n) if k not in self.still):
            field, y, h = self.fields[i], self.node(box, i), box[3 * n + i]
            A, guards = rows(field, self.parameters(box))
            ends = [self.orders(k, field, self.still) for k in (i, i + 1)]
            if not h > 0:
                raise Rejected(f"the duration of segment {i}")
            with ctx.workprec(BITS // 2):
                positive(A, [*zip(guards, *ends, strict=False)], y, h)
        if self.kind == "orbit":
            conditions = jury(self.monodromy(box))
            proved = all(x > 0 for x in conditions), any(x < 0 for x in conditions)
            if not proved[0 if self.given["stable"] else 1]:
                raise Rejected("stability")


def jury(turn: Any) -> tuple[Any, ...]:
    """Conditions that are above 0 if all multipliers are inside the unit circle, and only then."""
    a, b, c = turn.trace(), (turn.trace() ** 2 - (turn * turn).trace()) / 2, turn.det()
    return 1 - a + b - c, 1 + a + b + c, 1 - c, 1 + c, 1 - b + a * c - c * c


def check_certificate(given: Any) -> None:
    """Accept a certificate, or raise Rejected.

    The check repeats the proof with code of its own, in ball arithmetic. It does not use what made
    the certificate. The extra `symbolic` is needed.

    Parameters
    ----------
    given : dict
        Certificate of an orbit, a bifurcation or a run, of the form that certificates.schema.json
        gives. Numbers are decimals as texts, dimensionless.

    Returns
    -------
    None
        If the certificate is accepted.

    Raises
    ------
    Rejected
        For a certificate of another form, and for a claim that is not proved, with the reason.

    Notes
    -----
    The check uses Eqs. (7)-(12) of the paper, flint's exponential of their matrices, and
    comparisons of balls. A number with 30 decimals stands for all within half a unit of the last
    one; parameters and the start of a run are exact.

    See Also
    --------
    certify_orbit, certify_bifurcation, certify_run : certificates.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> certificate = cs.certify_orbit(cs.solve_orbit(cs.Parameters(alpha=0.9)))
    >>> cs.check_certificate(certificate)
    >>> try:
    ...     cs.check_certificate(certificate | {"stable": False})
    ... except cs.results.Rejected as error:
    ...     print(error)
    stability
    """
    kind = given.get("kind") if isinstance(given, dict) else None
    if not (isinstance(kind, str) and kind in FORMS):
        raise Rejected(f"kind: none of those that the schema gives, {', '.join(FORMS)}")
    form = {"kind": kind} | FORMS[kind]
    if kind == "orbit" and given.get("fields") in [[field] for field in MODES]:
        form |= UNSWITCHED
    fit(form, given, kind)
    try:
        with ctx.workprec(BITS + 4 * len(given["fields"]) * (kind == "run")):  # roundings grow
            Equations(given).check()
    except (ArithmeticError, ValueError) as error:
        raise Rejected(str(error)) from error


def read(path: str) -> list[Any]:
    """Certificates of a file; raises OSError, ValueError, RecursionError if it cannot be read.

    Raises Rejected for another form or version, and for a certificate that is given twice.
    """

    def refused(text: str) -> Any:
        raise ValueError(f"{text[:20]} is not an integer")

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(found := dict(pairs)) < len(pairs):
            raise ValueError("an object has a key twice")
        return found

    text = Path(path).read_text("utf-8")
    held = json.loads(text, object_pairs_hook=once, parse_float=refused, parse_constant=refused)
    fit({"version": range(VERSION, VERSION + 1), "certificates": [dict]}, held, "file")
    if any(one in held["certificates"][:k] for k, one in enumerate(held["certificates"])):
        raise Rejected("file.certificates: one is given twice")
    return list(held["certificates"])


def main(paths: list[str]) -> int:
    """Exit status of the command: 0, 1 or 2.

    It prints a line for each certificate of a file, up to the first rejected one.
    """
    status = 0
    for path in paths:
        at = path
        try:
            for number, one in enumerate(read(path)):
                at = f"{path} [{number}]"
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
        sys.exit(main(sys.argv[1:]) if sys.argv[1:] else "usage: python checker.py FILE...")
    except KeyboardInterrupt:
        sys.exit(130)
