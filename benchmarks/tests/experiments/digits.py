"""Scenes to any number of digits: Taylor steps in mpmath, every root of a guard isolated.

The equations of motion are stated here once more, apart from `tests/scenes/integrator.c`; how
polynomials are searched for roots is shared with the judge of the capsule.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from mpmath import mp, mpf

from tests.judges.taylor_events import Undecided, _clear, _deflate, _first_root, _order, _value
from tests.scenes import GENERAL, Form, Start

_GUARD_DIGITS = 15


class Piece(NamedTuple):
    """A segment: number of its field, its event as the integrator names it, and duration."""

    field: int
    event: str
    duration: Any


class Motion:
    """A run of a scene from a start, in so many digits; raises Undecided where they do not do."""

    def __init__(self, form: Form, start: Start, digits: int = 50) -> None:
        self.form, self.digits = form, digits
        with self.precision():
            numbers = map(mpf, form.general(start.parameters))
            self.p = dict(zip(GENERAL, numbers, strict=True))
            self.period = 2 * mp.pi / self.p["omega"]
            self.state = [*map(mpf, start.state), mpf(0)]
            self.t, self.turns = mpf(start.phase), 0
            self.level = int(form.pulsed and self.t >= self.p["D"] * self.period)
            self.zero = mpf(10) ** -digits

    def precision(self) -> Any:
        """The number of digits carried."""
        return mp.workdps(self.digits + _GUARD_DIGITS)

    def go(self, periods: int, most: int = 10**6) -> list[Piece]:
        """Segments until the end of a period; the state is then that at the end."""
        pieces = []
        with self.precision():
            while self.turns < periods and len(pieces) < most:
                contact, way = self.field()
                pieces.append(self.segment(contact, way, periods))
        return pieces

    def stop(self, contact: int) -> Any:
        """x_r at which a contact's spring begins to act."""
        return (mpf(0), self.p["delta_1"], -self.p["delta_2"])[contact]

    def series(
        self, contact: int, way: int, state: list[Any], t: Any, step: Any, order: int
    ) -> Any:
        """Coefficients of (x_r, v_r, v_c, x_c, P, Q) in powers of time over `step`."""
        p, kappa = self.p, (mpf(0), self.p["beta_1"], self.p["beta_2"])[contact]
        if self.form.pulsed:
            u = [p["alpha_low" if self.level else "alpha"]] + [mpf(0)] * order
        else:
            angle, rate = p["omega"] * t, p["omega"] * step
            turned = (mp.cos(angle), -mp.sin(angle), -mp.cos(angle), mp.sin(angle))
            u = [p["alpha"] * turned[k % 4] * rate**k / mp.factorial(k) for k in range(order + 1)]
        bound = {1: p["f_plus"], 0: mpf(0), -1: -p["f_minus"]}[way]
        x, v, c, y = ([value] for value in state)
        pull: list[Any] = []
        push: list[Any] = []
        for k in range(order + 1):
            gap = x[k] - self.stop(contact) if k == 0 else x[k]
            pull.append(x[k] + 2 * p["zeta"] * v[k] + kappa * gap)
            push.append(pull[k] - self.form.reacts * u[k])
            constant = mpf(k == 0)
            slip = (push[k] - constant * bound) / p["gamma"] if way else mpf(0)
            for column, rate in (
                (x, v[k]),
                (v, u[k] - constant * p["s"] - pull[k] - slip),
                (c, slip),
                (y, c[k]),
            ):
                column.append(step * rate / (k + 1))
        return [column[: order + 1] for column in (x, v, c, y, push)]

    def guards(self, contact: int, way: int, columns: Any) -> dict[str, list[Any]]:
        """Functions that are positive within a field, by the event that ends it."""
        x, _, c, _, push = columns
        found = {}
        for side, event in ((1, "F"), (2, "B"))[: self.form.stops]:
            if contact in {0, side}:
                sign = (1 if side == 1 else -1) * (1 if contact else -1)
                found[event] = [sign * (x[0] - self.stop(side)), *(sign * a for a in x[1:])]
        if way:
            found["V"] = [way * a for a in c]
        else:
            found["U"] = [self.p["f_plus"] - push[0], *(-a for a in push[1:])]
            found["L"] = [self.p["f_minus"] + push[0], *push[1:]]
        return found

    def longest(self, contact: int, way: int) -> Any:
        """A step over which coefficient k is at most a constant over k!."""
        p = self.p
        share = 1 + 1 / p["gamma"] if way else mpf(1)
        stiffness = share * (1 + (0, p["beta_1"], p["beta_2"])[contact])
        damping = share * p["zeta"]
        rate = damping + mp.sqrt(damping**2 + stiffness)
        return 1 / (rate if self.form.pulsed else max(rate, p["omega"]))

    def field(self) -> tuple[int, int]:
        """Contact and way of the one field whose own solution stays in its region."""
        fits = []
        for contact in range(self.form.stops + 1):
            for way in (1, 0, -1):
                if self.state[2] and way != mp.sign(self.state[2]):
                    continue
                step = self.longest(contact, way)
                columns = self.series(contact, way, self.state, self.t, step, 10)
                stays = True
                for event, guard in self.guards(contact, way, columns).items():
                    left = _deflate(guard, self.zero)
                    closed = contact > 0 if event in "FB" else way == 0
                    stays = stays and (left[0] > 0 if left else closed)
                if stays:
                    fits.append((contact, way))
        if len(fits) != 1:
            raise Undecided(f"one field must hold, not {fits}")
        return fits[0]

    def segment(self, contact: int, way: int, periods: int) -> Piece:
        """The segment in a field, to its first event; moves the state and the time there."""
        ends = {"E": (periods - self.turns) * self.period - self.t}
        if self.form.pulsed:
            edge = self.period if self.level else self.p["D"] * self.period
            ends = {"R" if self.level else "D": edge - self.t}
        ((event, total),) = ends.items()
        gone, order, resting = mpf(0), _order(), set()
        name = 3 * ((1 + self.form.stops) * self.level + contact) + 2 - way
        while True:
            step = min(self.longest(contact, way), total - gone)
            while True:
                columns = self.series(contact, way, self.state, self.t + gone, step, order)
                guards = self.guards(contact, way, columns)
                if not gone:
                    guards = {one: _deflate(guard, self.zero) for one, guard in guards.items()}
                    resting = {one for one, guard in guards.items() if not guard}
                guards = {one: guard for one, guard in guards.items() if one not in resting}
                if any(guard[0] <= 0 for guard in guards.values()):
                    raise Undecided("a field is left at once")
                if all(_clear(guard) for guard in guards.values()):
                    break
                if step == total - gone:
                    raise Undecided("a guard vanishes at an edge")
                step *= mpf("0.9")
            roots = {one: _first_root(guard) for one, guard in guards.items()}
            found = {one: root for one, root in roots.items() if root is not None}
            first = min(found, key=lambda one: found[one], default="")
            u = found.get(first, mpf(1))
            self.state = [_value(column, u) for column in columns[:4]]
            if not first and step != total - gone:
                gone += step
                continue
            self._arrive(first or event, gone + u * step if first else total)
            return Piece(name, first or event, gone + u * step if first else total)

    def _arrive(self, event: str, duration: Any) -> None:
        """Put the state exactly on what it reached, and the time and the drive's level there."""
        if event in {"F", "B"}:
            self.state[0] = self.stop(1 if event == "F" else 2)
        if event == "V":
            self.state[2] = mpf(0)
        self.t += duration
        if event == "D":
            self.t, self.level = self.p["D"] * self.period, 1
        if event == "R":
            self.t, self.level, self.turns = mpf(0), 0, self.turns + 1
        while event != "R" and self.t >= self.period * (1 - self.zero):
            self.t, self.turns = self.t - self.period, self.turns + 1
