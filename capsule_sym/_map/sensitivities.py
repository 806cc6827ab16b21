"""Exact derivatives of a run by its start and parameters, through all switches.

Derivatives of the closed forms are propagated from segment to segment. The time of a switch varies
so that its guard stays zero; in the next segment this is the saltation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from capsule_sym._arguments import checked
from capsule_sym._errors import check_one_of, counted
from capsule_sym._map import evaluation
from capsule_sym._map.native import core
from capsule_sym._map.result import brief
from capsule_sym._map.trajectory import Trajectory
from capsule_sym._native import check_time, present
from capsule_sym._parameters import CAPSULE, Scene

START = (*CAPSULE.facts.STATE, "phase")
STATE = (*CAPSULE.facts.STATE, "x_c")


def columns_of(scene: Scene) -> tuple[str, ...]:
    """Names of the variables of a run's derivatives: the start, and the scene's parameters."""
    return (*START, *scene.facts.PARAMETERS)


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Derivatives of a run by its start and the parameters; dimensionless.

    The last axis has a column for each of `columns`: x_r, v_r, v_c and phase at the start, and the
    parameters of the scene. In the paper's these are 4 and 7. The clock of `times` and
    `switching_times` is that of the run: it shows the phase at the start, `run.span[0]`.
    Derivatives are at a fixed time since the start. So that of a switching time by the phase is the
    derivative of the time since the start. After a tangential switch derivatives do not exist: the
    values are infinite, nan or without meaning. At a start on a surface, and where two switches
    coincide, they are one-sided, on the side of the run. If the capsule rests in the first segment,
    the column v_c has no meaning: friction, which would stop a small v_c, is left out there.
    """

    times: NDArray[np.float64]
    """Times, shape (n,)."""
    states: NDArray[np.float64]
    """States (x_r, v_r, v_c, x_c) at the times, shape (n, 4)."""
    slopes: NDArray[np.float64]
    """Derivatives of the states, shape (n, 4, columns)."""
    rates: NDArray[np.float64]
    """Rates of change of the states in time, shape (n, 4)."""
    switching_times: NDArray[np.float64]
    """Times of the switches between the run's segments, shape (m,)."""
    switching_slopes: NDArray[np.float64]
    """Derivatives of the switching times, shape (m, columns)."""
    scene: Scene
    """Scene of the run."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the variables of the derivatives."""
        return columns_of(self.scene)

    def __repr__(self) -> str:
        switches = counted(len(self.switching_times), "switch", "switches")
        return brief(self, f"{counted(len(self.times), 'time')} and {switches}")

    @checked
    def by(self, *names: str) -> NDArray[np.float64]:
        """Derivatives of the states by some of `columns`.

        The shape is (n, 4) for one name, and (n, 4, k) for k names, in their order.
        Raises InvalidInput for another name.
        """
        for name in names:
            check_one_of("name", name, self.columns)
        chosen = [self.columns.index(name) for name in names]
        return self.slopes[..., chosen[0] if len(chosen) == 1 else chosen]


def sensitivities(run: Trajectory, t: ArrayLike) -> Sensitivities:
    """Derivatives of a run's states at times t, and of its switching times; dimensionless.

    They are exact, by the start and by all parameters, through all switches of the run.

    Parameters
    ----------
    run : Trajectory
        Run with its segments (`keep="segments"`), as `simulate` gives; dimensionless.
    t : array_like of shape (n,)
        Times as in `run(t)`, in any order, dimensionless, from `run.span[0]` to `run.span[1]`.
        Arrays of other shapes are flattened.

    Returns
    -------
    Sensitivities
        `slopes` of shape (n, 4, variables) have the derivatives of (x_r, v_r, v_c, x_c) by
        `columns`; `by` gives those by some variables. `switching_slopes` have those of the
        switching times.

    Raises
    ------
    InvalidInput
        For times outside the run, if segments were not kept, and without a C core.

    Notes
    -----
    The derivatives of the closed forms are propagated from segment to segment. The time of a switch
    varies so that its guard stays zero; in the next segment this is the saltation.

    See Also
    --------
    fit : least squares with these derivatives.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> run = cs.simulate(cs.Parameters(alpha=0.9), periods=2)
    >>> found = cs.sensitivities(run, [0.0, 5.0])
    >>> print(found.by("alpha").round(6)[1])
    [-1.395152  0.282558 -0.563197 -0.049416]

    A difference quotient of x_r at t = 5 agrees:

    >>> low, high = (cs.simulate(cs.Parameters(alpha=a), periods=2) for a in (0.899999, 0.900001))
    >>> print(round((high(5.0)[0] - low(5.0)[0]) / 2e-6, 4))
    -1.3952
    """
    times = np.ravel(evaluation.real("t", t, "real numbers"))
    records = np.ascontiguousarray(run.records)
    evaluation.check(times, *run.span)
    scene, order = run.parameters.scene, np.argsort(times, kind="stable")
    names = columns_of(scene)
    switches = np.full((max(len(records) - 1, 0), len(names)), np.nan)
    found = np.full((len(times), len(STATE), len(names) + 1), np.nan)
    if not len(records):
        found[:] = np.diag([1, 1, 1, 0]) @ np.eye(len(STATE), len(names) + 1)
    else:
        core(scene)
        native = evaluation.borrowed(run.parameters)
        native.differentiate(records, times[order], switches, found, present())
        evaluation.give_back(run.parameters, native)
        check_time()
    slopes = np.empty_like(found)
    slopes[order] = found
    omega = run.parameters.omega
    ends = records["end_period"] * run.parameters.period + records["end_angle"] / omega
    states, by, rates = run(times, position=True), slopes[..., :-1], slopes[..., -1]
    return Sensitivities(times, states, by, rates, ends[:-1], switches, scene)
