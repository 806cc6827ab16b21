"""Segments of a trajectory: views of the records that the core writes, made on request.

A record is the C library's `capsule_segment`, 160 bytes. Besides the state at the start it holds
the gap and the force margin, since a quantity that vanishes at a switch is exactly 0 there, not a
difference of rounded numbers. It also holds cosine and sine of the angle, which is known to more
digits than a double has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nextafter, tau
from typing import Any, NamedTuple, overload

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import Outcome, counted
from capsule_sym._map.backend import Number
from capsule_sym._parameters import CAPSULE, Scene
from capsule_sym.generated.interface import OUTCOMES

SEGMENT = CAPSULE.records.SEGMENT
"""Record of any scene's core."""
_OUTCOMES = (*map(Outcome, OUTCOMES), Outcome.STALLED)
_BLOCK = 1024  # segments made at a time
Triple = tuple[Number, Number, Number]
Records = NDArray[np.void]

SWITCH = np.dtype([("period", "i8"), ("angle", "f8"), ("field", "i4"), ("plane", "i4")])
"""Switch: excitation periods passed, angle of the forcing, the field before it, and the plane."""


class _Instant(NamedTuple):
    period: int
    phase: Number


class Instant(_Instant):
    """Time as whole excitation periods and the phase in [0, 2 pi/omega) within the next.

    Dimensionless; the phase is a time. Where a number is wanted, as in sums and as the time at
    which a trajectory is evaluated, it is the absolute time `float(instant)`.
    """

    def __new__(cls, period: int, phase: Number, omega: Number) -> Instant:
        """Instant under a forcing of frequency omega."""
        made = super().__new__(cls, period, phase)
        made._omega = omega
        return made

    _omega: Number

    def __getnewargs__(self) -> tuple[int, Number, Number]:
        return self.period, self.phase, self._omega

    def __float__(self) -> float:
        return self.period * (tau / float(self._omega)) + float(self.phase)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        return np.array(float(self), dtype)


def _by_number(name: str) -> Callable[[Instant, Any], Any]:
    return lambda instant, other: getattr(np.float64(float(instant)), name)(other)


for _name in ("add", "sub", "mul", "truediv"):
    for _full in (f"__{_name}__", f"__r{_name}__"):
        setattr(Instant, _full, _by_number(_full))


def instant(periods: int, angle: Number, omega: Number) -> Instant:
    """Time at a forcing angle in [0, 2 pi) after whole periods."""
    return Instant(periods, angle / omega if angle else angle * 0, omega)


@dataclass(frozen=True)
class Segment:
    """One segment of a trajectory, from one switching plane to the next, dimensionless.

    `field` is the number of its field, 1 to 6 in the paper's scene. States are (x_r, v_r, v_c).
    `start` and `end` are times, each with a `period` and a `phase`; `float` gives the absolute
    time. `duration` is the time between. `position` is x_c at the start, 0 at that of the run, and
    `advance` its change.

    `source` and `target` are switching planes, "Σ1" to "Σ10" in the paper's scene. `target` is
    empty if the run ends before a switch or without a successor field, `source` for a segment that
    starts off every plane. `outcome` is an `Outcome`: "regular" if one switch ends the segment,
    "end" or "never" if the run ended first. `tangencies` are grazes and sliding tangencies within
    the error bound that did not end the segment, each with the duration after which it occurs.
    `evaluations` is the number of evaluations in the search for the switch; `closed` is the start
    of the closed form, for evaluation in between.
    """

    field: int
    source: str
    target: str
    start: Instant
    end: Instant
    start_state: Triple
    end_state: Triple
    duration: Number
    outcome: Outcome
    tangencies: tuple[tuple[Outcome, Number], ...]
    evaluations: int
    position: Number
    advance: Number
    closed: Any  # start of the closed form, for evaluation in between
    scene: Scene = CAPSULE

    def __repr__(self) -> str:
        way = f"{self.source or 'start'} to {self.target or 'end'}"
        begun = f"({self.start.period}, {float(self.start.phase):.6g})"
        ended = f"{self.outcome} after {float(self.duration):.6g}"
        return f"<Segment {self.name} {self.mode}: {way}, from {begun}, {ended}>"

    @property
    def name(self) -> str:
        """Name of the field, in the paper's scene "F1" to "F6"."""
        return f"F{self.field}"

    @property
    def mode(self) -> str:
        """Mode of operation in the paper's notation, such as "NC-FD"."""
        return str(self.scene.facts.MODES[self.field - 1])

    @property
    def local_map(self) -> str:
        """The segment as a local map in the paper's notation, such as "P_{Σ4,F5,Σ5}".

        The name of an empty plane is left out.
        """
        return f"P_{{{self.target},{self.name},{self.source}}}"


Tangencies = Mapping[int, tuple[tuple[Outcome, Number], ...]]


