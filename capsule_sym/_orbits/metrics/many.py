"""Performance of many periodic motions at once by the C core, with gradients and multipliers.

It serves the cells of a sweep, and the inner loop of an optimiser.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import InvalidInput, check_one_of, counted
from capsule_sym._map.checks import check_count
from capsule_sym._map.itinerary import begun
from capsule_sym._map.many import checked_rows, shared, spread
from capsule_sym._map.native import core
from capsule_sym._map.result import brief
from capsule_sym._map.simulate import watch_of
from capsule_sym._native import Watch, present
from capsule_sym._orbits.metrics.performance import METRICS as METRICS
from capsule_sym._parameters import CAPSULE, Scene
from capsule_sym.generated.interface import ORBIT_STATUSES, STOPS, OrbitStatus, Stop

MOST_SEGMENTS = 256
"""Largest number of segments in a period from forcing angle 0; a motion with more is not found."""
_AT_ONCE, _SHARES = 8, 4  # motions that a thread takes at a time at least, and how often at most


@dataclass(frozen=True, eq=False)
class Performances:
    """Periodic motions, closed at forcing angle 0, their metrics and multipliers; dimensionless.

    Values that were not requested or not found are nan. Derivatives are along the branch of orbits.
    Values at the status "changed" are those of the motion that was found, whose itinerary or period
    is another one than that of the run from the given state.
    """

    records: NDArray[np.void]
    """Results of the core, of dtype ORBIT, shape (n,)."""
    stops: NDArray[np.int8]
    """Status of the core, a `Stop`, shape (n,)."""
    fields: NDArray[np.uint8]
    """Fields from forcing angle 0 on, padded with 0, shape (n, 256)."""
    scene: Scene = CAPSULE
    """Scene of the parameters."""

    def __len__(self) -> int:
        return len(self.records)

    def __getitem__(self, metric: str) -> NDArray[np.float64]:
        """A metric by its name, shape (n,)."""
        check_one_of("metric", metric, METRICS)
        return self.records[metric]

    def __repr__(self) -> str:
        return brief(self, f"{int(self.closed.sum())} of {counted(len(self), 'motion')} closed")

    def of(self, chosen: NDArray[Any] | slice) -> Performances:
        """Some of the motions, by their indices, shape (k,), a mask, shape (n,), or a slice."""
        return Performances(
            self.records[chosen], self.stops[chosen], self.fields[chosen], self.scene
        )

    @property
    def closed(self) -> NDArray[np.bool_]:
        """True for each motion that is closed in the itinerary of its start state, shape (n,)."""
        return np.asarray(self.records["status"] == OrbitStatus.CLOSED)

    @property
    def status(self) -> NDArray[np.str_]:
        """Status of each motion, as a word, shape (n,).

        "closed": found in the itinerary of the run. "changed": found in another one, or with a
        smaller period number. "not-converged", "tangential" (no derivatives: a guard touches 0, or
        a fold), "open" (a switch is undecided, or a segment is too long for its integrals), "full"
        (more than 256 segments), "refused" (a state outside the range of a run): not found.
        "stopped": not solved within the time.
        """
        words = np.array(ORBIT_STATUSES)[self.records["status"]]
        return np.where(self.stops == Stop.DONE, words, np.array(STOPS)[self.stops])

    @property
    def states(self) -> NDArray[np.float64]:
        """(x_r, v_r, v_c) at forcing angle 0, shape (n, 3)."""
        return self.records["state"]

    @property
    def by_parameter(self) -> NDArray[np.float64]:
        """Derivatives of the states by the parameters, shape (n, 3, 7) in the paper's scene."""
        return self.records["by_parameter"].reshape(len(self), 3, -1)

    @property
    def values(self) -> NDArray[np.float64]:
        """Metrics, shape (n, 7).

        In this order: velocity, progression, work, damper_loss, friction_loss, peak_force,
        peak_contact.
        """
        return np.stack([self.records[name] for name in METRICS], axis=-1)

    @property
    def gradients(self) -> NDArray[np.float64]:
        """Derivatives of the metrics by the parameters, shape (n, 7, 7) in the paper's scene."""
        return self.records["gradients"].reshape(len(self), len(METRICS), -1)

    @cached_property
    def multipliers(self) -> NDArray[np.complex128]:
        """The three Floquet multipliers, the largest modulus first, shape (n, 3).

        They are those over the requested number of excitation periods, also if the motion has a
        smaller period number.
        """
        return multipliers_of(self.records["monodromy"].reshape(-1, 3, 3), self.records["sticks"])

    @checked
    def itinerary(self, i: int) -> tuple[str, ...]:
        """Names of the fields of motion i over the requested periods, from the standard first one.

        Empty for a motion that is not found, unless only its metrics or derivatives fail.
        """
        check_count("i", i, -len(self), len(self) - 1)
        return tuple(f"F{field}" for field in self.cycle(i))

    def cycle(self, i: int) -> tuple[int, ...]:
        """Numbers of the fields of motion i, as in `itinerary`."""
        passed = self.fields[i][: self.records["segments"][i]].tolist()
        # The run starts and ends within one segment, unless a switch is at the angle 0.
        if len(passed) > 1 and passed[0] == passed[-1]:
            passed.pop()
        return tuple(begun(passed, self.scene)) if passed else ()


