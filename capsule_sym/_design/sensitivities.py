"""How a run depends on where it starts and on the parameters, exactly, through every switch.

Derivatives of the closed forms are carried from segment to segment. At a switch its time moves as
well, by what keeps the guard at zero; in the next segment that is the saltation.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._errors import InvalidInput, Status
from capsule_sym._map import Trajectory, evaluation
from capsule_sym._map.backend import backend
from capsule_sym._map.checks import checked_seconds
from capsule_sym._map.segments import Records
from capsule_sym._native import Watch, check_time, core, present
from capsule_sym._orbits.shooting.closed import ClosedForms
from capsule_sym._orbits.shooting.equations import PARAMETERS
from capsule_sym.generated import formulas

START = ("x_r", "v_r", "v_c", "phase")
SLOPES = (*START, *PARAMETERS)
STATE = ("x_r", "v_r", "v_c", "x_c")
_PHASE, _OMEGA, _DELTA, _ZETA, _BETA, _F_B = (
    SLOPES.index(name) for name in ("phase", "omega", "delta", "zeta", "beta", "f_b")
)


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Derivatives of a run by its start and the parameters; dimensionless.

    The last axis has a column for each of `columns`: x_r, v_r, v_c and phase at the start, alpha,
    omega, delta, zeta, beta, gamma, f_b. Times stay the same, counted from the start: the phase is
    that of the forcing there. Where the run passes a tangential switch, derivatives are
    infinite or nan from then on: there is none. At a start on a surface, and where two switches
    coincide, they are those of the side that the run takes; a capsule at rest stays at rest.
    """

    columns = SLOPES

    times: NDArray[np.float64]
    """The times, shape (n,)."""
    states: NDArray[np.float64]
    """(x_r, v_r, v_c, x_c) there, shape (n, 4)."""
    slopes: NDArray[np.float64]
    """Their derivatives, shape (n, 4, 11)."""
    rates: NDArray[np.float64]
    """Their rates of change in time, shape (n, 4)."""
    switching_times: NDArray[np.float64]
    """The times of the switches, shape (m,)."""
    switching_slopes: NDArray[np.float64]
    """Their derivatives, shape (m, 11)."""
    status: Status = Status.FINISHED
    """Finished, or time-limit: derivatives later in the run are nan."""

    @property
    def success(self) -> bool:
        """Whether all derivatives were found."""
        return self.status is Status.FINISHED

    @property
    def message(self) -> str:
        """The status as a sentence."""
        return "all was found" if self.success else "the time was over: later derivatives are nan"

    def __repr__(self) -> str:
        return (
            f"<Sensitivities at {len(self.times)} times, over {len(self.switching_times)} switches>"
        )

    def by(self, *names: str) -> NDArray[np.float64]:
        """Derivatives of the states by some of `columns`, shape (n, 4), or (n, 4, names).

        Raises InvalidInput for another name.
        """
        for name in names:
            if name not in SLOPES:
                raise InvalidInput("name", name, f"one of {', '.join(SLOPES)}")
        chosen = [SLOPES.index(name) for name in names]
        return self.slopes[..., chosen[0] if len(chosen) == 1 else chosen]


def sensitivities(run: Trajectory, t: ArrayLike, *, max_seconds: float = math.inf) -> Sensitivities:
    """Derivatives of a run's states at times t, and of its switching times; dimensionless.

    `run` has its segments (`keep="segments"`); times are as in `run(t)`, in any order, shape (n,).
    After `max_seconds` of the clock the derivatives that were not found are nan. Raises
    InvalidInput for times outside the run, and where segments were not kept.
    """
    status, limit = Status.TIME_LIMIT, Watch(checked_seconds(max_seconds))
    times = np.ravel(evaluation.real("t", t, "real numbers"))
    records = np.ascontiguousarray(run.records)
    evaluation.check(times, *run.span)
    states = run(times, position=True)
    order = evaluation.in_order(times)
    ascending = times if order is None else times[order]
    switches = np.full((max(len(records) - 1, 0), 11), np.nan)
    found = np.full((len(times), 4, 12), np.nan)
    with limit:
        if not len(records):
            found[:] = np.eye(4, 12) * [1, 1, 1, *(9 * [0])]
        elif core is not None:
            native = evaluation.borrowed(run.parameters.to_dict().values())
            passed = native.differentiate(records, ascending, switches, found, present())
            evaluation.give_back(native)
            if passed < len(records):
                check_time()
        else:
            differentiated(run, records, ascending, switches, found)
        status = Status.FINISHED
    slopes = found
    if order is not None:
        slopes = np.empty_like(found)
        slopes[order] = found
    ends = (
        records["end_period"] * run.parameters.period + records["end_angle"] / run.parameters.omega
    )
    rates = slopes[..., 11]
    return Sensitivities(times, states, slopes[..., :11], rates, ends[:-1], switches, status)


