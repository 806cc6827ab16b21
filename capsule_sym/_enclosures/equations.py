"""The equations of a periodic orbit by multiple shooting, with their derivatives, in balls.

Columns are the unknowns and the parameters in one row: for every segment the free coordinates of
the state where it begins, then all durations, the forcing angle at the start, and the parameters.
What the guard of the segment before makes exact at a segment's start (x_r = delta, v_c = 0, P =
+-f_b) is put in, not solved for. Rows are, for every segment, its end minus the start of the next
one, and that the durations are whole periods. Where a segment's guard vanishes at the segment's
start already, that root is divided out, so that the equations stay regular down to the duration 0
at which the segment is inserted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from capsule_sym._enclosures.balls import Ball, Matrix, arb, column, matrix
from capsule_sym._enclosures.fields import ONE, SIZE, C, Field, U, V, W, X
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import Itinerary, drift
from capsule_sym.generated import fields as generated

GUARD_ROWS = {Guard.GAP: 0, Guard.DRIFT: 1, Guard.UPPER: 1, Guard.LOWER: 2}
"""The row of a guard among those of a field that watches it."""


@dataclass(frozen=True)
class Node:
    """The start of a segment: extended state (6, 1) and its derivative by all columns (6, many)."""

    state: Matrix
    by: Matrix


@dataclass(frozen=True)
class Evaluation:
    """The equations at a box of columns: residual, derivative, and nodes and flows of segments."""

    residual: Matrix
    by: Matrix
    nodes: tuple[Node, ...]
    flows: tuple[Matrix, ...]
    fields: tuple[Field, ...]


class Shooting:
    """The equations of an itinerary; `varied` names the parameters that are columns."""

    def __init__(self, itinerary: Itinerary, values: Sequence[Ball], varied: Sequence[str]) -> None:
        self.itinerary, self.varied = itinerary, tuple(varied)
        self._values = dict(zip(PARAMETERS, values, strict=True))
        self._fields: tuple[list[Ball], dict[int, Field]] | None = None
        n = len(itinerary)
        self.free: list[tuple[int, ...]] = []
        for i, segment in enumerate(itinerary.segments):
            before = itinerary.segments[i - 1].guard
            free = [X, V] if drift(segment.field) == 0 or before is not Guard.GAP else [X, V, C]
            if before in (Guard.GAP, Guard.UPPER, Guard.LOWER):
                free.remove(X)
            self.free.append(tuple(free))
        self.places: list[int] = [0]
        for rows in self.free:
            self.places.append(self.places[-1] + len(rows))
        self.durations = range(self.places[-1], self.places[-1] + n)
        self.angle = self.durations.stop
        self.unknowns = self.angle + 1
        self.columns = self.unknowns + len(self.varied)

    def parameter(self, name: str) -> int:
        """The column of a parameter that varies."""
        return self.unknowns + self.varied.index(name)

    def parameters(self, values: Sequence[Ball]) -> dict[str, Ball]:
        """All parameters, where the columns have these values."""
        return self._values | dict(zip(self.varied, values[self.unknowns :], strict=True))

    def fields(self, values: Sequence[Ball]) -> dict[int, Field]:
        """The fields of the itinerary, where the columns have these values."""
        given = [self.parameters(values)[name] for name in generated.PARAMETERS]
        if self._fields is None or any(
            a is not b for a, b in zip(given, self._fields[0], strict=True)
        ):
            named = dict(zip(generated.PARAMETERS, given, strict=True))
            self._fields = (
                given,
                {index: Field(index, named) for index in set(self.itinerary.fields)},
            )
        return self._fields[1]

    def evaluate(self, values: Sequence[Ball], fields: dict[int, Field]) -> Evaluation:
        """The equations where the columns have these values."""
        segments = self.itinerary.segments
        nodes = self._nodes(values, fields)
        residual, by, flows = [], [], []
        for i, segment in enumerate(segments):
            field, h = fields[segment.field], values[self.durations[i]]
            node, after = nodes[i], nodes[(i + 1) % len(segments)]
            moved = field.flow(h)
            flows.append(moved)
            end, end_by = moved * node.state, moved * node.by
            rate = field.A * end
            slopes = [
                (self.parameter(name), field.flow_by(h, name) * node.state)
                for name in self.varied
                if field.depends(name)
            ]
            zeros = self.itinerary.zeros(i) if segment.guard else 0
            place = {Guard.GAP: X, Guard.DRIFT: C}.get(segment.guard) if segment.guard else None
            for row in (X, V, C)[: 2 if field.stick else 3]:
                if row == place and zeros:
                    value, entries = self._divided(field, row, zeros, h, node, i)
                else:
                    value = end[row, 0] - after.state[row, 0]
                    entries = [
                        x - y for x, y in zip(_row(end_by, row), _row(after.by, row), strict=True)
                    ]
                    entries[self.durations[i]] += rate[row, 0]
                    for at, slope in slopes:
                        entries[at] += slope[row, 0]
                residual.append(value)
                by.append(entries)
        value, entries = self._closure(values)
        residual.append(value)
        by.append(entries)
        ordered = tuple(fields[segment.field] for segment in segments)
        return Evaluation(column(residual), _matrix(by), tuple(nodes), tuple(flows), ordered)

    def _divided(
        self, field: Field, row: int, zeros: int, h: Ball, node: Node, segment: int
    ) -> tuple[Ball, list[Ball]]:
        unit = matrix(1, SIZE, ((0, row, 1),))
        functional, slope = field.divided(unit, zeros, h)
        entries = _row(functional * node.by, 0)
        entries[self.durations[segment]] += (slope * node.state)[0, 0]
        for name in self.varied:
            if field.depends(name):
                moved = field.divided_by(unit, zeros, h, name)
                entries[self.parameter(name)] += (moved * node.state)[0, 0]
        return (functional * node.state)[0, 0], entries

    def _closure(self, values: Sequence[Ball]) -> tuple[Ball, list[Ball]]:
        given = self.parameters(values)
        elapsed = sum((values[k] for k in self.durations), arb(0))
        entries = [arb(0)] * self.columns
        for k in self.durations:
            entries[k] = given["omega"]
        if "omega" in self.varied:
            entries[self.parameter("omega")] = elapsed
        return given["omega"] * elapsed - 2 * self.itinerary.period_number * arb.pi(), entries

    def _nodes(self, values: Sequence[Ball], fields: dict[int, Field]) -> list[Node]:
        given = self.parameters(values)
        alpha, omega = given["alpha"], given["omega"]
        elapsed, nodes = arb(0), []
        for i in range(len(self.itinerary)):
            sine, cosine = (values[self.angle] + omega * elapsed).sin_cos()
            state, by = matrix(SIZE, 1), matrix(SIZE, self.columns)
            state[U, 0], state[W, 0], state[ONE, 0] = alpha * cosine, alpha * sine, arb(1)
            moving = [self.angle, *self.durations[:i]]
            for at in moving:
                rate = arb(1) if at == self.angle else omega
                by[U, at], by[W, at] = -alpha * sine * rate, alpha * cosine * rate
            if "alpha" in self.varied:
                at = self.parameter("alpha")
                by[U, at], by[W, at] = cosine, sine
            if "omega" in self.varied:
                at = self.parameter("omega")
                by[U, at], by[W, at] = -alpha * sine * elapsed, alpha * cosine * elapsed
            for k, row in enumerate(self.free[i]):
                at = self.places[i] + k
                state[row, 0], by[row, at] = values[at], arb(1)
            self._pin(i, fields, state, by)
            nodes.append(Node(state, by))
            elapsed += values[self.durations[i]]
        return nodes

    def _pin(self, i: int, fields: dict[int, Field], state: Matrix, by: Matrix) -> None:
        """Put in the x_r at which the guard of the segment before vanishes."""
        if X in self.free[i]:
            return
        before = self.itinerary.segments[i - 1]
        assert before.guard is not None
        field, row = fields[before.field], GUARD_ROWS[before.guard]
        g_x, g_v, g_1 = (field.guards[row, k] for k in (X, V, ONE))
        x = -(g_v * state[V, 0] + g_1) / g_x
        state[X, 0] = x
        by[X, self.places[i] + self.free[i].index(V)] = -g_v / g_x
        for name in self.varied:
            slope = field.guard_slope(name)
            change = slope[row, X] * x + slope[row, V] * state[V, 0] + slope[row, ONE]
            by[X, self.parameter(name)] = -change / g_x


def _row(found: Matrix, row: int) -> list[Ball]:
    return [found[row, j] for j in range(found.ncols())]


def _matrix(rows: Sequence[Sequence[Ball]]) -> Matrix:
    return matrix(
        len(rows),
        len(rows[0]),
        ((i, j, x) for i, row in enumerate(rows) for j, x in enumerate(row)),
    )
