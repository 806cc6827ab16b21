"""Orbits on the two sides of a bifurcation curve, over a patch of the plane that it passes through.

On one side the orbits have a segment more, whose duration h is 0 on the curve. There the patch has
the coordinates h and gamma, 0 <= h <= H, and alpha is solved for. On the other side, if it has no
such segment, the coordinates are alpha and gamma, and one guard fails beyond the curve.
"""

from __future__ import annotations

from collections.abc import Sequence

from capsule_sym._enclosures.interface import (
    GUARD_ROWS,
    SIZE,
    Ball,
    BoxValues,
    Field,
    Matrix,
    Shooting,
    Signs,
    Tube,
    Unproved,
    arb,
    enclose,
    matrix,
    upper,
    zeros,
)
from capsule_sym._orbits.interface import around
from paper.proofs.forms import MONOMIALS, hull
from paper.proofs.patch_orbits import PatchOrbits, within
from paper.proofs.stable import prove_stable

_HALF = 0.5000001  # of a segment, from either end: no gap between both
_WINDOWS = (0.4, 0.1, 0.03)  # times about the instant at which a guard fails


class _Side(PatchOrbits):
    """Orbits on one side of a curve; alpha is a column."""

    varied = ("alpha",)
    promising = 0.003

    def rates(self, found: BoxValues) -> Matrix:
        """Derivative of all columns by the first coordinate, over the patch."""
        count, (first, _) = self.shooting.columns, self.axes
        rates = matrix(count, 1, [(first, 0, 1)])
        regular = (self.inverse * (found.by * self.chosen)).hull
        moved = regular.solve((self.inverse * found.by).hull * rates)
        for k, at in enumerate(self.solved):
            rates[at, 0] = -moved[k, 0]
        return rates

    def holds(self, columns: Sequence[Ball]) -> bool:
        """True if a solution with these columns is the patch's, by its uniqueness."""
        place = []
        for at, radius in zip(self.axes, self.radii, strict=True):
            away = columns[at] - self.centre[at]
            if not (abs(away) <= radius if radius else away.is_zero()):
                return False
            place.append(away / radius if radius else away)
        s, t = place
        powers = [s**a * t**b for a, b in MONOMIALS[1:]]
        for k, at in enumerate(self.solved):
            terms = (x * power for x, power in zip(self.path[k, 1:].tolist(), powers, strict=True))
            if not abs(columns[at] - sum(terms, self.centre[at])) < self.unique[k]:
                return False
        return True


class WithSegment(_Side):
    """Orbits on which a segment has a duration in (0, 2 `reach`], over gammas about an orbit's.

    `event` is the orbit with the duration 0 at the middle gamma. With `at` all durations are this
    one, and `reach` is 0.
    """

    def __init__(
        self, event: Tube, segment: int, reach: float, radius: float, at: Ball | None = None
    ) -> None:
        self.segment, self.event, self.divided = segment, event, (segment,)
        narrow, guess = event.shooting, event.hull()
        axes = narrow.durations[segment], narrow.parameter("gamma")
        guess[axes[0]] = arb(reach) if at is None else at
        super().__init__(narrow, guess, (reach, radius), axes)

    def prove_side(self) -> tuple[Ball, Ball]:
        """Prove the orbits; alpha on the curve and at the largest duration, for all gammas.

        For every gamma alpha is continuous in the duration, so that all between both is covered. An
        orbit that is stable has a regular derivative at its alpha: so alpha changes with the
        duration, and nothing is covered twice.
        """
        found = self.enclose()
        if not self.holds(self.event.hull()):
            raise Unproved("gluing", "the curve's orbit is not seen to be the patch's")
        self._found, self._rates = found, self.rates(found)
        self.admissible(found)
        prove_stable(found)
        return self._alpha(-1), self._alpha(1)

    def _alpha(self, end: int) -> Ball:
        """Alpha at the duration 0 (-1) or at the largest one (1), for all gammas.

        At a touch alpha hardly changes with the duration, and the patch's remainder is too large:
        the orbits with this duration are proved alone. Those at the middle gamma are the patch's,
        so all of them are.
        """
        narrow, (column, gamma) = self.event.shooting, self.axes
        before, _, after = around(narrow.itinerary, self.segment)
        patch, part = self, (float(end), 0.0, 0.0, 1.0)
        if before == after:
            reach, radius = self.radii
            there = self.event.hull() if end < 0 else list(self.centre)
            there[column] = duration = arb(reach) * (1 + end)
            tube = enclose(narrow, there, {column: 0.0, gamma: 0.0})
            patch, part = (
                WithSegment(tube, self.segment, 0.0, radius, duration),
                (0.0, 0.0, 0.0, 1.0),
            )
            patch.enclose()
            if not (self.holds(tube.hull()) and patch.holds(tube.hull())):
                raise Unproved("gluing", "the orbits at an end are not seen to be the patch's")
        return within(patch.columns(patch.unique.tolist())[narrow.parameter("alpha")], part).hull

    def watched(
        self, i: int, watch: Signs, field: Field, start: Matrix, end: Matrix, h: Ball, name: str
    ) -> None:
        """Prove the guards of segment i, for all durations of the short one but 0.

        A guard that vanishes at an end of higher order on the curve than beside it is proved by its
        derivatives there.
        """
        itinerary = self.shooting.itinerary
        orders, still = zeros(itinerary, i), zeros(itinerary, i, (self.segment,))
        if i == self.segment:
            watch.segment(field, start, end, arb(upper(h)), orders, name)
            return
        pairs = [[*zip(*one, strict=True)] for one in zip(orders, still, strict=True)]
        apart = [
            g for g, (a, b) in enumerate(zip(*pairs, strict=True)) if a[0] < a[1] or b[0] < b[1]
        ]
        watch.segment(field, start, end, h, orders, name, apart)
        reach = upper(h) * _HALF
        for guard in apart:
            for last, sense, state in ((0, 1, start), (1, -1, end)):
                order, reached = pairs[last][guard]
                if order == reached:
                    proved = watch.pieces(field, sense, guard, order, state, reach, reach)
                else:
                    self._grows(i, last, guard, order, reached)
                    proved = watch.rising(field, sense, guard, reached - 1, state, reach)
                if not proved:
                    raise Unproved("guards", f"guard {guard} is not proved positive along {name}")

    def _grows(self, i: int, last: int, guard: int, order: int, reached: int) -> None:
        """Prove that the derivatives of a guard at an end which vanish on the curve are positive.

        There are `reached` of them on the curve, `order` beside it. The last one is 0 on the curve
        and grows with the duration. One before it is the force margin after a slip: it is positive,
        since the slip ended with a falling drift.
        """
        n = len(self.shooting.itinerary)
        after_slip = last == 0 and order == 0 and i == (self.segment + 1) % n
        if reached - order > 1 + after_slip:
            raise Unproved("guards", "several derivatives vanish on the curve")
        field, node = self._found.fields[i].whole, self._found.nodes[(i + last) % n]
        row = matrix(1, SIZE, ((0, k, field.guards[guard, k]) for k in range(SIZE)))
        for _ in range(reached - 1):
            row = row * field.A * (-1 if last else 1)
        if not (row * hull(node.own) * node.columns * self._rates)[0, 0] > 0:
            raise Unproved("guards", "a derivative that is 0 on the curve is not seen to grow")