class Segments(Sequence[Segment]):
    """Segments of a run in the order of time, each made from its record on access.

    Slices of step 1 are views too, other slices tuples. Equal to any sequence of equal segments.
    """

    def __init__(
        self,
        records: Records,
        omega: float,
        tangencies: Tangencies | None = None,
        first: int = 0,
        scene: Scene = CAPSULE,
    ) -> None:
        self.records, self.omega, self.scene = records, omega, scene
        self.tangencies, self._first = tangencies or {}, first

    def __len__(self) -> int:
        return len(self.records)

    @overload
    def __getitem__(self, index: int) -> Segment: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Segment]: ...
    def __getitem__(self, index: int | slice) -> Segment | Sequence[Segment]:
        if not isinstance(index, slice):
            place = range(len(self))[index]
            return self._made(place, self.records[place].item())
        start, _, step = index.indices(len(self))
        if step == 1:
            first = self._first + start
            return Segments(self.records[index], self.omega, self.tangencies, first, self.scene)
        return tuple(self[i] for i in range(*index.indices(len(self))))

    def __iter__(self) -> Iterator[Segment]:
        for start in range(0, len(self), _BLOCK):
            for i, values in enumerate(self.records[start : start + _BLOCK].tolist(), start):
                yield self._made(i, values)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Sequence):
            return NotImplemented
        return len(self) == len(other) and all(a == b for a, b in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<{counted(len(self), 'segment')}>"

    def _made(self, index: int, values: tuple[Any, ...]) -> Segment:
        start_period, end_period, angle, end_angle, start, end, duration, position, advance = (
            values[:9]
        )
        gap, margin, cosine, sine, field, source, target, outcome, evaluations, _ = values[9:]
        x_r, v_r, v_c = start.tolist()
        return Segment(
            field=field,
            source=plane_name(source),
            target=plane_name(target),
            start=instant(start_period, angle, self.omega),
            end=instant(end_period, end_angle, self.omega),
            start_state=(x_r, v_r, v_c),
            end_state=tuple(end.tolist()),
            duration=duration,
            outcome=_OUTCOMES[outcome],
            tangencies=self.tangencies.get(self._first + index, ()),
            evaluations=evaluations,
            position=position,
            advance=advance,
            closed=start_of(x_r, gap, v_r, v_c, margin, cosine, sine),
            scene=self.scene,
        )


def start_of(*values: Number) -> Any:
    """Start of a closed form; one class for all scenes, so that pickle finds it."""
    return CAPSULE.kernels.Start(*values)


def plane_name(number: int) -> str:
    """Name of a switching plane, such as "Σ1"; empty for 0."""
    return f"Σ{number}" if number else ""


def plane_number(name: str) -> int:
    """Number of a switching plane, from 1 on; 0 for an empty name."""
    return int(name[1:]) if name else 0


def records_of(segments: Iterable[Segment], omega: float) -> Records:
    """Records of segments, in double precision; those of `Segments` are not copied."""
    if isinstance(segments, Segments):
        return segments.records
    rows = []
    for s in segments:
        x_r, gap, v_r, v_c, margin, cosine, sine = map(float, s.closed)
        angles = (_angle(float(s.start.phase), omega), _angle(float(s.end.phase), omega))
        rows.append(
            (
                s.start.period,
                s.end.period,
                *angles,
                (x_r, v_r, v_c),
                tuple(map(float, s.end_state)),
                *map(float, (s.duration, s.position, s.advance, gap, margin, cosine, sine)),
                s.field,
                plane_number(s.source),
                plane_number(s.target),
                _OUTCOMES.index(s.outcome),
                s.evaluations,
                0,
            )
        )
    return np.array(rows, SEGMENT)


def _angle(phase: float, omega: float) -> float:
    """Angle that gives this phase when divided by omega, or the nearest one if none does."""
    angle = phase * omega
    near = (angle, nextafter(angle, inf), nextafter(angle, 0.0))
    return next((one for one in near if one / omega == phase), angle)


def switches_of(records: Records) -> Records:
    """Switches that end segments, as records of `SWITCH`."""
    ended = records[records["target"] != 0]
    events = np.empty(len(ended), SWITCH)
    events["period"], events["angle"] = ended["end_period"], ended["end_angle"]
    events["field"], events["plane"] = ended["field"], ended["target"]
    return events


def columns_of(records: Records, omega: float, scene: Scene = CAPSULE) -> dict[str, NDArray[Any]]:
    """Columns of a table of segments, arrays of numbers or of texts, shape (n,)."""
    last = max(*scene.switching.IMPACT_PLANES.values(), *scene.switching.EDGE_PLANES)
    planes = np.array([plane_name(i) for i in range(last + 1)])
    fields = np.array([f"F{i}" for i in range(len(scene.facts.FIELDS) + 1)])
    outcomes = np.array([str(outcome) for outcome in _OUTCOMES])
    start = records["start"]
    return {
        "period": records["start_period"],
        "phase": records["start_angle"] / omega,
        "duration": records["duration"],
        "field": fields[records["field"]],
        "source": planes[records["source"]],
        "target": planes[records["target"]],
        "x_r": start[:, 0],
        "v_r": start[:, 1],
        "v_c": start[:, 2],
        "x_c": records["position"],
        "advance": records["advance"],
        "outcome": outcomes[records["outcome"]],
        "evaluations": records["evaluations"],
    }