def performance_many(
    parameters: ArrayLike,
    states: ArrayLike,
    period_numbers: ArrayLike = 1,
    *,
    energies: bool = True,
    forces: bool = True,
    gradients: bool = False,
    max_seconds: float = math.inf,
    threads: int = 1,
    scene: Scene = CAPSULE,
) -> Performances:
    """Periodic motions near given states, with metrics by the C core.

    Each motion is closed at forcing angle 0 by Newton's method, in the itinerary of the run from
    its state. A motion of more than 256 segments is not found. The metrics are those of
    `performance` without `lift` and `imbalance`. Each motion that is found has its progression,
    velocity and multipliers; of the others only requested ones are computed. All other values are
    nan.

    Parameters
    ----------
    parameters : array_like of shape (n, 7) or (7,)
        Rows of the scene's parameters in their order, dimensionless, 7 in the paper's scene. One
        row is one motion.
    states : array_like of shape (n, 3) or (3,)
        States (x_r, v_r, v_c) at forcing angle 0 near the motions, dimensionless; one state is that
        of all motions.
    period_numbers : array_like of shape (n,) or one int, default 1, at least 1
        Number of excitation periods of each motion.
    energies : bool, default True
        True for `work`, `damper_loss` and `friction_loss`.
    forces : bool, default True
        True for `peak_force` and `peak_contact`.
    gradients : bool, default False
        True for `gradients`, the derivatives of the seven metrics by the parameters, of shape
        (n, 7, parameters).
    max_seconds : float, default inf, above 0
        Time limit, in seconds of wall time. Motions that are not solved within it have the status
        "stopped", and nan for values.
    threads : int, default 1, 1 to 10^12
        Number of threads that share the motions.
    scene : Scene, default the paper's
        Scene of the rows, such as `scenes.slope`.

    Returns
    -------
    Performances
        Metrics by name, shape (n,), and states, multipliers, gradients and status of the motions.

    Raises
    ------
    InvalidInput
        For a value that is not allowed, for parameters outside the ranges of a run, and without a
        C core.

    See Also
    --------
    performance : metrics of one orbit, with 50 digits too.
    simulate_many : states of many runs, at phase 0.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> rows = [[*cs.Parameters(alpha=alpha).to_dict().values()] for alpha in (1.1, 1.2, 1.3)]
    >>> states = cs.simulate_many([cs.Parameters(*row) for row in rows], periods=300).states
    >>> found = cs.performance_many(rows, states, gradients=True)
    >>> found["work"].round(6).tolist(), found.status.tolist()
    ([1.700301, 2.006505, 2.326266], ['closed', 'closed', 'closed'])
    >>> print(f"{found.gradients[1, 2, 0]:.6f}")  # of the work, by alpha
    3.129752
    """
    what, limit = (energies, forces, gradients), watch_of(max_seconds)
    if threads == 1 and max_seconds == math.inf:
        limit = present()  # which Ctrl-C stops
    return closed_many(limit, parameters, states, period_numbers, what, threads, scene)


def closed_many(
    watch: Watch,
    parameters: ArrayLike,
    states: ArrayLike,
    period_numbers: ArrayLike,
    what: tuple[bool, bool, bool],
    threads: int = 1,
    scene: Scene = CAPSULE,
) -> Performances:
    """Motions as by `performance_many`, with `what` its energies, forces and gradients."""
    binding = core(scene)
    rows = checked_rows(np.atleast_2d(np.ascontiguousarray(parameters, dtype=float)), scene)
    count = len(rows)
    check_count("threads", threads)
    starts = np.ascontiguousarray(spread("states", states, (count, 3)))
    given = spread("period_numbers", period_numbers, (count,))
    periods = given.astype(np.int32)
    if np.any((periods != given) | (periods < 1)):
        raise InvalidInput("period_numbers", period_numbers, "whole numbers >= 1")
    stops, records = np.zeros(count, np.int8), np.zeros(count, scene.records.ORBIT)
    fields = np.zeros((count, MOST_SEGMENTS), np.uint8)
    size = max(1, count if threads == 1 else _AT_ONCE, -(-count // (_SHARES * threads)))

    def solve(i: int) -> None:
        own = slice(i * size, (i + 1) * size)
        results = stops[own], records[own], fields[own]
        binding.orbit_many(rows[own], starts[own], periods[own], *results, *what, watch)

    shared(solve, -(-count // size), threads, watch)
    stops[(stops == Stop.DONE) & (records["runs"] == 0)] = Stop.STOPPED  # not begun
    for name, (kind, _) in records.dtype.fields.items():
        if kind.base.kind == "f":
            records[name][stops == Stop.STOPPED] = np.nan
    return Performances(records, stops, fields, scene)


def multipliers_of(
    monodromy: NDArray[np.float64], sticks: NDArray[np.integer[Any]]
) -> NDArray[np.complex128]:
    """Eigenvalues (n, 3) of matrices (n, 3, 3), the largest first; one is 0 if the capsule sticks.

    They are nan if the matrix is not finite.
    """
    found = np.full((len(monodromy), 3), np.nan, complex)
    finite = np.isfinite(monodromy).all(axis=(1, 2))
    values = np.linalg.eigvals(monodromy[finite])
    found[finite] = np.take_along_axis(values, np.argsort(-abs(values), axis=-1, kind="stable"), -1)
    found[finite & (np.asarray(sticks) != 0), 2] = 0.0
    return found