class WithoutSegment(_Side):
    """Orbits without the segment of a curve's orbit `event`, over a patch of alpha and gamma.

    `columns` are the event's in the equations `shooting`, and `kept` the event's segments that are
    left. One guard is positive on one side of the curve only.
    """

    def __init__(
        self,
        event: Tube,
        segment: int,
        other: tuple[Shooting, list[Ball], list[int]],
        alpha: float,
        radii: tuple[float, float],
    ) -> None:
        shooting, self._columns, kept = other
        guess = list(self._columns)
        guess[shooting.parameter("alpha")] = arb(alpha)
        super().__init__(shooting, guess, radii)
        itinerary, n = event.shooting.itinerary, len(event.shooting.itinerary)
        before, _, after = around(itinerary, segment)
        self._instant: float | None = None
        if before == after:  # the guard is touched within a segment
            guard = itinerary.guard_before(segment)
            assert guard is not None
            self._instant = float(event.centre[event.shooting.durations[segment - 1]])
            self._fails = kept.index((segment - 1) % n), GUARD_ROWS[guard]
            return
        i = kept.index((segment + 1) % n)
        (still, _), (orders, _) = (
            zeros(itinerary, kept[i], (segment,)),
            zeros(shooting.itinerary, i),
        )
        higher = [g for g, order in enumerate(orders) if order < still[g]]
        if len(higher) != 1:
            raise Unproved("guards", f"{len(higher)} guards fail after the curve's instant")
        self._fails = i, higher[0]

    def prove_side(self, curve: Ball, edge: Ball, sign: int) -> None:
        """Prove the orbits from the curve to an edge, on one side (1 or -1) of the curve.

        On the curve the guard that fails is not negative, as the limit of that of orbits with the
        segment. About its instant its derivative by alpha has the side's sign, elsewhere it is
        positive.
        """
        found, alpha = self.enclose(), self.centre[self.axes[0]]
        if not (self.holds(self._columns) and abs(curve - alpha) < self.radii[0]):
            raise Unproved("gluing", "the curve's orbits are not seen to be the patch's")
        if not abs(edge - alpha) < self.radii[0]:
            raise Unproved("coverage", "not all of the patch is reached from the curve")
        node = found.nodes[self._fails[0]]
        self._slopes = hull(node.own) * node.columns * self.rates(found) * sign
        prove_stable(found)
        for self._window in _WINDOWS:
            try:
                return self.admissible(found)
            except Unproved as error:
                failed = error
        raise failed

    def watched(
        self, i: int, watch: Signs, field: Field, start: Matrix, end: Matrix, h: Ball, name: str
    ) -> None:
        """Prove the guards of segment i, one of them by its derivative by alpha in the window."""
        at, guard = self._fails
        orders = zeros(self.shooting.itinerary, i)
        watch.segment(field, start, end, h, orders, name, (guard,) if i == at else ())
        if i != at:
            return
        first, last = (one[guard] for one in orders)
        low, high = 0.0, self._window
        if self._instant is not None:
            low, high = self._instant - self._window, self._instant + self._window
        slopes = field.flow(arb(low)) * self._slopes
        rest, wide = upper(h - high), (high - low) * (1 + 1e-12)
        if not (
            low >= 0
            and h > high
            and watch.pieces(field, 1, guard, first, start, low, wide)
            and watch.pieces(field, 1, guard, 0 if low else first, slopes, wide, wide)
            and watch.pieces(field, -1, guard, last, end, rest, rest)
        ):
            raise Unproved("guards", f"guard {guard} is not proved positive along {name}")
