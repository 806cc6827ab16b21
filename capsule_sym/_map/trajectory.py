"""Trajectory: result of a run, with segments, states at any time, and statistics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import Ended, InvalidInput, Status, counted
from capsule_sym._map import evaluation
from capsule_sym._map.backend import Number
from capsule_sym._map.labelled import Labelled, lock
from capsule_sym._map.result import brief
from capsule_sym._map.segments import (
    Instant,
    Records,
    Segment,
    Triple,
    columns_of,
    records_of,
    switches_of,
)
from capsule_sym._map.steady import LONGEST, SteadyMotion, steady_motion
from capsule_sym._native import core_of
from capsule_sym._parameters import Scene, SceneParameters

Kind = TypeVar("Kind")


FINISHED = "the run came to its end"
TIME_IS_UP = "the run stopped at its time limit"
MEMORY_IS_FULL = "the run stopped, as what it keeps takes all the memory that it may"


def after(most: int) -> str:
    """Reason of a run that ended at its limit of segments."""
    return f"the run stopped after {counted(most, 'segment')}"


class Statistics(NamedTuple):
    """Counts of a run: segments, evaluations, and decisions by more digits.

    `evaluations` counts those in the searches for switches. `escalations` counts switches and
    successor fields that double precision could not decide and 106 bits or 50 digits were tried on.
    """

    segments: int = 0
    evaluations: int = 0
    escalations: int = 0


@dataclass(frozen=True, eq=False)
class Kept:
    """Kept data of a run; None for data that are not kept.

    `what` is the run's `keep`. Arrays are read-only.
    """

    what: str
    segments: Sequence[Segment] | None = None
    stroboscopic: NDArray[Any] | None = None
    stroboscopic_periods: NDArray[np.int64] | None = None

    def __post_init__(self) -> None:
        lock(self)


@dataclass(frozen=True, eq=False)
class Trajectory(Ended, Labelled):
    """Result of a run of the exact map: the kept data, status and statistics.

    All quantities are dimensionless. `backend` is the one of the run: "c", "numpy" or "mpmath".
    Access to data that were not kept raises InvalidInput. Arrays that a trajectory keeps, and views
    of them, are read-only; `switches` and computed columns are copies.
    """

    parameters: SceneParameters
    backend: str
    origin: tuple[Instant, Triple]
    """Time, with its `period` and `phase`, and state at the start of the run."""
    final: tuple[Instant, Triple]
    """Time and state at the end of the run."""
    advance: Number
    """Displacement of the capsule over the run (change of x_c)."""
    status: Status
    """Status of the run."""
    message: str
    """Description of the status, as a sentence."""
    statistics: Statistics
    """Counts of segments, evaluations and escalations."""
    kept: Kept

    @classmethod
    def made(cls, *values: Any) -> Trajectory:
        """Trajectory of its fields in order, faster than by the constructor of a frozen class."""
        trajectory = object.__new__(cls)
        vars(trajectory).update(zip(_FIELDS, values, strict=True))
        return trajectory

    @classmethod
    def of_segments(
        cls,
        parameters: SceneParameters,
        backend: str,
        origin: tuple[Instant, Triple],
        segments: Sequence[Segment],
        reason: tuple[Status, str] = (Status.FINISHED, FINISHED),
        escalations: int = 0,
        **kept: NDArray[Any],
    ) -> Trajectory:
        """Run of these segments; `kept` are states at phase 0 (n, 3), and periods, by name."""
        final, advance = origin, abs(origin[1][0]) * 0
        if segments:
            last = segments[-1]
            final, advance = (last.end, last.end_state), last.position + last.advance
        evaluations = sum(segment.evaluations for segment in segments)
        return cls(
            parameters,
            backend,
            origin,
            final,
            advance,
            *reason,
            Statistics(len(segments), evaluations, escalations),
            Kept("segments", segments, **kept),
        )

    def __repr__(self) -> str:
        (periods, phase), (x_r, v_r, v_c) = self.final
        state = ", ".join(f"{float(value):.6g}" for value in (x_r, v_r, v_c))
        at = f"at ({periods}, {float(phase):.6g}) in ({state})"
        stopped = "" if self.success else f", {self.message}"
        count = self.statistics.segments
        return brief(self, f"{counted(count, 'segment')}{stopped}, {at}", f"by {self.backend}")

    @property
    def scene(self) -> Scene:
        """Scene of the parameters."""
        return self.parameters.scene

    @property
    def segments(self) -> Sequence[Segment]:
        """Segments in the order of time."""
        return self._kept("segments", self.kept.segments)

    @property
    def stroboscopic(self) -> NDArray[Any]:
        """States (x_r, v_r, v_c) at phase 0 in the order of time, shape (n, 3).

        The first is that at the start if its phase is 0, the last the end of a finished run. Kept
        with `keep` "segments" or "stroboscopic".

        A segment over very many periods has only the last states: 8,192 if the core computes it,
        32 if the reference map does, which continues where the core gives up.
        `stroboscopic_periods` numbers them. With 50 digits the array has the dtype object.
        """
        return self._kept("stroboscopic", self.kept.stroboscopic)

    @property
    def stroboscopic_periods(self) -> NDArray[np.int64]:
        """Number of whole periods before each stroboscopic state, shape (n,)."""
        return self._kept("stroboscopic", self.kept.stroboscopic_periods)

    @property
    def switches(self) -> Records:
        """All switches, as an array with fields period, angle, field and plane.

        The time of a switch is `period` excitation periods and the forcing's `angle` in [0, 2 pi).
        `field` is the field before it (1 to 6 in the paper's scene), and `plane` the switching
        plane on which it lies (1 to 10).
        """
        return switches_of(self.records)

    def _kept(self, name: str, value: Kind | None) -> Kind:
        if value is None:
            raise InvalidInput("keep", self.kept.what, f"{name!r} for this")
        return value

    @property
    def span(self) -> tuple[float, float]:
        """Start and end time of the run, absolute and dimensionless; the start is its phase."""
        return float(self.origin[0]), float(self.final[0])

    @cached_property
    def records(self) -> Records:
        """Segments as a structured array of shape (n,), in double precision: the struct of C."""
        records = records_of(self.segments, self.parameters.omega)
        records.flags.writeable = False
        return records

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """Segments as columns, arrays of shape (n,), in double precision.

        The start of each is in `period` and `phase`, `x_r`, `v_r`, `v_c` and `x_c`; then `duration`
        and `advance` of x_c; texts `field`, `source`, `target` and `outcome`; `evaluations`.
        """
        return columns_of(self.records, self.parameters.omega, self.scene)

    @checked
    def __call__(self, t: ArrayLike, *, position: bool = False) -> NDArray[np.float64]:
        """Evaluate the states (x_r, v_r, v_c) at times t, shape t.shape + (3,), in closed form.

        With `position` they are (x_r, v_r, v_c, x_c), with x_c zero at the start of the run. They
        are in double precision, whatever the backend. Times are absolute and dimensionless, the
        excitation periods times 2 pi/omega plus the phase. Raises InvalidInput outside the run, and
        if segments were not kept.
        """
        states = self._evaluate(t)
        return states if position else states[..., :3]

    @checked
    def position(self, t: ArrayLike) -> NDArray[np.float64]:
        """Capsule positions x_c at times t, shape t.shape, zero at the start of the run.

        Times are those of a call, absolute and dimensionless. Raises InvalidInput outside the run,
        and if segments were not kept.
        """
        return self._evaluate(t)[..., 3]

    def _evaluate(self, t: ArrayLike) -> NDArray[np.float64]:
        times = evaluation.real("t", t, "real numbers")
        records = self.records
        evaluation.check(times, *self.span)
        if not len(records):
            origin = np.array([*self.origin[1], 0.0], dtype=float)
            return np.broadcast_to(origin, (*times.shape, 4)).copy()
        if self.backend == "c" and core_of(self.scene) is not None:
            return evaluation.by_core(self.parameters, records, times)
        return evaluation.by_numpy(self.parameters, records, times)

    @checked
    def steady(self, tolerance: float = 1e-9, longest: int = LONGEST) -> SteadyMotion | None:
        """Return the periodic motion at the end of the run, or None if it has not settled on one.

        The motion has the period number m if the last m stroboscopic states are those m periods
        before within `tolerance`, and their segments have the same fields and planes; the least m
        up to `longest` is taken. So the run needs 2 m of these states. Slow alternating convergence
        to a shorter period looks almost periodic too. To exclude it, the states must differ by more
        than a thousand tolerances from those d periods before, for each divisor d < m.

        Raises InvalidInput for a tolerance that is not a finite number > 0, for a `longest` that is
        not a whole number from 1 on, and if segments were not kept.
        """
        return steady_motion(self, tolerance, longest)


_FIELDS = tuple(Trajectory.__dataclass_fields__)
