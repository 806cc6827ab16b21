"""Optimisation of a metric of the steady motion over parameters.

A survey and a population that evolves from it show where to search. Searches by SQP follow the
motion from there, through changes of itinerary, at which metrics are continuous. If no two of them
end at the best, a second round follows. Newton's method on the conditions of an optimum is last.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from capsule_sym._design.counts import MAX_SECONDS, SAMPLES, SEED
from capsule_sym._design.functions import Function, allowed, function_of, limit_of
from capsule_sym._design.optimum import Optimum
from capsule_sym._design.program import Program
from capsule_sym._design.search import Optimisation
from capsule_sym._design.survey import Survey
from capsule_sym._errors import InvalidInput
from capsule_sym._map import checks
from capsule_sym._native import Watch
from capsule_sym._native.watch import silent
from capsule_sym._parameters import Parameters
from capsule_sym._systems import System, check_parameter, dimensionless, real

_LARGEST = 4096  # survey by default, half a second of work


def optimise(
    metric: str | Function,
    over: Mapping[str, Sequence[float]],
    base: System | None = None,
    *,
    maximise: bool = True,
    subject_to: Sequence[object] = (),
    margin: float | None = None,
    start: Sequence[float] = (0.0, 0.0, 0.0),
    samples: int | None = None,
    seed: int = 0,
    max_seconds: float = MAX_SECONDS,
    progress: Callable[[str], object] | None = None,
) -> Optimum:
    """Parameters at which a metric of the steady motion is greatest, or least.

    A survey of the bounds and a population that evolves from its best points show where to search.
    Local searches follow the motion from there, through changes of itinerary, at which metrics are
    continuous. If there are several, and no two end at the best, a second round of all three
    follows. Newton's method on the conditions of an optimum is last. At a basin boundary or a
    kink, and sometimes beside a bifurcation, they are not solved, and `residual` is not small. The
    result is the best optimum found; it is not proved to be global.

    Points of the survey whose runs the core cannot decide, or for which there is no time, are
    unknown: the message has their number.

    Parameters
    ----------
    metric : str or callable
        Name of a metric, arithmetic of metrics and parameters such as "velocity/work", or a
        function. The names are velocity, speed, progression, work, damper_loss, friction_loss,
        power, peak_force, peak_contact, speed_per_work and cost_of_transport. Energies and
        progression are per excitation period; speed_per_work is `|progression|` over work. A
        function gets metrics and parameters by name, in a mapping, and returns a number, by
        arithmetic that accepts arrays. All is dimensionless, or in SI units if `base` is a device.
    over : mapping of str to (float, float)
        Bounds (low, high) of each varied parameter: ascending finite numbers within its own range.
        Dimensionless, or in SI units if `base` is a device.
    base : Parameters, PhysicalParameters, or those of another scene, default None
        Values of the other parameters, dimensionless or in SI units. None: those of the case study,
        Parameters().
    maximise : bool, default True
        True for the greatest value, False for the least.
    subject_to : sequence of str or tuple, default ()
        Constraints, each a text such as "peak_force <= 2" or a tuple (metric, "<=" or ">=",
        number). The number has the unit of the metric.
    margin : float, default None, from 0 to below 1
        Least distance of the Floquet multipliers from the unit circle, dimensionless: the modulus
        of each is at most 1 - `margin`. None: 0.01 where stability bounds the best, else no such
        constraint.
    start : sequence of float, default (0.0, 0.0, 0.0)
        State (x_r, v_r, v_c) at phase 0, dimensionless, of size at most 1e20. The motion is the one
        on which it settles.
    samples : int, default None, 1 to 1,000,000
        Number of points of each survey. None: 256 for one variable, 1,024 for two, else 4,096.
    seed : int, default 0, 0 to 10**12
        Seed of the surveys.
    max_seconds : float, default 60.0, above 0
        Time limit, in seconds of wall time; a second round has half of what is left.
    progress : callable, default None
        Function that is called with a text during the search.

    Returns
    -------
    Optimum
        Variables in `over`, the `value` of the metric, `constraints`, `status` and `message`. In SI
        units if `base` is a device, else dimensionless. `success` is True for the statuses
        "optimal" and "optimal-at-border". After `max_seconds` it is the best point so far, of
        status "time-limit".

    Raises
    ------
    InvalidInput
        For names, bounds, texts or other arguments that are not allowed, for a metric that is
        finite at no motion of the survey, and without a C core.

    Notes
    -----
    The surveys are parts of a Sobol sequence, each followed by differential evolution (Storn and
    Price, 1997). The local searches are SciPy's SLSQP. `residual` of the result is that of the
    Karush-Kuhn-Tucker conditions, with exact derivatives.

    See Also
    --------
    pareto : best trade-offs of two metrics.
    tolerances : spread of metrics under tolerances.

    Examples
    --------
    >>> import capsule_sym as cs
    >>> found = cs.optimise("speed_per_work", {"alpha": (0.9, 1.0)}, samples=4)
    >>> print(found.status, f"{found.value:.6f} at alpha = {found.over['alpha']:.4f}")
    optimal 0.714293 at alpha = 0.9645
    >>> print(*found.itinerary)
    F5 F4 F1 F2 F3 F2
    """
    program = program_of(metric, over, base, maximise, subject_to, margin, start, progress)
    count = min(4 ** (3 + len(over)), _LARGEST) if samples is None else samples
    check_survey(count, seed)
    search = Optimisation(Survey(program))
    with Watch(checks.checked_seconds(max_seconds)):
        search.run(count, seed)
    return search.result


def program_of(
    metric: str | Function,
    over: Mapping[str, Sequence[float]],
    base: System | None,
    maximise: bool,
    subject_to: Sequence[object],
    margin: float | None,
    start: Sequence[float] = (0.0, 0.0, 0.0),
    progress: Callable[[str], object] | None = None,
) -> Program:
    """Optimisation problem from arguments; raises InvalidInput for those that are not allowed."""
    system = system_of(base)
    if not over:
        raise InvalidInput("over", over, "one parameter or more, each with its bounds")
    for name, bounds in over.items():
        check_parameter("over", name, system)
        checks.checked_ends(f"bounds of {name}", bounds, allowed(system, name)[0])
    low, high = np.array([[float(end) for end in bounds] for bounds in over.values()]).T
    if margin is not None and not (real(margin) and 0 <= margin < 1):
        raise InvalidInput("margin", margin, "from 0 to below 1")
    if isinstance(subject_to, str):
        subject_to = (subject_to,)
    program = Program(
        system=system,
        names=tuple(over),
        low=low,
        high=high,
        function=function_of("metric", metric, system),
        sign=-1 if maximise else 1,
        limits=tuple(limit_of(one, system) for one in subject_to),
        margin=margin,
        start=checks.checked_state(start, "start"),
        progress=progress or silent,
    )
    _check_ends(program)
    return program


def system_of(base: System | None) -> System:
    """System to optimise, by default that of the case study."""
    return Parameters() if base is None else base


def _check_ends(program: Program) -> None:
    """Raises InvalidInput for a bound at which parameters are not allowed for a run.

    One variable at a time is at a bound, the others are in the middle of theirs. Nothing is run.
    """
    for i, name in enumerate(program.names):
        for end in (0.0, 1.0):
            u = np.full(len(program.names), 0.5)
            u[i] = end
            try:
                checks.check_scales(dimensionless(program.system_at(u)))
            except InvalidInput as error:
                bounds = float(program.low[i]), float(program.high[i])
                must = f"such that {error.field} is {error.allowed}"
                raise InvalidInput(f"bounds of {name}", bounds, must) from None


def check_survey(samples: int, seed: int) -> None:
    """Raises InvalidInput for a number of samples or a seed that is not allowed."""
    checks.check_count("samples", samples, *SAMPLES)
    checks.check_count("seed", seed, *SEED)
