"""Equations of a periodic orbit by multiple shooting, with their derivatives.

They are written once, for numbers that are balls, or forms over a patch, which other proofs use:
only the flow of a field depends on the number. Columns are the unknowns and the varied parameters
in one row: for every segment the free coordinates of its start state, then all durations, the
forcing angle at the start, and these parameters. Coordinates that the guard of the segment before
makes exact at a start (x_r = delta, v_c = 0, P = +-f_b) are put in, not solved for. Rows are, for
every segment, its end minus the start of the next one, and the condition that the durations are
whole periods. A root of a segment's guard at the segment's start is divided out, so that the
equations stay regular down to the duration 0 at which the segment is inserted. Over a patch it is
divided out only in a segment whose duration is a coordinate of the patch: others are too short
there for the guards' proof anyway.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from capsule_sym._enclosures.numbers.balls import Ball, Matrix, arb, assembled, matrix, stacked
from capsule_sym._enclosures.numbers.fields import ONE, SIZE, C, Field, U, V, W, X
from capsule_sym._enclosures.passage.switches import GUARD_ROWS, pin
from capsule_sym._map.expansion import Guard
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym._orbits.shooting.itinerary import Itinerary, drift
from capsule_sym.generated.capsule import fields as generated


@dataclass(frozen=True)
class Node:
    """Start of a segment: extended state (6, 1), and its derivative by all columns.

    That is `own` (6, m), by the free coordinates, the forcing angle there and the parameters, times
    `columns` (m, many), the derivative of these.
    """

    state: Any
    own: Any
    columns: Matrix

    @property
    def by(self) -> Any:
        """The derivative of the state by all columns (6, many)."""
        return self.own * self.columns


@dataclass(frozen=True)
class BoxValues:
    """Equations at a box of columns: residual, derivative, and data of each segment.

    Segment i begins at `nodes[i]` and takes `durations[i]` along `fields[i]`, with `flows[i]`.
    """

    itinerary: Itinerary
    residual: Any
    by: Any
    nodes: tuple[Node, ...]
    durations: tuple[Any, ...]
    flows: tuple[Any, ...]
    fields: tuple[Any, ...]


@cache
def _chosen(rows: tuple[int, ...]) -> Matrix:
    """Matrix that selects rows of an extended state."""
    return matrix(len(rows), SIZE, ((k, row, 1) for k, row in enumerate(rows)))


class Shooting:
    """The equations of an itinerary; `varied` names the parameters that are columns."""

    def __init__(
        self, itinerary: Itinerary, values: Sequence[Any], varied: Sequence[str] = ()
    ) -> None:
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

    def parameters(self, values: Sequence[Any]) -> dict[str, Any]:
        """All parameters, for these values of the columns."""
        return self._values | dict(zip(self.varied, values[self.unknowns :], strict=True))

    def fields(self, values: Sequence[Ball]) -> dict[int, Field]:
        """Fields of the itinerary, for these values of the columns."""
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

    def evaluate(
        self,
        values: Sequence[Any],
        fields: Mapping[int, Any],
        *,
        divided: Container[int] | None = None,
    ) -> BoxValues:
        """Equations for these values of the columns.

        Roots are divided out in all segments, or in those that are `divided`.
        """
        segments = self.itinerary.segments
        nodes = self._nodes(values, fields)
        durations = tuple(values[at] for at in self.durations)
        ordered = tuple(fields[segment.field] for segment in segments)
        residual, by, flows = [], [], []
        for i, segment in enumerate(segments):
            field, h = ordered[i], durations[i]
            flow = field.flow(h)
            flows.append(flow)
            here, following = nodes[i], nodes[(i + 1) % len(segments)]
            end = flow * here.state
            rows = [X, V] if field.stick else [X, V, C]
            short = divided is None or i in divided
            zeros = self.itinerary.zeros(i) if short and segment.guard else 0
            if zeros:
                root = X if segment.guard is Guard.GAP else C
                rows.remove(root)
                value, slopes = self._divided(field, root, zeros, h, here, i)
                residual.append(value)
                by.append(slopes)
            chosen = _chosen(tuple(rows))
            slopes = flow * here.own * here.columns - following.by
            slopes = slopes + self._at(self.durations[i], field.A * end)
            for name in self._moving(field):
                slopes = slopes + self._at(
                    self.parameter(name), field.flow_by(h, name) * here.state
                )
            residual.append(chosen * (end - following.state))
            by.append(chosen * slopes)
        omega = self.parameters(values)["omega"]
        elapsed = sum(durations, arb(0))
        turns = 2 * self.itinerary.period_number * arb.pi()
        residual.append(assembled(1, 1, [(0, 0, elapsed * omega - turns)]))
        rates = [(0, k, omega) for k in self.durations]
        if "omega" in self.varied:
            rates.append((0, self.parameter("omega"), elapsed))
        by.append(matrix(1, self.columns, rates))
        return BoxValues(
            self.itinerary, stacked(residual), stacked(by), nodes, durations, tuple(flows), ordered
        )

    def _moving(self, field: Any) -> Iterator[str]:
        """Parameters among the columns on which the flow of a field depends."""
        return (name for name in self.varied if field.depends(name))

    def _at(self, column: int, vector: Any) -> Any:
        """A vector as one column of a derivative."""
        return vector * matrix(1, self.columns, [(0, column, 1)])

    def _divided(
        self, field: Field, row: int, zeros: int, h: Ball, node: Node, segment: int
    ) -> tuple[Matrix, Matrix]:
        """Equation of a coordinate after division by the roots of its guard, and its derivative."""
        unit = matrix(1, SIZE, [(0, row, 1)])
        functional, slope = field.divided(unit, zeros, h)
        slopes = functional * node.own * node.columns + self._at(
            self.durations[segment], slope * node.state
        )
        for name in self._moving(field):
            moved = unit * field.flow_by(h, name, zeros)
            slopes += self._at(self.parameter(name), moved * node.state)
        return functional * node.state, slopes

    def _nodes(self, values: Sequence[Any], fields: Mapping[int, Any]) -> tuple[Node, ...]:
        given = self.parameters(values)
        elapsed, nodes = arb(0), []
        for i in range(len(self.itinerary)):
            nodes.append(self._node(i, values, fields, given, elapsed))
            elapsed = elapsed + values[self.durations[i]]
        return tuple(nodes)

    def _node(
        self,
        i: int,
        values: Sequence[Any],
        fields: Mapping[int, Any],
        given: Mapping[str, Any],
        elapsed: Any,
    ) -> Node:
        alpha, omega, free = given["alpha"], given["omega"], self.free[i]
        sine, cosine = (values[self.angle] + elapsed * omega).sin_cos()
        u, w = alpha * cosine, alpha * sine
        state = [(U, 0, u), (W, 0, w), (ONE, 0, 1)]
        angle = len(free)  # index of the forcing angle among the arguments of the start
        own: list[tuple[int, int, Any]] = [(U, angle, -w), (W, angle, u)]
        columns: list[tuple[int, int, Any]] = [(angle, self.angle, 1)]
        columns += [(angle, at, omega) for at in self.durations[:i]]
        for k, row in enumerate(free):
            at = self.places[i] + k
            state.append((row, 0, values[at]))
            own.append((row, k, 1))
            columns.append((k, at, 1))
        for k, name in enumerate(self.varied, angle + 1):
            columns.append((k, self.parameter(name), 1))
            if name == "alpha":
                own += [(U, k, cosine), (W, k, sine)]
            if name == "omega":
                own += [(U, k, -w * elapsed), (W, k, u * elapsed)]
        if X not in free:  # exact by the guard of the segment before
            before = self.itinerary.segments[i - 1]
            assert before.guard is not None
            field, row = fields[before.field], GUARD_ROWS[before.guard]
            v = values[self.places[i] + free.index(V)]
            slope, constant = pin(field, before.guard)
            x = v * slope + constant
            state.append((X, 0, x))
            own.append((X, free.index(V), slope))
            for k, name in enumerate(self.varied, angle + 1):
                by = field.guard_slope(name)
                change = by[row, X] * x + by[row, V] * v + by[row, ONE]
                own.append((X, k, -change / field.guards[row, X]))
        count = angle + 1 + len(self.varied)
        return Node(
            assembled(SIZE, 1, state),
            assembled(SIZE, count, own),
            matrix(count, self.columns, columns),
        )
