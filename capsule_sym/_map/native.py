"""The map in the C core, with the reference map for switches that the core cannot decide."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from capsule_sym._errors import InvalidInput, Status
from capsule_sym._map import evaluation
from capsule_sym._map.backend import NumpyBackend
from capsule_sym._map.keep import Keeper
from capsule_sym._map.segments import Instant, Segments, instant, records_of
from capsule_sym._map.trajectory import (
    FINISHED,
    MEMORY_IS_FULL,
    TIME_IS_UP,
    Kept,
    Statistics,
    Trajectory,
    after,
)
from capsule_sym._native import Watch, core_of
from capsule_sym._parameters import CAPSULE, Scene, SceneParameters
from capsule_sym.generated.interface import Precision

_NOTHING = Kept("final")
_SHORT = 40
"""Periods of a run whose segments nearly always fit into one piece, of 512."""


def core(scene: Scene = CAPSULE) -> Any:
    """Binding of a scene's core; raises InvalidInput if it was not compiled."""
    found = core_of(scene)
    if found is None:
        raise InvalidInput("backend", "c", "numpy or mpmath: the C core was not compiled")
    return found


def short_run(
    parameters: SceneParameters,
    values: tuple[float, float, float],
    phase: float,
    periods: int,
    escalate: bool,
    whole: bool,
) -> Trajectory | None:
    """Run of which all or only the end is kept; None if it is long, or the core cannot decide it.

    It takes the same steps as `NativeRun`, in one call. If all is kept, it is long from 40 periods
    or above 512 segments; else from 8,192 periods.
    """
    if (whole and periods >= _SHORT) or periods >= core(parameters.scene).ROWS:
        return None
    native = evaluation.borrowed(parameters)
    precision = Precision.AS_NEEDED if escalate else Precision.DOUBLE
    run = native.short_run if whole else native.end_of_run
    found, kept = run(*values, phase, periods, precision), _NOTHING
    evaluation.give_back(parameters, native)
    if found is None:
        return None
    if whole:
        found, records, strobe = found
        records.flags.writeable = False
        segments = Segments(records, parameters.omega, scene=parameters.scene)
        strobe[0], first = values, 0 if phase == 0.0 else 1
        kept = Kept("segments", segments, strobe[first:], np.arange(first, periods + 1))
    state, position, passed, angle, *took = found
    origin, end = Instant(0, phase, parameters.omega), instant(passed, angle, parameters.omega)
    ends, reason = ((origin, values), (end, state)), (Status.FINISHED, FINISHED)
    return Trajectory.made(parameters, "c", *ends, position, *reason, Statistics(*took), kept)


class NativeRun:
    """One run in the core, with the reference map for switches that it cannot decide."""

    def __init__(
        self,
        parameters: SceneParameters,
        escalate: bool,
        watch: Watch | None = None,
        progress: Callable[[int], object] | None = None,
    ) -> None:
        self.parameters, self.escalate, self.watch = parameters, escalate, watch or Watch()
        self.progress = progress
        self.precision = Precision.AS_NEEDED if escalate else Precision.DOUBLE
        self.core = core(parameters.scene)

    def go(
        self,
        values: tuple[float, float, float],
        phase: float,
        periods: int,
        most: int,
        keep: str = "segments",
    ) -> Trajectory:
        """Trajectory of at most `most` segments, with the data that `keep` names."""
        omega = self.parameters.omega
        keeper = Keeper(self.parameters, keep)
        native = evaluation.borrowed(self.parameters)
        record = native.state_at(*values, phase)
        if phase == 0.0:
            keeper.strobe(np.array([values]), np.array([0]))
        status, message = self._run(native, record, periods, most, keeper)
        x_r, v_r, v_c, angle, position, period = record[_FINAL].item()
        end = instant(period, angle, omega)
        evaluation.give_back(self.parameters, native)
        origin, final = (Instant(0, phase, omega), values), (end, (x_r, v_r, v_c))
        took, kept = keeper.statistics, keeper.kept()
        return Trajectory(
            self.parameters, "c", origin, final, position, status, message, took, kept
        )

    def _run(
        self, native: Any, record: NDArray[np.void], periods: int, most: int, keeper: Keeper
    ) -> tuple[Status, str]:
        """Continue to the end of the periods, or as far as possible; returns status and reason."""
        # A run pauses at the same places for every `keep`, and so reaches the same state.
        strobe = np.empty((min(periods + 1, self.core.ROWS), 3))
        while record["period"] < periods:
            left = min(most, keeper.most) - keeper.count
            stop = self._piece(native, record, periods, left, strobe, keeper)
            found = None
            if stop == self.core.OPEN and keeper.count < min(most, keeper.most):
                # Imported late, since it takes as long as all the rest.
                from capsule_sym._map.reference import Run, step, write

                run = Run(
                    NumpyBackend(self.parameters.scene), self.parameters, self.escalate, self.watch
                )
                run_state = step(run, record, periods, min(most, keeper.most) - keeper.count)
                tangencies = {i: s.tangencies for i, s in enumerate(run.segments)}
                keeper.append(records_of(run.segments, self.parameters.omega), tangencies)
                keeper.escalations += run.escalations
                marks = np.array(run.stroboscopic, dtype=float).reshape(-1, 3)
                keeper.strobe(marks, np.array(run.stroboscopic_periods, np.int64))
                if run_state.begin is None:
                    found = run.ended(run_state, periods, most)
                write(record, run_state)
            if self.progress is not None:
                self.progress(int(record["period"]))
            if record["period"] < periods:
                if found is None and keeper.count == most:
                    found = Status.SEGMENT_LIMIT, after(most)
                if found is None and keeper.full:
                    found = Status.MEMORY_LIMIT, MEMORY_IS_FULL
                if found is None and self.watch.over:
                    found = Status.TIME_LIMIT, TIME_IS_UP
                if found is not None:
                    return found
        return Status.FINISHED, FINISHED

    def _piece(
        self,
        native: Any,
        record: NDArray[np.void],
        periods: int,
        most: int,
        strobe: NDArray[np.float64],
        keeper: Keeper,
    ) -> int:
        """Compute as many segments as fit; returns the reason to stop."""
        room, before = keeper.room(most), record.copy()
        stop, count, _ = native.run(
            record, periods, room, strobe=strobe, watch=self.watch, precision=self.precision
        )
        first, last, rows = int(before["period"]) + 1, int(record["period"]), len(strobe)
        if last - first >= rows and count > 1:
            # The last segment rests forever, and its states replaced those before it.
            record[...] = before
            return self._piece(native, record, periods, count - 1, strobe, keeper)
        passed = np.arange(max(first, last + 1 - rows), last + 1)
        keeper.strobe(strobe[passed % rows], passed)
        keeper.wrote(count)
        return int(stop)


_FINAL = ["x_r", "v_r", "v_c", "angle", "position", "period"]