def differentiated(
    run: Trajectory,
    records: Records,
    times: NDArray[np.float64],
    switches: NDArray[np.float64],
    slopes: NDArray[np.float64],
) -> None:
    """The same in Python, as a reference to read and where there is no core; times ascend."""
    omega = run.parameters.omega
    with backend("numpy") as numbers:
        forms = ClosedForms(numbers, tuple(run.parameters.to_dict().values()))
        state, time = np.eye(4, 11), np.zeros(11)
        state[3, 3] = 0.0
        begins = records["start_period"] * run.parameters.period + records["start_angle"] / omega
        of = np.maximum(np.searchsorted(begins, times, side="right") - 1, 0)
        for i, record in enumerate(records):
            check_time()
            c = forms.constants(int(record["field"]))
            closed = numbers.kernels.Start(
                record["start"][0],
                record["gap"],
                *record["start"][1:],
                *(record[name] for name in ("margin", "cosine", "sine")),
            )
            angle = omega * time
            angle[_PHASE] += omega
            angle[_OMEGA] += begins[i]

            def rows(
                h: float, closed: Any = closed, c: Any = c, field: Any = record["field"]
            ) -> Any:
                matrix = forms.run(int(field), c, closed, h)[1].copy()
                if not c.drift:
                    matrix[2, 2] = 1.0
                return matrix

            def total(
                matrix: NDArray[np.float64],
                moved: NDArray[np.float64],
                state: NDArray[np.float64] = state,
                angle: NDArray[np.float64] = angle,
            ) -> NDArray[np.float64]:
                found = matrix[:, :3] @ state[:3] + np.outer(matrix[:, 3], angle)
                found += np.outer(matrix[:, 4], moved)
                found[:, 4:] += matrix[:, 5:]
                return found

            for k in np.flatnonzero(of == i):
                matrix = rows(times[k] - begins[i])
                slopes[k, :, :11] = total(matrix, -time)
                slopes[k, 3, :11] += state[3]
                slopes[k, :, 11] = matrix[:, 4]
            if i + 1 == len(records):
                break
            following = forms.constants(int(records[i + 1]["field"]))
            matrix = rows(record["duration"])
            guard = guard_row(c, following, record["end"], matrix)
            later = (
                np.zeros(11) if guard is None else total(guard[None], np.zeros(11))[0] / -guard[4]
            )
            passed = total(matrix, later)
            passed[3] += state[3]
            if not following.drift:
                passed[2] = 0.0
            state, time = passed, time + later
            switches[i] = time


def guard_row(
    c: Any, following: Any, end: NDArray[np.float64], matrix: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Derivatives of the guard that ends a segment, as a row like those of the state (12,).

    That is x_r - delta where contact changes, v_c where a slip ends, else P less the bound that it
    passes; None where the field stays.
    """
    if following.contact != c.contact:
        row = np.array(matrix[0])
        row[_DELTA + 1] -= 1.0
        return row
    if c.drift:
        return None if following.drift == c.drift else np.array(matrix[2])
    if not following.drift:
        return None
    row = formulas.force_change(c, matrix[0], matrix[1])
    slopes = formulas.force_slopes(c, end[0] - c.delta, end[1])
    for column, slope in zip((_DELTA, _ZETA, _BETA), slopes, strict=True):
        row[column + 1] += slope
    row[_F_B + 1] -= following.drift
    return row  # type: ignore[no-any-return]
