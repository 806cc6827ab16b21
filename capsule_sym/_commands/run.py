"""The command `run`."""

from __future__ import annotations

import sys
from functools import partial
from typing import Annotated, Any, Literal

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option
from capsule_sym._texts import bars
from capsule_sym._texts.runs import show_run

_USUAL_BACKEND = option(show_default="c where it was compiled, else numpy")


@command()
def run(
    *,
    system: options.Chosen,
    state: options.State = (0.0, 0.0, 0.0),
    phase: float = 0.0,
    periods: int = 100,
    backend: Annotated[Literal["c", "numpy", "mpmath"] | None, _USUAL_BACKEND] = None,
    max_seconds: options.TimeLimit = 120.0,
    certify: options.Certificate = None,
    as_json: options.Json = False,
) -> None:
    """Run the map and show the steady motion at the end.

    All quantities are dimensionless; states are x_r v_r v_c. With physical parameters the results
    are also given in SI units.

    In the JSON, "segments" are those of the whole run. "itinerary", "global_map", "period_number"
    and "progression" describe the steady motion at its end; they are null if there is none.
    "progression" is the advance of the capsule per excitation period. "stopped" exists only if the
    run ended early, and gives the reason. Exits with 3 if nothing was computed, and with 4 if
    --certify does not prove it.

    Parameters
    ----------
    state
        State at the start. [default: 0 0 0]
    phase
        Time at the start, within the excitation period 2π/ω. [default: 0]
    periods
        Excitation periods to run.
    backend
        Double precision (c, numpy), or 50 digits.
    certify
        Prove every switch of the run, and its end, in ball arithmetic, and write its certificate
        here.
    """
    from capsule_sym._native import Watch
    from capsule_sym._records import physical_record, run_record

    limit = Watch(max_seconds)
    parameters, physical = system.load()
    settings: dict[str, Any] = {"backend": backend, "max_seconds": max_seconds}
    go = partial(capsule_sym.simulate, parameters, state, phase, periods, **settings)
    try:
        if sys.stderr.isatty():
            with bars.progress("Running", periods) as update:
                trajectory = go(progress=lambda turns: update(completed=turns))
        else:
            trajectory = go()
    except KeyboardInterrupt:
        kept = "nothing is kept; with --max-seconds a run shows its results so far"
        raise KeyboardInterrupt(kept) from None
    motion = trajectory.steady() if trajectory.success else None

    def record() -> dict[str, Any]:
        found = run_record(trajectory, motion)
        if physical:
            found["physical"] = physical_record(physical, trajectory, motion)
        return found

    present.result(record, lambda: show_run(trajectory, motion, physical), as_json)
    present.certificates(certify, [trajectory], limit)
    if not trajectory.segments:
        present.fail(f"nothing was computed, {trajectory.message}")
