"""The command `run`."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import capsule_sym
from capsule_sym._commands import options, present
from capsule_sym._commands.signature import command, option
from capsule_sym._errors import counted
from capsule_sym._texts import bars

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
    out: options.Folder = None,
    certify: options.Certificate = None,
    as_json: options.Json = False,
) -> None:
    """Run the map and show the steady motion at the end.

    All quantities are dimensionless; states are x_r v_r v_c. If --params is a device, "si" has the
    progression and the average velocity in SI units.

    In the JSON, "segments" are those of the whole run. "itinerary", "global_map", "period_number"
    and "progression" describe the steady motion at its end; they are null if there is none.
    "progression" is the advance of the capsule per excitation period. "status" and "message" tell
    if the run ended early, and why. Exits with 3 if nothing was computed, and with 4 if
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
    out
        Write the JSON and the picture of the motion here.
    certify
        Prove every switch of the run, and its end, in ball arithmetic, and write its certificate
        here.
    """
    from capsule_sym._native import Watch
    from capsule_sym._records import in_si, run_record

    limit = Watch(max_seconds)
    parameters, device = system.load()
    try:
        with bars.reporting("Running") as report:
            trajectory = capsule_sym.simulate(
                parameters,
                state,
                phase,
                periods,
                backend=backend,
                max_seconds=max_seconds,
                progress=lambda turns: report(turns, periods),
            )
    except KeyboardInterrupt:
        kept = "nothing is kept; with --max-seconds a run shows its results so far"
        raise KeyboardInterrupt(kept) from None
    motion = trajectory.steady() if trajectory.success else None
    record = run_record(trajectory, motion)
    if device is not None:
        record |= {"device": device.to_dict(), "si": {}}
        if motion is not None:
            advance = float(motion.progression)
            pace = advance / parameters.period
            record["si"] = in_si(device, {"progression": advance, "average_velocity": pace})
    pictures = {"run.svg": lambda: capsule_sym.plot(trajectory)} if trajectory.success else {}
    shown = record if as_json else {**record, **_in_short(trajectory, motion)}
    present.result(shown, as_json, out, {"run.json": record}, pictures)
    present.certificates(certify, [trajectory], limit)
    if not trajectory.segments:
        present.fail(f"nothing was computed: {trajectory.message}")


def _in_short(
    trajectory: capsule_sym.results.Trajectory, motion: capsule_sym.results.SteadyMotion | None
) -> dict[str, Any]:
    """Entries of a record in short: segments of the steady motion, and its progression.

    Without such a motion: segments of the last excitation period, and why there is none.
    """
    from capsule_sym._map.drift import dragged
    from capsule_sym._map.steady import shown_progression
    from capsule_sym._records import segment_record

    (count, phase), _ = trajectory.final
    segments = motion.segments if motion else trajectory.segments
    last = [one for one in segments if motion or one.end >= (count - 1, phase)]
    shown = [segment_record(one) | {"duration": one.duration} for one in last]
    if motion is not None:
        return {"segments": shown, "progression": shown_progression(motion)}
    how = "more --periods, or capsule-sym orbit, which solves the orbit of a slow approach"
    why = f"within {counted(count, 'period')}: {dragged(trajectory.parameters) or how}"
    return {"segments": shown} | ({"not_steady": why} if trajectory.success else {})
